#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"
#include "levelset/progress.h"

namespace levelset::convert {

/// Sums over the crossings of a grid line between x = −∞ and a grid point.
struct CrossingSum {
  std::int32_t winding = 0;  ///< faces entered − faces left: the winding number of a closed set of
                             ///< faces
  std::uint32_t crossings = 0;
};

/// Crossings of a mesh with the grid lines along x (y and z integer), decided exactly. If an edge
/// or a vertex lies on a line, the line counts as shifted by (ε, ε²) in y and z. Every closed set
/// of faces is thus crossed consistently. A grid point on a face counts as before the face.
class LineCrossings {
 public:
  /// @param weights  multiplicity of each triangle; empty: 1 each
  LineCrossings(const LocalMesh& mesh, std::span<const int> weights, const Progress& progress);

  [[nodiscard]] CrossingSum at(int x, int y, int z) const;

  /// Writes the sums at x0, x0 + 1, …, x0 + 7 on the lines (y, z0) … (y, z0 + 7): sums[8 * dx +
  /// dz].
  void slab(int x0, int y, int z0, CrossingSum* sums) const;

  [[nodiscard]] std::size_t size() const { return crossings_.size(); }

 private:
  struct Crossing {
    std::int32_t y, z, x;  ///< x: first grid point behind the face
    std::int32_t step;     ///< +weight where the line enters
    CrossingSum sum;       ///< sum up to and including this crossing
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
