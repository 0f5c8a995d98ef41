#include "mapping/distortion/distortion.h"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "mapping/maps/layer_map.h"

namespace mapping {
namespace {

using Imath::V3d;

/// Least and largest singular value of the derivative of texture → patch, world units per world
/// unit. They are the reciprocals of the singular values of the Jacobian, scaled by the texture's
/// size.
struct Stretch {
  double least, most;
};

Stretch stretchOf(const Imath::M33d& jacobian, const V3d& textureSize) {
  Eigen::Matrix3d scaled;
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 3; ++axis) scaled(k, axis) = jacobian[k][axis] * textureSize[k];
  if (!scaled.allFinite()) return {0, std::numeric_limits<double>::infinity()};
  const Eigen::Vector3d squares = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(
                                      scaled * scaled.transpose(), Eigen::EigenvaluesOnly)
                                      .eigenvalues();
  return {1 / std::sqrt(squares[2]), 1 / std::sqrt(std::max(0.0, squares[0]))};
}

Spread spreadOf(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return {values.front(), at(0.01), at(0.5), at(0.99), values.back()};
}

}  // namespace

std::vector<V3d> samplePoints(const Patch& patch, double embedDepth) {
  std::vector<V3d> points;
  if (embedDepth != 0) {  // add points below the surface, or above the last layer
    const ParticleLayer& end = embedDepth > 0 ? patch.layers.front() : patch.layers.back();
    for (std::size_t j = 0; j < end.rows; ++j)
      for (std::size_t i = 0; i < end.columns; ++i)
        for (const double share : {1.0, 0.5})
          points.push_back({static_cast<double>(i) / static_cast<double>(end.columns - 1),
                            static_cast<double>(j) / static_cast<double>(end.rows - 1),
                            end.w - share * embedDepth});
  }
  for (std::size_t k = 0; k < patch.layers.size(); ++k) {
    const ParticleLayer& layer = patch.layers[k];
    const double columns = static_cast<double>(layer.columns - 1);
    const double rows = static_cast<double>(layer.rows - 1);
    for (std::size_t j = 0; j < layer.rows; ++j)
      for (std::size_t i = 0; i < layer.columns; ++i) {
        const double u = static_cast<double>(i), v = static_cast<double>(j);
        points.push_back({u / columns, v / rows, layer.w});
        if (i + 1 == layer.columns || j + 1 == layer.rows) continue;
        points.push_back({(u + 0.5) / columns, (v + 0.5) / rows, layer.w});
        if (k + 1 < patch.layers.size())
          points.push_back(
              {(u + 0.5) / columns, (v + 0.5) / rows, 0.5 * (layer.w + patch.layers[k + 1].w)});
      }
  }
  return points;
}

std::vector<MapSample> sampleMap(const PatchMap& map, const Patch& patch, double embedDepth) {
  const std::vector<V3d> points = samplePoints(patch, embedDepth);
  std::vector<MapSample> samples(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t n) {
    const V3d position = layerPosition(patch, points[n]);
    samples[n] = {position, points[n], map.jacobian(position)};
  });
  return samples;
}

Distortion surveyDistortion(std::span<const MapSample> samples, const V3d& textureSize,
                            bool isMirrored) {
  const double hand = isMirrored ? -1 : 1;
  std::vector<double> jacobians(samples.size()), stretches(2 * samples.size());
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t n) {
    const double det = samples[n].jacobian.determinant();
    jacobians[n] = std::isfinite(det) ? hand * det : 0;
    const Stretch stretch = stretchOf(samples[n].jacobian, textureSize);
    stretches[2 * n] = stretch.least;
    stretches[2 * n + 1] = stretch.most;
  });
  // The median of the volume ratios, patch to texture, is insensitive to slivers and folds.
  std::vector<double> volumes;
  for (const double jacobian : jacobians)
    if (jacobian > 0) volumes.push_back(1 / jacobian);
  const double volume = volumes.empty() ? 1 : spreadOf(std::move(volumes)).median;

  Distortion result;
  result.samples = samples.size();
  for (double& jacobian : jacobians) {
    jacobian *= volume;
    result.folded += !(jacobian > 0);
  }
  const auto worst = static_cast<std::size_t>(std::min_element(jacobians.begin(), jacobians.end()) -
                                              jacobians.begin());
  result.foldUvw = samples[worst].uvw;
  result.foldPoint = samples[worst].position;
  result.jacobian = spreadOf(std::move(jacobians));
  result.leastAbove = HUGE_VAL;
  for (std::size_t n = 0; n < samples.size(); ++n)
    if (samples[n].uvw.z >= 0) result.leastAbove = std::min(result.leastAbove, stretches[2 * n]);
  result.stretch = spreadOf(std::move(stretches));
  result.meanStretch = std::cbrt(volume / (textureSize.x * textureSize.y * textureSize.z));
  return result;
}

Distortion worstOf(std::span<const Distortion> maps) {
  std::vector<const Distortion*> byJacobian;
  for (const Distortion& map : maps) byJacobian.push_back(&map);
  std::stable_sort(byJacobian.begin(), byJacobian.end(), [](const auto* a, const auto* b) {
    return a->jacobian.least < b->jacobian.least;
  });
  Distortion result = *byJacobian.front();
  for (const Distortion& map : maps)
    result.leastAbove = std::min(result.leastAbove, map.leastAbove);
  const auto widen = [](Spread& spread, const Spread& other) {
    spread.least = std::min(spread.least, other.least);
    spread.percent1 = std::min(spread.percent1, other.percent1);
    spread.percent99 = std::max(spread.percent99, other.percent99);
    spread.most = std::max(spread.most, other.most);
  };
  const auto middle = [&](const auto& value) {
    std::vector<double> values;
    for (const Distortion& map : maps) values.push_back(value(map));
    return spreadOf(std::move(values)).median;
  };
  result.samples = result.folded = 0;
  for (const Distortion& map : maps) {
    result.samples += map.samples;
    result.folded += map.folded;
    widen(result.jacobian, map.jacobian);
    widen(result.stretch, map.stretch);
  }
  result.jacobian.median = middle([](const Distortion& map) { return map.jacobian.median; });
  result.stretch.median = middle([](const Distortion& map) { return map.stretch.median; });
  result.meanStretch = middle([](const Distortion& map) { return map.meanStretch; });
  return result;
}

}  // namespace mapping
