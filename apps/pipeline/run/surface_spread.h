#pragma once

#include <Imath/ImathBox.h>

#include <functional>
#include <unordered_map>

#include "apps/pipeline/graph/graph.h"
#include "levelset/mesh.h"

namespace pipeline {

/// Spread of a surface in space, for estimates of the memory that a part of its band takes. The
/// surface is counted in the cells of a regular grid.
class SurfaceSpread {
 public:
  /// @param cellSize  edge length of a cell, world units
  explicit SurfaceSpread(double cellSize) : cellSize_(cellSize) {}

  void add(const Imath::V3d& at, double amount);
  /// Adds the area of the triangles. Triangles larger than a cell are divided.
  void add(const levelset::TriMesh& mesh);

  /// Share of the surface in a box, in [0, 1]. A cell counts by its share in the box.
  [[nodiscard]] double within(const Imath::Box3d& box) const;
  /// Largest share of the surface in a slab of the box, in [0, 1].
  /// @param width  extent of the slab along x, world units
  [[nodiscard]] double inDensestSlab(const Imath::Box3d& box, double width) const;

 private:
  struct CellHash {
    std::size_t operator()(const Imath::V3i& cell) const;
  };
  double cellSize_, total_ = 0;
  std::unordered_map<Imath::V3i, double, CellHash> amounts_;
};

/// Estimates of the share of a surface in a box, in [0, 1]. Lengths are in world units.
struct SurfaceShares {
  std::function<double(const Imath::Box3d& box)> inBox;
  /// Largest share in a slab of the box; `width` is its extent along x.
  std::function<double(const Imath::Box3d& box, double width)> inDensestSlab;
};

/// Returns estimates for the band that a node makes from a mesh or a file. For other bands they are
/// the share of a solid's surface that a box can contain at most, unless the surface has folds.
/// @param node  its operands are in graph.given
[[nodiscard]] SurfaceShares surfaceShares(const Graph& graph, std::size_t node, const Plan& plan);

}  // namespace pipeline
