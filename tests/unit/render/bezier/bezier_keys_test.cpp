// Bézier volumes between key frames.

#include "render/bezier/keys/bezier_keys.h"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "tests/support/files.h"

namespace bezier_keys_test {

using Imath::V3d;
using render::BezierVolume;

/// A patch of degree 2 on the unit cube. @param moved  added to numbers of the middle control point
BezierVolume volumeWith(double moved, bool isRational = false) {
  BezierVolume volume;
  render::BezierPatch patch{.degree = {2, 2, 2}, .attributes = {{}}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) {
        patch.points.push_back(V3d(i, j, k) / 2.0);
        patch.attributes[0].push_back(0.5 * i - 0.4);
      }
  patch.points[13] += V3d(0, moved, 0);
  patch.attributes[0][13] += moved;
  if (isRational) patch.weights.assign(27, 1 + moved);
  volume.patches = {patch, patch};
  return volume;
}

TEST(BezierKeys, InterpolateAllNumbers) {
  const std::vector<double> times = {0, 4};
  const std::vector<BezierVolume> keys = {volumeWith(0, true), volumeWith(1, true)};
  render::requireSameVolumes(keys);
  const auto at = [&](double t) {
    return render::volumeBetween(
        keys, levelset::keyWeights(times, t, levelset::KeyInterpolation::Linear));
  };
  EXPECT_EQ(at(4).patches[1].points, keys[1].patches[1].points);
  EXPECT_EQ(at(4).patches[1].attributes, keys[1].patches[1].attributes);
  const render::BezierPatch quarter = at(1).patches[1];
  EXPECT_EQ(quarter.points[13], V3d(0.5, 0.75, 0.5));
  EXPECT_NEAR(quarter.attributes[0][13], 0.35, 1e-16);
  EXPECT_EQ(quarter.weights[26], 1.25);
  EXPECT_EQ(quarter.points[12], keys[0].patches[1].points[12]);
}

TEST(BezierKeys, RefuseVolumesThatDiffer) {
  const auto refusal = [](const BezierVolume& other) {
    return support::refusal<levelset::InvalidInput>([&] {
      render::requireSameVolumes({volumeWith(0), other});
    });
  };
  BezierVolume other = volumeWith(0);
  other.patches.pop_back();
  EXPECT_NE(refusal(other).find("number of patches"), std::string::npos);
  other = volumeWith(0);
  other.isovalue = 0.1;
  EXPECT_NE(refusal(other).find("isovalue"), std::string::npos);
  other = volumeWith(0);
  other.patches[1] = render::elevated(other.patches[1], 0);
  EXPECT_NE(refusal(other).find("degree"), std::string::npos);
  EXPECT_NE(refusal(volumeWith(0, true)).find("weights"), std::string::npos);
  other = volumeWith(0);
  other.patches[0].attributes.push_back(other.patches[0].attributes[0]);
  EXPECT_NE(refusal(other).find("attributes"), std::string::npos);
  other = volumeWith(0);
  other.expression = {0};
  EXPECT_NE(refusal(other).find("expression"), std::string::npos);
}

}  // namespace bezier_keys_test
