#include "levelset/components/regions.h"

#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "levelset/geometry/disjoint_sets.h"
#include "levelset/geometry/surface_components.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Int32Tree;
using FloatLeaf = FloatTree::LeafNodeType;
using LabelLeaf = Int32Tree::LeafNodeType;
/// One bit for each voxel (x, y, z) of a leaf: bit 8y + z of word x.
using LeafBits = std::array<std::uint64_t, 8>;

constexpr int kLeafDepth = FloatTree::DEPTH - 1;

LeafBits insideMask(const FloatLeaf& leaf) {
  LeafBits mask = {};
  const float* values = leaf.buffer().data();
  for (std::size_t i = 0; i < FloatLeaf::SIZE; ++i) {
    mask[i >> 6] |= static_cast<std::uint64_t>(values[i] < 0) << (i & 63);
  }
  return mask;
}

bool isEmpty(const LeafBits& mask) {
  return std::all_of(mask.begin(), mask.end(), [](std::uint64_t word) { return word == 0; });
}

/// Returns the 6-connected component that contains the first voxel of `within`.
LeafBits firstComponent(const LeafBits& within) {
  constexpr std::uint64_t kLowZ = 0x0101010101010101ull, kHighZ = kLowZ << 7;
  LeafBits grown = {};
  const auto seed = std::find_if(within.begin(), within.end(), [](std::uint64_t w) { return w; });
  const auto slab = static_cast<std::size_t>(seed - within.begin());
  grown[slab] = *seed & (~*seed + 1);
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t x = 0; x < 8; ++x) {
      const std::uint64_t own = grown[x];
      std::uint64_t next = own | ((own << 1) & ~kLowZ) | ((own >> 1) & ~kHighZ) | (own << 8) |
                           (own >> 8) | (x ? grown[x - 1] : 0) | (x < 7 ? grown[x + 1] : 0);
      next &= within[x];
      changed |= next != own;
      grown[x] = next;
    }
  }
  return grown;
}

/// Splits the voxels of a leaf into 6-connected components: first the inside ones, then the outside
/// ones, each in the order of their first voxels.
std::vector<LeafBits> splitLeaf(const FloatLeaf& leaf) {
  std::vector<LeafBits> parts;
  LeafBits left = insideMask(leaf);
  for (int sign = 0; sign < 2; ++sign) {
    if (sign) {
      left = insideMask(leaf);
      for (std::uint64_t& word : left) word = ~word;
    }
    while (!isEmpty(left)) {
      parts.push_back(firstComponent(left));
      for (std::size_t x = 0; x < 8; ++x) left[x] &= ~parts.back()[x];
    }
  }
  return parts;
}

/// Returns the buffer offsets of the 64 voxels of a leaf whose local coordinate along `axis` is
/// `position`.
std::array<openvdb::Index, 64> faceOffsets(int axis, int position) {
  std::array<openvdb::Index, 64> offsets;
  std::size_t count = 0;
  Coord c;
  c[axis] = position;
  const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
  for (c[u] = 0; c[u] < 8; ++c[u])
    for (c[v] = 0; c[v] < 8; ++c[v]) offsets[count++] = FloatLeaf::coordToOffset(c);
  return offsets;
}

}  // namespace

/// Joins labels of connected voxels and tiles into disjoint sets. The lowest label represents its
/// set. Label 0 is the space outside the tree.
class RegionMap::Linker {
 public:
  std::int32_t add() { return static_cast<std::int32_t>(sets_.add()); }
  std::int32_t root(std::int32_t i) {
    return static_cast<std::int32_t>(sets_.find(static_cast<std::uint32_t>(i)));
  }
  void join(std::int32_t a, std::int32_t b) {
    if (a == lastA_ && b == lastB_) return;
    lastA_ = a, lastB_ = b;
    sets_.join(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
  }
  [[nodiscard]] std::int32_t size() const { return static_cast<std::int32_t>(sets_.size()); }

 private:
  DisjointSets sets_{1};
  std::int32_t lastA_ = 0, lastB_ = 0;
};

RegionMap::RegionMap(const FloatGrid& grid, const Progress& progress)
    : labels_(grid.tree(), 0, openvdb::TopologyCopy()) {
  report(progress, 0);
  const CellSurface surface(grid);
  Linker linker;
  report(progress, 0.1);
  labelLeaves(grid, linker);
  labelTiles(grid, linker);
  report(progress, 0.3);
  joinLeaves(grid, linker);
  joinTiles(grid, linker);
  report(progress, 0.5);
  joinDiagonals(surface, linker);
  report(progress, 0.6);
  numberRegions(grid, linker);
  report(progress, 0.7);
  findSurfaceComponents(surface);
  report(progress, 1);
}

void RegionMap::labelLeaves(const FloatGrid& grid, Linker& linker) {
  std::vector<const FloatLeaf*> leaves;
  std::vector<LabelLeaf*> labelled;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) leaves.push_back(leaf.getLeaf());
  for (auto leaf = labels_.beginLeaf(); leaf; ++leaf) labelled.push_back(leaf.getLeaf());
  std::vector<std::vector<LeafBits>> parts(leaves.size());
  std::vector<std::int32_t> first(leaves.size());
  tbb::parallel_for(std::size_t{0}, leaves.size(),
                    [&](std::size_t i) { parts[i] = splitLeaf(*leaves[i]); });
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    first[i] = linker.size();
    for (std::size_t k = 0; k < parts[i].size(); ++k) linker.add();
  }
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    std::int32_t* out = labelled[i]->buffer().data();
    for (std::size_t k = 0; k < parts[i].size(); ++k) {
      for (std::size_t x = 0; x < 8; ++x) {
        for (std::uint64_t left = parts[i][k][x]; left; left &= left - 1) {
          out[x * 64 + static_cast<std::size_t>(__builtin_ctzll(left))] =
              first[i] + static_cast<std::int32_t>(k);
        }
      }
    }
  });
}

void RegionMap::labelTiles(const FloatGrid&, Linker& linker) {
  auto tile = labels_.beginValueAll();
  tile.setMaxDepth(kLeafDepth - 1);
  for (; tile; ++tile) tile.setValue(linker.add());
}

void RegionMap::joinLeaves(const FloatGrid& grid, Linker& linker) const {
  std::array<std::array<openvdb::Index, 64>, 3> low, high;
  for (int axis = 0; axis < 3; ++axis) {
    low[static_cast<std::size_t>(axis)] = faceOffsets(axis, 0);
    high[static_cast<std::size_t>(axis)] = faceOffsets(axis, 7);
  }
  openvdb::tree::ValueAccessor<const FloatTree> values(grid.tree());
  openvdb::tree::ValueAccessor<const Int32Tree> labels(labels_);
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    const LabelLeaf& own = *labels.probeConstLeaf(leaf->origin());
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = 0; side < 2; ++side) {
        Coord beside = leaf->origin();
        beside[axis] += side ? 8 : -8;
        const auto& here = (side ? high : low)[static_cast<std::size_t>(axis)];
        const auto& there = (side ? low : high)[static_cast<std::size_t>(axis)];
        const FloatLeaf* other = values.probeConstLeaf(beside);
        if (other && !side) continue;  // the loop over the other leaf joins this pair
        const LabelLeaf* otherLabels = other ? labels.probeConstLeaf(beside) : nullptr;
        const bool tileInside = !other && values.getValue(beside) < 0;
        const std::int32_t tileLabel = other ? 0 : labels.getValue(beside);
        for (std::size_t i = 0; i < 64; ++i) {
          const bool inside = leaf->getValue(here[i]) < 0;
          if (inside != (other ? other->getValue(there[i]) < 0 : tileInside)) continue;
          linker.join(own.getValue(here[i]), other ? otherLabels->getValue(there[i]) : tileLabel);
        }
      }
    }
  }
}

/// Joins each tile with neighbouring tiles of equal or larger size and of the same sign. Smaller
/// neighbour tiles are joined when the loop reaches them, and neighbouring leaves by joinLeaves().
void RegionMap::joinTiles(const FloatGrid& grid, Linker& linker) const {
  openvdb::tree::ValueAccessor<const FloatTree> values(grid.tree());
  openvdb::tree::ValueAccessor<const Int32Tree> labels(labels_);
  auto tile = grid.tree().cbeginValueAll();
  tile.setMaxDepth(kLeafDepth - 1);
  for (; tile; ++tile) {
    const openvdb::CoordBBox box = tile.getBoundingBox();
    const std::int32_t own = labels.getValue(box.min());
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = 0; side < 2; ++side) {
        Coord beside = box.min();
        beside[axis] = side ? box.max()[axis] + 1 : box.min()[axis] - 1;
        if (values.getValueDepth(beside) > static_cast<int>(tile.getDepth())) continue;
        if ((values.getValue(beside) < 0) == (*tile < 0)) linker.join(own, labels.getValue(beside));
      }
    }
  }
}

/// Joins two outside grid points on the diagonal of a cell face whose other two corners are inside.
void RegionMap::joinDiagonals(const CellSurface& surface, Linker& linker) const {
  constexpr int kAxes[3] = {4, 2, 1};  // bit of a corner number along x, y and z
  openvdb::tree::ValueAccessor<const Int32Tree> labels(labels_);
  for (const SurfaceBlock& block : surface.blocks()) {
    surface.forEachCell(block, [&](int x, int y, int z, unsigned pattern) {
      const auto label = [&](int corner) {
        return labels.getValue(
            block.origin.offsetBy(x + (corner >> 2), y + ((corner >> 1) & 1), z + (corner & 1)));
      };
      for (int axis = 0; axis < 3; ++axis) {
        const int u = kAxes[(axis + 1) % 3], v = kAxes[(axis + 2) % 3];
        for (int base = 0; base <= kAxes[axis]; base += kAxes[axis]) {
          const auto inside = [&](int corner) { return (pattern >> corner) & 1; };
          const int a = base, b = base + u, c = base + u + v, d = base + v;
          if (!inside(a) && !inside(c) && inside(b) && inside(d)) linker.join(label(a), label(c));
          if (inside(a) && inside(c) && !inside(b) && !inside(d)) linker.join(label(b), label(d));
        }
      }
    });
  }
}

void RegionMap::numberRegions(const FloatGrid& grid, Linker& linker) {
  std::vector<std::int32_t> number(static_cast<std::size_t>(linker.size()));
  std::int32_t count = 0;
  for (std::int32_t i = 0; i < linker.size(); ++i) {
    const std::int32_t root = linker.root(i);  // never greater than i
    number[static_cast<std::size_t>(i)] =
        root == i ? count++ : number[static_cast<std::size_t>(root)];
  }
  regions_.resize(static_cast<std::size_t>(count));
  auto tile = labels_.beginValueAll();
  tile.setMaxDepth(kLeafDepth - 1);
  for (; tile; ++tile) tile.setValue(number[static_cast<std::size_t>(*tile)]);
  openvdb::tree::LeafManager<Int32Tree> leaves(labels_);
  leaves.foreach ([&](LabelLeaf& leaf, std::size_t) {
    std::int32_t* values = leaf.buffer().data();
    for (std::size_t i = 0; i < LabelLeaf::SIZE; ++i) {
      values[i] = number[static_cast<std::size_t>(values[i])];
    }
  });
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    const LabelLeaf& labelled = *labels_.probeConstLeaf(leaf->origin());
    std::int32_t last = -1;
    for (openvdb::Index i = 0; i < LabelLeaf::SIZE; ++i) {
      const std::int32_t region = labelled.getValue(i);
      if (region == last) continue;
      last = region;
      regions_[static_cast<std::size_t>(region)].inside = leaf->getValue(i) < 0;
    }
  }
  auto value = grid.tree().cbeginValueAll();
  value.setMaxDepth(kLeafDepth - 1);
  for (; value; ++value) {
    if (*value < 0) {
      const std::int32_t region = labels_.getValue(value.getBoundingBox().min());
      regions_[static_cast<std::size_t>(region)].inside = true;
    }
  }
}

void RegionMap::findSurfaceComponents(const CellSurface& surface) {
  const IndexMesh mesh = marchCells(surface);
  const SurfaceComponents found = levelset::findSurfaceComponents(mesh.positions, mesh.triangles);
  surfaces_.resize(found.figures.size());
  std::vector<bool> seen(surfaces_.size(), false);
  openvdb::tree::ValueAccessor<const Int32Tree> labels(labels_);
  std::size_t vertex = 0;
  for (const SurfaceBlock& block : surface.blocks()) {
    std::uint32_t last = SurfaceComponents::kNoComponent;
    CellSurface::forEachVertex(block, [&](int x, int y, int z, int axis) {
      const std::uint32_t component = found.componentOfVertex[vertex++];
      if (component != last) surfaceBlocks_.emplace_back(block.origin, last = component);
      if (seen[component]) return;
      seen[component] = true;
      const Coord low = block.origin.offsetBy(x, y, z);
      Coord high = low;
      high[axis] += 1;
      const bool lowInside = block.value(x * 64 + y * 8 + z) < 0;
      surfaces_[component].inside =
          static_cast<std::uint32_t>(labels.getValue(lowInside ? low : high));
      surfaces_[component].outside =
          static_cast<std::uint32_t>(labels.getValue(lowInside ? high : low));
    });
  }
  for (std::size_t i = 0; i < surfaces_.size(); ++i) {
    regions_[surfaces_[i].inside].volume += found.figures[i].volume;
    regions_[surfaces_[i].outside].volume -= found.figures[i].volume;
  }
}

}  // namespace levelset
