#include "render/kernel/brick_pool.h"

#include <fmt/core.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>

#include "levelset/error.h"
#include "levelset/vdb.h"

namespace render {
namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;

constexpr int kBlock = 8;
constexpr std::size_t kEntriesOfPage = 2 * BrickPool::kBlocksOfPage;
constexpr int kMostEmptyPages = 1 << 10;  // pages along the edge of an empty cube
// Single precision tells a place this far from the table's corner to 5e-4 voxel.
constexpr double kWidest = 8192;  // voxels
constexpr std::size_t kMostBricks = std::numeric_limits<std::int32_t>::max() / BrickPool::kValues;
constexpr int kReachBefore = 2, kReachBehind = 3;  // grid points that tell a cell's curvature

struct Brick {
  Coord origin;
  std::array<float, BrickPool::kValues> value;
  std::array<std::uint32_t, BrickPool::kMaskWords> mask;
};

/// Origins of the blocks that can hold a crossing cell: those of leaves, and those before them,
/// whose last cells reach into them. In tree order of no importance, each once.
std::vector<Coord> blocksOf(const openvdb::FloatTree& tree) {
  std::vector<Coord> blocks;
  blocks.reserve(tree.leafCount() * 2);
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
    for (int i = 0; i < 8; ++i)
      blocks.push_back(
          leaf->origin().offsetBy(i & 4 ? -kBlock : 0, i & 2 ? -kBlock : 0, i & 1 ? -kBlock : 0));
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  return blocks;
}

/// The values of the 9³ points from a block's origin on, from up to eight leaves.
/// @return do they differ in sign?
template <typename Accessor>
bool fill(const Accessor& accessor, Brick& brick) {
  constexpr int kEdge = BrickPool::kEdge;
  bool anyInside = false, anyOutside = false;
  for (int i = 0; i < 8; ++i) {
    const int fromX = i & 4 ? kBlock : 0, fromY = i & 2 ? kBlock : 0, fromZ = i & 1 ? kBlock : 0;
    const Coord at = brick.origin.offsetBy(fromX, fromY, fromZ);
    const Leaf* leaf = accessor.probeConstLeaf(at);
    const float* values = leaf ? leaf->buffer().data() : nullptr;
    const float tile = leaf ? 0.0f : accessor.getValue(at);
    for (int x = fromX; x < (fromX ? kEdge : kBlock); ++x)
      for (int y = fromY; y < (fromY ? kEdge : kBlock); ++y)
        for (int z = fromZ; z < (fromZ ? kEdge : kBlock); ++z) {
          const float v = values ? values[(x - fromX) << 6 | (y - fromY) << 3 | (z - fromZ)] : tile;
          brick.value[static_cast<std::size_t>((x * kEdge + y) * kEdge + z)] = v;
          (v < 0 ? anyInside : anyOutside) = true;
        }
  }
  return anyInside && anyOutside;
}

/// Marks the cells whose corners differ in sign.
void findCrossings(Brick& brick) {
  constexpr int kEdge = BrickPool::kEdge;
  brick.mask = {};
  for (int x = 0; x < kBlock; ++x)
    for (int y = 0; y < kBlock; ++y) {
      // Bit z: are the four points at z of this column of cells inside, all or any?
      unsigned all = 0, any = 0;
      for (int z = 0; z < kEdge; ++z) {
        const auto isInside = [&](int i, int j) {
          return brick.value[static_cast<std::size_t>(((x + i) * kEdge + y + j) * kEdge + z)] < 0;
        };
        const bool a = isInside(0, 0), b = isInside(0, 1), c = isInside(1, 0), d = isInside(1, 1);
        all |= static_cast<unsigned>(a && b && c && d) << z;
        any |= static_cast<unsigned>(a || b || c || d) << z;
      }
      const unsigned crossing = (any | any >> 1) & ~(all & all >> 1) & 0xff;
      const unsigned bit = static_cast<unsigned>(x << 6 | y << 3);
      brick.mask[bit >> 5] |= crossing << (bit & 31);
    }
}

/// The coefficients that the cells of a block need, from the point before the first one on.
struct SplineBlock {
  static constexpr int kAround = kBlock + 3;
  float c[kAround][kAround][kAround];

  template <typename Accessor>
  SplineBlock(const Accessor& accessor, const Coord& origin) {
    constexpr int kFirst[4] = {0, 1, kBlock + 1, kAround};  // of the blocks before, here and behind
    for (int n = 0; n < 27; ++n) {
      const int b[3] = {n / 9, n / 3 % 3, n % 3};
      const Coord at =
          origin.offsetBy((b[0] - 1) * kBlock, (b[1] - 1) * kBlock, (b[2] - 1) * kBlock);
      const Leaf* leaf = accessor.probeConstLeaf(at);
      const float tile = leaf ? 0.0f : accessor.getValue(at);
      const int z0 = kFirst[b[2]], z1 = kFirst[b[2] + 1];
      for (int x = kFirst[b[0]]; x < kFirst[b[0] + 1]; ++x)
        for (int y = kFirst[b[1]]; y < kFirst[b[1] + 1]; ++y) {
          if (!leaf) {
            std::fill(c[x][y] + z0, c[x][y] + z1, tile);
            continue;
          }
          const float* row = leaf->buffer().data() + (((x - 1) & 7) << 6 | ((y - 1) & 7) << 3);
          std::copy_n(row + ((z0 - 1) & 7), z1 - z0, c[x][y] + z0);
        }
    }
  }

  using SignRows = std::array<std::array<unsigned, kAround>, kAround>;
  /// Bit z of row (x, y): is the coefficient negative?
  [[nodiscard]] SignRows signRows() const {
    SignRows rows;
    for (std::size_t x = 0; x < kAround; ++x)
      for (std::size_t y = 0; y < kAround; ++y) {
        unsigned row = 0;
        for (int z = 0; z < kAround; ++z) row |= static_cast<unsigned>(c[x][y][z] < 0) << z;
        rows[x][y] = row;
      }
    return rows;
  }

  /// Bit z: do the coefficients of the cell (x, y, z) differ in sign? Where not the spline, which
  /// lies between them, crosses nothing.
  [[nodiscard]] static unsigned mixedCells(const SignRows& rows, std::size_t x, std::size_t y) {
    unsigned any = 0, all = ~0u;
    for (std::size_t i = x; i < x + 4; ++i)
      for (std::size_t j = y; j < y + 4; ++j) {
        any |= rows[i][j];
        all &= rows[i][j];
      }
    any |= any >> 1;
    all &= all >> 1;
    return (any | any >> 2) & ~(all & all >> 2) & 0xff;
  }

  /// Bit z: is the spline in the middle of the cell (x, y, z) nearer to zero than its slopes let it
  /// get from there? For a row at a time, whose points along z stand side by side.
  [[nodiscard]] unsigned openCells(int x, int y) const {
    constexpr float kMiddle[4] = {1.0f / 48, 23.0f / 48, 23.0f / 48, 1.0f / 48};
    constexpr float kRoom = 1e-5f;  // of the largest coefficient, for single precision
    Row middle{}, most{}, slopeX{}, slopeY{}, slopeZ{};  // of all points at that z
    const auto widen = [](float& to, float v) { to = std::max(to, v); };
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        const auto& v = c[x + i][y + j];
        const auto& nextX = c[std::min(x + i + 1, x + 3)][y + j];
        const auto& nextY = c[x + i][std::min(y + j + 1, y + 3)];
        for (std::size_t z = 0; z < kAround; ++z) {
          middle[z] += kMiddle[i] * kMiddle[j] * v[z];
          widen(most[z], std::abs(v[z]));
          widen(slopeX[z], std::abs(nextX[z] - v[z]));
          widen(slopeY[z], std::abs(nextY[z] - v[z]));
        }
        for (std::size_t z = 0; z + 1 < kAround; ++z) widen(slopeZ[z], std::abs(v[z + 1] - v[z]));
      }
    for (Row* row : {&most, &slopeX, &slopeY}) takeLargest(*row, 4);
    takeLargest(slopeZ, 3);
    unsigned open = 0;
    for (std::size_t z = 0; z < kBlock; ++z) {
      float value = 0;
      for (std::size_t k = 0; k < 4; ++k) value += kMiddle[k] * middle[z + k];
      const float slope = slopeX[z] + slopeY[z] + slopeZ[z];
      const bool isOpen = std::abs(value) <= 0.5f * slope + kRoom * most[z];
      open |= static_cast<unsigned>(isOpen) << z;
    }
    return open;
  }

 private:
  using Row = std::array<float, kAround>;
  /// In each place that of it and those behind it, 3 or 4 in all.
  static void takeLargest(Row& row, std::size_t count) {
    for (std::size_t z = 0; z + 1 < kAround; ++z) row[z] = std::max(row[z], row[z + 1]);
    for (std::size_t z = 0; z < kBlock; ++z) row[z] = std::max(row[z], row[z + count - 2]);
  }
};

/// Marks the cells in which the spline may cross zero.
template <typename Accessor>
void findSplineCrossings(const Accessor& accessor, Brick& brick) {
  const SplineBlock block(accessor, brick.origin);
  const SplineBlock::SignRows signs = block.signRows();
  brick.mask = {};
  for (int x = 0; x < kBlock; ++x)
    for (int y = 0; y < kBlock; ++y) {
      const unsigned mixed =
          SplineBlock::mixedCells(signs, static_cast<std::size_t>(x), static_cast<std::size_t>(y));
      if (mixed == 0) continue;
      const unsigned bit = static_cast<unsigned>(x << 6 | y << 3);
      brick.mask[bit >> 5] |= (mixed & block.openCells(x, y)) << (bit & 31);
    }
}

/// The spline's coefficients f − ∇²f/6 in the place of the values, in leaves.
openvdb::FloatTree::Ptr quasiInterpolated(const openvdb::FloatTree& tree) {
  openvdb::FloatTree::Ptr result(new openvdb::FloatTree(tree));
  openvdb::tree::LeafManager<openvdb::FloatTree> leaves(*result);
  leaves.foreach ([&](Leaf& leaf, std::size_t) {
    const openvdb::tree::ValueAccessor<const openvdb::FloatTree> accessor(tree);
    const SplineBlock f(accessor, leaf.origin());
    float* values = leaf.buffer().data();
    for (int x = 1; x <= kBlock; ++x)
      for (int y = 1; y <= kBlock; ++y)
        for (int z = 1; z <= kBlock; ++z) {
          const auto at = [&](int i, int j, int k) {
            return static_cast<double>(f.c[x + i][y + j][z + k]);
          };
          const double own = at(0, 0, 0);
          const double bend = at(-1, 0, 0) + at(1, 0, 0) + at(0, -1, 0) + at(0, 1, 0) +
                              at(0, 0, -1) + at(0, 0, 1) - 6 * own;
          values[(x - 1) << 6 | (y - 1) << 3 | (z - 1)] = static_cast<float>(own - bend / 6);
        }
  });
  return result;
}

/// The bricks that hold a crossing, in the order of their origins.
std::vector<std::unique_ptr<Brick>> bricksOf(const openvdb::FloatTree& tree, Filter filter) {
  const std::vector<Coord> blocks = blocksOf(tree);
  std::vector<std::unique_ptr<Brick>> bricks(blocks.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 64), [&](const auto& range) {
    const openvdb::tree::ValueAccessor<const openvdb::FloatTree> accessor(tree);
    auto brick = std::make_unique<Brick>();
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      brick->origin = blocks[i];
      const bool differ = fill(accessor, *brick);
      if (filter == Filter::Trilinear) {
        if (!differ) continue;
        findCrossings(*brick);
      } else {
        findSplineCrossings(accessor, *brick);
        if (brick->mask == decltype(brick->mask){}) continue;
      }
      bricks[i] = std::move(brick);
      brick = std::make_unique<Brick>();
    }
  });
  std::erase(bricks, nullptr);
  return bricks;
}

/// The range of the cells that are crossed, on each axis.
openvdb::CoordBBox crossedCells(const Brick& brick) {
  openvdb::CoordBBox box;
  for (int x = 0; x < kBlock; ++x)
    for (int y = 0; y < kBlock; ++y) {
      const unsigned bit = static_cast<unsigned>(x << 6 | y << 3);
      const unsigned column = brick.mask[bit >> 5] >> (bit & 31) & 0xff;
      if (column == 0) continue;
      box.expand(Coord(x, y, std::countr_zero(column)));
      box.expand(Coord(x, y, std::bit_width(column) - 1));
    }
  return box;
}

/// A block that the surface does not cross, and whose values tell its curvature.
struct Neighbour {
  Coord origin;
  std::unique_ptr<Brick> brick;  ///< none where all values are alike: far away
  bool isInside = false;
};

/// In the order of their origins.
std::vector<Neighbour> neighboursOf(const openvdb::FloatTree& tree,
                                    const std::vector<std::unique_ptr<Brick>>& bricks) {
  std::vector<Coord> origins;
  for (const auto& brick : bricks) {
    const openvdb::CoordBBox cells = crossedCells(*brick);
    const Coord from = cells.min().offsetBy(-kReachBefore), to = cells.max().offsetBy(kReachBehind);
    for (int x = from.x() >> 3; x <= to.x() >> 3; ++x)
      for (int y = from.y() >> 3; y <= to.y() >> 3; ++y)
        for (int z = from.z() >> 3; z <= to.z() >> 3; ++z)
          if (x || y || z)
            origins.push_back(brick->origin.offsetBy(x * kBlock, y * kBlock, z * kBlock));
  }
  std::sort(origins.begin(), origins.end());
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  std::erase_if(origins, [&](const Coord& origin) {
    const auto at = std::lower_bound(
        bricks.begin(), bricks.end(), origin,
        [](const std::unique_ptr<Brick>& b, const Coord& o) { return b->origin < o; });
    return at != bricks.end() && (*at)->origin == origin;
  });
  std::vector<Neighbour> neighbours(origins.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, origins.size(), 64), [&](const auto& range) {
    const openvdb::tree::ValueAccessor<const openvdb::FloatTree> accessor(tree);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      Neighbour& n = neighbours[i];
      n.origin = origins[i];
      if (accessor.probeConstLeaf(n.origin)) {
        n.brick = std::make_unique<Brick>();
        n.brick->origin = n.origin;
        (void)fill(accessor, *n.brick);
      } else {
        n.isInside = accessor.getValue(n.origin) < 0;
      }
    }
  });
  return neighbours;
}

/// Writes into the empty items of a cubic table the edges of the largest aligned empty cubes.
/// @param size    items along each axis
/// @param isEmpty of an item's number
/// @param edge    of an item
template <typename IsEmpty, typename Set>
void markEmpty(const std::array<int, 3>& size, int most, const IsEmpty& isEmpty, const Set& set) {
  const auto number = [&](const std::array<int, 3>& size_, int x, int y, int z) {
    return (static_cast<std::size_t>(x) * static_cast<std::size_t>(size_[1]) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size_[2]) +
           static_cast<std::size_t>(z);
  };
  // A pyramid, finest first: is all below empty?
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

/// Where the entry of the block with that origin is.
class Table {
 public:
  explicit Table(BrickPool& pool) : pool_(pool) {
    std::size_t count = 1;
    for (const int n : pool.pages) count *= static_cast<std::size_t>(n);
    pool.page.assign(count, -BrickPool::kPage);
  }
  /// Makes the page if there is none.
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
      first = static_cast<std::int32_t>(pool_.entry.size());
      pool_.entry.resize(pool_.entry.size() + BrickPool::kBlocksOfPage, -kBlock);
      pool_.entry.resize(pool_.entry.size() + BrickPool::kBlocksOfPage, 0);
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
        [&](std::size_t i, int edge) { entries[i] = -kBlock * edge; });
  }
  markEmpty(
      pool.pages, kMostEmptyPages, [&](std::size_t i) { return pool.page[i] < 0; },
      [&](std::size_t i, int edge) { pool.page[i] = -BrickPool::kPage * edge; });
}

/// The bricks that are crossed, then those beside them, then one that is far outside and one that
/// is far inside.
void fillPool(BrickPool& pool, const std::vector<std::unique_ptr<Brick>>& bricks,
              const std::vector<Neighbour>& neighbours, float background) {
  std::vector<const Brick*> held;
  Table table(pool);
  const auto hold = [&](std::size_t slot, const Brick& brick) {
    pool.entry[slot + BrickPool::kBlockOfEntry] = static_cast<std::int32_t>(held.size());
    held.push_back(&brick);
  };
  for (const auto& brick : bricks) {
    const std::size_t slot = table.slotOf(brick->origin);
    pool.entry[slot] = static_cast<std::int32_t>(held.size());
    hold(slot, *brick);
  }
  for (const Neighbour& n : neighbours)
    if (n.brick) hold(table.slotOf(n.origin), *n.brick);
  Brick far[2];
  for (const bool isInside : {false, true}) {
    far[isInside].value.fill(isInside ? -background : background);
    for (const Neighbour& n : neighbours)
      if (!n.brick && n.isInside == isInside)
        pool.entry[table.slotOf(n.origin) + BrickPool::kBlockOfEntry] =
            static_cast<std::int32_t>(held.size());
    held.push_back(&far[isInside]);
  }
  if (held.size() > kMostBricks) {
    throw levelset::ResourceLimit(
        fmt::format("render: the surface takes {} blocks, and {} are the most; use larger voxels",
                    held.size(), kMostBricks));
  }
  markEmptyCubes(pool);
  pool.value.resize(held.size() * BrickPool::kValues);
  pool.mask.resize(bricks.size() * BrickPool::kMaskWords);
  tbb::parallel_for(std::size_t{0}, held.size(), [&](std::size_t i) {
    std::copy(held[i]->value.begin(), held[i]->value.end(),
              pool.value.begin() + static_cast<std::ptrdiff_t>(i * BrickPool::kValues));
    if (i < bricks.size())
      std::copy(bricks[i]->mask.begin(), bricks[i]->mask.end(),
                pool.mask.begin() + static_cast<std::ptrdiff_t>(i * BrickPool::kMaskWords));
  });
}

/// @param crossed  origins of the bricks
void requireNarrow(const openvdb::CoordBBox& crossed) {
  std::array<double, 3> spans{};
  for (int a = 0; a < 3; ++a)
    spans[static_cast<std::size_t>(a)] =
        static_cast<double>(crossed.max()[a]) - crossed.min()[a] + kBlock;
  if (*std::max_element(spans.begin(), spans.end()) <= kWidest) return;
  throw levelset::ResourceLimit(fmt::format(
      "render: the surface spans {:.6g} x {:.6g} x {:.6g} voxels, and {:.0f} are the most in "
      "single precision; draw with --renderer embree, use larger voxels, or draw its parts apart",
      spans[0], spans[1], spans[2], kWidest));
}

}  // namespace

std::size_t BrickPool::bytes() const {
  return 4 * (page.size() + entry.size() + mask.size() + value.size());
}

BrickPool makeBricks(const levelset::NarrowBand& band, Filter filter) {
  BrickPool pool;
  pool.filter = filter;
  if (band.isEmpty()) return pool;
  openvdb::FloatTree::ConstPtr coefficients;
  if (filter == Filter::BSplineQi) coefficients = quasiInterpolated(levelset::vdb(band).tree());
  const openvdb::FloatTree& tree = coefficients ? *coefficients : levelset::vdb(band).tree();
  const auto bricks = bricksOf(tree, filter);
  if (bricks.empty()) return pool;
  openvdb::CoordBBox crossed;
  for (const auto& brick : bricks) crossed.expand(brick->origin);
  requireNarrow(crossed);
  const std::vector<Neighbour> neighbours = neighboursOf(tree, bricks);
  openvdb::CoordBBox box = crossed;
  for (const Neighbour& n : neighbours) box.expand(n.origin);
  for (std::size_t i = 0; i < 3; ++i) {
    const int a = static_cast<int>(i);
    pool.origin[i] = box.min()[a];
    pool.low[i] = crossed.min()[a] - box.min()[a];
    pool.high[i] = crossed.max()[a] - box.min()[a] + kBlock;
    pool.pages[i] =
        (box.max()[a] - box.min()[a] + kBlock + BrickPool::kPage - 1) / BrickPool::kPage;
  }
  fillPool(pool, bricks, neighbours, levelset::vdb(band).background());
  pool.blocksLeftOut = tree.leafCount();
  for (const auto& brick : bricks)
    pool.blocksLeftOut -= tree.probeConstLeaf(brick->origin) != nullptr;
  for (const Neighbour& n : neighbours) pool.blocksLeftOut -= n.brick != nullptr;
  return pool;
}

}  // namespace render
