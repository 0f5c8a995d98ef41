#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <array>
#include <memory>
#include <span>

namespace mapping {

/// Grid of edge³ points at origin + i·rows[0] + j·rows[1] + k·rows[2], with i, j, k in 0 … edge −
/// 1.
struct GridBlock {
  static constexpr int kLeafEdge = 8;
  Imath::V3d origin;
  Imath::M33d rows;
  int edge = kLeafEdge;  ///< a power of two, at least kLeafEdge

  [[nodiscard]] Imath::V3d row(int i) const { return {rows[i][0], rows[i][1], rows[i][2]}; }
  [[nodiscard]] Imath::V3d center() const {
    return origin + (row(0) + row(1) + row(2)) * (0.5 * (edge - 1));
  }
  /// Octant of the block. Bits 4, 2 and 1 of `bits` select the upper half along i, j and k.
  /// @pre edge > kLeafEdge
  [[nodiscard]] GridBlock octant(int bits) const {
    const double half = 0.5 * edge;
    const V3d corner = origin + row(0) * (bits & 4 ? half : 0.0) +
                       row(1) * (bits & 2 ? half : 0.0) + row(2) * (bits & 1 ? half : 0.0);
    return {corner, rows, edge / 2};
  }

 private:
  using V3d = Imath::V3d;
};

/// A map restricted to the grid points of one block. An RBF map sums the particles far from the
/// block into a polynomial; a prism map keeps only the cells that touch the block.
class BlockMap {
 public:
  virtual ~BlockMap() = default;
  /// Box of texture coordinates that contains the image of the block's hull; empty if the map is
  /// not defined there.
  [[nodiscard]] virtual Imath::Box3d imageBounds() const = 0;
  /// True if the map is defined in all of the block's hull.
  [[nodiscard]] virtual bool isTotal() const { return true; }
  /// This map restricted to an octant, see GridBlock::octant.
  [[nodiscard]] virtual std::unique_ptr<BlockMap> octant(int bits) const = 0;
  /// Computes the texture coordinates of the 512 grid points, at index 64 i + 8 j + k; NaN where
  /// the map is not defined.
  /// @pre the edge of the block is kLeafEdge
  /// @return number of particles summed or tetrahedra tested, total of all grid points
  virtual std::size_t evaluate(std::span<Imath::V3d, 512> uvw) const = 0;
};

/// Value and Jacobian of a map at one point.
struct MapSample {
  Imath::V3d position, uvw;
  /// Rows: gradients of u, v and w; not finite where the inverse map, from u, v, w to positions, is
  /// singular.
  Imath::M33d jacobian;
};

/// Value and derivatives of a map in the opposite direction, from texture coordinates to positions.
struct ForwardFrame {
  Imath::V3d position;
  /// Derivatives along u, v and w, world units; NaN where the map is not defined.
  std::array<Imath::V3d, 3> slopes;
};

/// A map from world positions above a patch to texture coordinates, the texture's unit cube.
class PatchMap {
 public:
  virtual ~PatchMap() = default;
  /// Texture coordinates; NaN where the map is not defined.
  [[nodiscard]] virtual Imath::V3d operator()(const Imath::V3d& x) const = 0;
  /// True if the map is defined only near its particles, and takes each value of u, v, w at most
  /// once.
  [[nodiscard]] virtual bool isLocal() const { return false; }
  /// Jacobian with the gradients of u, v and w as rows; NaN where the map is not defined.
  [[nodiscard]] virtual Imath::M33d jacobian(const Imath::V3d& x) const = 0;
  /// The map restricted to a block, accurate to `tolerance` in u, v and w. The result keeps a
  /// reference to this map.
  [[nodiscard]] virtual std::unique_ptr<BlockMap> restrictTo(const GridBlock& block,
                                                             double tolerance) const = 0;
};

}  // namespace mapping
