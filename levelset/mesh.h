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

/// How finely the numbers of a mesh are stored in a file.
enum class CoordinatePrecision { Float, Double };

/// How finely the colours of a mesh are stored in a file: as whole numbers from 0 to 255, or as
/// floats.
enum class ColorPrecision { Byte, Float };

/// What the vertices of a mesh carry beside their positions. Each list is empty, or as long as
/// there are vertices. A seam, where one place has two normals or texture coordinates, has two
/// vertices at equal positions.
struct MeshAttributes {
  std::vector<Imath::V3d> normals;  ///< n × 3, finite, of any length; zero: has no direction
  std::vector<Imath::V2d> uvs;  ///< n × 2, texture coordinates, finite, (0, 0) at the lower left
  std::vector<Imath::V4f> colors;  ///< n × 4, red, green, blue, alpha, finite, 1 for full, as they
                                   ///< stand in the file (no curve is taken off or put on)
  CoordinatePrecision precision = CoordinatePrecision::Float;  ///< of normals and uvs in a file
  ColorPrecision colorPrecision = ColorPrecision::Byte;
  bool hasAlpha = false;  ///< else every alpha is 1

  [[nodiscard]] bool isEmpty() const { return normals.empty() && uvs.empty() && colors.empty(); }
};

/// An indexed triangle mesh; polygons are split when read. Counter-clockwise seen from outside.
struct TriMesh {
  std::vector<Imath::V3d> positions;                    ///< n × 3, world units, finite
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< m × 3, each index < n
  CoordinatePrecision precision = CoordinatePrecision::Double;
  /// World units: no coordinate is known better than this, whatever `precision` would allow where
  /// the mesh lies now; 0 for one that was not moved.
  double spacing = 0;
  MeshAttributes attributes = {};

  [[nodiscard]] bool isEmpty() const { return triangles.empty(); }
};

/// What the mesh carries, in words: "normals, texture coordinates and colours"; empty for nothing.
[[nodiscard]] std::string describe(const MeshAttributes& attributes);

/// @throws InvalidInput for a list that is not as long as there are vertices, and for a number in
///         one that is not finite: "texture: the mesh has 3 normals for 4 vertices; …"
void requireAttributes(const TriMesh& mesh, const char* action);

/// A normal under a map whose derivatives along x, y and z are `slopes`: by the inverse transpose,
/// so that it stays across the surface, on the side that `hand` tells; unit length.
/// @param hand  1, or −1 for a map that mirrors (where triangles are turned over)
/// @return      zero for a normal of length zero, and where the map is so flat that none is left
[[nodiscard]] Imath::V3d carriedNormal(const Imath::V3d& normal,
                                       const std::array<Imath::V3d, 3>& slopes, double hand);

/// Adds vertices and triangles of another mesh behind those of `mesh`. What only one of them
/// carries is dropped; of precision and spacing the coarser holds.
void append(TriMesh& mesh, const TriMesh& other);

/// The mesh without attributes, and with the seams closed at which vertices were doubled for them:
/// edges of a single triangle each, at equal positions, that run against each other become one.
/// Parts that merely touch keep their own vertices.
/// @param action  what is named when memory does not suffice
/// @return        nothing where there is nothing to close: the triangles of `mesh` are the result
/// @throws ResourceLimit
[[nodiscard]] std::optional<TriMesh> withoutSeams(const TriMesh& mesh, const char* action,
                                                  std::size_t maxMemory = kNoMemoryLimit);

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
