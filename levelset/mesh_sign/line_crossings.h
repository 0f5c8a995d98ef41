#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"
#include "levelset/progress.h"

namespace levelset::convert {

/// Sums over the triangles that a grid line along x crosses between x = −∞ and a grid point.
struct CrossingSum {
  /// Crossings where the line enters the solid minus crossings where it leaves, times the weights
  /// of the triangles. This is the winding number if the triangles have no boundary.
  std::int32_t winding = 0;
  std::uint32_t crossings = 0;  ///< number of crossings, without weights
};

/// Crossings of a mesh with the grid lines along x (y and z integer), decided exactly. If an edge
/// or a vertex lies on a line, the line counts as shifted by (ε, ε²) in y and z. Every closed set
/// of faces is thus crossed consistently. A grid point on a face counts as lying on its −x side.
class LineCrossings {
 public:
  /// @param weights  multiplicity of each triangle; empty: 1 each
  LineCrossings(const LocalMesh& mesh, std::span<const int> weights, const Progress& progress);

  [[nodiscard]] CrossingSum at(int x, int y, int z) const;

  /// Writes the sums of the 64 grid points (x0 + dx, y, z0 + dz), dx and dz from 0 to 7, to
  /// sums[8 * dx + dz].
  void slab(int x0, int y, int z0, CrossingSum* sums) const;

  [[nodiscard]] std::size_t size() const { return crossings_.size(); }

 private:
  struct Crossing {
    /// Grid line (y, z), and the lowest x of a grid point on the +x side of the face.
    std::int32_t y, z, x;
    std::int32_t step;  ///< +weight where the line enters the solid, −weight where it leaves
    CrossingSum sum;    ///< sum over the crossings of this line, up to and including this one
    bool operator<(const Crossing& other) const {
      if (y != other.y) return y < other.y;
      if (z != other.z) return z < other.z;
      if (x != other.x) return x < other.x;
      return step < other.step;
    }
  };
  static void addTriangle(const Imath::V3d& a, const Imath::V3d& b, const Imath::V3d& c, int weight,
                          std::vector<Crossing>& out);
  std::vector<Crossing> crossings_;
};

}  // namespace levelset::convert
