#include "levelset/convert/prisms/prism_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace levelset::convert {
namespace {

using Imath::V3d;
using Imath::V3f;

constexpr double kHalfBlock = (kBlockDim - 1) / 2.0;
/// Number of triangles above which a block is divided into cells of 4³ points.
constexpr std::size_t kManyTriangles = 48;
/// Generous bounds of the rounding error of `float` spheres and distances in a block: a factor, and
/// a length in voxels.
constexpr float kSphereSlack = 1e-5f, kSphereMargin = 2e-5f;

/// Coordinates x and y of the rows along z of a cell, relative to its centre.
template <int kDim>
struct RowPositions {
  static constexpr std::size_t kCount = std::size_t{kDim} * kDim;
  std::array<float, kCount> x{}, y{};

  constexpr RowPositions() {
    for (std::size_t i = 0; i < kCount; ++i) {
      const std::size_t row = i / kDim;
      x[i] = static_cast<float>(row) - static_cast<float>(kDim - 1) / 2;
      y[i] = static_cast<float>(i % kDim) - static_cast<float>(kDim - 1) / 2;
    }
  }
};

template <int kDim>
constexpr RowPositions<kDim> kRows;

template <int kDim>
constexpr double kHalfEdge = (kDim - 1) / 2.0;

}  // namespace

/// Copies to `to` the spheres whose triangles can be nearest to a point of the cell. The centre of
/// a sphere lies on its triangle, so the nearest centre bounds the distance from above. Between the
/// centre of the cell and one of its points, this bound and the distance to a triangle each change
/// by at most the cell's radius.
void PrismScan::keepNear(const Spheres& from, const V3f& centre, float cellRadius, Spheres& to) {
  squared_.resize(from.size());
  float least = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < from.size(); ++i) {
    squared_[i] = (from[i].centre - centre).length2();
    least = std::min(least, squared_[i]);
  }
  const float near = std::sqrt(least) * (1 + kSphereSlack) + kSphereMargin + 2 * cellRadius;
  to.clear();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const float range = near + from[i].radius;
    if (squared_[i] <= range * range) to.push_back(from[i]);
  }
}

/// Intersects each row of a cell with the half-spaces of a half of a prism. Returns false when no
/// point of the cell lies in it.
template <int kDim>
bool PrismScan::findRows(const PrismPlanes::HalfPlanes& planes, const V3d& centre) {
  struct Cut {
    const V3d* normal;
    double limit;
  };
  std::array<Cut, 5> cuts{};
  std::size_t count = 0;
  for (const PrismPlanes::Plane& plane : planes) {
    const V3d& n = plane.normal;
    const double limit = plane.limit - n.dot(centre),
                 radius = kHalfEdge<kDim> * (std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
    if (limit < -radius) return false;
    if (limit < radius) cuts[count++] = {&n, limit};
  }
  constexpr std::size_t kCount = RowPositions<kDim>::kCount;
  const RowPositions<kDim>& rows = kRows<kDim>;
  std::fill_n(low_.begin(), kCount, -static_cast<float>(kHalfEdge<kDim>));
  std::fill_n(high_.begin(), kCount, static_cast<float>(kHalfEdge<kDim>));
  for (std::size_t k = 0; k < count; ++k) {
    const V3d& n = *cuts[k].normal;
    // A row that is almost parallel to the plane is on one side of it.
    constexpr double kLeast = 1e-9;
    const double z = std::abs(n.z) > kLeast ? n.z : (n.z < 0 ? -kLeast : kLeast);
    const auto a = static_cast<float>(-n.x / z), b = static_cast<float>(-n.y / z),
               c = static_cast<float>(cuts[k].limit / z);
    if (z > 0) {
      for (std::size_t i = 0; i < kCount; ++i) {
        const float end = c + a * rows.x[i] + b * rows.y[i];
        high_[i] = end < high_[i] ? end : high_[i];
      }
    } else {
      for (std::size_t i = 0; i < kCount; ++i) {
        const float end = c + a * rows.x[i] + b * rows.y[i];
        low_[i] = end > low_[i] ? end : low_[i];
      }
    }
  }
  return true;
}

template <int kDim>
void PrismScan::measureRows(const Candidate& candidate, const V3d& centre) {
  const RowPositions<kDim>& rows = kRows<kDim>;
  const auto half = static_cast<float>(kHalfEdge<kDim>);
  for (std::size_t i = 0; i < RowPositions<kDim>::kCount; ++i) {
    if (!(low_[i] <= high_[i])) continue;
    const int first = static_cast<int>(std::ceil(low_[i] + half)),
              last = static_cast<int>(std::floor(high_[i] + half));
    V3d point = centre + V3d(static_cast<double>(rows.x[i]), static_cast<double>(rows.y[i]), 0);
    const auto index = [](double coordinate) {
      return static_cast<std::size_t>(coordinate + kHalfBlock);
    };
    const std::size_t row = 64 * index(point.x) + 8 * index(point.y);
    for (int z = first; z <= last; ++z) {
      point.z = centre.z + z - kHalfEdge<kDim>;
      const std::size_t at = row + index(point.z);
      ++measured_;
      const double squared = candidate.frame.squaredDistance(point);
      if (squared < distances_[at]) {
        distances_[at] = squared;
        nearest_[at] = candidate.triangle;
      }
    }
  }
}

template <int kDim>
void PrismScan::scanCell(const Spheres& spheres, const V3d& centre) {
  for (const Sphere& sphere : spheres) {
    Candidate& candidate = candidates_[sphere.candidate];
    const auto& corners = candidate.corners;
    if (!candidate.planes) {
      candidate.planes.emplace(corners, prisms_.prism(candidate.triangle), prisms_.reach());
      candidate.frame = TriangleFrame(corners[0], corners[1], corners[2]);
    }
    if (!candidate.planes->mayTouch(centre, kHalfEdge<kDim>)) continue;
    for (const bool isFront : {true, false})
      if (findRows<kDim>(candidate.planes->half(isFront), centre))
        measureRows<kDim>(candidate, centre);
  }
}

bool PrismScan::measure(const LocalMesh& mesh, std::span<const std::uint32_t> candidates,
                        const V3d& origin) {
  const V3d centre = origin + V3d(kHalfBlock);
  const double reach = prisms_.reach();
  distances_.fill(reach * reach);
  nearest_.fill(kNoTriangle);
  candidates_.resize(candidates.size());
  all_.clear();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    Candidate& candidate = candidates_[i];
    const std::uint32_t t = candidates[i];
    candidate.triangle = t;
    candidate.planes.reset();
    V3d middle(0);
    for (std::size_t k = 0; k < 3; ++k) {
      candidate.corners[k] = mesh.corner(t, k) - centre;
      middle += candidate.corners[k] / 3;
    }
    double squared = 0;
    for (const V3d& corner : candidate.corners)
      squared = std::max(squared, (corner - middle).length2());
    const float radius = static_cast<float>(std::sqrt(squared)) * (1 + kSphereSlack) +
                         static_cast<float>(middle.length()) * kSphereSlack + kSphereMargin;
    all_.push_back({V3f(middle), radius, static_cast<std::uint32_t>(i)});
  }
  const auto radiusOf = [](int dim) { return static_cast<float>(dim - 1) * 0.8660255f; };
  keepNear(all_, V3f(0), radiusOf(kBlockDim), block_);
  constexpr int kCellDim = kBlockDim / 2;
  if (block_.size() <= kManyTriangles) {
    scanCell<kBlockDim>(block_, V3d(0));
  } else {
    for (int child = 0; child < 8; ++child) {
      const V3d at = V3d(child & 4 ? 1 : -1, child & 2 ? 1 : -1, child & 1 ? 1 : -1) * kCellDim / 2;
      keepNear(block_, V3f(at), radiusOf(kCellDim), cell_);
      scanCell<kCellDim>(cell_, at);
    }
  }
  bool anyWithin = false;
  for (std::size_t i = 0; i < kBlockVoxels; ++i) {
    distances_[i] = std::sqrt(distances_[i]);
    anyWithin = anyWithin || distances_[i] < reach;
  }
  return anyWithin;
}

}  // namespace levelset::convert
