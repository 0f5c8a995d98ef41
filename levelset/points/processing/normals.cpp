#include "levelset/points/processing/normals.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/points/processing/orientation.h"
#include "levelset/points/processing/point_neighbours.h"
#include "levelset/progress_gate.h"

namespace levelset {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Imath::V3d;

constexpr std::size_t kQuadraticUnknowns = 6;

/// Neighbours of a point relative to it, with their weights.
struct Neighbourhood {
  std::vector<Vector3d> offsets;  ///< in units of the distance to the farthest neighbour
  std::vector<double> weights;
};

/// Axes of a local coordinate system; the last row is the normal.
Matrix3d frameOf(const Vector3d& normal) {
  Matrix3d frame;
  const Vector3d u = normal.unitOrthogonal();
  frame.row(0) = u;
  frame.row(1) = normal.cross(u);
  frame.row(2) = normal;
  return frame;
}

/// Returns the normal of the plane through the neighbours by principal components; empty when they
/// lie on a line.
std::optional<Vector3d> planeNormal(const Neighbourhood& near) {
  Vector3d centre = Vector3d::Zero();
  double sum = 0;
  for (std::size_t i = 0; i < near.offsets.size(); ++i) {
    centre += near.weights[i] * near.offsets[i];
    sum += near.weights[i];
  }
  centre /= sum;
  Matrix3d spread = Matrix3d::Zero();
  for (std::size_t i = 0; i < near.offsets.size(); ++i) {
    const Vector3d d = near.offsets[i] - centre;
    spread += near.weights[i] * d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(spread);
  // A width of 1e-5 of the length. Below it, the direction of the plane is mostly rounding.
  constexpr double kLeastWidth = 1e-10;
  if (!(solver.eigenvalues()[1] > kLeastWidth * solver.eigenvalues()[2])) return std::nullopt;
  return solver.eigenvectors().col(0).normalized();
}

struct HeightFit {
  Vector3d normal = Vector3d::Zero();
  double error = std::numeric_limits<double>::infinity();  ///< generalised cross-validation
};

/// Fits a polynomial height function of kUnknowns coefficients over the plane of the frame.
template <int kUnknowns>
HeightFit fitHeights(const Neighbourhood& near, const Matrix3d& frame) {
  using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;
  const auto count = static_cast<double>(near.offsets.size());
  HeightFit fit;
  if (near.offsets.size() <= kUnknowns) return fit;
  const auto basis = [](const Vector3d& p) {
    Vector b;
    if constexpr (kUnknowns == 3)
      b << 1, p.x(), p.y();
    else
      b << 1, p.x(), p.y(), p.x() * p.x(), p.x() * p.y(), p.y() * p.y();
    return b;
  };
  Matrix normalMatrix = Matrix::Zero();
  Vector right = Vector::Zero();
  for (std::size_t i = 0; i < near.offsets.size(); ++i) {
    const Vector3d p = frame * near.offsets[i];
    const Vector b = basis(p);
    normalMatrix += near.weights[i] * b * b.transpose();
    right += near.weights[i] * p.z() * b;
  }
  const Eigen::LDLT<Matrix> solver(normalMatrix);
  const auto pivots = solver.vectorD();
  constexpr double kLeastPivot = 1e-10;
  if (!(pivots.minCoeff() > kLeastPivot * pivots.maxCoeff())) return fit;
  const Vector coefficients = solver.solve(right);
  double residual = 0, sum = 0;
  for (std::size_t i = 0; i < near.offsets.size(); ++i) {
    const Vector3d p = frame * near.offsets[i];
    const double miss = p.z() - basis(p).dot(coefficients);
    residual += near.weights[i] * miss * miss;
    sum += near.weights[i];
  }
  const double left = 1 - kUnknowns / count;
  fit.error = residual / sum / (left * left);
  const Vector3d local(-coefficients[1], -coefficients[2], 1);
  fit.normal = (frame.transpose() * local).normalized();
  return fit;
}

struct PointFit {
  Vector3d normal = Vector3d::Zero();  ///< zero: the neighbours lie on a line
  bool isQuadratic = false;
  double error = std::numeric_limits<double>::infinity();  ///< as HeightFit
};

PointFit fitPoint(const Neighbourhood& near, FitDegree degree) {
  PointFit result;
  const std::optional<Vector3d> plane = planeNormal(near);
  if (!plane) return result;
  result.normal = *plane;
  // The second pass measures heights along the normal of the first.
  for (int pass = 0; pass < 2; ++pass) {
    const Matrix3d frame = frameOf(result.normal);
    HeightFit linear, quadratic;
    if (degree != FitDegree::Two || near.offsets.size() <= kQuadraticUnknowns)
      linear = fitHeights<3>(near, frame);
    if (degree != FitDegree::One) quadratic = fitHeights<6>(near, frame);
    result.isQuadratic = quadratic.error < linear.error;
    const HeightFit& chosen = result.isQuadratic ? quadratic : linear;
    if (!std::isfinite(chosen.error)) break;  // too few points: the plane through them remains
    result.normal = chosen.normal;
    result.error = chosen.error;
  }
  return result;
}

/// Sets `near` to the neighbours of a position, which are sorted by distance.
void setNeighbourhood(const PointCloud& cloud, const V3d& centre,
                      const std::vector<points::Neighbour>& found, Neighbourhood& near) {
  const double reach = std::sqrt(found.back().squared);
  near.offsets.clear();
  near.weights.clear();
  for (const points::Neighbour& other : found) {
    const V3d d = (cloud.positions[other.index] - centre) / reach;
    near.offsets.emplace_back(d.x, d.y, d.z);
    constexpr double kReach = 1.2;  // the weight vanishes a little beyond the last neighbour
    const double share = d.length2() / (kReach * kReach);
    near.weights.push_back((1 - share) * (1 - share));
  }
}

Vector3d normalAt(const PointCloud& cloud, std::uint32_t point) {
  const Imath::V3f& n = cloud.normals[point];
  return Vector3d(static_cast<double>(n.x), static_cast<double>(n.y), static_cast<double>(n.z));
}

/// Normals beside sharp edges: where the fit at a neighbour is much better, the part of the
/// neighbours that lies on its side of the edge is fitted.
class OneSidedFits {
 public:
  OneSidedFits(PointCloud& cloud, const points::PointNeighbours& tree, std::size_t neighbours,
               FitDegree degree, std::vector<float>& errors)
      : cloud_(cloud), tree_(tree), neighbours_(neighbours), degree_(degree), errors_(errors) {}

  /// Replaces normals until none changes, a few times at most: a point beside a corner may need
  /// the new normals of others.
  void replaceNormals(const Progress& progress) {
    for (std::size_t at = 0; at < tree_.size(); ++at)
      if (const std::uint32_t i = tree_.at(at);
          std::isfinite(errors_[i]) && errors_[i] > kLeastError)
        candidates_.push_back(static_cast<std::uint32_t>(at));
    constexpr int kMostPasses = 4;
    for (int pass = 0; pass < kMostPasses && !candidates_.empty(); ++pass) {
      const bool hasChanged = replaceOnce(subProgress(
          progress, pass / static_cast<double>(kMostPasses), (pass + 1.0) / kMostPasses));
      if (!hasChanged) break;
    }
  }

 private:
  static constexpr float kLeastError = 4e-4f;  ///< the square of 0.02 of the neighbourhood's radius
  static constexpr float kGain = 16;           ///< least ratio of the squared errors of two fits
  /// Points of a side. Fewer fit a quadratic by chance, which spoils noisy scans.
  static constexpr std::size_t kFewest = 9;
  static constexpr std::size_t kMostTries = 6;

  bool replaceOnce(const Progress& progress) {
    std::vector<PointFit> fits(candidates_.size());
    ProgressGate gate(progress, candidates_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, candidates_.size(), 256),
                      [&](const auto& range) {
                        std::vector<points::Neighbour> found;
                        Neighbourhood near, side;
                        for (std::size_t n = range.begin(); n < range.end(); ++n)
                          fits[n] = fitSide(candidates_[n], found, near, side);
                        gate.advance(range.size());
                      });
    std::vector<std::uint32_t> left;
    for (std::size_t n = 0; n < fits.size(); ++n) {
      if (!std::isfinite(fits[n].error)) {
        left.push_back(candidates_[n]);
        continue;
      }
      const std::uint32_t i = tree_.at(candidates_[n]);
      const Vector3d& normal = fits[n].normal;
      cloud_.normals[i] = Imath::V3f(V3d(normal.x(), normal.y(), normal.z()));
      errors_[i] = static_cast<float>(fits[n].error);
    }
    const bool hasChanged = left.size() < candidates_.size();
    candidates_ = std::move(left);
    return hasChanged;
  }

  /// Returns a fit of infinite error if no side fits much better than all neighbours.
  PointFit fitSide(std::uint32_t at, std::vector<points::Neighbour>& found, Neighbourhood& near,
                   Neighbourhood& side) const {
    const std::uint32_t index = tree_.at(at);
    const float most = errors_[index] / kGain;
    const V3d& centre = tree_.positionAt(at);
    tree_.nearest(centre, neighbours_ + 1, found);
    setNeighbourhood(cloud_, centre, found, near);
    PointFit best;
    std::size_t tries = 0;
    for (const points::Neighbour& other : found) {
      if (!(errors_[other.index] <= most)) continue;
      if (++tries > kMostTries) break;
      const Vector3d normal = normalAt(cloud_, other.index);
      side.offsets.clear();
      side.weights.clear();
      for (std::size_t k = 0; k < near.offsets.size(); ++k) {
        constexpr double kMostSlope = 0.1;
        if (std::abs(near.offsets[k].dot(normal)) > kMostSlope * near.offsets[k].norm()) continue;
        side.offsets.push_back(near.offsets[k]);
        side.weights.push_back(near.weights[k]);
      }
      if (side.offsets.size() < kFewest) continue;
      const PointFit fit = fitPoint(side, degree_);
      if (fit.error <= static_cast<double>(most) && fit.error < best.error) best = fit;
    }
    return best;
  }

  PointCloud& cloud_;
  const points::PointNeighbours& tree_;
  std::size_t neighbours_;
  FitDegree degree_;
  std::vector<float>& errors_;  ///< squared errors of the fits, by the number of the point
  std::vector<std::uint32_t> candidates_ = {};
};

}  // namespace

NormalsResult estimateNormals(PointCloud cloud, const NormalsOptions& options) {
  if (options.neighbours < 3)
    throw UsageError("fewer than 3 neighbours determine no plane; give at least 3");
  points::requireNeighbours(options.neighbours);
  requirePoints(cloud);
  if (cloud.isEmpty()) throw InvalidInput("the point cloud has no points; read another file");
  constexpr double kBytesPerPoint = 160;
  requireMemory(kBytesPerPoint * static_cast<double>(cloud.size()), memoryLimit(options.maxMemory));
  const points::PointNeighbours tree(cloud.positions);
  const auto wanted = static_cast<std::size_t>(options.neighbours);
  NormalsResult result;
  cloud.normals.assign(cloud.size(), Imath::V3f(0));
  points::NeighbourGraph graph(cloud.size());
  std::atomic<std::size_t> missing = 0, quadratic = 0;
  std::vector<float> errors(cloud.size(), std::numeric_limits<float>::infinity());
  const double fitted = options.isOriented ? 0.6 : 1, begun = 0.8 * fitted;
  const Progress fitting = subProgress(options.progress, 0, begun);
  ProgressGate gate(fitting, tree.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tree.size(), 1024), [&](const auto& range) {
    std::vector<points::Neighbour> found;
    Neighbourhood near;
    for (std::size_t at = range.begin(); at < range.end(); ++at) {
      const std::uint32_t index = tree.at(at);
      const V3d& centre = tree.positionAt(at);
      tree.nearest(centre, wanted + 1, found);
      setNeighbourhood(cloud, centre, found, near);
      PointFit fit;
      if (found.size() >= 3) fit = fitPoint(near, options.degree);
      cloud.normals[index] = Imath::V3f(V3d(fit.normal.x(), fit.normal.y(), fit.normal.z()));
      errors[index] = static_cast<float>(fit.error);
      if (fit.normal.isZero()) ++missing;
      if (fit.isQuadratic) ++quadratic;
      if (options.isOriented) graph.set(index, found);
    }
    gate.advance(range.size());
  });
  if (tree.size() < 3)
    throw InvalidInput(
        "the point cloud has fewer than 3 different positions, and a normal needs 3; read a file "
        "with more points");
  if (missing == tree.size())
    throw InvalidInput(
        "all points lie on a line within rounding, so no surface passes through them; check the "
        "units and the columns of the file");
  OneSidedFits(cloud, tree, wanted, options.degree, errors)
      .replaceNormals(subProgress(options.progress, begun, fitted));
  result.report.missing = missing;
  result.report.quadratic = quadratic;
  if (options.isOriented) {
    const points::Orientation found =
        points::orientNormals(cloud, graph, subProgress(options.progress, fitted, 1));
    result.report.components = found.components;
    result.report.guessed = found.guessed;
    result.report.doubtful = found.doubtful;
  }
  if (tree.duplicates() > 0)
    tbb::parallel_for(std::size_t{0}, cloud.size(), [&](std::size_t i) {
      const std::uint32_t first = tree.first(static_cast<std::uint32_t>(i));
      if (first != i) cloud.normals[i] = cloud.normals[first];
    });
  result.cloud = std::move(cloud);
  return result;
}

}  // namespace levelset
