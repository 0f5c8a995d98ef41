#pragma once

#include <Imath/ImathBox.h>

#include <array>
#include <map>
#include <vector>

#include "levelset/mesh.h"

namespace mapping {

/// A closed mesh under a relief of convex, flat facets (internal). Facets that share an edge must
/// give its ends with the same bits; clipping at the sides of a rectangle preserves this.
class ReliefMesh {
 public:
  /// @param rectangle  range of x and y, to which facets are clipped
  /// @param snap       corners of facets within this distance of a side of the rectangle are moved
  ///         onto it
  ReliefMesh(const Imath::Box2d& rectangle, double snap) : rectangle_(rectangle), snap_(snap) {}

  /// Adds a facet.
  /// @param corners  corners of a convex polygon, anticlockwise seen from above
  void add(std::vector<Imath::V3d> corners);

  /// Returns the solid between the relief and z = bottom: walls below the relief's border and a
  /// flat bottom. The relief must cover the rectangle.
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
