#include "render/segmented/vertex_diagram.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "levelset/error.h"

namespace render {

using Imath::V3d;
using Imath::V3i;

int PackedDistances::at(int x, int y, int z) const {
  const auto inside = [](int i, int count) {
    return static_cast<std::size_t>(std::clamp(i, 0, count - 1));
  };
  const auto width = static_cast<std::size_t>(size.x), height = static_cast<std::size_t>(size.y);
  return values[(inside(z, size.z) * height + inside(y, size.y)) * width + inside(x, size.x)];
}

PackedDistances packDistances(const V3i& size, const V3d& origin, double spacing,
                              double farthestVoxels,
                              const std::function<RegionSample(const V3d&)>& sample) {
  if (size.x < 1 || size.y < 1 || size.z < 1 || !(spacing > 0) || !(farthestVoxels > 0))
    throw levelset::UsageError(fmt::format(
        "a grid of {}x{}x{} points with a spacing of {} and a largest distance of {} voxels is not "
        "valid; give positive numbers",
        size.x, size.y, size.z, spacing, farthestVoxels));
  PackedDistances packed{.size = size, .origin = origin, .spacing = spacing};
  packed.levelsPerLength = PackedDistances::kFarthest / (farthestVoxels * spacing);
  packed.values.resize(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
                       static_cast<std::size_t>(size.z));
  constexpr int kNone = std::numeric_limits<int>::min();
  std::atomic<int> wrong = kNone;
  tbb::parallel_for(0, size.z, [&](int z) {
    std::size_t n = static_cast<std::size_t>(z) * static_cast<std::size_t>(size.x) *
                    static_cast<std::size_t>(size.y);
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) {
        const RegionSample found = sample(origin + V3d(x, y, z) * spacing);
        if (found.region < 0 || found.region >= PackedDistances::kMostRegions) wrong = found.region;
        const double levels = std::min(std::round(found.distance * packed.levelsPerLength),
                                       static_cast<double>(PackedDistances::kFarthest));
        packed.values[n++] = static_cast<std::uint8_t>(static_cast<int>(levels) +
                                                       PackedDistances::kBand * (found.region & 3));
      }
  });
  if (wrong != kNone)
    throw levelset::InvalidInput(fmt::format(
        "region {} does not fit into a byte, which holds {} regions; give fewer regions",
        wrong.load(), PackedDistances::kMostRegions));
  return packed;
}

VertexDiagram::Entry VertexDiagram::entryOf(double front, double behind, double width,
                                            double tolerance) {
  const double sum = front + behind;
  if (!(sum < width + tolerance)) return {};
  // Two samples on the interface: it lies between them.
  return {true, sum > 0 ? static_cast<float>(front / sum) : 0.5f};
}

VertexDiagram::VertexDiagram(int regions, double width, double tolerance)
    : entries_(static_cast<std::size_t>(kSize) * kSize) {
  for (int a = 0; a < kSize; ++a)
    for (int b = 0; b < kSize; ++b) {
      const int i = PackedDistances::regionOf(a), j = PackedDistances::regionOf(b);
      const int u = PackedDistances::levelsOf(a), v = PackedDistances::levelsOf(b);
      if (i == j || i >= regions || j >= regions || u >= PackedDistances::kFarthest ||
          v >= PackedDistances::kFarthest)
        continue;
      entries_[static_cast<std::size_t>(a) * kSize + static_cast<std::size_t>(b)] =
          entryOf(u, v, width, tolerance);
    }
}

}  // namespace render
