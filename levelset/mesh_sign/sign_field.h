#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "levelset/mesh_sign/line_crossings.h"
#include "levelset/mesh_sign/local_mesh.h"
#include "levelset/mesh_sign/triangle_distance.h"
#include "levelset/mesh_sign/winding.h"
#include "levelset/progress.h"

namespace levelset::convert {

/// Inside or outside at the grid points around a mesh.
///
/// For a mesh without boundary the crossings with grid lines suffice. Otherwise a fan of triangles
/// closes each loop of the boundary. Mesh and fans together have an integer winding number, which
/// the crossings give. The winding number of the mesh is this integer minus the winding number of
/// the fans, a sum over few triangles. If the boundary has more edges than the mesh has triangles,
/// the winding number is summed over the mesh itself.
class SignField {
 public:
  enum class Rule { Parity, Orientation, Winding };

  SignField(const LocalMesh& mesh, const MeshTopology& topology, Rule rule,
            const Progress& progress);

  /// Returns true when the complete mesh faces inwards and counts as reversed.
  [[nodiscard]] bool isFlipped() const { return flip_ < 0; }
  /// Returns true when the surface between inside and outside may leave the triangles, to span
  /// holes of the mesh.
  [[nodiscard]] bool isOpen() const { return !field_.isEmpty(); }

  /// Winding number at a grid point, for the reversed mesh if isFlipped(). Accurate enough that
  /// comparisons with 1/4, 1/2 and 3/4 give the exact result. Under Parity: 1 inside, 0 outside.
  [[nodiscard]] double winding(const Imath::V3i& point) const;
  [[nodiscard]] bool isInside(const Imath::V3i& point) const { return winding(point) > 0.5; }

  /// Winding numbers of all points of a block, x slowest.
  using BlockWinding = std::array<double, kBlockVoxels>;
  void winding(const Imath::V3i& origin, BlockWinding& out) const;

  /// Returns true when the winding number lies within 1/4 of an integer throughout the block. The
  /// sign is then unambiguous and no open surface passes through.
  [[nodiscard]] bool isUnambiguousIn(const Imath::V3i& origin) const;

 private:
  [[nodiscard]] double refine(double integer, const Imath::V3d& point) const;
  [[nodiscard]] double fromSum(const CrossingSum& sum) const;

  Rule rule_;
  double flip_ = 1;
  /// Triangles whose winding number is added to the integer winding number from `lines_`: the fans
  /// with negative weights, or all triangles of the mesh. Empty for a mesh without boundary.
  WindingField field_;
  LineCrossings lines_;
};

}  // namespace levelset::convert
