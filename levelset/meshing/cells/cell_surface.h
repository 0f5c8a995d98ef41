#pragma once

// Grid cells that the zero set passes through, block by block. Internal header of levelset: public
// headers must not include it.

#include <array>
#include <cstdint>
#include <vector>

#include "levelset/meshing/cells/cell_table.h"
#include "levelset/vdb.h"

namespace levelset {

/// Block of 8³ grid points, with the grid cells and grid edges whose lowest corner is one of these
/// points. In the bit masks, bit y·8 + z of word x stands for a grid point, as in OpenVDB. The
/// values are not copied: all blocks exist at once, so each refers to its leaf and, by index, to
/// its neighbours.
struct SurfaceBlock {
  openvdb::Coord origin;
  const float* values = nullptr;  ///< values of the leaf; null: a tile with the value `fill`
  float fill = 0;
  /// Indices of the blocks at the offset (dx, dy, dz) of 0 or 1 blocks, by dx·4 + dy·2 + dz;
  /// CellSurface::kNoBlock if there is none. [0] is the block itself.
  std::array<std::uint32_t, 8> neighbour = {};
  std::array<float, 8> neighbourFill = {};     ///< value of a neighbour that has no block
  std::array<std::uint64_t, 8> inside = {};    ///< [x]: grid points with φ < 0
  std::array<std::uint64_t, 8> chosen = {};    ///< [x]: cells that belong to the surface
  std::array<std::uint64_t, 24> crossed = {};  ///< [x·3 + axis]: edges with a change of sign
  /// [word]: number of crossed edges in the words of `crossed` before this word.
  std::array<std::uint16_t, 24> rank = {};
  std::size_t firstVertex = 0, vertexCount = 0;
  std::size_t firstTriangle = 0, triangleCount = 0;
  /// Number of polygons (CellCase) in all earlier blocks, and in this block's cells. A dual mesh
  /// has one vertex for each polygon.
  std::size_t firstCycle = 0, cycleCount = 0;
  [[nodiscard]] float value(int offset) const { return values ? values[offset] : fill; }
};

/// The cells and edges of a grid whose corners or ends have both signs, in blocks: all of them, or
/// a part of the cells.
/// The blocks are ordered by position, as OpenVDB orders leaves, whether they are leaves or tiles.
/// A grid point with φ < 0 is inside. Outside the leaves the tiles give the values, so a band that
/// was cut off at a box still yields a closed surface.
class CellSurface {
 public:
  /// Collects the blocks, links them to their neighbours, and numbers vertices and triangles.
  /// @param cells  lowest corners of the cells that belong to the surface; null: all cells. The
  /// edges around a cell are numbered even if their other cells do not belong to it.
  /// @throws ResourceLimit when the blocks or the vertices of the surface exceed 32-bit indices
  explicit CellSurface(const openvdb::FloatGrid& grid, const openvdb::MaskTree* cells = nullptr);

  static constexpr std::uint32_t kNoBlock = 0xffffffffu;

  [[nodiscard]] const std::vector<SurfaceBlock>& blocks() const { return blocks_; }
  [[nodiscard]] std::size_t vertexCount() const { return vertexCount_; }
  [[nodiscard]] std::size_t triangleCount() const { return triangleCount_; }
  [[nodiscard]] std::size_t cycleCount() const { return cycleCount_; }

  /// Returns, for each of the eight corners of a cell, the bit mask of the cells in slab x of the
  /// block (64 cells of equal x) for which this corner is inside.
  [[nodiscard]] std::array<std::uint64_t, 8> cornerWords(const SurfaceBlock& block, int x) const;
  /// Returns the value at a grid point relative to the block, each coordinate in [0, 8].
  [[nodiscard]] float valueAt(const SurfaceBlock& block, int x, int y, int z) const;
  /// Returns true when the grid point is inside. Accepts any grid point, but is slow.
  [[nodiscard]] bool isInside(const openvdb::Coord& point) const;
  /// Returns the number of the vertex on the crossed edge `edge` of the cell (x, y, z), with edges
  /// numbered as in cell_table.h.
  [[nodiscard]] std::uint32_t vertexOf(const SurfaceBlock& block, int x, int y, int z,
                                       int edge) const;

  /// Calls visit(x, y, z, pattern) for each cell of the surface in the block with corners of both
  /// signs. Bit c of `pattern` is set when corner c is inside.
  template <typename Visit>
  void forEachCell(const SurfaceBlock& block, Visit&& visit) const {
    for (int x = 0; x < 8; ++x) {
      const std::uint64_t chosen = block.chosen[static_cast<std::size_t>(x)];
      if (!chosen) continue;
      const auto words = cornerWords(block, x);
      std::uint64_t any = 0, all = ~0ull;
      for (const std::uint64_t word : words) any |= word, all &= word;
      for (std::uint64_t left = any & ~all & chosen; left; left &= left - 1) {
        const int bit = __builtin_ctzll(left);
        unsigned pattern = 0;
        for (unsigned corner = 0; corner < 8; ++corner) {
          pattern |= static_cast<unsigned>((words[corner] >> bit) & 1) << corner;
        }
        visit(x, bit >> 3, bit & 7, pattern);
      }
    }
  }

  /// Calls visit(x, y, z, axis) for each crossed edge that starts at a grid point of the block, in
  /// the order of vertex numbers.
  template <typename Visit>
  static void forEachVertex(const SurfaceBlock& block, Visit&& visit) {
    for (int word = 0; word < 24; ++word) {
      for (std::uint64_t left = block.crossed[static_cast<std::size_t>(word)]; left;
           left &= left - 1) {
        const int bit = __builtin_ctzll(left);
        visit(word / 3, bit >> 3, bit & 7, word % 3);
      }
    }
  }

 private:
  using Slab = std::array<std::uint64_t, 4>;
  void collectAllBlocks();
  void collectBlocks(const openvdb::MaskTree& cells);
  void sortBlocks();
  void linkBlocks();
  [[nodiscard]] Slab slabWords(const SurfaceBlock& block, int x) const;
  [[nodiscard]] std::uint64_t insideWord(const SurfaceBlock& block, unsigned side, int x) const;
  void countBlock(SurfaceBlock& block) const;
  void numberAll();

  const openvdb::FloatGrid& grid_;
  std::vector<SurfaceBlock> blocks_;
  std::size_t vertexCount_ = 0, triangleCount_ = 0, cycleCount_ = 0;
};

/// Returns the zero of the linear interpolation on a crossed edge, in index space. The zero keeps a
/// small distance from an end of the edge at which further crossed edges meet, so that no two
/// vertices coincide.
[[nodiscard]] openvdb::Vec3d crossingPoint(const CellSurface& surface, const SurfaceBlock& block,
                                           int x, int y, int z, int axis);

/// Returns the point at the share `t` of the crossed edge that starts at `low`, in index space,
/// with the distance from the ends that crossingPoint() keeps.
/// @param t  in [0, 1]
[[nodiscard]] openvdb::Vec3d pointOnEdge(const CellSurface& surface, const openvdb::Coord& low,
                                         int axis, double t);

/// Triangle mesh in index space.
struct IndexMesh {
  std::vector<openvdb::Vec3d> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};
/// Builds the uniform mesh by marching cubes [Lor87], with the polygons of cell_table.h.
[[nodiscard]] IndexMesh marchCells(const CellSurface& surface);

}  // namespace levelset
