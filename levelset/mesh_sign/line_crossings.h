#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"
#include "levelset/progress.h"

namespace levelset::convert {

/// What the line from −x has met when it comes to a grid point.
struct CrossingSum {
  std::int32_t winding = 0;  ///< faces entered − faces left: the winding number of a cycle of faces
  std::uint32_t crossings = 0;
};

/// Crossings of a mesh with the grid lines along x (y and z integer), decided exactly: an edge or a
/// vertex on a line counts as if the line were moved by (ε, ε²) in y and z, so every closed chain
/// of faces is crossed consistently. A grid point that lies on a face is taken as before it.
class LineCrossings {
 public:
  /// @param weights  one per triangle, how often it counts; empty: once
  LineCrossings(const LocalMesh& mesh, std::span<const int> weights, const Progress& progress);

  [[nodiscard]] CrossingSum at(int x, int y, int z) const;

  /// The sums at x0, x0 + 1, …, x0 + 7 on the lines (y, z0) … (y, z0 + 7): sums[8 * dx + dz].
  void slab(int x0, int y, int z0, CrossingSum* sums) const;

  [[nodiscard]] std::size_t size() const { return crossings_.size(); }

 private:
  struct Crossing {
    std::int32_t y, z, x;  ///< x: the first grid point behind the face
    std::int32_t step;     ///< +weight where the line enters
    CrossingSum sum;       ///< up to and with this one
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
