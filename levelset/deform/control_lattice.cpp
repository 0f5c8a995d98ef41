#include "levelset/deform/control_lattice.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "levelset/error.h"

namespace levelset {
namespace {

using Imath::M44d;
using Imath::V3d;

constexpr double kFarthestControlPoint =
    1e100;  // so that products of three differences stay finite

constexpr const char* kAxisNames[3] = {"u", "v", "w"};

bool isFinitePoint(const V3d& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

void requireDegree(int degree) {
  if (degree >= 1 && degree <= kMostDegree) return;
  throw InvalidInput(fmt::format("the degree of the lattice is {}; give a degree from 1 to {}",
                                 degree, kMostDegree));
}

void requireLatticeAxis(const LatticeAxis& axis, const char* name) {
  requireDegree(axis.degree);
  const auto order = static_cast<std::size_t>(axis.degree) + 1;
  if (axis.knots.size() < 2 * order)
    throw InvalidInput(fmt::format("the lattice has {} knots along {}; degree {} needs at least {}",
                                   axis.knots.size(), name, axis.degree, 2 * order));
  for (std::size_t i = 0; i < axis.knots.size(); ++i) {
    const double knot = axis.knots[i];
    if (!std::isfinite(knot) || (i > 0 && knot < axis.knots[i - 1]))
      throw InvalidInput(
          fmt::format("knot {} of the lattice along {} is {}; give finite knots in ascending order",
                      i, name, knot));
  }
  const std::size_t last = axis.knots.size() - 1;
  for (std::size_t i = 0; i < order; ++i)
    if (axis.knots[i] != 0 || axis.knots[last - i] != 1)
      throw InvalidInput(fmt::format(
          "the knots of the lattice along {} must begin with {} zeros and end with {} ones", name,
          order, order));
  for (std::size_t i = order; i + order <= last; ++i)
    if (!(axis.knots[i] > 0) || !(axis.knots[i] < 1) || axis.knots[i] == axis.knots[i + order - 1])
      throw InvalidInput(fmt::format(
          "the inner knot {} along {} is 0, 1 or repeated more than {} times, so the lattice is "
          "not continuous; remove it",
          axis.knots[i], name, axis.degree));
}

/// Index of the knot span that contains a parameter in [0, 1]: knots[span] ≤ t < knots[span + 1].
std::size_t spanOf(const LatticeAxis& axis, double t) {
  const auto first = axis.knots.begin() + axis.degree, end = axis.knots.end() - axis.degree - 1;
  const auto after = std::upper_bound(first, end, t);
  return static_cast<std::size_t>(std::max(after - axis.knots.begin(), std::ptrdiff_t{1}) - 1);
}

/// B-spline basis at a parameter, and its derivatives [Piegl97, A2.2].
struct Basis {
  std::size_t first = 0;  ///< first control point with a basis function that is not zero
  std::array<double, kMostDegree + 1> value{}, slope{};

  Basis(const LatticeAxis& axis, double t) {
    const auto p = static_cast<std::size_t>(axis.degree);
    const std::size_t span = spanOf(axis, t);
    first = span - p;
    const std::vector<double>& knots = axis.knots;
    value[0] = 1;
    for (std::size_t order = 1; order <= p; ++order) {
      if (order == p) setSlopes(knots, span, p);
      double carried = 0;
      for (std::size_t r = 0; r < order; ++r) {
        const double right = knots[span + r + 1], left = knots[span + 1 + r - order];
        const double share = value[r] / (right - left);
        value[r] = carried + (right - t) * share;
        carried = (t - left) * share;
      }
      value[order] = carried;
    }
  }

 private:
  /// The derivative is a difference of the basis functions of one degree less.
  void setSlopes(const std::vector<double>& knots, std::size_t span, std::size_t p) {
    for (std::size_t r = 0; r < p; ++r) {
      const double width = knots[span + r + 1] - knots[span + 1 + r - p];
      const double change = static_cast<double>(p) * value[r] / width;
      slope[r] -= change;
      slope[r + 1] += change;
    }
  }
};

/// Bernstein coefficients on a span as a matrix of the control points that act there: coefficient j
/// is the blossom at (p − j) times the begin and j times the end of the span.
std::vector<double> extractionMatrix(const LatticeAxis& axis, std::size_t span) {
  const auto p = static_cast<std::size_t>(axis.degree);
  const std::vector<double>& knots = axis.knots;
  std::vector<double> matrix((p + 1) * (p + 1));
  std::vector<double> row(p + 1);
  for (std::size_t j = 0; j <= p; ++j)
    for (std::size_t point = 0; point <= p; ++point) {
      std::fill(row.begin(), row.end(), 0.0);
      row[point] = 1;
      for (std::size_t step = 1; step <= p; ++step) {
        const double argument = step <= p - j ? knots[span] : knots[span + 1];
        for (std::size_t i = p; i >= step; --i) {
          const double left = knots[span - p + i], right = knots[span + 1 + i - step];
          const double share = (argument - left) / (right - left);
          row[i] = (1 - share) * row[i - 1] + share * row[i];
        }
      }
      matrix[j * (p + 1) + point] = row[p];
    }
  return matrix;
}

void requireControlPoints(const LatticeData& data) {
  for (std::size_t n = 0; n < data.points.size(); ++n) {
    const V3d& p = data.points[n];
    if (!isFinitePoint(p) || p.length2() > kFarthestControlPoint * kFarthestControlPoint)
      throw InvalidInput(fmt::format(
          "control point {} of the lattice is ({}, {}, {}); give finite coordinates below 1e100", n,
          p.x, p.y, p.z));
  }
  if (data.weights.empty()) return;
  if (data.weights.size() != data.points.size())
    throw InvalidInput(
        fmt::format("the lattice has {} weights for {} control points; give one "
                    "weight for each control point, or none",
                    data.weights.size(), data.points.size()));
  for (std::size_t n = 0; n < data.weights.size(); ++n)
    if (!(data.weights[n] >= 1e-30) || !(data.weights[n] <= 1e30))
      throw InvalidInput(
          fmt::format("weight {} of the lattice is {}; give positive weights from 1e-30 to 1e30", n,
                      data.weights[n]));
}

void requireLatticeFrame(const M44d& frame) {
  const V3d u(frame[0][0], frame[0][1], frame[0][2]), v(frame[1][0], frame[1][1], frame[1][2]),
      w(frame[2][0], frame[2][1], frame[2][2]), origin(frame[3][0], frame[3][1], frame[3][2]);
  const double volume = std::abs(u.dot(v.cross(w))), edges = u.length() * v.length() * w.length();
  const bool isAffine =
      frame[0][3] == 0 && frame[1][3] == 0 && frame[2][3] == 0 && frame[3][3] == 1;
  if (isAffine && isFinitePoint(origin) && edges < kFarthestControlPoint &&
      edges > 1 / kFarthestControlPoint && volume > 1e-12 * edges)
    return;
  throw InvalidInput(
      "the box of the lattice is flat, empty or not finite; give three edges that span a volume");
}

}  // namespace

double boxVolume(const LatticeData& data) {
  const Imath::M44d& m = data.boxToWorld;
  return V3d(m[0][0], m[0][1], m[0][2])
      .dot(V3d(m[1][0], m[1][1], m[1][2]).cross(V3d(m[2][0], m[2][1], m[2][2])));
}

LatticeAxis uniformAxis(int degree, std::size_t count) {
  requireDegree(degree);
  const auto p = static_cast<std::size_t>(degree);
  if (count < p + 1 || count > kMostControlPoints)
    throw InvalidInput(
        fmt::format("the lattice has {} control points along one axis; degree {} needs at least {}",
                    count, degree, p + 1));
  LatticeAxis axis{degree, {}};
  const std::size_t spans = count - p;
  for (std::size_t i = 0; i <= p; ++i) axis.knots.push_back(0);
  for (std::size_t i = 1; i < spans; ++i)
    axis.knots.push_back(static_cast<double>(i) / static_cast<double>(spans));
  for (std::size_t i = 0; i <= p; ++i) axis.knots.push_back(1);
  return axis;
}

std::vector<double> grevilleAbscissae(const LatticeAxis& axis) {
  std::vector<double> result(axis.count());
  for (std::size_t i = 0; i < result.size(); ++i) {
    double sum = 0;
    for (int n = 1; n <= axis.degree; ++n) sum += axis.knots[i + static_cast<std::size_t>(n)];
    result[i] = sum / axis.degree;
  }
  return result;
}

std::vector<double> basisAt(const LatticeAxis& axis, double parameter) {
  const Basis basis(axis, parameter);
  std::vector<double> result(axis.count(), 0.0);
  for (std::size_t i = 0; i <= static_cast<std::size_t>(axis.degree); ++i)
    result[basis.first + i] = basis.value[i];
  return result;
}

M44d frameOf(const Imath::Box3d& box) {
  const V3d size = box.max - box.min;
  if (!(size.x > 0) || !(size.y > 0) || !(size.z > 0) || !isFinitePoint(box.min) ||
      !isFinitePoint(box.max))
    throw InvalidInput("the box of the lattice is empty or flat; give a box with three edges");
  M44d frame;
  for (int axis = 0; axis < 3; ++axis) {
    frame[axis][axis] = size[axis];
    frame[3][axis] = box.min[axis];
  }
  return frame;
}

ControlLattice::ControlLattice(LatticeData data) {
  std::size_t count = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    requireLatticeAxis(data.axes[axis], kAxisNames[axis]);
    if (data.axes[axis].count() > kMostControlPoints / count)
      throw InvalidInput(fmt::format("the lattice has more than {} control points; use fewer",
                                     kMostControlPoints));
    count *= data.axes[axis].count();
  }
  if (data.points.size() != count)
    throw InvalidInput(
        fmt::format("the lattice has {} control points, but {} x {} x {} are {}; "
                    "give that many",
                    data.points.size(), data.axes[0].count(), data.axes[1].count(),
                    data.axes[2].count(), count));
  requireLatticeFrame(data.boxToWorld);
  requireControlPoints(data);
  auto shared = std::make_shared<Shared>();
  shared->worldToBox = data.boxToWorld.inverse();
  const bool isRational = !data.weights.empty();
  shared->homogeneous.reserve(count * (isRational ? 4 : 3));
  for (std::size_t n = 0; n < count; ++n) {
    const double weight = isRational ? data.weights[n] : 1;
    for (int axis = 0; axis < 3; ++axis)
      shared->homogeneous.push_back(weight * data.points[n][axis]);
    if (isRational) shared->homogeneous.push_back(weight);
  }
  shared->data = std::move(data);
  shared_ = std::move(shared);
}

V3d ControlLattice::parameterOf(const V3d& world) const {
  V3d parameter;
  shared_->worldToBox.multVecMatrix(world, parameter);
  return parameter;
}

V3d ControlLattice::worldOf(const V3d& parameter) const {
  V3d world;
  shared_->data.boxToWorld.multVecMatrix(parameter, world);
  return world;
}

bool ControlLattice::contains(const V3d& world, double tolerance) const {
  const V3d u = parameterOf(world);
  for (int axis = 0; axis < 3; ++axis)
    if (!(u[axis] >= -tolerance && u[axis] <= 1 + tolerance)) return false;
  return true;
}

DeformationJet ControlLattice::jet(const V3d& world) const {
  const std::array<LatticeAxis, 3>& axes = shared_->data.axes;
  const V3d u = parameterOf(world);
  V3d inside;
  for (int axis = 0; axis < 3; ++axis) inside[axis] = std::clamp(u[axis], 0.0, 1.0);
  const Basis x(axes[0], inside.x), y(axes[1], inside.y), z(axes[2], inside.z);
  const std::size_t width = isRational() ? 4 : 3;
  // Value and derivatives by u, v and w, each with four components.
  std::array<std::array<double, 4>, 4> sums{};
  const std::size_t rows = axes[1].count(), columns = axes[2].count();
  for (std::size_t i = 0; i <= static_cast<std::size_t>(axes[0].degree); ++i)
    for (std::size_t j = 0; j <= static_cast<std::size_t>(axes[1].degree); ++j) {
      const double* line = shared_->homogeneous.data() +
                           (((x.first + i) * rows + y.first + j) * columns + z.first) * width;
      std::array<double, 4> value{}, slope{};
      for (std::size_t k = 0; k <= static_cast<std::size_t>(axes[2].degree); ++k, line += width)
        for (std::size_t c = 0; c < width; ++c) {
          value[c] += z.value[k] * line[c];
          slope[c] += z.slope[k] * line[c];
        }
      const double both = x.value[i] * y.value[j], byU = x.slope[i] * y.value[j],
                   byV = x.value[i] * y.slope[j];
      for (std::size_t c = 0; c < width; ++c) {
        sums[0][c] += both * value[c];
        sums[1][c] += byU * value[c];
        sums[2][c] += byV * value[c];
        sums[3][c] += both * slope[c];
      }
    }
  const auto vectorOf = [](const std::array<double, 4>& s) { return V3d(s[0], s[1], s[2]); };
  DeformationJet jet;
  jet.position = vectorOf(sums[0]);
  std::array<V3d, 3> byParameter = {vectorOf(sums[1]), vectorOf(sums[2]), vectorOf(sums[3])};
  if (isRational()) {
    jet.position /= sums[0][3];
    for (std::size_t a = 0; a < 3; ++a)
      byParameter[a] = (byParameter[a] - jet.position * sums[a + 1][3]) / sums[0][3];
  }
  for (int a = 0; a < 3; ++a)
    jet.position += byParameter[static_cast<std::size_t>(a)] * (u[a] - inside[a]);
  const M44d& toBox = shared_->worldToBox;
  for (int c = 0; c < 3; ++c)
    jet.slopes[static_cast<std::size_t>(c)] =
        byParameter[0] * toBox[c][0] + byParameter[1] * toBox[c][1] + byParameter[2] * toBox[c][2];
  return jet;
}

Imath::Box3d ControlLattice::bounds() const {
  Imath::Box3d box;
  for (const V3d& p : shared_->data.points) box.extendBy(p);
  return box;
}

bool ControlLattice::isIdentity() const {
  const LatticeData& data = shared_->data;
  for (const double weight : data.weights)
    if (weight != data.weights[0]) return false;
  std::array<std::vector<double>, 3> greville;
  for (std::size_t axis = 0; axis < 3; ++axis) greville[axis] = grevilleAbscissae(data.axes[axis]);
  double largest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const V3d p = worldOf(V3d(corner & 1, (corner >> 1) & 1, corner >> 2));
    largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  }
  const double tolerance = 8 * std::numeric_limits<double>::epsilon() * largest;
  std::size_t n = 0;
  for (const double u : greville[0])
    for (const double v : greville[1])
      for (const double w : greville[2]) {
        const V3d difference = data.points[n++] - worldOf(V3d(u, v, w));
        for (int axis = 0; axis < 3; ++axis)
          if (!(std::abs(difference[axis]) <= tolerance)) return false;
      }
  return true;
}

ControlLattice identityLattice(const std::array<LatticeAxis, 3>& axes, const M44d& boxToWorld) {
  LatticeData data{.axes = axes, .boxToWorld = boxToWorld};
  const std::array<std::vector<double>, 3> greville = {
      grevilleAbscissae(axes[0]), grevilleAbscissae(axes[1]), grevilleAbscissae(axes[2])};
  for (const double u : greville[0])
    for (const double v : greville[1])
      for (const double w : greville[2]) {
        V3d p;
        boxToWorld.multVecMatrix(V3d(u, v, w), p);
        data.points.push_back(p);
      }
  return ControlLattice(std::move(data));
}

ControlLattice elevated(const ControlLattice& lattice, int axis) {
  const BezierPieces pieces(lattice);
  if (pieces.size() != 1)
    throw InvalidInput(
        fmt::format("the lattice has {} spans, but only a Bézier lattice has its degree raised",
                    pieces.size()));
  const BezierPiece piece = pieces.piece(0);
  LatticeData data{.axes = lattice.data().axes, .boxToWorld = lattice.data().boxToWorld};
  const auto a = static_cast<std::size_t>(axis);
  data.axes[a] = uniformAxis(data.axes[a].degree + 1, data.axes[a].count() + 1);
  std::array<TensorBernstein, 3> higher;
  for (std::size_t c = 0; c < 3; ++c) higher[c] = elevated(piece.numerator[c], axis);
  if (lattice.isRational()) data.weights = elevated(piece.weight, axis).coefficients;
  for (std::size_t n = 0; n < higher[0].coefficients.size(); ++n) {
    const double weight = data.weights.empty() ? 1 : data.weights[n];
    data.points.push_back(
        V3d(higher[0].coefficients[n], higher[1].coefficients[n], higher[2].coefficients[n]) /
        weight);
  }
  return ControlLattice(std::move(data));
}

std::size_t spanCount(const LatticeAxis& axis) {
  std::size_t spans = 0;
  for (std::size_t i = 1; i < axis.knots.size(); ++i)
    if (axis.knots[i] > axis.knots[i - 1]) ++spans;
  return spans;
}

BezierPieces::BezierPieces(const ControlLattice& lattice) : lattice_(lattice) {
  for (std::size_t a = 0; a < 3; ++a) {
    const LatticeAxis& axis = lattice.data().axes[a];
    const auto p = static_cast<std::size_t>(axis.degree);
    for (std::size_t span = p; span + p + 1 < axis.knots.size(); ++span)
      if (axis.knots[span + 1] > axis.knots[span])
        spans_[a].push_back(
            {span - p, axis.knots[span], axis.knots[span + 1], extractionMatrix(axis, span)});
  }
}

BezierPiece BezierPieces::piece(std::size_t index) const {
  const std::array<LatticeAxis, 3>& axes = lattice_.data().axes;
  const Span& z = spans_[2][index % spans_[2].size()];
  index /= spans_[2].size();
  const Span &y = spans_[1][index % spans_[1].size()], &x = spans_[0][index / spans_[1].size()];
  const std::array<const Span*, 3> spans = {&x, &y, &z};
  const std::array<int, 3> degree = {axes[0].degree, axes[1].degree, axes[2].degree};
  BezierPiece piece{V3d(x.low, y.low, z.low), V3d(x.high, y.high, z.high), {}, {}};
  const LatticeData& data = lattice_.data();
  const std::size_t rows = axes[1].count(), columns = axes[2].count();
  const auto gather = [&](const auto& number) {
    TensorBernstein form(degree);
    for (int i = 0; i <= degree[0]; ++i)
      for (int j = 0; j <= degree[1]; ++j)
        for (int k = 0; k <= degree[2]; ++k)
          form.at(i, j, k) = number(((x.first + static_cast<std::size_t>(i)) * rows + y.first +
                                     static_cast<std::size_t>(j)) *
                                        columns +
                                    z.first + static_cast<std::size_t>(k));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      TensorBernstein next(degree);
      const std::vector<double>& matrix = spans[axis]->matrix;
      const int p = degree[axis];
      std::array<int, 3> at{};
      for (at[0] = 0; at[0] <= degree[0]; ++at[0])
        for (at[1] = 0; at[1] <= degree[1]; ++at[1])
          for (at[2] = 0; at[2] <= degree[2]; ++at[2]) {
            std::array<int, 3> from = at;
            double sum = 0;
            for (int n = 0; n <= p; ++n) {
              from[axis] = n;
              sum += matrix[static_cast<std::size_t>(at[axis] * (p + 1) + n)] *
                     form.at(from[0], from[1], from[2]);
            }
            next.at(at[0], at[1], at[2]) = sum;
          }
      form = std::move(next);
    }
    return form;
  };
  const auto weightOf = [&](std::size_t n) { return data.weights.empty() ? 1 : data.weights[n]; };
  for (std::size_t c = 0; c < 3; ++c)
    piece.numerator[c] =
        gather([&](std::size_t n) { return weightOf(n) * data.points[n][static_cast<int>(c)]; });
  if (data.weights.empty()) {
    piece.weight = TensorBernstein({0, 0, 0});
    piece.weight.coefficients[0] = 1;
  } else {
    piece.weight = gather(weightOf);
  }
  return piece;
}

}  // namespace levelset
