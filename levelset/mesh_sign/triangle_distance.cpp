#include "levelset/mesh_sign/triangle_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace levelset::convert {
namespace {

using Imath::V3d;
using Imath::V3f;

/// Generous bounds of the rounding error of `float` sphere centres and distances near a block: a
/// factor, and a length in voxels.
constexpr float kRelativeSlack = 1e-5f, kSlack = 2e-5f;

double clampUnit(double t) {
  return t < 0 ? 0 : (t > 1 ? 1 : t);
}

/// A unit vector perpendicular to u.
V3d anyPerpendicular(const V3d& u) {
  const V3d axis = std::abs(u.x) < 0.6 ? V3d(1, 0, 0) : V3d(0, 1, 0);
  return (axis - u * u.dot(axis)).normalized();
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
  if (y <= 0) {  // AB is the longest edge, so the angles at A and B are acute and AB is nearest
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

double BlockDistance::squaredDistance(std::uint32_t slot, const V3f& point) {
  if (!hasFrame_[slot]) {
    frames_[slot] = TriangleFrame(corners_[slot][0], corners_[slot][1], corners_[slot][2]);
    hasFrame_[slot] = 1;
  }
  return frames_[slot].squaredDistance(V3d(point));
}

double BlockDistance::nearest(const Spheres& spheres, const V3f& point) {
  const float low = squaredToCentres(spheres, point);
  double best = reach_ * reach_;
  std::size_t first = 0;
  while (squared_[first] > low) ++first;
  best = std::min(best, squaredDistance(spheres.slot[first], point));
  float bound = static_cast<float>(std::sqrt(best)) * (1 + kRelativeSlack);
  for (std::size_t i = 0; i < spheres.size; ++i) {
    const float range = bound + spheres.radius[i];
    if (squared_[i] > range * range || i == first) continue;
    const double squared = squaredDistance(spheres.slot[i], point);
    if (squared >= best) continue;
    best = squared;
    bound = static_cast<float>(std::sqrt(best)) * (1 + kRelativeSlack);
  }
  return std::sqrt(best);
}

/// Computes the distances at the grid points of the eight children of the cell around `centre`.
/// @param level  size of the children: 1 for 4³ points, 2 for 2³ points, 3 for single points
void BlockDistance::splitCell(int level, const V3f& centre) {
  const float offset = static_cast<float>(kBlockDim >> level) / 2;
  const float cellRadius = (static_cast<float>(kBlockDim >> level) - 1) * 0.8660255f;
  for (int child = 0; child < 8; ++child) {
    const V3f c = centre + V3f((child & 4) ? offset : -offset, (child & 2) ? offset : -offset,
                               (child & 1) ? offset : -offset);
    if (level == 3) {
      const double distance = nearest(lists_[2], c);
      const auto index = [](float value) { return static_cast<std::size_t>(value + 3.5f); };
      distances_[index(c.x) * 64 + index(c.y) * 8 + index(c.z)] = distance;
      anyWithin_ = anyWithin_ || distance < reach_;
      continue;
    }
    Spheres& kept = lists_[static_cast<std::size_t>(level)];
    pass(lists_[static_cast<std::size_t>(level) - 1], c, cellRadius, kept);
    if (kept.size > 0) splitCell(level + 1, c);
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
