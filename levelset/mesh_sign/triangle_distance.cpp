#include "levelset/mesh_sign/triangle_distance.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "levelset/geometry/perpendicular.h"

namespace levelset::convert {
namespace {

using Imath::V3d;
using Imath::V3f;

/// Generous bounds of the rounding error of `float` sphere centres and distances near a block: a
/// factor, and a length in voxels.
constexpr float kRelativeSlack = 1e-5f, kSlack = 2e-5f;

/// Upper bound of the error of approximate distances, relative to the largest length in the
/// calculation. About 20 roundings are added, each of 6e-8.
constexpr float kApproximateError = 4e-6f;
/// Relative part of the error of squared approximate distances. With an error e of the distance d,
/// the square is wrong by at most 2de + e² ≤ kSquareError d² + (1 + 1 / kSquareError) e².
constexpr float kSquareError = 1e-4f;
/// Smallest height and longest edge, voxels, of a triangle with approximate distances.
constexpr double kShortest = 1e-6, kLongest = 1e4;

double clampUnit(double t) {
  return t < 0 ? 0 : (t > 1 ? 1 : t);
}

using Float4 = float __attribute__((vector_size(16)));

Float4 load4(const float* values) {
  Float4 result;
  std::memcpy(&result, values, sizeof(result));
  return result;
}

}  // namespace

TriangleFrame::TriangleFrame(const V3d& a, const V3d& b, const V3d& c) {
  const double ab = (b - a).length2(), bc = (c - b).length2(), ca = (a - c).length2();
  V3d p = a, q = b, r = c;  // pq becomes the longest edge
  if (bc > ab && bc >= ca) {
    p = b, q = c, r = a;
  } else if (ca > ab) {
    p = c, q = a, r = b;
  }
  a_ = p;
  length_ = (q - p).length();
  u_ = length_ > 0 ? (q - p) / length_ : V3d(1, 0, 0);
  cx_ = (r - p).dot(u_);
  V3d rise = (r - p) - u_ * cx_;
  rise -= u_ * u_.dot(rise);
  cy_ = rise.length();
  if (cy_ > 1e-13 * length_) {
    v_ = rise / cy_;
  } else {
    v_ = anyPerpendicular(u_);
    cy_ = 0;
  }
  n_ = u_.cross(v_);
  const double squaredAc = cx_ * cx_ + cy_ * cy_;
  const double squaredBc = (cx_ - length_) * (cx_ - length_) + cy_ * cy_;
  inverseAc_ = squaredAc > 0 ? 1 / squaredAc : 0;
  inverseBc_ = squaredBc > 0 ? 1 / squaredBc : 0;
}

double TriangleFrame::squaredDistance(const V3d& point) const {
  const V3d d = point - a_;
  const double x = d.dot(u_), y = d.dot(v_), height = d.dot(n_);
  double plane = 0;
  // AB is the longest edge, so the angles at A and B are acute and AB is nearest if y ≤ 0. A point
  // has no other edges.
  if (y <= 0 || length_ == 0) {
    const double dx = x < 0 ? -x : (x > length_ ? x - length_ : 0);
    plane = dx * dx + y * y;
  } else {
    const double ex = cx_ - length_, fx = x - length_;
    const bool beyondAc = cx_ * y > cy_ * x, beyondBc = ex * y < cy_ * fx;
    plane = beyondAc || beyondBc ? std::numeric_limits<double>::max() : 0;
    if (beyondAc) {
      const double t = clampUnit((x * cx_ + y * cy_) * inverseAc_);
      const double gx = x - t * cx_, gy = y - t * cy_;
      plane = gx * gx + gy * gy;
    }
    if (beyondBc) {
      const double t = clampUnit((fx * ex + y * cy_) * inverseBc_);
      const double gx = fx - t * ex, gy = y - t * cy_;
      plane = std::min(plane, gx * gx + gy * gy);
    }
  }
  return height * height + plane;
}

ApproximateTriangle::ApproximateTriangle(const TriangleFrame& frame, float range)
    : length_(static_cast<float>(frame.length_)),
      cx_(static_cast<float>(frame.cx_)),
      cy_(static_cast<float>(frame.cy_)),
      inverseAc_(static_cast<float>(frame.inverseAc_)),
      inverseBc_(static_cast<float>(frame.inverseBc_)) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    a_[i] = static_cast<float>(frame.a_[axis]);
    u_[i] = static_cast<float>(frame.u_[axis]);
    v_[i] = static_cast<float>(frame.v_[axis]);
    n_[i] = static_cast<float>(frame.n_[axis]);
  }
  const double shortest = 1 / std::sqrt(std::max(frame.inverseAc_, frame.inverseBc_)),
               farthest = frame.a_.length();
  const bool isSuitable = std::min(frame.inverseAc_, frame.inverseBc_) > 0 &&
                          std::min(shortest, frame.cy_) > kShortest && frame.length_ < kLongest &&
                          farthest < kLongest;
  const float error =
      kApproximateError * (static_cast<float>(farthest + frame.length_) + 2 * range);
  error_ =
      isSuitable ? (1 + 1 / kSquareError) * error * error : std::numeric_limits<float>::infinity();
}

void ApproximateTriangle::squaredDistances(const Coordinates& x, const Coordinates& y,
                                           const Coordinates& z, Coordinates& squared) const {
  const auto least = [](const Float4& a, const Float4& b) { return a < b ? a : b; };
  const auto clamped = [](const Float4& t) {
    const Float4 positive = t > 0 ? t : Float4{};
    return positive < 1 ? positive : Float4{} + 1;
  };
  const float ex = cx_ - length_;
  for (std::size_t i = 0; i < kPoints; i += 4) {
    const Float4 dx = load4(x.data() + i) - a_[0], dy = load4(y.data() + i) - a_[1],
                 dz = load4(z.data() + i) - a_[2];
    const Float4 along = dx * u_[0] + dy * u_[1] + dz * u_[2],
                 rise = dx * v_[0] + dy * v_[1] + dz * v_[2],
                 height = dx * n_[0] + dy * n_[1] + dz * n_[2];
    const Float4 beyond = along - length_;
    // Squared distances to the three edges.
    const Float4 outside = least(least(along, -beyond), Float4{});
    const Float4 toAb = outside * outside + rise * rise;
    const Float4 s = clamped((along * cx_ + rise * cy_) * inverseAc_);
    const Float4 sx = along - s * cx_, sy = rise - s * cy_, toAc = sx * sx + sy * sy;
    const Float4 t = clamped((beyond * ex + rise * cy_) * inverseBc_);
    const Float4 tx = beyond - t * ex, ty = rise - t * cy_, toBc = tx * tx + ty * ty;
    // Least signed distance from the lines of the edges, times a length: negative outside.
    const Float4 inside = least(least(rise, cy_ * along - cx_ * rise), ex * rise - cy_ * beyond);
    const Float4 plane = inside >= 0 ? Float4{} : least(least(toAb, toAc), toBc);
    const Float4 result = height * height + plane;
    std::memcpy(squared.data() + i, &result, sizeof(result));
  }
}

void BlockDistance::Spheres::resize(std::size_t count) {
  size = count;
  if (x.size() >= count) return;
  for (std::vector<float>* v : {&x, &y, &z, &radius}) v->resize(count + count / 2);
  slot.resize(count + count / 2);
}

void BlockDistance::load(const LocalMesh& mesh, std::span<const std::uint32_t> candidates) {
  const std::size_t count = candidates.size();
  Spheres& all = lists_[0];
  all.resize(count);
  if (corners_.size() < count) {
    corners_.resize(count);
    frames_.resize(count);
    approximate_.resize(count);
    near_.resize(count);
    hasFrame_.resize(count);
    squared_.resize(count);
  }
  std::fill_n(hasFrame_.begin(), count, char{0});
  for (std::size_t i = 0; i < count; ++i) {
    const V3d a = mesh.corner(candidates[i], 0) - centre_,
              b = mesh.corner(candidates[i], 1) - centre_,
              c = mesh.corner(candidates[i], 2) - centre_;
    corners_[i] = {a, b, c};
    const V3d middle = (a + b + c) / 3;
    const double radius = std::sqrt(
        std::max({(a - middle).length2(), (b - middle).length2(), (c - middle).length2()}));
    all.x[i] = static_cast<float>(middle.x);
    all.y[i] = static_cast<float>(middle.y);
    all.z[i] = static_cast<float>(middle.z);
    all.radius[i] = static_cast<float>(radius) * (1 + kRelativeSlack) +
                    static_cast<float>(middle.length()) * kRelativeSlack + kSlack;
    all.slot[i] = static_cast<std::uint32_t>(i);
  }
}

float BlockDistance::squaredToCentres(const Spheres& spheres, const V3f& point) {
  const float *x = spheres.x.data(), *y = spheres.y.data(), *z = spheres.z.data();
  float* squared = squared_.data();
  const float px = point.x, py = point.y, pz = point.z;
  for (std::size_t i = 0; i < spheres.size; ++i) {
    const float dx = x[i] - px, dy = y[i] - py, dz = z[i] - pz;
    squared[i] = dx * dx + dy * dy + dz * dz;
  }
  float low = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < spheres.size; ++i) low = squared[i] < low ? squared[i] : low;
  return low;
}

/// Copies to `to` the spheres whose triangles can be nearest to a point of the cell around
/// `centre`. The centre of a sphere lies on its triangle, so the nearest centre bounds the distance
/// from above. Between `centre` and a point of the cell, this bound and the distance to a triangle
/// each change by at most the cell's radius.
void BlockDistance::pass(const Spheres& from, const V3f& centre, float cellRadius, Spheres& to) {
  const float low = std::sqrt(squaredToCentres(from, centre)) * (1 + kRelativeSlack) + kSlack;
  const float bound =
      std::min(low + 2 * cellRadius, static_cast<float>(reach_) + cellRadius + kSlack);
  to.resize(from.size);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < from.size; ++i) {
    const float range = bound + from.radius[i];
    to.x[kept] = from.x[i];
    to.y[kept] = from.y[i];
    to.z[kept] = from.z[i];
    to.radius[kept] = from.radius[i];
    to.slot[kept] = from.slot[i];
    kept += squared_[i] <= range * range;
  }
  to.size = kept;
}

/// Computes near_[at], the approximate squared distances of the triangle in a slot from the eight
/// points.
void BlockDistance::approximate(std::uint32_t slot, std::size_t at) {
  if (!hasFrame_[slot]) {
    frames_[slot] = TriangleFrame(corners_[slot][0], corners_[slot][1], corners_[slot][2]);
    approximate_[slot] = ApproximateTriangle(frames_[slot], kBlockDim);
    hasFrame_[slot] = 1;
  }
  approximate_[slot].squaredDistances(x_, y_, z_, near_[at]);
}

/// Computes the distances at the eight grid points of the 2³ cell around `centre`. Only triangles
/// whose approximate distance is near the least one are measured exactly, so the result is that of
/// measuring all.
void BlockDistance::measureCell(const Spheres& spheres, const V3f& centre) {
  constexpr std::size_t kPoints = ApproximateTriangle::kPoints;
  for (std::size_t i = 0; i < kPoints; ++i) {
    x_[i] = centre.x + (i & 4 ? 0.5f : -0.5f);
    y_[i] = centre.y + (i & 2 ? 0.5f : -0.5f);
    z_[i] = centre.z + (i & 1 ? 0.5f : -0.5f);
  }

  // === Approximate distances, the triangle with the nearest centre first
  constexpr float kCellRadius = 0.8660255f;
  const float low = squaredToCentres(spheres, centre);
  std::size_t first = 0;
  while (squared_[first] > low) ++first;
  ApproximateTriangle::Coordinates bound;  // upper bounds of the squared distances
  bound.fill(static_cast<float>(reach_ * reach_) * (1 + kRelativeSlack));
  float farthest = 0;  // square root of the largest bound
  const auto take = [&](std::size_t i) {
    const std::uint32_t slot = spheres.slot[i];
    approximate(slot, i);
    const float error = approximate_[slot].error();
    float largest = 0;
    for (std::size_t k = 0; k < kPoints; ++k) {
      const float upper = near_[i][k] * (1 + kSquareError) + error;
      bound[k] = upper < bound[k] ? upper : bound[k];
      largest = bound[k] > largest ? bound[k] : largest;
    }
    farthest = std::sqrt(largest);
  };
  kept_.clear();
  take(first);
  kept_.push_back(static_cast<std::uint32_t>(first));
  for (std::size_t i = 0; i < spheres.size; ++i) {
    const float range = (farthest + kCellRadius) * (1 + kRelativeSlack) + spheres.radius[i];
    if (squared_[i] > range * range || i == first) continue;
    take(i);
    kept_.push_back(static_cast<std::uint32_t>(i));
  }

  // === Exact distances
  std::array<double, kPoints> best;
  best.fill(reach_ * reach_);
  for (const std::uint32_t i : kept_) {
    const std::uint32_t slot = spheres.slot[i];
    const float error = approximate_[slot].error();
    for (std::size_t k = 0; k < kPoints; ++k) {
      if (near_[i][k] * (1 - kSquareError) - error > bound[k]) continue;
      best[k] = std::min(best[k], frames_[slot].squaredDistance(V3d(V3f(x_[k], y_[k], z_[k]))));
    }
  }
  const auto index = [](float value) { return static_cast<std::size_t>(value + 3.5f); };
  for (std::size_t k = 0; k < kPoints; ++k) {
    const double distance = std::sqrt(best[k]);
    distances_[index(x_[k]) * 64 + index(y_[k]) * 8 + index(z_[k])] = distance;
    anyWithin_ = anyWithin_ || distance < reach_;
  }
}

/// Computes the distances at the grid points of the eight children of the cell around `centre`.
/// @param level  size of the children: 1 for 4³ points, 2 for 2³ points
void BlockDistance::splitCell(int level, const V3f& centre) {
  const float offset = static_cast<float>(kBlockDim >> level) / 2;
  const float cellRadius = (static_cast<float>(kBlockDim >> level) - 1) * 0.8660255f;
  for (int child = 0; child < 8; ++child) {
    const V3f c = centre + V3f((child & 4) ? offset : -offset, (child & 2) ? offset : -offset,
                               (child & 1) ? offset : -offset);
    Spheres& kept = lists_[static_cast<std::size_t>(level)];
    pass(lists_[static_cast<std::size_t>(level) - 1], c, cellRadius, kept);
    if (kept.size == 0) continue;
    if (level == 1)
      splitCell(2, c);
    else
      measureCell(kept, c);
  }
}

bool BlockDistance::measure(const LocalMesh& mesh, std::span<const std::uint32_t> candidates,
                            const V3d& origin) {
  constexpr double kHalf = (kBlockDim - 1) / 2.0;
  centre_ = origin + V3d(kHalf);
  distances_.fill(reach_);
  anyWithin_ = false;
  if (candidates.empty()) return false;
  load(mesh, candidates);
  splitCell(1, V3f(0));
  return anyWithin_;
}

}  // namespace levelset::convert
