#include "render/bricks/brick_pool.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "levelset/error.h"
#include "levelset/vdb.h"
#include "render/bricks/surface_bricks_vdb.h"

namespace render {
namespace {

using openvdb::Coord;

constexpr std::size_t kEntriesOfPage = 3 * BrickPool::kBlocksOfPage;
constexpr int kMostEmptyPages = 1 << 10;  // largest edge of a cube of empty pages, in pages
// At this distance from the table's corner, single precision resolves positions to 5e-4 voxels.
constexpr double kWidest = 8192;  // largest extent of a surface along an axis, voxels
constexpr std::size_t kMostValues = std::numeric_limits<std::int32_t>::max();

/// For each empty item of a three-dimensional table, stores the edge of the largest aligned cube of
/// empty items that contains it.
/// @param size  number of items along each axis
/// @param most  largest edge of a cube, items
/// @param isEmpty  returns true when the item with a given number is empty
/// @param set  stores the edge of the cube, in items, for the item with a given number
template <typename IsEmpty, typename Set>
void markEmpty(const std::array<int, 3>& size, int most, const IsEmpty& isEmpty, const Set& set) {
  const auto number = [&](const std::array<int, 3>& size_, int x, int y, int z) {
    return (static_cast<std::size_t>(x) * static_cast<std::size_t>(size_[1]) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size_[2]) +
           static_cast<std::size_t>(z);
  };
  // Build a pyramid of flags, finest level first. A flag is true when all items that it covers are
  // empty.
  std::vector<std::array<int, 3>> sizes{size};
  std::vector<std::vector<char>> levels(1);
  levels[0].resize(number(size, size[0] - 1, size[1] - 1, size[2] - 1) + 1);
  for (std::size_t i = 0; i < levels[0].size(); ++i) levels[0][i] = isEmpty(i);
  for (int edge = 2; edge <= most; edge *= 2) {
    const std::array<int, 3> below = sizes.back();
    std::array<int, 3> here;
    for (std::size_t a = 0; a < 3; ++a) here[a] = (below[a] + 1) / 2;
    std::vector<char> level(number(here, here[0] - 1, here[1] - 1, here[2] - 1) + 1, 1);
    for (int x = 0; x < below[0]; ++x)
      for (int y = 0; y < below[1]; ++y)
        for (int z = 0; z < below[2]; ++z)
          if (!levels.back()[number(below, x, y, z)]) level[number(here, x / 2, y / 2, z / 2)] = 0;
    sizes.push_back(here);
    levels.push_back(std::move(level));
    if (here == std::array<int, 3>{1, 1, 1}) break;
  }
  for (int x = 0; x < size[0]; ++x)
    for (int y = 0; y < size[1]; ++y)
      for (int z = 0; z < size[2]; ++z) {
        const std::size_t i = number(size, x, y, z);
        if (!levels[0][i]) continue;
        std::size_t level = 0;
        while (level + 1 < levels.size() &&
               levels[level + 1][number(sizes[level + 1], x >> (level + 1), y >> (level + 1),
                                        z >> (level + 1))])
          ++level;
        set(i, 1 << level);
      }
}

/// Fills the two-level table of a pool (`page` and `entry`): finds the items of a block by the
/// block's origin, and adds pages.
class Table {
 public:
  explicit Table(BrickPool& pool) : pool_(pool) {
    std::size_t count = 1;
    for (const int n : pool.pages) count *= static_cast<std::size_t>(n);
    pool.page.assign(count, -BrickPool::kPage);
  }
  /// Position in `entry` of the block's item of list 1, the brick numbers. Adds the three lists of
  /// the block's page if they are missing.
  std::size_t slotOf(const Coord& origin) {
    std::size_t page = 0, block = 0;
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<std::size_t>(a);
      const int at = origin[a] - pool_.origin[i];
      page = page * static_cast<std::size_t>(pool_.pages[i]) +
             static_cast<std::size_t>(at / BrickPool::kPage);
      block = block << 3 | static_cast<std::size_t>((at >> 3) & 7);
    }
    std::int32_t& first = pool_.page[page];
    if (first < 0) {
      if (pool_.entry.size() > kMostValues - kEntriesOfPage)
        throw levelset::ResourceLimit(
            "the surface occupies more table pages than a 32-bit index can address; use larger "
            "voxels, or draw its parts separately");
      first = static_cast<std::int32_t>(pool_.entry.size());
      pool_.entry.resize(pool_.entry.size() + BrickPool::kBlocksOfPage, -BrickPool::kBlock);
      pool_.entry.resize(pool_.entry.size() + kEntriesOfPage - BrickPool::kBlocksOfPage, 0);
    }
    return static_cast<std::size_t>(first) + block;
  }

 private:
  BrickPool& pool_;
};

void markEmptyCubes(BrickPool& pool) {
  for (std::size_t first = 0; first < pool.entry.size(); first += kEntriesOfPage) {
    std::int32_t* entries = pool.entry.data() + first;
    markEmpty(
        {8, 8, 8}, 4, [&](std::size_t i) { return entries[i] < 0; },
        [&](std::size_t i, int edge) { entries[i] = -BrickPool::kBlock * edge; });
  }
  markEmpty(
      pool.pages, kMostEmptyPages, [&](std::size_t i) { return pool.page[i] < 0; },
      [&](std::size_t i, int edge) { pool.page[i] = -BrickPool::kPage * edge; });
}

/// Fills the pool with the values of the bricks, then of the halo blocks, then with eight
/// background values for outside and eight for inside.
void fillPool(BrickPool& pool, const std::vector<std::unique_ptr<Brick>>& bricks,
              const std::vector<HaloBlock>& beside, float background) {
  constexpr int kEdge = BrickPool::kEdge;
  Table table(pool);
  const auto hold = [&](std::size_t slot, std::size_t first, int strideX, int strideY) {
    pool.entry[slot + BrickPool::kFirstOfEntry] = static_cast<std::int32_t>(first);
    pool.entry[slot + BrickPool::kStridesOfEntry] = strideX << BrickPool::kStrideShift | strideY;
  };
  std::size_t held = 0;
  for (std::size_t i = 0; i < bricks.size(); ++i, held += pool.brickValues()) {
    const std::size_t slot = table.slotOf(bricks[i]->origin);
    pool.entry[slot] = static_cast<std::int32_t>(i);
    hold(slot, held, kEdge * kEdge, kEdge);
  }
  for (const HaloBlock& block : beside) {
    if (block.value.empty()) continue;
    const Coord low = block.points.min(), size = block.points.dim();
    const int strideY = size.z(), strideX = size.y() * strideY;
    const auto before = static_cast<std::size_t>(low.x() * strideX + low.y() * strideY + low.z());
    hold(table.slotOf(block.origin), held - before, strideX, strideY);
    held += block.value.size();
    ++pool.haloCount;
  }
  for (const HaloBlock& block : beside)
    if (block.value.empty())
      hold(table.slotOf(block.origin), held + (block.isInside ? BrickPool::kBlock : 0), 0, 0);
  held += 2 * BrickPool::kBlock;
  if (held > kMostValues) {
    throw levelset::ResourceLimit(
        fmt::format("the surface needs {} values, but at most {} are supported; use larger voxels",
                    held, kMostValues));
  }
  markEmptyCubes(pool);
  pool.value.resize(bricks.size() * pool.brickValues());
  pool.value.reserve(held);
  pool.mask.resize(bricks.size() * BrickPool::kMaskWords);
  tbb::parallel_for(std::size_t{0}, bricks.size(), [&](std::size_t i) {
    std::copy(bricks[i]->value.begin(), bricks[i]->value.end(),
              pool.value.begin() + static_cast<std::ptrdiff_t>(i * pool.brickValues()));
    std::copy(bricks[i]->mask.begin(), bricks[i]->mask.end(),
              pool.mask.begin() + static_cast<std::ptrdiff_t>(i * BrickPool::kMaskWords));
  });
  for (const HaloBlock& block : beside)
    pool.value.insert(pool.value.end(), block.value.begin(), block.value.end());
  pool.value.insert(pool.value.end(), BrickPool::kBlock, background);
  pool.value.insert(pool.value.end(), BrickPool::kBlock, -background);
}

/// Replaces the values of the pool by codes of the quantization `held`.
void encode(BrickPool& pool, const ValueBits& held) {
  pool.quantization = held;
  const auto size = static_cast<std::size_t>(held.bits / 8);
  pool.code.assign(pool.value.size() * size + BrickPool::kCodePadding, 0);
  tbb::parallel_for(std::size_t{0}, pool.value.size(), [&](std::size_t i) {
    const int code = held.codeOf(pool.value[i]);
    for (std::size_t b = 0; b < size; ++b)
      pool.code[i * size + b] = static_cast<std::uint8_t>(code >> (8 * b));
  });
  pool.value = {};
}

/// Checks that the surface spans at most kWidest voxels. @param crossed  box of the origins of the
/// crossed blocks
void requireNarrow(const openvdb::CoordBBox& crossed) {
  std::array<double, 3> spans{};
  for (int a = 0; a < 3; ++a)
    spans[static_cast<std::size_t>(a)] =
        static_cast<double>(crossed.max()[a]) - crossed.min()[a] + BrickPool::kBlock;
  if (*std::max_element(spans.begin(), spans.end()) <= kWidest) return;
  throw levelset::ResourceLimit(
      fmt::format("the surface spans {:.6g} x {:.6g} x {:.6g} voxels, but at most {:.0f} "
                  "are supported in "
                  "single precision; draw with --renderer embree, use larger voxels, or draw its "
                  "parts separately",
                  spans[0], spans[1], spans[2], kWidest));
}

BrickPool makePool(const GridSource& grid, float background, const TableOptions& options) {
  BrickPool pool;
  pool.filter = options.filter;
  const Bricks bricks = bricksOf(grid, options);
  const openvdb::CoordBBox& crossed = bricks.crossed;
  if (crossed.empty()) return pool;
  requireNarrow(crossed);
  openvdb::CoordBBox box = crossed;
  box.expand(BrickPool::kBlock);  // stencils of crossed cells then read no block outside the table
  for (std::size_t i = 0; i < 3; ++i) {
    const int a = static_cast<int>(i);
    pool.origin[i] = box.min()[a];
    pool.low[i] = crossed.min()[a] - box.min()[a];
    pool.high[i] = crossed.max()[a] - box.min()[a] + BrickPool::kBlock;
    pool.cellsLow[i] = bricks.cells.min()[a] - box.min()[a];
    pool.cellsHigh[i] = bricks.cells.max()[a] + 1 - box.min()[a];
    pool.pages[i] =
        (box.max()[a] - box.min()[a] + BrickPool::kBlock + BrickPool::kPage - 1) / BrickPool::kPage;
  }
  pool.blocksCulled = bricks.culled;
  pool.blocksOmitted = grid.storedBlocks();
  if (bricks.kept.empty()) return pool;
  const bool isClosed =
      tetrahedralDegree(options.filter) > 0 || options.filter == Filter::BccQuadratic;
  const std::vector<HaloBlock> beside =
      isClosed ? std::vector<HaloBlock>() : haloBlocks(grid, bricks.kept);
  fillPool(pool, bricks.kept, beside, background);
  for (const auto& brick : bricks.kept) pool.blocksOmitted -= grid.isStored(brick->origin);
  for (const HaloBlock& block : beside)
    pool.blocksOmitted -= !block.value.empty() && grid.isStored(block.origin);
  if (options.quantization.bits != 32) encode(pool, options.quantization);
  return pool;
}

}  // namespace

double BrickPool::valueAt(std::size_t i) const {
  if (quantization.bits == 32) return static_cast<double>(value[i]);
  const int held = quantization.bits == 16 ? code[2 * i] | code[2 * i + 1] << 8 : code[i];
  return static_cast<double>(quantization.valueOf(held));
}

std::size_t BrickPool::bytes() const {
  return 4 * (page.size() + entry.size() + mask.size()) + valueBytes();
}

BrickPool makeBricks(const levelset::NarrowBand& band, const TableOptions& options) {
  if (band.isEmpty()) {
    BrickPool nothing;
    nothing.filter = options.filter;
    return nothing;
  }
  openvdb::FloatTree::ConstPtr coefficients;
  if (options.filter == Filter::BSplineQi)
    coefficients = quasiInterpolated(levelset::vdb(band).tree());
  const openvdb::FloatTree& tree = coefficients ? *coefficients : levelset::vdb(band).tree();
  return makePool(*treeSource(tree), levelset::vdb(band).background(), options);
}

BrickPool makeBricks(const VolumeSurface& surface, const TableOptions& options) {
  return makePool(*volumeSource(surface, options.filter), 0, options);
}

}  // namespace render
