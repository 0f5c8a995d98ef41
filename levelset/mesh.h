#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "levelset/progress.h"

namespace levelset {

/// Precision of the coordinates of a mesh in a file.
enum class CoordinatePrecision { Float, Double };

/// Precision of the colours of a mesh in a file: integers from 0 to 255, or floats.
enum class ColorPrecision { Byte, Float };

/// Attributes of the vertices of a mesh. Each list is empty or has one entry for each vertex. A
/// seam is a point with two normals or texture coordinates. It has two vertices at equal positions.
struct MeshAttributes {
  std::vector<Imath::V3d> normals;  ///< n × 3, finite, any length; zero: no direction
  std::vector<Imath::V2d> uvs;  ///< n × 2, texture coordinates, finite, (0, 0) at the lower left
  std::vector<Imath::V4f> colors;  ///< n × 4, red, green, blue, alpha, finite, 1 is full; values of
                                   ///< the file, no transfer curve applied
  CoordinatePrecision precision = CoordinatePrecision::Float;  ///< normals and uvs in a file
  ColorPrecision colorPrecision = ColorPrecision::Byte;
  bool hasAlpha = false;  ///< false: every alpha is 1

  [[nodiscard]] bool isEmpty() const { return normals.empty() && uvs.empty() && colors.empty(); }
};

/// Indexed triangle mesh. Readers split polygons into triangles. Corners run counter-clockwise as
/// seen from outside.
struct TriMesh {
  std::vector<Imath::V3d> positions;                    ///< n × 3, world units, finite
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< m × 3, each index < n
  CoordinatePrecision precision = CoordinatePrecision::Double;
  /// Coarsest precision that the coordinates ever had, world units. It may be larger than the
  /// spacing of `precision` at the present position. 0 for a mesh that was not moved.
  double spacing = 0;
  MeshAttributes attributes = {};

  [[nodiscard]] bool isEmpty() const { return triangles.empty(); }
};

/// Lists the attributes of the mesh in words: "normals, texture coordinates and colours". Empty
/// when there are none.
[[nodiscard]] std::string describe(const MeshAttributes& attributes);

/// Checks the attributes of a mesh.
/// @throws InvalidInput when the length of a list differs from the number of vertices, or a value
///         is not finite: "the mesh has 3 normals for 4 vertices; …"
void requireAttributes(const TriMesh& mesh);

/// Transforms a normal by a map with the derivatives `slopes` along x, y and z. Uses the inverse
/// transpose, so that the normal stays perpendicular to the surface. Returns unit length.
/// @param hand  1, or −1 for a map that mirrors and so reverses the triangles
/// @return zero for a normal of length zero, and where the map is too flat to leave a direction
[[nodiscard]] Imath::V3d transformedNormal(const Imath::V3d& normal,
                                           const std::array<Imath::V3d, 3>& slopes, double hand);

/// Appends the vertices and triangles of another mesh. Attributes that only one mesh has are
/// dropped. The result has the coarser precision and spacing of the two.
void append(TriMesh& mesh, const TriMesh& other);

/// Returns the mesh without attributes and with closed seams. Attributes double the vertices along
/// a seam. The function joins two edges at equal positions when each has one triangle and they run
/// in opposite directions. Parts that only touch keep their own vertices.
/// @return nullopt when there is no seam to close: the triangles of `mesh` are the result
/// @throws ResourceLimit
[[nodiscard]] std::optional<TriMesh> withoutSeams(const TriMesh& mesh,
                                                  std::size_t maxMemory = kNoMemoryLimit);

/// Distance from a coordinate of that magnitude to the next one that the precision can represent.
[[nodiscard]] double spacingAt(double magnitude, CoordinatePrecision precision);

/// Precision of the coordinates of a mesh, world units: the larger of `spacing` and the spacing of
/// `precision` at the coordinate of greatest magnitude.
[[nodiscard]] double coordinateSpacing(const TriMesh& mesh);

/// Bounding box of the vertices that triangles use. Empty for a mesh without triangles.
[[nodiscard]] Imath::Box3d bounds(const TriMesh& mesh);

/// Signed volume by the divergence theorem, world units³. Positive for a closed mesh whose
/// triangles face outwards. Summed in index order, relative to the centre of the bounding box.
[[nodiscard]] double signedVolume(const TriMesh& mesh);

/// Sum of the areas of the triangles, world units².
[[nodiscard]] double surfaceArea(const TriMesh& mesh);

}  // namespace levelset
