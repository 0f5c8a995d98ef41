// Stiff and extreme textures and patches, each with its stated outcome. Cases that concern a single
// module are tested beside it: corners (Patch.Refuses…), ears (Patch.WrapsAThinEar), and offsets
// beyond the medial axis (Patch.RefusesHeightsBeyondTheMedialAxis, Untangle.RepairsOffsets…).

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/shapes/shapes.h"
#include "mapping/placement/make_patch.h"
#include "mapping/textures/geometric_texture.h"
#include "tests/support/files.h"
#include "tests/support/formula_patches.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"

namespace extreme_textures_test {

using Imath::V3d;
using levelset::Measurement;
using levelset::NarrowBand;
using mapping::makePatch;
using mapping::mapTexture;
using mapping::Patch;
using mapping::TextureMap;
using mapping::TextureMerge;
using support::cap;
using support::square;

constexpr double kPi = 3.14159265358979323846;
constexpr std::size_t kGiB = std::size_t{1} << 30;

const NarrowBand& slab() {
  static const NarrowBand band = levelset::makeBox(V3d(8, 8, 2), V3d(0, 0, -1), 0.2);
  return band;
}

constexpr double kTrough = 1.5;  // radius of the groove

/// A slab with a round groove along y.
NarrowBand makeTrough(const NarrowBand& plate) {
  const std::array<NarrowBand, 2> both = {
      plate, levelset::makeCylinder(kTrough, 12, V3d(0), V3d(0, 1, 0), 0.2)};
  return levelset::combine(levelset::CsgOperation::Difference, both).band;
}

/// Corners near the bottom of the groove, up to `half` along it on both sides.
std::array<V3d, 4> troughCorners(double half) {
  return {V3d(-1, -half, -1.12), V3d(1, -half, -1.12), V3d(1, half, -1.12), V3d(-1, half, -1.12)};
}

Measurement measureAlone(const NarrowBand& base, const NarrowBand& texture, const Patch& patch,
                         double voxel, TextureMap map = TextureMap::Rbf) {
  const mapping::TextureResult mapped =
      mapTexture(base, texture, patch,
                 {.merge = TextureMerge::Alone, .map = map, .embedDepth = 0.0, .voxelSize = voxel});
  EXPECT_TRUE(levelset::manifoldness(levelset::bandToMesh(mapped.band)).isClosedManifold());
  return levelset::measure(mapped.band);
}

TEST(ExtremeTextures, UnitsOfTheTextureDoNotMatter) {
  // A texture in kilometres or microns on a patch in metres. Only its proportions count.
  const Patch patch = makePatch(slab(), square(1.5), 1, {.layers = 3}).patch;
  const auto of = [&](double unit) {
    return measureAlone(slab(),
                        levelset::makeTorus(2 * unit, 0.6 * unit, V3d(0), V3d(0, 0, 1), 0.1 * unit),
                        patch, 0.1);
  };
  const Measurement unit = of(1);
  EXPECT_EQ(unit.euler, 0);
  for (const double factor : {1e-3, 1e3}) {
    const Measurement other = of(factor);
    EXPECT_NEAR(other.volume, unit.volume, support::measured(2.77e-9) * unit.volume) << factor;
    EXPECT_EQ(other.euler, 0) << factor;
  }
}

TEST(ExtremeTextures, AThousandTimesFinerThanTheBase) {
  // The voxels of the texture become a thousandth of the base's. Alone the texture is mapped at
  // this size. The union would need the same voxels for the base, which is refused before any
  // allocation. With the base's voxels no part of the texture would remain, which is refused too.
  const Patch patch = makePatch(slab(), square(0.3), 0.3, {.layers = 3}).patch;
  const NarrowBand texture = levelset::makeSphere(1, V3d(0), 0.1);
  mapping::TextureOptions options = {.merge = TextureMerge::Alone,
                                     .embedDepth = 0.0,
                                     .textureBox = Imath::Box3d(V3d(-150), V3d(150)),
                                     .voxelSize = 2e-4,
                                     .maxMemory = 4 * kGiB};
  const Measurement alone = levelset::measure(mapTexture(slab(), texture, patch, options).band);
  EXPECT_NEAR(alone.volume, 4 * kPi / 3 * 0.002 * 0.002 * 0.001,
              support::measured(6.24e-5) * alone.volume);
  options.merge = TextureMerge::Union;
  EXPECT_THROW((void)mapTexture(slab(), texture, patch, options), levelset::ResourceLimit);
  options.voxelSize = 0.2;
  EXPECT_THROW((void)mapTexture(slab(), texture, patch, options), levelset::InvalidInput);
}

TEST(ExtremeTextures, CoarseVoxelsKeepWhatTheyResolve) {
  // A texture with seven times too many voxels is second-order accurate in the voxels of the
  // result.
  const Patch patch = makePatch(slab(), square(1), 1, {.layers = 3}).patch;
  const NarrowBand texture = levelset::makeSphere(1, V3d(0), 0.03);
  const Measurement mapped = measureAlone(slab(), texture, patch, 0.2);
  EXPECT_NEAR(mapped.volume, 4 * kPi / 3 * 0.5, support::measured(0.00137) * mapped.volume);
}

TEST(ExtremeTextures, AThousandTimesCoarserThanTheBase) {
  // A unit a thousand times larger, and six voxels of texture over a patch. The result is as round
  // as these permit.
  const NarrowBand fine = levelset::makeSphere(1, V3d(0), 0.04);
  const Patch patch = makePatch(fine, cap(0.5), 0.5, {.layers = 3}).patch;
  const NarrowBand rough = levelset::makeSphere(3000, V3d(0), 1000);
  const Measurement mapped = measureAlone(fine, rough, patch, 0.04);
  const Measurement smooth =
      measureAlone(fine, levelset::makeSphere(3000, V3d(0), 300), patch, 0.04);
  EXPECT_NEAR(mapped.volume, smooth.volume, support::measured(9.64e-5) * smooth.volume);
  EXPECT_EQ(mapped.euler, 2);
}

TEST(ExtremeTextures, VoxelsFortyTimesTheBasesGiveASmoothSurface) {
  // Six voxels of texture over 250 of the base's. The mapped solid is the interpolant of the
  // texture's distances. The trilinear interpolant lies h²/12
  // x
  // '' = h²/(6 r) above
  // x
  //  on average, which removes h²/(2 R²) = 1/18 of the volume from a ball of R = 3 h. The tricubic
  //  interpolant is exact for parabolas. Its error is of third order and changes sign from cell to
  //  cell, far below a hundredth.
  const double voxel = 0.01, half = 1.25, height = 0.25;
  const NarrowBand base = levelset::makeBox(V3d(2.7, 2.7, 0.1), V3d(0, 0, -0.05), voxel);
  const NarrowBand rough = levelset::makeSphere(3, V3d(0), 1);
  const auto place = [&](const V3d& uvw) {
    return V3d(half * (2 * uvw.x - 1), half * (2 * uvw.y - 1), height * uvw.z);
  };
  const mapping::TextureResult result =
      mapTexture(base, rough, support::patchAt(place, 24, 24, 2, height),
                 {.merge = TextureMerge::Alone, .map = TextureMap::Prism, .embedDepth = 0.0});
  EXPECT_EQ(result.report.voxelSize, voxel);
  EXPECT_GT(result.report.distortion.stretch.most * rough.voxelSize(), 40 * voxel);
  const Measurement mapped = levelset::measure(result.band);
  const double ball = 4 * kPi / 3 * half * half * height / 2;
  EXPECT_NEAR(mapped.volume, ball, support::measured(9.52e-5) * ball);
  EXPECT_EQ(mapped.euler, 2);
  // The surface is within a tenth of the texture's voxel of the mapped ball.
  const levelset::BandSampler sampler(result.band);
  for (int i = 0; i < 60; ++i)
    for (int j = 0; j < 30; ++j) {
      const double a = kPi * i / 30, b = kPi * (j + 0.5) / 30;
      const V3d out(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
      EXPECT_LT(sampler.value(place(V3d(0.5) + out * (2.9 / 6))), 0) << out;
      EXPECT_GT(sampler.value(place(V3d(0.5) + out * (3.1 / 6))), 0) << out;
    }
}

TEST(ExtremeTextures, HolesAndHandlesAreKept) {
  // A plate with a hole and a handle over it, a surface of genus two. On a bent patch, with all
  // maps.
  const double voxel = 0.1;
  const NarrowBand plate = levelset::makeBox(V3d(3, 2, 0.5), V3d(0), voxel),
                   hole = levelset::makeCylinder(0.4, 2, V3d(-0.8, 0, 0), V3d(0, 0, 1), voxel),
                   handle = levelset::makeTorus(0.5, 0.2, V3d(0.7, 0, 0.2), V3d(0, 1, 0), voxel);
  const auto combine = [](levelset::CsgOperation how, const NarrowBand& a, const NarrowBand& b) {
    const std::array<NarrowBand, 2> both = {a, b};
    return levelset::combine(how, both).band;
  };
  const NarrowBand texture =
      combine(levelset::CsgOperation::Union,
              combine(levelset::CsgOperation::Difference, plate, hole), handle);
  ASSERT_EQ(levelset::measure(texture).euler, -2);
  const NarrowBand ball = support::makeBall(4, 0.2);
  const Patch patch = makePatch(ball, cap(0.5, 4), 1.5, {.layers = 6, .spacing = 0.3}).patch;
  for (const TextureMap map : {TextureMap::Rbf, TextureMap::Prism})
    EXPECT_EQ(measureAlone(ball, texture, patch, 0.1, map).euler, -2);
}

TEST(ExtremeTextures, ASpikeThinnerThanAVoxelIsLostAndNothingElse) {
  // A needle a fifth of a voxel wide contains no grid point, so it disappears. The rest is kept.
  const double voxel = 0.1;
  const std::array<NarrowBand, 2> both = {
      levelset::makeSphere(1, V3d(0), voxel),
      levelset::makeCapsule(V3d(0, 0, 0.5), V3d(0, 0, 2), 0.2 * voxel, voxel)};
  const NarrowBand spiked = levelset::combine(levelset::CsgOperation::Union, both).band;
  const Patch patch = makePatch(slab(), square(1), 3, {.layers = 4}).patch;
  const mapping::TextureOptions options = {.merge = TextureMerge::Alone,
                                           .embedDepth = 0.0,
                                           .textureBox = Imath::Box3d(V3d(-1), V3d(1, 1, 2)),
                                           .voxelSize = voxel};
  const Measurement mapped = levelset::measure(mapTexture(slab(), spiked, patch, options).band),
                    ball = levelset::measure(mapTexture(slab(), both[0], patch, options).band);
  EXPECT_NEAR(mapped.volume, ball.volume, support::measured(6.55e-4) * ball.volume);
  EXPECT_TRUE(std::isfinite(mapped.area));
}

TEST(ExtremeTextures, ASplineThroughItselfIsRefusedWithThePosition) {
  // A loop that returns through its own stem. No cell folds, but at the crossing the texture has
  // two values. The smooth map cannot interpolate both, and the tetrahedra overlap.
  const NarrowBand base = support::makeBall(4, 0.2);
  mapping::PatchOptions options = {
      .layers = 24,
      .scheme = mapping::LayerScheme::Spline,
      .spline = {V3d(0, 0, 6), V3d(2, 0, 8), V3d(3, 0, 6.5), V3d(1.5, 0, 5.3), V3d(-1, 0, 5.2)},
      .spacing = 0.35};
  const NarrowBand texture = levelset::makeBox(V3d(1, 1, 11), V3d(0), 0.2);
  const auto refusal = [&](double height, TextureMap map) -> std::string {
    const Patch patch = makePatch(base, square(0.5, 4), height, options).patch;
    try {
      (void)mapTexture(base, texture, patch, {.map = map, .voxelSize = 0.2});
    } catch (const levelset::InvalidInput& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refusal(11, TextureMap::Rbf).find("folds at"), std::string::npos);
  const std::string shell = refusal(11, TextureMap::Prism);
  EXPECT_NE(shell.find("passes through itself"), std::string::npos) << shell;
  // The first seven units of the loop do not overlap.
  EXPECT_EQ(refusal(7, TextureMap::Prism), "");
}

TEST(ExtremeTextures, OverACreaseNoTextureTears) {
  // Across the right-angled edge of a box, with both maps: one closed component on both sides of
  // the edge, and after the union one solid without cavities.
  const std::array<V3d, 4> corners = {V3d(2.5, -1, 0), V3d(4, -1, -1.2), V3d(4, 1, -1.2),
                                      V3d(2.5, 1, 0)};
  const Patch patch = makePatch(slab(), corners, 0.6, {.layers = 4}).patch;
  const NarrowBand texture = levelset::makeBox(V3d(2, 2, 1), V3d(0), 0.2);
  for (const TextureMap map : {TextureMap::Rbf, TextureMap::Prism}) {
    const Measurement alone = measureAlone(slab(), texture, patch, 0.1, map);
    EXPECT_EQ(alone.components, 1u);
    EXPECT_EQ(alone.euler, 2);
    EXPECT_NEAR(alone.volume, 0.6 * 2 * 2.7 + 2 * kPi / 4 * 0.6 * 0.6,
                support::measured(0.0139) * alone.volume);
    const Measurement joined =
        levelset::measure(mapTexture(slab(), texture, patch, {.map = map}).band);
    EXPECT_EQ(joined.components, 1u);
    EXPECT_EQ(joined.cavities, 0u);
    EXPECT_GT(joined.volume, 128 + 0.5 * alone.volume);
  }
}

TEST(ExtremeTextures, OffsetsBeyondTheCurvatureRadiusAreRefusedWithTheCause) {
  // In a trough the particles of a patch of height 2 meet on the axis and stay there. The map
  // compresses the texture to zero thickness without folds. Voxels that resolve it would be too
  // many, and the error names the position. With a requested voxel size the resolved part is
  // mapped.
  const NarrowBand trough = makeTrough(slab());
  const Patch patch = makePatch(trough, troughCorners(1), 2,
                                {.layers = 4, .scheme = mapping::LayerScheme::Conforming})
                          .patch;
  const NarrowBand texture = levelset::makeSphere(1, V3d(0), 0.1);
  std::string message;
  try {
    (void)mapTexture(trough, texture, patch, {.maxMemory = 4 * kGiB});
  } catch (const levelset::Error& error) {
    message = error.what();
  }
  EXPECT_NE(message.find("compresses"), std::string::npos) << message;
  EXPECT_NE(message.find("--voxel"), std::string::npos) << message;
  const Measurement mapped = measureAlone(trough, texture, patch, 0.1);
  EXPECT_GT(mapped.volume, 0.5);
}

TEST(ExtremeTextures, LayersBeyondTheCurvatureRadiusThatFoldAreRefused) {
  // In such a trough the corners of reduced layers meet over the axis and climb there. The sides of
  // the layers above overlap, and cells fold. Samples and certificate both find this, for both
  // maps. On request the texture is mapped anyway, with a count of the folds.
  constexpr double kHeight = 2.5;
  const NarrowBand trough = makeTrough(levelset::makeBox(V3d(4, 3, 2), V3d(0, 0, -1), 0.2));
  const Patch patch =
      makePatch(trough, troughCorners(0.7), kHeight, {.layers = 4, .spacing = 0.3}).patch;
  const NarrowBand texture = levelset::makeSphere(1, V3d(0), 0.1);
  for (const TextureMap map : {TextureMap::Rbf, TextureMap::Prism}) {
    SCOPED_TRACE(map == TextureMap::Rbf ? "rbf" : "shell");
    mapping::TextureOptions options = {.map = map, .voxelSize = 0.2};
    const std::string message = support::refusal<levelset::InvalidInput>(
        [&] { (void)mapTexture(trough, texture, patch, options); });
    EXPECT_NE(message.find("the patch folds at"), std::string::npos) << message;
    options.allowFolds = true;
    const mapping::TextureResult mapped = mapTexture(trough, texture, patch, options);
    const mapping::TextureReport& report = mapped.report;
    EXPECT_FALSE(mapped.band.isEmpty());
    EXPECT_GT(report.distortion.folded, 0u);
    EXPECT_LT(report.distortion.jacobian.least, 0);
    EXPECT_GE(report.distortion.foldUvw.z * kHeight, kTrough);
    EXPECT_EQ(report.certificate.verdict(), mapping::FoldVerdict::Folds);
    EXPECT_GT(report.certificate.foldedShare, 0);
    EXPECT_FALSE(report.certificate.worst.empty());
    for (const mapping::FoldPoint& fold : report.certificate.worst) {
      EXPECT_LE(fold.jacobian, 0);
      EXPECT_GE(fold.uvw.z * kHeight, kTrough) << fold.uvw;
    }
  }
}

TEST(ExtremeTextures, LambdaIsANumber) {
  const Patch patch = makePatch(slab(), square(1), 1, {.layers = 2, .spacing = 0.5}).patch;
  const NarrowBand texture = levelset::makeSphere(1, V3d(0), 0.1);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {kNan, -1.0, std::numeric_limits<double>::infinity()})
    for (const bool near : {false, true}) {
      mapping::TextureOptions options;
      (near ? options.rbf.lambdaNear : options.rbf.lambdaFar) = bad;
      EXPECT_THROW((void)mapTexture(slab(), texture, patch, options), levelset::UsageError);
    }
}

}  // namespace extreme_textures_test
