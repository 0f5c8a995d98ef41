#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "levelset/grids/interpolate_vdb.h"
#include "levelset/segmented/operators/junction_distances_vdb.h"

namespace levelset {
namespace {

using Imath::V3d;

constexpr int kMeetingIterations = 8;
constexpr double kMeetingConverged = 1e-3;  // voxels: the error is then about its square
constexpr double kLongestMove = 2;          // voxels
// Excess, in voxels, over the least value from which on a point belongs to another region.
constexpr double kOwnerTie = 1e-3;
// Largest value on an interface, voxels. Near junctions all functions are positive.
constexpr double kLargestValue = 3;
constexpr std::size_t kMostMeeting = 4;

}  // namespace

JunctionDistances::JunctionDistances(const CompetingFields& fields) : fields_(fields) {
  for (const openvdb::FloatTree::Ptr& tree : fields.trees) accessors_.emplace_back(*tree);
}

double JunctionDistances::value(std::size_t region, const V3d& p) const {
  return SampleBlock<4>(accessors_[region], toVdb(p)).value() / fields_.voxelSize;
}

JunctionDistances::Sample JunctionDistances::sample(std::size_t region, const V3d& p) const {
  const SampleBlock<4> block(accessors_[region], toVdb(p));
  return {block.value() / fields_.voxelSize, toImath(block.gradient()) / fields_.voxelSize};
}

/// Function that is zero on the interface between two regions. A fixed one bounds it alone.
JunctionDistances::Sample JunctionDistances::interface(std::size_t a, std::size_t b,
                                                       const V3d& p) const {
  if (fields_.isFixed[a]) return sample(a, p);
  if (fields_.isFixed[b]) return sample(b, p);
  const Sample u = sample(a, p), v = sample(b, p);
  return {(u.value - v.value) / 2, (u.gradient - v.gradient) / 2};
}

/// Finds the point closest to `from` at which regions meet: a surface for two, a curve for three.
std::optional<V3d> JunctionDistances::closest(const V3d& from, const V3d& start,
                                              std::span<const std::size_t> meeting) const {
  const auto count = static_cast<Eigen::Index>(meeting.size() - 1);
  V3d p = start;
  for (int n = 0; n < kMeetingIterations; ++n) {
    // At most three functions, so that no memory is allocated.
    Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 3, 3> slopes(count, 3);
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> values(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Sample f = interface(meeting[0], meeting[static_cast<std::size_t>(i) + 1], p);
      if (!(f.gradient.length2() > 0.01)) return {};
      values[i] = f.value;
      for (int k = 0; k < 3; ++k) slopes(i, k) = f.gradient[k];
    }
    // Onto the linear functions, along the directions that they leave free towards `from`.
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3> square =
        slopes * slopes.transpose();
    if (!(std::abs(square.determinant()) > 1e-4)) return {};
    const Eigen::Vector3d away(from.x - p.x, from.y - p.y, from.z - p.z);
    const Eigen::Vector3d move =
        away - slopes.transpose() * square.inverse() * (slopes * away + values);
    const double length = move.norm(), part = std::min(1.0, kLongestMove / length);
    p += V3d(move[0], move[1], move[2]) * (length > 0 ? part : 0);
    if (length < kMeetingConverged) return p;
  }
  return {};
}

/// Finds another region that owns a point at which regions should meet.
std::optional<std::size_t> JunctionDistances::intruder(const V3d& p,
                                                       std::span<const std::size_t> meeting,
                                                       std::span<const std::size_t> regions) const {
  double own = std::numeric_limits<double>::infinity();
  for (const std::size_t region : meeting)
    if (!fields_.isFixed[region]) own = std::min(own, value(region, p));
  std::optional<std::size_t> found;
  double most = kOwnerTie;
  for (const std::size_t region : regions) {
    if (std::find(meeting.begin(), meeting.end(), region) != meeting.end()) continue;
    const double other = value(region, p), excess = fields_.isFixed[region] ? -other : own - other;
    if (!(excess > most)) continue;
    most = excess;
    found = region;
  }
  return found;
}

void JunctionDistances::find(const openvdb::Coord& at, std::span<const std::size_t> regions,
                             std::vector<double>& distances) {
  const V3d from(at[0], at[1], at[2]);
  distances.assign(regions.size(), -1);
  for (std::size_t i = 0; i < regions.size(); ++i)
    for (std::size_t j = i + 1; j < regions.size(); ++j) {
      if (fields_.isFixed[regions[i]] && fields_.isFixed[regions[j]]) continue;
      std::vector<std::size_t> meeting = {regions[i], regions[j]};
      // The function of a fixed region does not depend on the other one, so it comes second.
      if (fields_.isFixed[meeting[0]]) std::swap(meeting[0], meeting[1]);
      V3d p = from;
      bool isFound = false;
      while (meeting.size() <= kMostMeeting) {
        const std::optional<V3d> next = closest(from, p, meeting);
        if (!next) break;
        p = *next;
        if (!(value(meeting[0], p) < kLargestValue)) break;
        const std::optional<std::size_t> other = intruder(p, meeting, regions);
        if (!other) {
          isFound = true;
          break;
        }
        meeting.push_back(*other);
      }
      if (!isFound) continue;
      const double distance = (p - from).length();
      for (const std::size_t n : {i, j})
        if (distances[n] < 0 || distance < distances[n]) distances[n] = distance;
    }
}

}  // namespace levelset
