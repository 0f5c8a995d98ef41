#include "levelset/distance/moved/moved_surface.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "levelset/distance/surface/closest_point.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::Vec3d;
using LeafNode = openvdb::FloatTree::LeafNodeType;

// Another part of the surface counts as nearer if it is nearer by more than this, voxels.
constexpr double kNearer = 5e-4;
// The same for sharp patches, whose vertices are fitted to planes, and distance beyond that of the
// moved surface in which the patches are searched, voxels.
constexpr double kNearerPatch = 1e-3, kPastEnd = 1;
// Points of the surface within this distance of each other, voxels, belong to the same part.
constexpr double kSamePart = 0.75;
// A search near a crease starts from surface points whose distance differs from the shift by less
// than kStartOff, voxels, on up to kStartParts parts.
constexpr double kStartOff = 1;
constexpr std::size_t kStartParts = 4;
// Square of the largest distance of a surface point from the place where the surface is nearest to
// the point in question, voxels².
constexpr double kBetweenPoints = 8;
// Longest Newton step with the derivatives at a surface point, and its error, voxels.
constexpr double kStepOfJet = 2.5, kStepError = 0.1;
// Number of steps of the search for a point of the crease, and number of sets of parts to try.
constexpr int kMoves = 40, kSets = 6;
// The search fails after this many steps in a row none of which is the shortest so far.
constexpr int kStalled = 8;
// Number of searches for a foot point. Each starts where the search before it moved too far.
constexpr int kFollows = 4;
// A surface point is at most about this much farther than the closest point of its part, voxels.
constexpr double kSampleGap = 0.01;
// The search ends after a step of less than kLastMove voxels. No step is longer than kLongestMove.
constexpr double kLastMove = 1e-4, kLongestMove = 1;
// Least square root of the determinant of the scalar products of the unit normals at a crease: the
// sine of about 1° for two normals. The moved surface counts as smooth below it; the distance is
// then too small by less than 5e-5 of it.
constexpr double kLeastSine = 0.02;
// Parts that meet at less than 1° come nearer to the moved surface by less than this share of the
// distance. A larger gap shows that two searches have found the same foot point.
constexpr double kSmoothGap = 0.002;
// If a point of the moved surface is nearer to another plane face by a length, the crease is as far
// away as that length divided by the sine of the angle between the faces. On curved faces it is at
// most kCreaseFactor times as far. A length below kClose, voxels, is neglected if the search fails.
constexpr double kCreaseFactor = 3, kClose = 1e-4;
// Least such length that shows that a point is beside a crease, voxels.
constexpr double kBesideCrease = 0.05;
// Distance along each axis, voxels, from the place in question to the grid points whose nearest
// surface points nearerPart() and partsAround() look at.
constexpr double kAroundMeeting = 2;

/// Largest distance along each axis, voxels, from a grid point to its crease point. The nearest one
/// is within the half width if it matters. The rest is for searches that come to another one first.
double farthestMeeting(double shift, double halfWidth) {
  return 2 * halfWidth + std::max(8.0, std::abs(shift));
}

/// Largest distance along each axis, voxels, from a grid point to the foot points of its search.
double farthestFoot(double shift, double halfWidth) {
  return farthestMeeting(shift, halfWidth) + std::abs(shift) + 2 * halfWidth;
}

}  // namespace

MovedSurface::MovedSurface(const ZeroSet& surface, DenseBlockCache& cache, double shift,
                           double halfWidth)
    : cache_(cache),
      points_(surface.points),
      patches_(surface.patches),
      shift_(shift),
      halfWidth_(halfWidth) {}

double MovedSurface::reach(double shift, double halfWidth) {
  return farthestMeeting(shift, halfWidth) + kAroundMeeting;
}

double MovedSurface::fieldReach(double shift, double halfWidth) {
  // The last search for a foot point moves by up to two voxels. Its leaf extends by seven.
  return farthestFoot(shift, halfWidth) + 2 + 7 + DenseBlock::kPad;
}

/// Returns true if a point is within a distance of the grid point of the present search, along each
/// axis.
bool MovedSurface::isWithin(const Vec3d& point, double distance) const {
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::abs(point[axis] - gridPoint_[axis]) <= distance)) return false;
  return true;
}

MovedSurface::Search MovedSurface::distance(const NearestPoints::Block& block, openvdb::Index n,
                                            const Closest& closest) {
  const Vec3d x = (block.origin + LeafNode::offsetToLocalCoord(n)).asVec3d();
  gridPoint_ = x;
  const double sign = block.inside.isOn(n) ? -1 : 1;
  Vec3d normal = (x - closest.point) * sign;
  if (!(closest.distance > 1e-3)) normal = points_.jets[block.nearest[n]].jet().gradient;
  if (!normal.normalize()) return {};
  const double least = std::abs(sign * closest.distance - shift_);
  meetsPatches_ = false;

  std::vector<Vec3d> parts{closest.point}, seen = parts;
  Vec3d meeting = closest.point + normal * shift_;
  NearerPart nearer = nearerPart(block, meeting, parts);
  if (nearer.kind == Nearer::None) return {Result{least}};
  const Vec3d start = meeting;
  const double gap = std::abs(shift_) - nearer.distance;
  const bool isPart = nearer.kind == Nearer::Part;
  for (int i = 0; i < kSets && nearer.kind == Nearer::Part && parts.size() < kParts; ++i) {
    parts.push_back(nearer.point);
    seen.push_back(nearer.point);
    const Meeting kind = meetActive(x, parts, meeting);
    if (kind == Meeting::Smooth && gap < kSmoothGap * least + kNearer) return {Result{least}};
    if (kind == Meeting::Smooth) break;
    if (kind == Meeting::Failed) break;
    nearer = nearerPart(block, meeting, parts);
    const double found = (x - meeting).length();
    if (nearer.kind == Nearer::None && found > least - kNearer &&
        (meeting - start).length() < kCreaseFactor * gap / kLeastSine)
      return {nearestPair(block, x, start, seen, {found, CreasePoint{meeting, parts}})};
  }
  if (isPart && gap < kClose) return {Result{least}};
  return {std::nullopt, isPart && gap > kBesideCrease, meetsPatches_};
}

/// Where more than two parts are near, several creases are. Returns the nearest of `best` and of
/// the crease points of all pairs of parts.
/// @param start  start of the searches
MovedSurface::Result MovedSurface::nearestPair(const NearestPoints::Block& block, const Vec3d& x,
                                               const Vec3d& start, const std::vector<Vec3d>& feet,
                                               Result best) {
  if (feet.size() < 3) return best;
  for (std::size_t i = 0; i < feet.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      CreasePoint crease{start, {feet[i], feet[j]}};
      if (meetActive(x, crease.feet, crease.point) != Meeting::Found) continue;
      const double distance = (x - crease.point).length();
      if (distance < best.distance - kNearer &&
          nearerPart(block, crease.point, crease.feet).kind == Nearer::None)
        best = {distance, std::move(crease)};
    }
  return best;
}

std::optional<MovedSurface::Result> MovedSurface::distanceNear(const NearestPoints::Block& block,
                                                               openvdb::Index n,
                                                               const Vec3d& near) {
  gridPoint_ = (block.origin + LeafNode::offsetToLocalCoord(n)).asVec3d();
  const std::vector<Vec3d> feet = partsAround(block, near);
  std::optional<Result> best;
  for (std::size_t i = 0; i < feet.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      auto found = distanceFrom(block, n, {near, {feet[j], feet[i]}});
      if (found && (!best || found->distance < best->distance)) best = std::move(found);
    }
  return best;
}

/// Returns the closest points of the parts that are about as far from a point as the surface moves,
/// the nearest first.
std::vector<Vec3d> MovedSurface::partsAround(const NearestPoints::Block& block,
                                             const Vec3d& point) {
  std::vector<std::pair<double, std::uint32_t>> near;
  const Coord low = Coord::floor(point).offsetBy(-1);
  for (const Coord& c : openvdb::CoordBBox(low, low.offsetBy(3))) {
    const std::uint32_t number = NearestPoints::nearestAt(block, c);
    if (number == NearestPoints::kNone) continue;
    const double off = (points_.positions[number] - point).length() - std::abs(shift_);
    if (std::abs(off) < kStartOff) near.emplace_back(off, number);
  }
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  std::vector<Vec3d> feet;
  for (const auto& [off, number] : near) {
    Vec3d foot = points_.positions[number];
    const auto isKnown = [&] {
      return std::any_of(feet.begin(), feet.end(), [&](const Vec3d& other) {
        return (other - foot).lengthSqr() < kSamePart * kSamePart;
      });
    };
    if (isKnown() || !follow(foot, point) || isKnown()) continue;
    feet.push_back(foot);
    if (feet.size() == kStartParts) break;
  }
  return feet;
}

std::optional<MovedSurface::Result> MovedSurface::distanceFrom(const NearestPoints::Block& block,
                                                               openvdb::Index n,
                                                               CreasePoint start) {
  const Vec3d x = (block.origin + LeafNode::offsetToLocalCoord(n)).asVec3d();
  gridPoint_ = x;
  if (meetActive(x, start.feet, start.point) != Meeting::Found ||
      nearerPart(block, start.point, start.feet).kind != Nearer::None)
    return std::nullopt;
  return Result{(x - start.point).length(), std::move(start)};
}

/// As meet(), but drops the parts that do not decide where the nearest point is.
MovedSurface::Meeting MovedSurface::meetActive(const Vec3d& x, std::vector<Vec3d>& feet,
                                               Vec3d& meeting) {
  while (feet.size() > 1) {
    std::array<double, kParts> multipliers = {};
    const Meeting kind = meet(x, feet, meeting, multipliers);
    if (kind != Meeting::Found) return kind;
    const auto end = multipliers.begin() + static_cast<std::ptrdiff_t>(feet.size());
    const auto least = std::min_element(multipliers.begin(), end);
    if (*least > -kLastMove) return Meeting::Found;
    feet.erase(feet.begin() + (least - multipliers.begin()));
  }
  return Meeting::Failed;
}

/// Finds the part of the surface that is nearest to a point of the moved surface, and nearer than
/// the shift. Looks at the surface points of eight grid points around `at`, at least half a voxel
/// away along each axis: beside the border of two parts, a surface point may be of either part.
/// @param parts  a point on each part that is known already
MovedSurface::NearerPart MovedSurface::nearerPart(const NearestPoints::Block& block,
                                                  const Vec3d& at,
                                                  const std::vector<Vec3d>& parts) {
  const double distance = std::abs(shift_);
  const Coord low = Coord::floor(at - Vec3d(0.5));
  std::uint32_t last = NearestPoints::kNone;
  NearerPart nearest;
  double least = distance - kNearer;
  for (int corner = 0; corner < 8; ++corner) {
    const std::uint32_t point =
        NearestPoints::nearestAt(block, low.offsetBy(corner >> 1 & 2, corner & 2, corner << 1 & 2));
    if (point == NearestPoints::kNone) return {Nearer::Unknown};
    if (point == last) continue;
    last = point;
    const Vec3d start = points_.positions[point];
    const auto isKnown = [&](const Vec3d& p) {
      return std::any_of(parts.begin(), parts.end(), [&](const Vec3d& part) {
        return (p - part).lengthSqr() < kSamePart * kSamePart;
      });
    };
    if (isKnown(start)) continue;
    const bool mayBeNearer = (start - at).lengthSqr() < distance * distance + kBetweenPoints;
    if (points_.sharp[point]) {
      meetsPatches_ = true;
      const PatchDistance patch = patchDistance(at);
      if (patch == PatchDistance::Nearer) return {Nearer::Unknown};
      if (patch == PatchDistance::PastEnd && mayBeNearer) return {Nearer::Unknown};
      continue;
    }
    const Foot near = closestPointByOneStep(points_.jets[point].jet(), at, start, kStepOfJet);
    if (near.converged && (near.distance > distance + kStepError || isKnown(near.point))) continue;
    if (!near.converged && !mayBeNearer) continue;
    Vec3d foot = near.converged ? near.point : start;
    if (!follow(foot, at)) {
      // Near a centre of curvature, all surface points are about equally far.
      const bool isNearer = (start - at).length() < distance - kSampleGap;
      if (!mayBeNearer || (!isNearer && patchDistance(at) != PatchDistance::Nearer)) continue;
      return {Nearer::Unknown};
    }
    const double found = (at - foot).length();
    if (found >= least || isKnown(foot)) continue;
    if (!isOnOuterSide(foot, at))
      return {Nearer::Unknown};  // in another body, or beyond a thin wall
    least = found;
    nearest = {Nearer::Part, foot, found};
  }
  return nearest;
}

/// Compares the distance of a point from the sharp patches with that of the moved surface.
MovedSurface::PatchDistance MovedSurface::patchDistance(const Vec3d& at) const {
  const double distance = std::abs(shift_);
  const SharpPatches::Hit hit = patches_.nearest(at, distance + kPastEnd);
  if (hit.found && hit.distance < distance - kNearerPatch) return PatchDistance::Nearer;
  return hit.found && patches_.covers(Coord::floor(hit.point)) ? PatchDistance::Farther
                                                               : PatchDistance::PastEnd;
}

/// Returns true if a point lies on the side of the surface to which it moves.
/// @param foot  closest point of the surface
bool MovedSurface::isOnOuterSide(const Vec3d& foot, const Vec3d& point) {
  const DenseBlock& block = cache_.around(foot);
  Jet jet;
  block.slope(foot - block.origin().asVec3d(), jet);
  return (point - foot).dot(jet.gradient) * shift_ > 0;
}

/// Finds the point nearest to x among those that are as far from all parts as the surface moves.
/// The normals of the moved parts there span the vector from x to that point.
/// @param feet     a point on each part; becomes the closest point to `meeting`
/// @param meeting  start of the search
/// @param multipliers  factors of the normals; one below 0 shows that the nearest point of the
/// moved
///                     surface is nearer to the other parts only
MovedSurface::Meeting MovedSurface::meet(const Vec3d& x, std::vector<Vec3d>& feet, Vec3d& meeting,
                                         std::array<double, kParts>& multipliers) {
  const auto count = static_cast<Eigen::Index>(feet.size());
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> normals(3, count);
  Vec3d lastStep(0), lastTarget(0);
  double shortest = INFINITY;
  int stalled = 0;
  for (int i = 0; i < kMoves; ++i) {
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> right(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      Vec3d& foot = feet[static_cast<std::size_t>(k)];
      if (!follow(foot, meeting)) return Meeting::Failed;
      Vec3d n = meeting - foot;
      const double length = n.length();
      if (!(length > 0)) return Meeting::Failed;
      n /= length;
      normals.col(k) = Eigen::Vector3d(n.x(), n.y(), n.z());
      right[k] = std::abs(shift_) - length + n.dot(meeting - x);
    }
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3> gram =
        normals.transpose() * normals;
    // Opposite normals are those of a gap that has closed.
    if (!(gram.determinant() > kLeastSine * kLeastSine))
      return gram.minCoeff() > 0 ? Meeting::Smooth : Meeting::Failed;
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> along = gram.inverse() * right;
    const Eigen::Vector3d offset = normals * along;
    const Vec3d target = x + Vec3d(offset.x(), offset.y(), offset.z());
    Vec3d step = target - meeting;
    const double length = step.length();
    if (!std::isfinite(length)) return Meeting::Failed;
    if (length < kLastMove) {
      if (!isWithin(target, farthestMeeting(shift_, halfWidth_))) return Meeting::Failed;
      meeting = target;
      for (Eigen::Index k = 0; k < count; ++k) multipliers[static_cast<std::size_t>(k)] = along[k];
      return Meeting::Found;
    }
    stalled = length < shortest ? 0 : stalled + 1;
    if (stalled == kStalled) return Meeting::Failed;
    shortest = std::min(shortest, length);
    if (length > kLongestMove) step *= kLongestMove / length;
    // Anderson acceleration [Walker11]: the normals turn as the point moves along the crease, so
    // that the plain iteration converges slowly far from the crease.
    Vec3d next = meeting + step;
    if (i > 0 && length <= kLongestMove) {
      const Vec3d change = step - lastStep;
      const double squared = change.lengthSqr();
      const double mix = squared > 0 ? step.dot(change) / squared : 0;
      if (std::abs(mix) < 2) next -= (next - lastTarget) * mix;
    }
    lastStep = step;
    lastTarget = meeting + step;
    meeting = next;
  }
  return Meeting::Failed;
}

/// Moves a foot point to the closest point of the same part for `from`. Returns false where sharp
/// patches replace the interpolant.
bool MovedSurface::follow(Vec3d& foot, const Vec3d& from) {
  for (int i = 0; i < kFollows; ++i) {
    if (!isWithin(foot, farthestFoot(shift_, halfWidth_))) return false;
    const DenseBlock& block = cache_.around(foot);
    const Vec3d origin = block.origin().asVec3d();
    const Foot found = closestPoint(block, from - origin, foot - origin);
    if (!found.converged && !found.left) return false;
    foot = found.point + origin;
    if (!found.converged) continue;
    const bool isOnPatches = patches_.covers(Coord::floor(foot));
    meetsPatches_ |= isOnPatches;
    return !isOnPatches;
  }
  return false;
}

}  // namespace levelset::eikonal
