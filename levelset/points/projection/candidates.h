#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <span>
#include <vector>

#include "levelset/points/projection/cocone.h"

namespace levelset::points {

/// Local coordinate system of a point of a surface.
struct LocalFrame {
  Imath::V3d origin, u, v, normal;  ///< unit axes, right-handed
  double scale = 1;                 ///< local units per world unit

  /// Sets the axes to a normal and two tangents.
  void setNormal(const Imath::V3d& unit);
  [[nodiscard]] Imath::V3d toLocal(const Imath::V3d& position) const {
    const Imath::V3d d = (position - origin) * scale;
    return {d.dot(u), d.dot(v), d.dot(normal)};
  }
  [[nodiscard]] Imath::V3d toWorld(const Imath::V3d& local) const {
    return origin + (u * local.x + v * local.y + normal * local.z) / scale;
  }
  [[nodiscard]] Imath::V3d directionToWorld(const Imath::V3d& local) const {
    return u * local.x + v * local.y + normal * local.z;
  }
};

/// Neighbour that takes part in the fit at a point.
struct FitCandidate {
  std::uint32_t point;
  Imath::V3d local;
  Imath::V3d normal;  ///< consistent along the path
};

/// Finds the points for a fit by breadth-first search over the graph [Kalbe11]. Paths do not leave
/// the ball of `reach` local units. They end where the normal, kept consistent along the path, has
/// turned by more than 107 degrees: on the other side of a thin part. [Kalbe11] leaves out points
/// whose projection lies in the convex hull of those before them. At sharp edges, that rule may
/// leave one side out, so that the fits of the two sides do not agree.
class CandidateSearch {
 public:
  CandidateSearch(std::span<const Imath::V3d> positions, const CoconeGraph& graph)
      : positions_(positions), graph_(graph), seen_(positions.size(), 0) {}

  /// @return the candidates, with the point itself first; valid until the next call
  const std::vector<FitCandidate>& find(std::uint32_t point, const LocalFrame& frame, double reach);

 private:
  std::span<const Imath::V3d> positions_;
  const CoconeGraph& graph_;
  std::vector<std::uint32_t> seen_;  ///< number of the search that reached a point last
  std::uint32_t search_ = 0;
  std::vector<FitCandidate> found_;
};

}  // namespace levelset::points
