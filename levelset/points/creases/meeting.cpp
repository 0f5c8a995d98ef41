#include "levelset/points/creases/meeting.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace levelset::points {

using Imath::V3d;

std::optional<Meeting> meet(const PointSurface& surface, std::span<const std::uint32_t> pieces,
                            std::span<const V3d> sides, const V3d& start, double spacing,
                            double reach) {
  constexpr int kMostNewton = 24;
  // Blends jump a little from one nearest point to the next. Four or more surfaces need not meet.
  const double accepted = (pieces.size() > 3 ? 0.25 : 0.1) * spacing, exact = 1e-12 * spacing;
  // Directions in which the surfaces do not fix the position: they are nearly parallel.
  constexpr double kParallel = 0.05;
  const auto rows = static_cast<Eigen::Index>(pieces.size());
  Eigen::Matrix<double, Eigen::Dynamic, 3> normals(rows, 3);
  Eigen::VectorXd heights(rows);
  Meeting best;
  double least = INFINITY;
  V3d at = start;
  for (int step = 0; step < kMostNewton; ++step) {
    std::vector<V3d> found;
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      const auto foot = surface.project(at, sides[k], pieces[k]);
      if (!foot) return std::nullopt;
      const auto row = static_cast<Eigen::Index>(k);
      heights[row] = (at - foot->point).dot(foot->normal);
      normals.row(row) << foot->normal.x, foot->normal.y, foot->normal.z;
      found.push_back(foot->normal);
    }
    Eigen::JacobiSVD<Eigen::MatrixXd> solver(normals, Eigen::ComputeThinU | Eigen::ComputeThinV);
    solver.setThreshold(kParallel);
    const Eigen::Vector3d change = solver.solve(heights);
    const double miss = pieces.size() > 3 ? change.norm() : heights.cwiseAbs().maxCoeff();
    if (miss < least) {
      least = miss;
      best = {at, found};
    }
    if (miss <= exact) break;
    const double length = change.norm();
    const double share = std::min(1.0, spacing / length);
    at -= V3d(change.x(), change.y(), change.z()) * share;
    if (!((at - start).length() <= reach)) return std::nullopt;
  }
  if (!(least <= accepted)) return std::nullopt;
  return best;
}

}  // namespace levelset::points
