#include "levelset/points/surface/sample_field.h"

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/components/regions.h"
#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

namespace levelset::points {
namespace {

using Imath::V3d;
using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;

/// Distance from the surface, voxels, within which grid points are sampled. The interpolant of
/// redistance() reads less.
constexpr double kSampledWidth = 3;
constexpr int kSide = static_cast<int>(Leaf::DIM), kCube = kSide / 2;

/// A block and the neighbours into which its surface continues: bit 9 (dx + 1) + 3 (dy + 1) + dz +
/// 1.
struct SampledBlock {
  std::unique_ptr<Leaf> leaf;
  std::uint32_t continues = 0;
};

class BlockSampler {
 public:
  BlockSampler(const SampledField& field, const SampleFrame& frame)
      : field_(field), frame_(frame) {}

  [[nodiscard]] SampledBlock sample(const Coord& origin) const {
    SampledBlock block{std::make_unique<Leaf>(origin)};
    FieldMemory memory;
    for (int n = 0; n < 8; ++n) sampleCube(block, corner(n, kCube), memory);
    return block;
  }

 private:
  [[nodiscard]] double limit() const { return kSampledWidth * frame_.voxelSize; }

  /// Samples the 4³ grid points of a block from `low` on.
  void sampleCube(SampledBlock& block, const Coord& low, FieldMemory& memory) const {
    std::array<Coord, 64> local;
    CubePositions at;
    CubeValues outside, values;
    for (std::size_t n = 0; n < at.size(); ++n) {
      const int number = static_cast<int>(n);
      local[n] = low + corner(number / 8, 2) + corner(number % 8, 1);
      const Coord index = block.leaf->origin() + local[n];
      at[n] = frame_.voxelSize * V3d(index.x(), index.y(), index.z()) - frame_.centre;
      outside[n] = outsideBox(at[n]);
    }
    if (*std::min_element(outside.begin(), outside.end()) > limit())
      values = outside;
    else
      field_(at, values, memory, limit());
    const auto most = static_cast<float>(limit());
    for (std::size_t n = 0; n < at.size(); ++n) {
      const auto value = static_cast<float>(std::max(outside[n], values[n]));
      block.leaf->setValueOnly(Leaf::coordToOffset(local[n]), std::clamp(value, -most, most));
      if (std::abs(value) < most) block.continues |= neighbours(local[n]);
    }
  }

  [[nodiscard]] static Coord corner(int n, int edge) {
    return {(n >> 2) * edge, (n >> 1 & 1) * edge, (n & 1) * edge};
  }

  /// Blocks that grid points within the sampled width of a surface at `local` may lie in.
  [[nodiscard]] static std::uint32_t neighbours(const Coord& local) {
    constexpr int kWidth = static_cast<int>(kSampledWidth);
    std::uint32_t bits = 0;
    for (int dx = local.x() < kWidth ? -1 : 0; dx <= (local.x() >= kSide - kWidth ? 1 : 0); ++dx)
      for (int dy = local.y() < kWidth ? -1 : 0; dy <= (local.y() >= kSide - kWidth ? 1 : 0); ++dy)
        for (int dz = local.z() < kWidth ? -1 : 0; dz <= (local.z() >= kSide - kWidth ? 1 : 0);
             ++dz)
          bits |= 1u << (9 * (dx + 1) + 3 * (dy + 1) + dz + 1);
    return bits;
  }

  /// Distance from the box of the frame, in the maximum norm; negative inside.
  [[nodiscard]] double outsideBox(const V3d& relative) const {
    double outside = -std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
      outside = std::max(
          {outside, frame_.box.min[axis] - relative[axis], relative[axis] - frame_.box.max[axis]});
    return outside;
  }

  const SampledField& field_;
  const SampleFrame& frame_;
};

void sortUnique(std::vector<Coord>& blocks) {
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
}

}  // namespace

Coord blockAt(const SampleFrame& frame, const V3d& position) {
  const V3d index = (position + frame.centre) / frame.voxelSize;
  return Coord::floor(openvdb::Vec3d(index.x, index.y, index.z)) & ~(kSide - 1);
}

openvdb::FloatGrid::Ptr sampleField(const SampledField& field, const SampleFrame& frame,
                                    std::vector<Coord> wave, std::size_t maxMemory,
                                    const Progress& progress) {
  const auto background = static_cast<float>(kSampledWidth * frame.voxelSize);
  auto grid = openvdb::FloatGrid::create(background);
  grid->setTransform(uniformTransform(frame.voxelSize));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  openvdb::FloatTree& tree = grid->tree();

  sortUnique(wave);
  const auto first = static_cast<double>(wave.size());
  const std::size_t most = memoryLeft(memoryLimit(maxMemory));
  const BlockSampler sampler(field, frame);
  double count = 0;
  while (!wave.empty()) {
    // Batches bound the time between two reports.
    constexpr std::size_t kBatch = 4096;
    std::vector<Coord> next;
    for (std::size_t begin = 0; begin < wave.size(); begin += kBatch) {
      const std::size_t size = std::min(kBatch, wave.size() - begin);
      count += static_cast<double>(size);
      // A leaf with its share of the inner nodes; the distance transform holds as much again.
      constexpr double kLeafBytes = 2.2 * 2200;
      requireMemory(kLeafBytes * count, most);
      std::vector<SampledBlock> blocks(size);
      tbb::parallel_for(std::size_t{0}, size,
                        [&](std::size_t i) { blocks[i] = sampler.sample(wave[begin + i]); });
      for (SampledBlock& block : blocks) {
        const Coord origin = block.leaf->origin();
        tree.addLeaf(block.leaf.release());
        for (int n = 0; n < 27; ++n)
          if (block.continues >> n & 1)
            next.push_back(
                origin.offsetBy(kSide * (n / 9 - 1), kSide * (n / 3 % 3 - 1), kSide * (n % 3 - 1)));
      }
      report(progress, 1 - first / (first + 1.5 * count));
    }
    sortUnique(next);
    std::erase_if(next,
                  [&](const Coord& origin) { return tree.probeConstLeaf(origin) != nullptr; });
    wave = std::move(next);
  }

  // All values are active while the tiles between the blocks get their signs.
  bool hasInside = false, hasOutside = false;
  for (auto leaf = tree.beginLeaf(); leaf; ++leaf) leaf->setValuesOn();
  openvdb::tools::signedFloodFill(tree);
  for (auto leaf = tree.beginLeaf(); leaf; ++leaf)
    for (auto value = leaf->beginValueOn(); value; ++value) {
      (*value < 0 ? hasInside : hasOutside) = true;
      if (!(std::abs(*value) < background)) value.setValueOff();
    }
  if (!hasInside || !hasOutside)
    throw NoSurface(
        "the points enclose no grid point, so they have no surface; use smaller voxels, or check "
        "normals and radii");
  return grid;
}

std::size_t dropPartsWithoutPoints(openvdb::FloatGrid& grid, const OrientedPoints& points) {
  constexpr std::uint32_t kFewest = 4;
  const RegionMap map(grid);
  std::vector<std::uint32_t> counts(map.regions().size(), 0);
  openvdb::tree::ValueAccessor<const openvdb::Int32Tree> read(map.labels());
  for (const V3d& p : points.positions) {
    // Regions at the grid points about the point.
    const Coord nearest = Coord::round(grid.worldToIndex(toVdb(p + points.centre)));
    std::array<std::int32_t, 27> seen{};
    for (int n = 0; n < 27; ++n)
      seen[static_cast<std::size_t>(n)] =
          read.getValue(nearest.offsetBy(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1));
    std::sort(seen.begin(), seen.end());
    for (std::size_t n = 0; n < seen.size(); ++n)
      if (n == 0 || seen[n] != seen[n - 1]) ++counts[static_cast<std::size_t>(seen[n])];
  }
  counts[RegionMap::kInfinite] = kFewest;
  const auto isDropped = [&](std::int32_t region) {
    return counts[static_cast<std::size_t>(region)] < kFewest;
  };
  const auto dropped = static_cast<std::size_t>(
      std::count_if(counts.begin(), counts.end(), [](std::uint32_t n) { return n < kFewest; }));
  if (dropped == 0) return 0;
  for (auto value = grid.beginValueAll(); value; ++value)
    if (isDropped(map.labels().getValue(value.getCoord()))) value.setValue(-*value);
  return dropped;
}

}  // namespace levelset::points
