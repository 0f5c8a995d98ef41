#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <memory>
#include <span>

namespace mapping {

/// edge³ grid points at origin + i·rows[0] + j·rows[1] + k·rows[2], i, j, k in 0 … edge − 1.
struct GridBlock {
  static constexpr int kLeafEdge = 8;
  Imath::V3d origin;
  Imath::M33d rows;
  int edge = kLeafEdge;  ///< a power of two, at least kLeafEdge

  [[nodiscard]] Imath::V3d row(int i) const { return {rows[i][0], rows[i][1], rows[i][2]}; }
  [[nodiscard]] Imath::V3d center() const {
    return origin + (row(0) + row(1) + row(2)) * (0.5 * (edge - 1));
  }
  /// Upper half along i, j, k where bit 4, 2, 1 is set. @pre edge > kLeafEdge
  [[nodiscard]] GridBlock octant(int bits) const {
    const double half = 0.5 * edge;
    const V3d corner = origin + row(0) * (bits & 4 ? half : 0.0) +
                       row(1) * (bits & 2 ? half : 0.0) + row(2) * (bits & 1 ? half : 0.0);
    return {corner, rows, edge / 2};
  }

 private:
  using V3d = Imath::V3d;
};

/// A map as it looks from the grid points of one block: what is far from the block has been summed
/// up, what cannot reach it left out.
class BlockMap {
 public:
  virtual ~BlockMap() = default;
  /// A box that holds the image of the block's hull; empty where the map is not defined in it.
  [[nodiscard]] virtual Imath::Box3d imageBounds() const = 0;
  /// Is the map defined in all of the block's hull?
  [[nodiscard]] virtual bool isTotal() const { return true; }
  /// The same map on an octant, see GridBlock::octant.
  [[nodiscard]] virtual std::unique_ptr<BlockMap> octant(int bits) const = 0;
  /// Texture coordinates of the 512 grid points, at index 64 i + 8 j + k; NaN where the map is not
  /// defined. @pre edge == kLeafEdge
  /// @return how many particles were added up or tetrahedra tried, over all grid points
  virtual std::size_t evaluate(std::span<Imath::V3d, 512> uvw) const = 0;
};

/// A map at one place.
struct MapSample {
  Imath::V3d position, uvw;
  Imath::M33d jacobian;  ///< rows: gradients of u, v and w; not finite where the map is flat
};

/// A map from patch space to the texture's unit cube.
class PatchMap {
 public:
  virtual ~PatchMap() = default;
  /// Texture coordinates; NaN where the map is not defined.
  [[nodiscard]] virtual Imath::V3d operator()(const Imath::V3d& x) const = 0;
  /// Is the map defined beside its particles only, each place of texture space once?
  [[nodiscard]] virtual bool isLocal() const { return false; }
  /// Rows are the gradients of u, v and w; NaN where the map is not defined.
  [[nodiscard]] virtual Imath::M33d jacobian(const Imath::V3d& x) const = 0;
  /// The map on a block, right to `tolerance` in u, v and w. It refers to this map.
  [[nodiscard]] virtual std::unique_ptr<BlockMap> restrictTo(const GridBlock& block,
                                                             double tolerance) const = 0;
};

}  // namespace mapping
