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

/// Type of the coordinates of a mesh in a file, 32 or 64 bits. In memory they are double.
enum class CoordinatePrecision { Float, Double };

/// Type of the colours of a mesh in a file: integers from 0 to 255, or floats.
enum class ColorPrecision { Byte, Float };

/// Attributes of the vertices of a mesh. Each list is empty or has one entry for each vertex. A
/// point on a seam has two normals or two texture coordinates, and therefore two vertices at equal
/// positions.
struct MeshAttributes {
  std::vector<Imath::V3d> normals;  ///< n × 3, finite, any length; zero: no normal
  std::vector<Imath::V2d> uvs;  ///< n × 2, texture coordinates, finite, (0, 0) at the lower left
  std::vector<Imath::V4f> colors;  ///< n × 4, red, green, blue, alpha, finite, full intensity is 1;
                                   ///< as in the file, without conversion from sRGB
  /// Type of normals and uvs in a file.
  CoordinatePrecision precision = CoordinatePrecision::Float;
  ColorPrecision colorPrecision = ColorPrecision::Byte;
  bool hasAlpha = false;  ///< false: every alpha is 1

  [[nodiscard]] bool isEmpty() const { return normals.empty() && uvs.empty() && colors.empty(); }
};

/// Indexed triangle mesh. Readers split polygons into triangles. Corners run counter-clockwise as
/// seen from outside.
struct TriMesh {
  std::vector<Imath::V3d> positions;                            ///< n × 3, world units, finite
  std::vector<std::array<std::uint32_t, 3>> triangles;          ///< m × 3, each index < n
  CoordinatePrecision precision = CoordinatePrecision::Double;  ///< type of positions in a file
  /// Largest spacing of representable numbers at the coordinates, world units, over all transforms
  /// of the mesh so far. A mesh that was read far from the origin and moved to it keeps the
  /// rounding errors of its old position. 0 for a mesh that was never transformed.
  double spacing = 0;
  MeshAttributes attributes = {};

  [[nodiscard]] bool isEmpty() const { return triangles.empty(); }
};

/// Returns the names of the attributes that are present, as text: "normals, texture coordinates and
/// colours". Empty when there are none.
[[nodiscard]] std::string describe(const MeshAttributes& attributes);

/// Checks the attributes of a mesh.
/// @throws InvalidInput when the length of a list differs from the number of vertices, or a value
///         is not finite: "the mesh has 3 normals for 4 vertices; …"
void requireAttributes(const TriMesh& mesh);

/// Transforms a normal by the inverse transpose of a map's Jacobian, so that the normal stays
/// perpendicular to the surface.
/// @param slopes  derivatives of the map along x, y and z
/// @param hand    1; −1 for a map that mirrors, since it reverses the orientation of the triangles
/// @return a unit vector; zero for a normal of length zero, and where the Jacobian is singular
///         within rounding
[[nodiscard]] Imath::V3d transformedNormal(const Imath::V3d& normal,
                                           const std::array<Imath::V3d, 3>& slopes, double hand);

/// Appends the vertices and triangles of another mesh. Drops attributes that only one of the meshes
/// has. The result has the coarser `precision` and the larger `spacing` of the two meshes. A mesh
/// without vertices takes both, and the attributes, from `other`.
void append(TriMesh& mesh, const TriMesh& other);

/// Returns the mesh without attributes, with the doubled vertices along seams (edges where normals,
/// texture coordinates or colours jump) merged. Merges two edges at equal positions when each has
/// only one triangle and they run in opposite directions. Surface components that only touch keep
/// their own vertices.
/// @return nullopt when no vertices are merged: use `mesh` itself
/// @throws ResourceLimit
[[nodiscard]] std::optional<TriMesh> withoutSeams(const TriMesh& mesh,
                                                  std::size_t maxMemory = kNoMemoryLimit);

/// Returns the distance from a coordinate of the given magnitude to the next larger number of the
/// given type.
[[nodiscard]] double spacingAt(double magnitude, CoordinatePrecision precision);

/// Returns the rounding error of the coordinates of a mesh, world units: the larger of
/// `mesh.spacing` and spacingAt() of the coordinate of greatest magnitude.
[[nodiscard]] double coordinateSpacing(const TriMesh& mesh);

/// Bounding box of the vertices that triangles use. Empty for a mesh without triangles.
[[nodiscard]] Imath::Box3d bounds(const TriMesh& mesh);

/// Signed volume by the divergence theorem, world units³. Positive for a closed mesh whose
/// triangles face outwards. Summed in index order, relative to the centre of the bounding box.
[[nodiscard]] double signedVolume(const TriMesh& mesh);

/// Sum of the areas of the triangles, world units².
[[nodiscard]] double surfaceArea(const TriMesh& mesh);

}  // namespace levelset
