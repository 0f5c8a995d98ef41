#pragma once

#include <Imath/ImathBox.h>

#include <array>
#include <map>
#include <vector>

#include "levelset/mesh.h"

namespace mapping {

/// Closed mesh of the solid under a relief of convex, flat facets (internal). Facets that share an
/// edge must give the ends of this edge with the same bits. Clipping at the sides of the rectangle
/// preserves this property.
class ReliefMesh {
 public:
  /// @param rectangle  range of x and y of the solid, to which facets are clipped
  /// @param snap       distance, world units: corners of facets nearer to a side of the rectangle
  ///         are moved onto the side
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
