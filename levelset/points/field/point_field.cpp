#include "levelset/points/field/point_field.h"

#include <algorithm>
#include <cmath>

#include "levelset/points/field/local_quadric.h"

namespace levelset::points {

using Imath::V3d;

namespace {

struct LocalQuadrics {
  const OrientedPoints* points;

  double operator()(const V3d& at, const std::vector<FoundItem>& found) const {
    const double squaredCutOff = found.back().squared;
    V3d centre(0), normal(0);
    double weights = 0;
    for (std::size_t n = 0; n + 1 < found.size(); ++n) {
      const double weight = pointWeight(found[n].squared / squaredCutOff);
      weights += weight;
      centre += weight * points->positions[found[n].index];
      normal += weight * points->normals[found[n].index];
    }
    const std::uint32_t first = found.front().index;
    if (!(weights > 0) || !(normal.length() > 1e-3 * weights))
      return points->normals[first].dot(at - points->positions[first]);
    centre /= weights;
    normal.normalize();
    QuadricFit fit(centre, normal, std::sqrt(squaredCutOff));
    for (std::size_t n = 0; n + 1 < found.size(); ++n)
      fit.add(points->positions[found[n].index], points->normals[found[n].index],
              pointWeight(found[n].squared / squaredCutOff));
    return fit.solve().distance(at);
  }
};

}  // namespace

PointField movingLeastSquares(const OrientedPoints& points, std::size_t neighbours) {
  return {LocalQuadrics{&points}, std::min(neighbours + 1, points.size())};
}

}  // namespace levelset::points
