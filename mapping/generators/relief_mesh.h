#pragma once

#include <Imath/ImathBox.h>

#include <array>
#include <map>
#include <vector>

#include "levelset/mesh.h"

namespace mapping {

/// A closed mesh under a relief of convex, flat facets (internal). Facets that share an edge give
/// its ends with the same bits; what is cut off by the sides of a rectangle keeps that.
class ReliefMesh {
 public:
  /// @param rectangle  x and y; facets are cut off there. Corners of facets within `snap` of a side
  ///                   are put onto it
  ReliefMesh(const Imath::Box2d& rectangle, double snap) : rectangle_(rectangle), snap_(snap) {}

  /// @param corners  of a convex polygon, anticlockwise seen from above
  void add(std::vector<Imath::V3d> corners);

  /// The solid between the relief, which covers the rectangle, and z = bottom: walls below the
  /// relief's border and a flat bottom.
  [[nodiscard]] levelset::TriMesh close(double bottom) &&;

 private:
  using Key = std::array<double, 3>;

  std::uint32_t vertex(const Imath::V3d& p);
  void addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);

  Imath::Box2d rectangle_;
  double snap_;
  levelset::TriMesh mesh_;
  std::map<Key, std::uint32_t> vertices_;
};

}  // namespace mapping
