#include "levelset/volumes/synthetic.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

namespace levelset {
namespace {

using Imath::V3d;

template <typename Function>
Volume sampledCube(int size, std::size_t maxMemory, const Function& function) {
  if (size < 2)
    throw UsageError(
        fmt::format("the size is {} grid points along each axis; give at least 2", size));
  const double count = std::pow(static_cast<double>(size), 3);
  requireMemory(count * sizeof(float), memoryLimit(maxMemory));
  const double step = 2.0 / (size - 1);
  VolumeGrid grid{Imath::V3i(size),
                  Imath::M44d(step, 0, 0, 0, 0, step, 0, 0, 0, 0, step, 0, -1, -1, -1, 1)};
  std::vector<float> values(grid.pointCount());
  const auto side = static_cast<std::size_t>(size);
  tbb::parallel_for(std::size_t{0}, side, [&](std::size_t k) {
    const auto at = [&](std::size_t n) { return -1 + step * static_cast<double>(n); };
    for (std::size_t j = 0; j < side; ++j)
      for (std::size_t i = 0; i < side; ++i)
        values[(k * side + j) * side + i] = static_cast<float>(function(V3d(at(i), at(j), at(k))));
  });
  return {grid, std::move(values)};
}

void requirePositive(double length, const char* name) {
  if (!(length > 0) || !std::isfinite(length))
    throw UsageError(fmt::format("{} is {}; give a positive length", name, length));
}

/// Weights of the Gaussian at 0, 1, 2, … samples from its centre; they sum to 1 with both sides.
std::vector<double> gaussian(double sigmaInSamples) {
  const auto reach = static_cast<std::size_t>(std::ceil(4 * sigmaInSamples));
  std::vector<double> weights(reach + 1);
  double sum = 0;
  for (std::size_t n = 0; n <= reach; ++n) {
    const double x = static_cast<double>(n) / sigmaInSamples;
    weights[n] = std::exp(-0.5 * x * x);
    sum += n == 0 ? weights[n] : 2 * weights[n];
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// Convolves all lines along an axis.
void convolve(std::vector<float>& values, const Imath::V3i& size, int axis,
              const std::vector<double>& weights, const Progress& progress) {
  const std::array<std::size_t, 3> count = {static_cast<std::size_t>(size.x),
                                            static_cast<std::size_t>(size.y),
                                            static_cast<std::size_t>(size.z)};
  const std::array<std::size_t, 3> stride = {1, count[0], count[0] * count[1]};
  const auto a = static_cast<std::size_t>(axis);
  const std::size_t other = a == 2 ? 1 : 2, inner = 3 - a - other;
  constexpr std::size_t kSlice = 16;
  for (std::size_t from = 0; from < count[other]; from += kSlice) {
    const std::size_t to = std::min(count[other], from + kSlice);
    tbb::parallel_for(from, to, [&](std::size_t layer) {
      std::vector<double> line(count[a]);
      for (std::size_t n = 0; n < count[inner]; ++n) {
        float* first = values.data() + layer * stride[other] + n * stride[inner];
        for (std::size_t i = 0; i < count[a]; ++i)
          line[i] = static_cast<double>(first[i * stride[a]]);
        for (std::size_t i = 0; i < count[a]; ++i) {
          double sum = weights[0] * line[i];
          for (std::size_t w = 1; w < weights.size(); ++w)
            sum += weights[w] * (line[i >= w ? i - w : 0] + line[std::min(i + w, count[a] - 1)]);
          first[i * stride[a]] = static_cast<float>(sum);
        }
      }
    });
    report(progress, static_cast<double>(to) / static_cast<double>(count[other]));
  }
}

}  // namespace

double marschnerLobbAt(const V3d& position) {
  constexpr double kFrequency = 6, kAlpha = 0.25, kPi = std::numbers::pi;
  const double r = std::hypot(position.x, position.y);
  const double rings = std::cos(2 * kPi * kFrequency * std::cos(kPi * r / 2));
  return (1 - std::sin(kPi * position.z / 2) + kAlpha * (1 + rings)) / (2 * (1 + kAlpha));
}

Volume marschnerLobb(int size, std::size_t maxMemory) {
  return sampledCube(size, maxMemory, marschnerLobbAt);
}

Volume sphereVolume(int size, double radius, std::size_t maxMemory) {
  requirePositive(radius, "the radius");
  return sampledCube(size, maxMemory, [=](const V3d& p) { return radius - p.length(); });
}

Volume torusVolume(int size, double radius, double tube, std::size_t maxMemory) {
  requirePositive(radius, "the radius");
  requirePositive(tube, "the radius of the tube");
  return sampledCube(size, maxMemory, [=](const V3d& p) {
    return tube - std::hypot(std::hypot(p.x, p.y) - radius, p.z);
  });
}

Volume blurred(const Volume& volume, double sigma, const BlurOptions& options) {
  requirePositive(sigma, "sigma");
  if (!volume.grid().isOrthogonal())
    throw InvalidInput(
        "the axes of the volume are not perpendicular, so the blur would not be the same in all "
        "directions; resample the volume first");
  const V3d spacing = volume.grid().spacing();
  for (int axis = 0; axis < 3; ++axis)
    if (!(4 * sigma / spacing[axis] < volume.size()[axis] + 1e6))
      throw UsageError(fmt::format("sigma is {}, which is {:.3g} samples; give a smaller length",
                                   sigma, sigma / spacing[axis]));
  requireMemory(static_cast<double>(volume.grid().pointCount()) * sizeof(float),
                memoryLimit(options.maxMemory));
  std::vector<float> values(volume.grid().pointCount());
  const Imath::V3i size = volume.size();
  for (int k = 0; k < size.z; ++k)
    for (int j = 0; j < size.y; ++j) {
      float* row = values.data() + volume.index(0, j, k);
      volume.storedRow(j, k, {row, static_cast<std::size_t>(size.x)});
      for (int i = 0; i < size.x; ++i)
        row[i] = static_cast<float>(volume.scale()(static_cast<double>(row[i])));
    }
  for (int axis = 0; axis < 3; ++axis)
    convolve(values, size, axis, gaussian(sigma / spacing[axis]),
             subProgress(options.progress, axis / 3.0, (axis + 1) / 3.0));
  return {volume.grid(), std::move(values)};
}

}  // namespace levelset
