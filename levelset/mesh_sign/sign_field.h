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

/// Inside or outside at the grid points of a mesh.
///
/// A mesh without boundary needs its crossings with grid lines only. Otherwise each loop of its
/// boundary is closed by a fan of triangles: mesh and fans together have an integer winding number,
/// read off the crossings, and the mesh has that less what the fans have, a sum over few triangles.
/// A soup that is mostly boundary is summed itself.
class SignField {
 public:
  enum class Rule { Parity, Orientation, Winding };

  SignField(const LocalMesh& mesh, const MeshTopology& topology, Rule rule,
            const Progress& progress);

  /// True when the whole mesh faces inwards, and was turned.
  [[nodiscard]] bool isFlipped() const { return flip_ < 0; }
  /// True when the surface between inside and outside may leave the triangles.
  [[nodiscard]] bool isOpen() const { return !field_.isEmpty(); }

  /// Winding number at a grid point, turned if the mesh was, to such accuracy that comparisons with
  /// 1/4, 1/2 and 3/4 are those of the exact number. Under Parity: 1 inside, 0 outside.
  [[nodiscard]] double winding(const Imath::V3i& point) const;
  [[nodiscard]] bool isInside(const Imath::V3i& point) const { return winding(point) > 0.5; }

  /// The same for all points of a block, x slowest.
  using BlockWinding = std::array<double, kBlockVoxels>;
  void winding(const Imath::V3i& origin, BlockWinding& out) const;

  /// True when the number is within 1/4 of an integer all over the block: no doubt, no open
  /// surface.
  [[nodiscard]] bool isClearIn(const Imath::V3i& origin) const;

 private:
  [[nodiscard]] double refine(double integer, const Imath::V3d& point) const;
  [[nodiscard]] double fromSum(const CrossingSum& sum) const;

  Rule rule_;
  double flip_ = 1;
  WindingField field_;  ///< what the mesh has beyond the integer
  LineCrossings lines_;
};

}  // namespace levelset::convert
