#include "mapping/distortion.h"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "mapping/level_map.h"

namespace mapping {
namespace {

using Imath::V3d;

/// Texture coordinates of the places that are looked at.
std::vector<V3d> samplePlaces(const Patch& patch, double sink) {
  std::vector<V3d> places;
  if (sink > 0) {
    const ParticleLevel& surface = patch.levels.front();
    for (std::size_t j = 0; j < surface.rows; ++j)
      for (std::size_t i = 0; i < surface.columns; ++i)
        for (const double depth : {sink, sink / 2})
          places.push_back({static_cast<double>(i) / static_cast<double>(surface.columns - 1),
                            static_cast<double>(j) / static_cast<double>(surface.rows - 1),
                            -depth});
  }
  for (std::size_t k = 0; k < patch.levels.size(); ++k) {
    const ParticleLevel& level = patch.levels[k];
    const double columns = static_cast<double>(level.columns - 1);
    const double rows = static_cast<double>(level.rows - 1);
    for (std::size_t j = 0; j < level.rows; ++j)
      for (std::size_t i = 0; i < level.columns; ++i) {
        const double u = static_cast<double>(i), v = static_cast<double>(j);
        places.push_back({u / columns, v / rows, level.w});
        if (i + 1 == level.columns || j + 1 == level.rows) continue;
        places.push_back({(u + 0.5) / columns, (v + 0.5) / rows, level.w});
        if (k + 1 < patch.levels.size())
          places.push_back(
              {(u + 0.5) / columns, (v + 0.5) / rows, 0.5 * (level.w + patch.levels[k + 1].w)});
      }
  }
  return places;
}

struct Sample {
  double determinant, least, most;
};

Sample sampleAt(const RbfMap& map, const V3d& place, const V3d& textureSize) {
  const Imath::M33d gradient = map.jacobian(place);
  Eigen::Matrix3d jacobian, scaled;
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 3; ++axis) {
      jacobian(k, axis) = gradient[k][axis];
      scaled(k, axis) = gradient[k][axis] * textureSize[k];
    }
  const Eigen::Vector3d squares = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(
                                      scaled * scaled.transpose(), Eigen::EigenvaluesOnly)
                                      .eigenvalues();
  return {jacobian.determinant(), std::sqrt(std::max(0.0, squares[0])),
          std::sqrt(std::max(0.0, squares[2]))};
}

}  // namespace

Distortion surveyDistortion(const RbfMap& map, const Patch& patch, const V3d& textureSize,
                            double sink) {
  const std::vector<V3d> places = samplePlaces(patch, sink);
  std::vector<Sample> samples(places.size());
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t n) {
    samples[n] = sampleAt(map, levelPosition(patch, places[n]), textureSize);
  });

  const double hand = patch.mirrored ? -1 : 1;
  double sum = 0;
  for (const Sample& sample : samples) sum += hand * sample.determinant;
  const double volume = static_cast<double>(samples.size()) / sum;

  Distortion result;
  result.minJacobian = std::numeric_limits<double>::max();
  double steepest = 0, flattest = std::numeric_limits<double>::max();
  for (std::size_t n = 0; n < samples.size(); ++n) {
    const double determinant = hand * samples[n].determinant * std::abs(volume);
    if (determinant < result.minJacobian) {
      result.minJacobian = determinant;
      result.foldUvw = places[n];
      result.foldPlace = levelPosition(patch, places[n]);
    }
    steepest = std::max(steepest, samples[n].most);
    flattest = std::min(flattest, samples[n].least);
  }
  result.minStretch = 1 / steepest;
  result.maxStretch = flattest > 0 ? 1 / flattest : std::numeric_limits<double>::infinity();
  result.meanStretch =
      std::cbrt(std::abs(volume) / (textureSize.x * textureSize.y * textureSize.z));
  return result;
}

}  // namespace mapping
