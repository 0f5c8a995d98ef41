// The pieces and border faces of a FilteredSurface.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/isosurface/filtered_surface.h"
#include "levelset/volumes/filters/filter_weights.h"

namespace levelset {
namespace {

using openvdb::Mat3d;
using openvdb::Vec3d;

// Samples below and above a cell on which its values may depend.
constexpr int kReachBelow = 2, kReachAbove = 3, kReachCount = kReachBelow + kReachAbove + 1;
// Part of a border face that is searched as one, in cells.
constexpr double kFaceEdge = 0.5;
// Edges of the largest boxes that hold a piece, and of the smallest boxes, in cells.
constexpr double kLargestBox = 0.5, kSmallestBox = 0.0625;
// A box is split when the gradient may change in it by this part of itself.
constexpr double kMostChange = 0.5;

/// Part of a triangle in which the linear interpolant of three values is positive.
double positiveShare(double a, double b, double c) {
  const int positive = (a > 0) + (b > 0) + (c > 0);
  if (positive == 0) return 0;
  if (positive == 3) return 1;
  if (positive == 2) return 1 - positiveShare(-a, -b, -c);
  if (b > 0) std::swap(a, b);
  if (c > 0) std::swap(a, c);
  return a * a / ((a - b) * (a - c));
}

}  // namespace

FilterBounds boundsOf(VolumeFilter filter) {
  // The splines on tetrahedra: the weights of the values are known, and linear programs give the
  // least factors of the second derivatives (2, 1.5 and 3.25). The first has a reserve for the
  // jumps of its gradient.
  if (filter == VolumeFilter::SuperQuadratic) return {9.0 / 8, 3, true};
  if (filter == VolumeFilter::CubicC1) return {1, 1.5, true};
  if (filter == VolumeFilter::BccQuadratic) return {5.0 / 4, 3.25, true};
  double value = 0, curvature = 0, correction = 0;
  constexpr int kSteps = 256;
  for (int n = 0; n <= kSteps; ++n) {
    const FilterWeights axis =
        filterWeights(filter, 4 + static_cast<double>(n) / kSteps, 10, GridExtension::Quadratic);
    double sum = 0;
    for (const double w : axis.weight[0]) sum += std::abs(w);
    value = std::max(value, sum);
    if (filter == VolumeFilter::BSplineQi) {
      sum = 0;
      for (std::size_t i = 0; i < axis.weight[0].size(); ++i)
        sum += std::abs(axis.weight[0][i] - axis.uncorrected[0][i]);
      correction = std::max(correction, sum);
    }
    // Weights of the second differences: twofold partial sums of the weights of the samples.
    double once = 0, twice = 0;
    sum = 0;
    for (const double w : axis.weight[2]) {
      once += w;
      twice += once;
      sum += std::abs(twice);
    }
    curvature = std::max(curvature, sum);
  }
  // The sums change by less than this between two steps.
  value += 0.001;
  curvature += 0.05;
  // Each axis adds its correction to the B-spline, whose weights are positive with the sum 1.
  if (filter == VolumeFilter::BSplineQi) {
    correction = 2 * (correction + 0.001);
    return {value + correction, curvature + correction};
  }
  return {value * value * value, curvature * value * value};
}

void FilteredSurface::collectSlab(int k, SlabOfPieces& out) const {
  const Imath::V3i size = volume_.volume().size();
  for (int j = 0; j + 1 < size.y; ++j)
    for (int i = 0; i + 1 < size.x; ++i)
      if (double curvature = 0; mayHoldSurface({i, j, k}, curvature))
        collectCell({i, j, k}, curvature, out);
}

bool FilteredSurface::mayHoldSurface(const Imath::V3i& cell, double& curvature) const {
  const Volume& volume = volume_.volume();
  const Imath::V3i size = volume.size();
  constexpr std::size_t kCount = kReachCount;
  std::array<double, kCount * kCount * kCount> sample{};  // x fastest
  const Imath::V3i first = cell - Imath::V3i(kReachBelow);
  bool isInner = true;
  for (int axis = 0; axis < 3; ++axis)
    isInner = isInner && first[axis] >= 0 && cell[axis] + kReachAbove < size[axis];
  if (isInner) {
    std::size_t at = 0;
    for (int k = 0; k < kReachCount; ++k)
      for (int j = 0; j < kReachCount; ++j, at += kCount)
        volume.storedRun(volume.index(first.x, first.y + j, first.z + k), {&sample[at], kCount});
    for (double& value : sample) value = volume.scale()(value);
  } else {
    const ExtendedGrid extended([&](int i, int j, int k) { return volume.at(i, j, k); },
                                {size.x, size.y, size.z}, GridExtension::Quadratic);
    std::size_t at = 0;
    for (int k = 0; k < kReachCount; ++k)
      for (int j = 0; j < kReachCount; ++j)
        for (int i = 0; i < kReachCount; ++i)
          sample[at++] = extended(first.x + i, first.y + j, first.z + k);
  }
  const auto [low, high] = std::minmax_element(sample.begin(), sample.end());
  const double middle = (*low + *high) / 2, half = bounds_.value * (*high - *low) / 2;
  bool may = false;
  for (int n = 0; n < limits_.count; ++n)
    may = may || std::abs(limits_.limit[static_cast<std::size_t>(n)] - middle) <= half;
  if (!may) return false;

  double largest = 0;
  constexpr std::array<std::size_t, 3> kStride = {1, kCount, kCount * kCount};
  for (std::size_t at = 0; at < sample.size(); ++at)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t step = kStride[axis], place = at / step % kCount;
      if (place + 2 < kCount)
        largest =
            std::max(largest, std::abs(sample[at] - 2 * sample[at + step] + sample[at + 2 * step]));
      const std::size_t other = kStride[(axis + 1) % 3];
      if (bounds_.usesMixed && place + 1 < kCount && at / other % kCount + 1 < kCount)
        largest = std::max(largest, std::abs(sample[at] - sample[at + step] - sample[at + other] +
                                             sample[at + step + other]));
    }
  curvature = bounds_.curvature * largest / unit_;
  return true;
}

void FilteredSurface::collectCell(const Imath::V3i& cell, double curvature,
                                  SlabOfPieces& out) const {
  Box box{.first = Vec3d(cell.x, cell.y, cell.z)};
  for (std::size_t c = 0; c < 8; ++c) box.value[c] = valueAt(box.corner(c));
  const std::size_t before = out.pieces.size();
  for (int n = 0; n < limits_.count; ++n) collectBox(box, n, curvature, out);
  out.cells += out.pieces.size() > before;
}

void FilteredSurface::collectBox(const Box& box, int function, double curvature,
                                 SlabOfPieces& out) const {
  std::array<double, 8> f{};
  unsigned inside = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < 8; ++c) {
    f[c] = functionAt(function, box.value[c]);
    inside |= f[c] > 0 ? 1u << c : 0;
    least = std::min(least, std::abs(f[c]));
  }
  bool split = false;
  if (inside == 0 || inside == 255) {
    // The function differs from the trilinear interpolant of the corners by this at most.
    const double most = 3 * curvature * box.edge * box.edge / 8;
    if (least > most || box.edge <= kSmallestBox) return;
    split = true;
  } else if (box.edge > kLargestBox) {
    split = true;
  } else {
    // An edge of the box whose ends lie on different sides.
    for (std::size_t edge = 0; edge < 24; ++edge) {
      const std::size_t from = edge & 7, to = from ^ (std::size_t{1} << (edge >> 3));
      if (!(f[from] > 0) || f[to] > 0) continue;
      double slope = 0;
      const Piece piece = pieceIn(box, function, box.corner(from), box.corner(to), slope);
      split = box.edge > kSmallestBox && box.edge * curvature > kMostChange * slope;
      if (!split) out.pieces.push_back(piece);
      break;
    }
  }
  if (!split) return;
  std::array<double, 27> values{};
  for (std::size_t n = 0; n < 27; ++n) {
    const std::size_t x = n / 9, y = n / 3 % 3, z = n % 3;
    values[n] = x % 2 == 0 && y % 2 == 0 && z % 2 == 0
                    ? box.value[2 * x + y + z / 2]
                    : valueAt(box.first + box.edge / 2 *
                                              Vec3d(static_cast<double>(x), static_cast<double>(y),
                                                    static_cast<double>(z)));
  }
  for (std::size_t octant = 0; octant < 8; ++octant) {
    const std::size_t x = octant >> 2, y = octant >> 1 & 1, z = octant & 1;
    Box part{.first = box.first + box.edge / 2 * Box::offset(octant), .edge = box.edge / 2};
    for (std::size_t c = 0; c < 8; ++c)
      part.value[c] = values[(x + (c >> 2)) * 9 + (y + (c >> 1 & 1)) * 3 + z + (c & 1)];
    collectBox(part, function, curvature, out);
  }
}

FilteredSurface::Piece FilteredSurface::pieceIn(const Box& box, int function, const Vec3d& inside,
                                                const Vec3d& outside, double& slopeHere) const {
  // Bisection keeps a crossing between the two ends.
  Vec3d in = inside, out = outside;
  constexpr int kBisections = 12;
  for (int n = 0; n < kBisections; ++n) {
    const Vec3d middle = 0.5 * (in + out);
    (functionAt(function, valueAt(middle)) > 0 ? in : out) = middle;
  }
  const Vec3d start = 0.5 * (in + out);
  const VolumeDerivatives d = volume_.derivatives({start[0], start[1], start[2]});
  Piece piece;
  piece.function = function;
  piece.edge = static_cast<float>(box.edge);
  slopeHere = d.gradient.length() / unit_;
  // Gradient in the frame of the search, and the size of the second derivatives there.
  const Vec3d gradient = frame_.toIndex * Vec3d(d.gradient.x, d.gradient.y, d.gradient.z);
  Mat3d hessian;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) hessian(r, c) = d.hessian[r][c];
  hessian = frame_.toIndex * hessian * frame_.toIndex.transpose();
  double size = 0;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) size += hessian(r, c) * hessian(r, c);
  const double slope = gradient.length();
  double furthest = 0;
  for (std::size_t c = 0; c < 8; ++c) {
    const Vec3d corner = box.corner(c) - start;
    furthest = std::max(furthest, std::sqrt(corner.dot(metric_ * corner)));
  }
  // Twice the second-order term. It is an estimate, not a bound: third derivatives are left out.
  const double bend = slope > 0 ? std::sqrt(size) / slope * furthest * furthest : furthest;
  for (int axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<std::size_t>(axis);
    piece.first[n] = static_cast<float>(box.first[axis]);
    piece.start[n] = static_cast<float>(start[axis]);
    piece.normal[n] = slope > 0 ? static_cast<float>(gradient[axis] / slope) : 0;
  }
  piece.radius = static_cast<float>(furthest);
  piece.bend = static_cast<float>(std::min(bend, furthest));
  return piece;
}

void FilteredSurface::collectFaces() {
  const Imath::V3i size = volume_.volume().size();
  const auto row = [&](int axis) {
    return Vec3d(frame_.axes(axis, 0), frame_.axes(axis, 1), frame_.axes(axis, 2));
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const int countU = 2 * (size[u] - 1), countV = 2 * (size[v] - 1);
    const double area = row(u).cross(row(v)).length() * kFaceEdge * kFaceEdge;
    for (const double side : {0.0, last_[axis]}) {
      const auto place = [&](int a, int b) {
        Vec3d index;
        index[axis] = side;
        index[u] = kFaceEdge * a;
        index[v] = kFaceEdge * b;
        return index;
      };
      std::vector<double> depth(static_cast<std::size_t>((countU + 1) * (countV + 1)));
      tbb::parallel_for(0, countU + 1, [&](int a) {
        for (int b = 0; b <= countV; ++b)
          depth[static_cast<std::size_t>(a * (countV + 1) + b)] = depthAt(place(a, b));
      });
      for (int a = 0; a < countU; ++a)
        for (int b = 0; b < countV; ++b) {
          const auto at = [&](int p, int q) {
            return depth[static_cast<std::size_t>((a + p) * (countV + 1) + b + q)];
          };
          if (std::max({at(0, 0), at(0, 1), at(1, 0), at(1, 1)}) <= 0) continue;
          report_.closedArea += area / 2 *
                                (positiveShare(at(0, 0), at(0, 1), at(1, 0)) +
                                 positiveShare(at(1, 1), at(0, 1), at(1, 0)));
          Face face{};
          Vec3d low(std::numeric_limits<double>::max()), high = -low;
          for (int c = 0; c < 4; ++c) {
            const Vec3d p = frame_.place(place(a + (c >> 1), b + (c & 1)));
            low = openvdb::math::minComponent(low, p);
            high = openvdb::math::maxComponent(high, p);
          }
          for (int n = 0; n < 3; ++n) {
            face.low[static_cast<std::size_t>(n)] = static_cast<float>(low[n]);
            face.high[static_cast<std::size_t>(n)] = static_cast<float>(high[n]);
          }
          faces_.push_back(face);
        }
    }
  }
  report_.closedArea *= voxelSize_ * voxelSize_;
}

}  // namespace levelset
