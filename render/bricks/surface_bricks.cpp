#include "render/bricks/surface_bricks_vdb.h"

#include <openvdb/tree/LeafManager.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "levelset/grids/padded_leaf_vdb.h"

namespace render {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using Leaf = openvdb::FloatTree::LeafNodeType;

constexpr int kBlock = BrickPool::kBlock;

/// Origins of the blocks that may hold a crossed cell: the leaves, and the blocks before them along
/// the axes, whose last cells have corners in the leaves. Sorted, without duplicates.
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

/// Copies the values of the 9³ grid points from a block's origin on, which lie in up to eight
/// leaves. Returns true when the values differ in sign.
bool fill(GridReader& grid, Brick& brick) {
  static_assert(BrickPool::kEdge == kBlock + 1);
  grid.copyPadded(brick.origin, 0, 1, brick.value.data());
  bool anyInside = false, anyOutside = false;
  for (const float v : brick.value) (v < 0 ? anyInside : anyOutside) = true;
  return anyInside && anyOutside;
}

/// Sets the mask bits of the cells whose corners differ in sign.
void findCrossings(Brick& brick) {
  constexpr int kEdge = BrickPool::kEdge;
  brick.mask = {};
  for (int x = 0; x < kBlock; ++x)
    for (int y = 0; y < kBlock; ++y) {
      // Bit z of `all` and of `any`: all, or any, of the four points at height z of the column of
      // cells (x, y) are inside.
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

/// Spline coefficients, or values for Filter::Tricubic, at the 11³ grid points that the cells of a
/// block read, starting one point before the block's origin.
struct SplineBlock {
  static constexpr int kAround = kBlock + 3;
  float c[kAround][kAround][kAround];

  SplineBlock(GridReader& grid, const Coord& origin) { grid.copyPadded(origin, 1, 2, &c[0][0][0]); }

  using SignRows = std::array<std::array<unsigned, kAround>, kAround>;
  /// Signs of the coefficients: bit z of rows[x][y] is set when c[x][y][z] is negative.
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

  /// Row of cells (x, y) as bits: bit z is set when the coefficients of cell (x, y, z) differ in
  /// sign. In other cells the spline has no zero, because its values lie between the coefficients.
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

  /// Row of cells (x, y) as bits: bit z is set when a zero of the spline in cell (x, y, z) is
  /// possible. That is when the value in the cell's middle does not exceed the bound on its change
  /// within the cell.
  [[nodiscard]] unsigned openCells(int x, int y) const {
    constexpr float kMiddle[4] = {1.0f / 48, 23.0f / 48, 23.0f / 48, 1.0f / 48};
    constexpr float kRoom =
        1e-5f;  // margin for single-precision rounding, relative to the largest coefficient
    Row middle{}, most{}, slopeX{}, slopeY{}, slopeZ{};  // one entry for each z
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

  /// Row of cells (x, y) as bits: bit z is set when Bézier coefficients of the Catmull-Rom spline
  /// in cell (x, y, z) differ in sign.
  [[nodiscard]] unsigned openTricubicCells(int x, int y) const {
    Row least, most;
    least.fill(std::numeric_limits<float>::max());
    most.fill(std::numeric_limits<float>::lowest());
    const auto widen = [&](std::size_t z, float v) {
      least[z] = std::min(least[z], v);
      most[z] = std::max(most[z], v);
    };
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        for (std::size_t z = 0; z < kAround; ++z) widen(z, c[x + i][y + j][z]);
    // The magnitudes of the weights of a coefficient sum to at most (4/3)³ = 64/27.
    constexpr float kRounding = 1e-5f;
    unsigned open = 0;
    Row room;
    for (std::size_t z = 0; z < kBlock; ++z) {
      const float low = std::min({least[z], least[z + 1], least[z + 2], least[z + 3]}),
                  high = std::max({most[z], most[z + 1], most[z + 2], most[z + 3]});
      const float widening = (high - low) * (37.0f / 54);
      room[z] = kRounding * std::max(std::abs(low), std::abs(high));
      if (low - widening < room[z] && high + widening >= -room[z]) open |= 1u << z;
    }
    if (open == 0) return 0;
    std::array<std::array<Row, 4>, 4> net;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j)
        std::copy_n(c[x + static_cast<int>(i)][y + static_cast<int>(j)], kAround,
                    net[i][j].begin());
    for (std::size_t n = 0; n < 4; ++n) toBezier(net[0][n], net[1][n], net[2][n], net[3][n]);
    for (std::size_t n = 0; n < 4; ++n) toBezier(net[n][0], net[n][1], net[n][2], net[n][3]);
    least.fill(std::numeric_limits<float>::max());
    most.fill(std::numeric_limits<float>::lowest());
    for (const auto& rows : net)
      for (const Row& f : rows)
        for (std::size_t z = 0; z < kBlock; ++z) {
          widen(z, f[z + 1]);
          widen(z, f[z + 1] + (f[z + 2] - f[z]) * (1.0f / 6));
          widen(z, f[z + 2] - (f[z + 3] - f[z + 1]) * (1.0f / 6));
          widen(z, f[z + 2]);
        }
    for (std::size_t z = 0; z < kBlock; ++z)
      if (!(least[z] < room[z] && most[z] >= -room[z])) open &= ~(1u << z);
    return open;
  }

 private:
  using Row = std::array<float, kAround>;
  /// Replaces four successive rows of values by the Bézier coefficients between the second and the
  /// third.
  static void toBezier(Row& f0, Row& f1, Row& f2, Row& f3) {
    for (std::size_t z = 0; z < kAround; ++z) {
      const float a = f1[z], b = f2[z];
      const float first = a + (b - f0[z]) * (1.0f / 6), second = b - (f3[z] - a) * (1.0f / 6);
      f0[z] = a;
      f1[z] = first;
      f2[z] = second;
      f3[z] = b;
    }
  }
  /// Replaces each entry by the largest of `count` consecutive entries (3 or 4) from it on.
  static void takeLargest(Row& row, std::size_t count) {
    for (std::size_t z = 0; z + 1 < kAround; ++z) row[z] = std::max(row[z], row[z + 1]);
    for (std::size_t z = 0; z < kBlock; ++z) row[z] = std::max(row[z], row[z + count - 2]);
  }
};

/// Sets the mask bits of the cells in which the spline may cross zero.
void findSplineCrossings(GridReader& grid, Filter filter, Brick& brick) {
  const SplineBlock block(grid, brick.origin);
  brick.mask = {};
  if (filter == Filter::Tricubic) {
    for (int x = 0; x < kBlock; ++x)
      for (int y = 0; y < kBlock; ++y) {
        const unsigned bit = static_cast<unsigned>(x << 6 | y << 3);
        brick.mask[bit >> 5] |= block.openTricubicCells(x, y) << (bit & 31);
      }
    return;
  }
  const SplineBlock::SignRows signs = block.signRows();
  for (int x = 0; x < kBlock; ++x)
    for (int y = 0; y < kBlock; ++y) {
      const unsigned mixed =
          SplineBlock::mixedCells(signs, static_cast<std::size_t>(x), static_cast<std::size_t>(y));
      if (mixed == 0) continue;
      const unsigned bit = static_cast<unsigned>(x << 6 | y << 3);
      brick.mask[bit >> 5] |= (mixed & block.openCells(x, y)) << (bit & 31);
    }
}

/// Clears the mask bits of the cells outside a box.
void keepCells(const CoordBBox& cells, Brick& brick) {
  const CoordBBox block = CoordBBox::createCube(brick.origin, kBlock);
  if (cells.isInside(block)) return;
  for (int n = 0; n < kBlock * kBlock * kBlock; ++n)
    if (!cells.isInside(brick.origin.offsetBy(n >> 6, n >> 3 & 7, n & 7)))
      brick.mask[static_cast<std::size_t>(n >> 5)] &= ~(1u << (n & 31));
}

/// Calls work(first, last) with the first and the last crossed cell of each row of cells along z
/// that has any. Cells are relative to the brick's origin.
template <typename Work>
void overCrossedRows(const Brick& brick, const Work& work) {
  for (int x = 0; x < kBlock; ++x)
    for (int y = 0; y < kBlock; ++y) {
      const unsigned bit = static_cast<unsigned>(x << 6 | y << 3);
      const unsigned column = brick.mask[bit >> 5] >> (bit & 31) & 0xff;
      if (column != 0)
        work(Coord(x, y, std::countr_zero(column)), Coord(x, y, std::bit_width(column) - 1));
    }
}

/// A block, and the box of its points that the stencils of one brick read.
struct Part {
  Coord origin;
  CoordBBox points;  ///< relative to the origin
};

/// Adds the points of neighbouring blocks that the stencils of a brick's crossed cells read. The
/// stencil of a cell starts one point before its lowest corner and ends two points after it, on
/// each axis. Along one axis at a time it covers one more point in both directions.
void addPartsBeside(const Brick& brick, std::vector<Part>& parts) {
  std::array<CoordBBox, 27> beside;
  const auto add = [&](const CoordBBox& points) {
    for (int x = points.min().x() >> 3; x <= points.max().x() >> 3; ++x)
      for (int y = points.min().y() >> 3; y <= points.max().y() >> 3; ++y)
        for (int z = points.min().z() >> 3; z <= points.max().z() >> 3; ++z) {
          CoordBBox part = CoordBBox::createCube(Coord(x, y, z) << 3, kBlock);
          part.intersect(points);
          beside[static_cast<std::size_t>(((x + 1) * 3 + y + 1) * 3 + z + 1)].expand(part);
        }
  };
  overCrossedRows(brick, [&](const Coord& first, const Coord& last) {
    for (int a = 0; a < 3; ++a) {
      Coord further(0);
      further[a] = 1;
      add(CoordBBox(first - Coord(1) - further, last + Coord(2) + further));
    }
  });
  for (int n = 0; n < 27; ++n) {
    const CoordBBox& points = beside[static_cast<std::size_t>(n)];
    if (n == 13 || points.empty()) continue;
    const Coord corner = Coord(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1) << 3;
    parts.push_back(
        {brick.origin + corner, CoordBBox(points.min() - corner, points.max() - corner)});
  }
}

/// Reader of a tree's values.
class TreeReader : public GridReader {
 public:
  explicit TreeReader(const openvdb::FloatTree& tree) : accessor_(tree) {}
  void copyPadded(const Coord& origin, int before, int after, float* out) override {
    levelset::copyPaddedLeaf(accessor_, origin, before, after, out);
  }
  void read(HaloBlock& block) override {
    const Leaf* leaf = accessor_.probeConstLeaf(block.origin);
    if (!leaf) {
      block.isInside = accessor_.getValue(block.origin) < 0;
      return;
    }
    block.value.reserve(block.points.volume());
    for (const Coord& point : block.points)
      block.value.push_back(leaf->buffer().data()[Leaf::coordToOffset(point)]);
  }

 private:
  openvdb::tree::ValueAccessor<const openvdb::FloatTree> accessor_;
};

class TreeSource : public GridSource {
 public:
  explicit TreeSource(const openvdb::FloatTree& tree) : tree_(tree) {}
  [[nodiscard]] std::vector<Coord> blocks() const override { return blocksOf(tree_); }
  [[nodiscard]] std::size_t storedBlocks() const override { return tree_.leafCount(); }
  [[nodiscard]] bool isStored(const Coord& origin) const override {
    return tree_.probeConstLeaf(origin) != nullptr;
  }
  [[nodiscard]] std::unique_ptr<GridReader> reader() const override {
    return std::make_unique<TreeReader>(tree_);
  }

 private:
  const openvdb::FloatTree& tree_;
};

}  // namespace

std::unique_ptr<GridSource> treeSource(const openvdb::FloatTree& tree) {
  return std::make_unique<TreeSource>(tree);
}

openvdb::FloatTree::Ptr quasiInterpolated(const openvdb::FloatTree& tree) {
  openvdb::FloatTree::Ptr result(new openvdb::FloatTree(tree));
  openvdb::tree::LeafManager<openvdb::FloatTree> leaves(*result);
  leaves.foreach ([&](Leaf& leaf, std::size_t) {
    TreeReader reader(tree);
    const SplineBlock f(reader, leaf.origin());
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

Bricks bricksOf(const GridSource& grid, const TableOptions& options) {
  // Radius, in voxels, of a ball that contains a block and the stencils of its cells.
  constexpr double kRadius = 0.5 * kBlock * std::numbers::sqrt3 + 3;
  const std::vector<Coord> blocks = grid.blocks();
  const CoordBBox cells = grid.cells();
  std::vector<std::unique_ptr<Brick>> bricks(blocks.size());
  struct Sum {
    CoordBBox crossed, cells;
    std::size_t culled = 0;
  };
  tbb::enumerable_thread_specific<Sum> sums;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 64), [&](const auto& range) {
    const std::unique_ptr<GridReader> reader = grid.reader();
    Sum& sum = sums.local();
    auto brick = std::make_unique<Brick>();
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      brick->origin = blocks[i];
      if (tetrahedralDegree(options.filter) > 0) {
        fillCubes(*reader, options.filter, *brick);
      } else if (options.filter == Filter::BccQuadratic) {
        fillSites(*reader, *brick);
      } else if (const bool differ = fill(*reader, *brick); options.filter != Filter::Trilinear) {
        findSplineCrossings(*reader, options.filter, *brick);
      } else {
        if (!differ) continue;
        findCrossings(*brick);
      }
      keepCells(cells, *brick);
      if (brick->mask == decltype(brick->mask){}) continue;
      const Coord& origin = brick->origin;
      sum.crossed.expand(origin);
      overCrossedRows(*brick, [&](const Coord& first, const Coord& last) {
        sum.cells.expand(origin + first);
        sum.cells.expand(origin + last);
      });
      if (options.keeps &&
          !options.keeps(Imath::V3d(origin.x(), origin.y(), origin.z()) + Imath::V3d(0.5 * kBlock),
                         kRadius)) {
        ++sum.culled;
        continue;
      }
      bricks[i] = std::move(brick);
      brick = std::make_unique<Brick>();
    }
  });
  Bricks result;
  std::erase(bricks, nullptr);
  result.kept = std::move(bricks);
  for (const Sum& sum : sums) {
    result.crossed.expand(sum.crossed);
    result.cells.expand(sum.cells);
    result.culled += sum.culled;
  }
  return result;
}

std::vector<HaloBlock> haloBlocks(const GridSource& grid,
                                  const std::vector<std::unique_ptr<Brick>>& bricks) {
  std::vector<Part> parts;
  for (const auto& brick : bricks) addPartsBeside(*brick, parts);
  std::sort(parts.begin(), parts.end(),
            [](const Part& a, const Part& b) { return a.origin < b.origin; });
  std::vector<HaloBlock> blocks;
  auto brick = bricks.begin();
  for (const Part& part : parts) {
    while (brick != bricks.end() && (*brick)->origin < part.origin) ++brick;
    if (brick != bricks.end() && (*brick)->origin == part.origin) continue;
    if (blocks.empty() || blocks.back().origin != part.origin)
      blocks.emplace_back().origin = part.origin;
    blocks.back().points.expand(part.points);
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 64), [&](const auto& range) {
    const std::unique_ptr<GridReader> reader = grid.reader();
    for (std::size_t i = range.begin(); i != range.end(); ++i) reader->read(blocks[i]);
  });
  return blocks;
}

}  // namespace render
