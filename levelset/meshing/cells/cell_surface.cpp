#include "levelset/meshing/cells/cell_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <unordered_map>

#include "levelset/error.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using LeafNode = FloatTree::LeafNodeType;

constexpr int kSide = 8;
constexpr std::uint64_t kLowZ = 0x0101010101010101ull;  ///< bits of a slab's points with z = 0

Coord shifted(const Coord& origin, unsigned side) {
  return origin.offsetBy(side & 4 ? kSide : 0, side & 2 ? kSide : 0, side & 1 ? kSide : 0);
}

Coord lowered(const Coord& origin, unsigned side) {
  return origin.offsetBy(side & 4 ? -kSide : 0, side & 2 ? -kSide : 0, side & 1 ? -kSide : 0);
}

/// Shifts a slab by one along z: bit (y, z) of the result is bit (y, z + 1) of the slab. Bits with
/// z = 7 come from `beyond`, the slab of the next block along z.
std::uint64_t shiftZ(std::uint64_t slab, std::uint64_t beyond) {
  return ((slab >> 1) & ~(kLowZ << 7)) | ((beyond & kLowZ) << 7);
}
std::uint64_t shiftY(std::uint64_t slab, std::uint64_t beyond) {
  return (slab >> 8) | (beyond << 56);
}

struct OriginHash {
  std::size_t operator()(const Coord& origin) const {
    std::uint64_t hash = 0;
    for (int axis = 0; axis < 3; ++axis) {
      hash = (hash ^ static_cast<std::uint32_t>(origin[axis] >> 3)) * 0x9e3779b97f4a7c15ull;
      hash ^= hash >> 29;
    }
    return hash;
  }
};

void readSigns(SurfaceBlock& block) {
  for (std::size_t x = 0; x < kSide; ++x) {
    std::uint64_t word = 0;
    if (block.values) {
      const float* slab = block.values + x * 64;
      for (int i = 0; i < 64; ++i) word |= static_cast<std::uint64_t>(slab[i] < 0) << i;
    } else {
      word = block.fill < 0 ? ~0ull : 0;
    }
    block.inside[x] = word;
  }
}

void sortUnique(std::vector<Coord>& coords) {
  std::sort(coords.begin(), coords.end());
  coords.erase(std::unique(coords.begin(), coords.end()), coords.end());
}

/// Returns the origins of the blocks without a leaf that meet at a face with opposite signs.
std::vector<Coord> blocksBetweenTiles(const FloatGrid& grid) {
  std::vector<Coord> found;
  FloatGrid::ConstAccessor accessor = grid.getConstAccessor();
  for (auto tile = grid.tree().cbeginValueAll(); tile; ++tile) {
    if (tile.getDepth() == FloatTree::DEPTH - 1 || !(*tile < 0)) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (int side = 0; side < 2; ++side) {
        Coord inner = box.min();
        if (side) inner[axis] = box.max()[axis] - (kSide - 1);
        for (inner[u] = box.min()[u]; inner[u] <= box.max()[u]; inner[u] += kSide) {
          for (inner[v] = box.min()[v]; inner[v] <= box.max()[v]; inner[v] += kSide) {
            Coord outer = inner;
            outer[axis] += side ? kSide : -kSide;
            if (accessor.probeConstLeaf(outer) || accessor.getValue(outer) < 0) continue;
            found.push_back(inner);
            found.push_back(outer);
          }
        }
      }
    }
  }
  return found;
}

}  // namespace

CellSurface::CellSurface(const FloatGrid& grid, const openvdb::MaskTree* cells) : grid_(grid) {
  if (cells)
    collectBlocks(*cells);
  else
    collectAllBlocks();
  sortBlocks();
  linkBlocks();
  tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t i) { countBlock(blocks_[i]); });
  numberAll();
}

/// Collects the leaves, and the blocks in tiles that contain a cell with corners of both signs. A
/// cell belongs to the block of its lowest corner, which may lie in a tile.
void CellSurface::collectAllBlocks() {
  const FloatTree& tree = grid_.tree();
  blocks_.reserve(tree.leafCount());
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    SurfaceBlock block;
    block.origin = leaf->origin();
    block.values = leaf->buffer().data();
    blocks_.push_back(block);
  }
  std::vector<Coord> candidates;
  FloatGrid::ConstAccessor accessor = grid_.getConstAccessor();
  const auto addBelow = [&](const Coord& origin, unsigned from) {
    for (unsigned side = from; side < 8; ++side) {
      const Coord below = lowered(origin, side);
      if (!accessor.probeConstLeaf(below)) candidates.push_back(below);
    }
  };
  for (const SurfaceBlock& block : blocks_) addBelow(block.origin, 1);
  for (const Coord& origin : blocksBetweenTiles(grid_)) addBelow(origin, 0);
  sortUnique(candidates);
  // A block in a tile contains a cell with both signs only if a neighbour in positive direction has
  // a value of the other sign at their common border.
  for (const Coord& origin : candidates) {
    const float fill = accessor.getValue(origin);
    bool mixed = false;
    for (unsigned side = 1; side < 8 && !mixed; ++side) {
      const Coord above = shifted(origin, side);
      const LeafNode* leaf = accessor.probeConstLeaf(above);
      if (!leaf) {
        mixed = (accessor.getValue(above) < 0) != (fill < 0);
        continue;
      }
      const float* values = leaf->buffer().data();
      const int endX = side & 4 ? 1 : kSide, endY = side & 2 ? 1 : kSide,
                endZ = side & 1 ? 1 : kSide;
      for (int x = 0; x < endX; ++x)
        for (int y = 0; y < endY; ++y)
          for (int z = 0; z < endZ; ++z) mixed |= (values[x * 64 + y * 8 + z] < 0) != (fill < 0);
    }
    if (!mixed) continue;
    SurfaceBlock block;
    block.origin = origin;
    block.fill = fill;
    blocks_.push_back(block);
  }
  for (SurfaceBlock& block : blocks_) block.chosen.fill(~0ull);
}

/// Collects the blocks of the given cells and the blocks with their upper corners.
void CellSurface::collectBlocks(const openvdb::MaskTree& cells) {
  std::vector<Coord> origins;
  for (auto leaf = cells.cbeginLeaf(); leaf; ++leaf)
    for (unsigned side = 0; side < 8; ++side) origins.push_back(shifted(leaf->origin(), side));
  sortUnique(origins);
  FloatGrid::ConstAccessor accessor = grid_.getConstAccessor();
  const openvdb::tree::ValueAccessor<const openvdb::MaskTree> chosen(cells);
  blocks_.reserve(origins.size());
  for (const Coord& origin : origins) {
    SurfaceBlock block;
    block.origin = origin;
    if (const LeafNode* leaf = accessor.probeConstLeaf(origin))
      block.values = leaf->buffer().data();
    else
      block.fill = accessor.getValue(origin);
    if (const auto* mask = chosen.probeConstLeaf(origin))
      for (openvdb::Index x = 0; x < kSide; ++x)
        block.chosen[x] = mask->valueMask().getWord<std::uint64_t>(x);
    blocks_.push_back(block);
  }
}

void CellSurface::sortBlocks() {
  // Order the blocks as a tree orders its leaves. Whether a block is a leaf depends on the width of
  // the band, and the order of the triangles must not depend on that width.
  std::sort(blocks_.begin(), blocks_.end(), [](const SurfaceBlock& a, const SurfaceBlock& b) {
    for (const int nodeSide : {4096, 128, kSide}) {
      const Coord first = a.origin & -nodeSide, second = b.origin & -nodeSide;
      if (first != second) return first < second;
    }
    return false;
  });
}

void CellSurface::linkBlocks() {
  if (blocks_.size() >= kNoBlock)
    throw ResourceLimit("the surface passes more than 4294967294 blocks; use larger voxels");
  std::unordered_map<Coord, std::uint32_t, OriginHash> indexOf;
  indexOf.reserve(blocks_.size());
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    indexOf.emplace(blocks_[i].origin, static_cast<std::uint32_t>(i));
  }
  tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t i) {
    SurfaceBlock& block = blocks_[i];
    readSigns(block);
    block.neighbour[0] = static_cast<std::uint32_t>(i);
    for (unsigned side = 1; side < 8; ++side) {
      const Coord above = shifted(block.origin, side);
      const auto found = indexOf.find(above);
      block.neighbour[side] = found == indexOf.end() ? kNoBlock : found->second;
      if (found == indexOf.end()) block.neighbourFill[side] = grid_.tree().getValue(above);
    }
  });
}

std::uint64_t CellSurface::insideWord(const SurfaceBlock& block, unsigned side, int x) const {
  const std::uint32_t other = block.neighbour[side];
  if (other != kNoBlock) return blocks_[other].inside[static_cast<std::size_t>(x)];
  return block.neighbourFill[side] < 0 ? ~0ull : 0;
}

/// Returns four bit masks of slab x in [0, 8], indexed by dy·2 + dz. Bit y·8 + z of a mask is set
/// when the grid point (x, y + dy, z + dz) is inside.
CellSurface::Slab CellSurface::slabWords(const SurfaceBlock& block, int x) const {
  const unsigned far = x == kSide ? 4 : 0;
  const int slab = x & (kSide - 1);
  const std::uint64_t own = insideWord(block, far, slab);
  const std::uint64_t beyondY = insideWord(block, far | 2, slab);
  const std::uint64_t movedZ = shiftZ(own, insideWord(block, far | 1, slab));
  const std::uint64_t beyondYMovedZ = shiftZ(beyondY, insideWord(block, far | 3, slab));
  return {own, movedZ, shiftY(own, beyondY), shiftY(movedZ, beyondYMovedZ)};
}

std::array<std::uint64_t, 8> CellSurface::cornerWords(const SurfaceBlock& block, int x) const {
  const Slab low = slabWords(block, x), high = slabWords(block, x + 1);
  return {low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]};
}

void CellSurface::countBlock(SurfaceBlock& block) const {
  std::size_t rank = 0;
  for (std::size_t x = 0; x < kSide; ++x) {
    const auto words = cornerWords(block, static_cast<int>(x));
    const std::uint64_t own = words[0];
    const std::uint64_t crossed[3] = {own ^ words[4], own ^ words[2], own ^ words[1]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      block.crossed[x * 3 + axis] = crossed[axis];
      block.rank[x * 3 + axis] = static_cast<std::uint16_t>(rank);
      rank += static_cast<std::size_t>(std::popcount(crossed[axis]));
    }
  }
  block.vertexCount = rank;
  const auto& table = cellTable();
  forEachCell(block, [&](int, int, int, unsigned pattern) {
    block.triangleCount += table[pattern].triangleCount;
    block.cycleCount += table[pattern].cycleCount;
  });
}

void CellSurface::numberAll() {
  for (SurfaceBlock& block : blocks_) {
    block.firstVertex = vertexCount_;
    block.firstTriangle = triangleCount_;
    block.firstCycle = cycleCount_;
    vertexCount_ += block.vertexCount;
    triangleCount_ += block.triangleCount;
    cycleCount_ += block.cycleCount;
  }
  if (vertexCount_ > std::numeric_limits<std::uint32_t>::max()) {
    throw ResourceLimit("the surface needs more than 4294967295 vertices; use larger voxels");
  }
}

float CellSurface::valueAt(const SurfaceBlock& block, int x, int y, int z) const {
  const unsigned side = static_cast<unsigned>((x >> 3) * 4 + (y >> 3) * 2 + (z >> 3));
  const int offset = (x & 7) * 64 + (y & 7) * 8 + (z & 7);
  const std::uint32_t other = block.neighbour[side];
  return other == kNoBlock ? block.neighbourFill[side] : blocks_[other].value(offset);
}

bool CellSurface::isInside(const Coord& point) const {
  return grid_.tree().getValue(point) < 0;
}

std::uint32_t CellSurface::vertexOf(const SurfaceBlock& block, int x, int y, int z,
                                    int edge) const {
  const std::array<int, 3> offset = edgeOffset(edge);
  x += offset[0], y += offset[1], z += offset[2];
  const unsigned side = static_cast<unsigned>((x >> 3) * 4 + (y >> 3) * 2 + (z >> 3));
  const SurfaceBlock& owner = blocks_[block.neighbour[side]];
  const auto word = static_cast<std::size_t>((x & 7) * 3 + edgeAxis(edge));
  const std::uint64_t before = (1ull << ((y & 7) * 8 + (z & 7))) - 1;
  return static_cast<std::uint32_t>(
      owner.firstVertex + owner.rank[word] +
      static_cast<unsigned>(std::popcount(owner.crossed[word] & before)));
}

namespace {

/// Least distance, in voxels, of a vertex from a grid point at which other crossed edges meet. It
/// is far above the rounding of single-precision coordinates in a mesh file, and far below the
/// accuracy of any field.
constexpr double kCornerGuard = 1e-4;

bool hasOtherCrossing(const CellSurface& surface, const Coord& point, const Coord& along) {
  const bool inside = surface.isInside(point);
  for (int axis = 0; axis < 3; ++axis) {
    for (int step = -1; step <= 1; step += 2) {
      Coord next = point;
      next[axis] += step;
      if (next != along && surface.isInside(next) != inside) return true;
    }
  }
  return false;
}

}  // namespace

openvdb::Vec3d crossingPoint(const CellSurface& surface, const SurfaceBlock& block, int x, int y,
                             int z, int axis) {
  const double low = static_cast<double>(block.value(x * 64 + y * 8 + z));
  const double high = static_cast<double>(
      surface.valueAt(block, x + (axis == 0), y + (axis == 1), z + (axis == 2)));
  const double t = low / (low - high);
  // Without the test, a value that is NaN or infinite would give such a vertex.
  return pointOnEdge(surface, block.origin.offsetBy(x, y, z), axis, t >= 0 && t <= 1 ? t : 0.5);
}

openvdb::Vec3d pointOnEdge(const CellSurface& surface, const Coord& point, int axis, double t) {
  if (t < kCornerGuard || t > 1 - kCornerGuard) {
    Coord beyond = point;
    beyond[axis] += 1;
    const bool atLow = t < 0.5;
    if (hasOtherCrossing(surface, atLow ? point : beyond, atLow ? beyond : point)) {
      t = atLow ? kCornerGuard : 1 - kCornerGuard;
    }
  }
  openvdb::Vec3d result = point.asVec3d();
  result[axis] += t;
  return result;
}

IndexMesh marchCells(const CellSurface& surface) {
  IndexMesh mesh;
  mesh.positions.resize(surface.vertexCount());
  mesh.triangles.resize(surface.triangleCount());
  const auto& table = cellTable();
  const std::vector<SurfaceBlock>& blocks = surface.blocks();
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
    const SurfaceBlock& block = blocks[i];
    std::size_t vertex = block.firstVertex, triangle = block.firstTriangle;
    CellSurface::forEachVertex(block, [&](int x, int y, int z, int axis) {
      mesh.positions[vertex++] = crossingPoint(surface, block, x, y, z, axis);
    });
    surface.forEachCell(block, [&](int x, int y, int z, unsigned pattern) {
      const CellCase& cell = table[pattern];
      for (std::size_t t = 0; t < cell.triangleCount; ++t) {
        for (std::size_t corner = 0; corner < 3; ++corner) {
          mesh.triangles[triangle][corner] =
              surface.vertexOf(block, x, y, z, cell.triangles[t][corner]);
        }
        ++triangle;
      }
    });
  });
  return mesh;
}

}  // namespace levelset
