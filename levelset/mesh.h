#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <vector>

namespace levelset {

/// How finely the numbers of a mesh are stored in a file.
enum class CoordinatePrecision { Float, Double };

/// An indexed triangle mesh; polygons are split when read. Counter-clockwise seen from outside.
struct TriMesh {
  std::vector<Imath::V3d> positions;                    ///< n × 3, world units, finite
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< m × 3, each index < n
  CoordinatePrecision precision = CoordinatePrecision::Double;
  /// World units: no coordinate is known better than this, whatever `precision` would allow where
  /// the mesh lies now; 0 for one that was not moved.
  double spacing = 0;

  [[nodiscard]] bool isEmpty() const { return triangles.empty(); }
};

/// Distance from a coordinate of that magnitude to the next that the precision can tell from it.
[[nodiscard]] double spacingAt(double magnitude, CoordinatePrecision precision);

/// How finely the coordinates of a mesh are known, world units: what `spacing` says, or the
/// precision at the coordinate of greatest magnitude.
[[nodiscard]] double coordinateSpacing(const TriMesh& mesh);

/// Bounding box of the vertices that triangles use; empty for a mesh without triangles.
[[nodiscard]] Imath::Box3d bounds(const TriMesh& mesh);

/// Signed volume by the divergence theorem, world units³; positive for a closed mesh that faces
/// out. Summed about the centre of the bounding box, in index order.
[[nodiscard]] double signedVolume(const TriMesh& mesh);

/// Sum of the triangles' areas, world units².
[[nodiscard]] double surfaceArea(const TriMesh& mesh);

}  // namespace levelset
