#include "levelset/csg/fillet.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/csg/csg_vdb.h"
#include "levelset/csg/seam_curve.h"
#include "levelset/distance/distance_transform.h"
#include "levelset/distance/surface/interpolant.h"
#include "levelset/memory/memory_limit.h"

namespace levelset::solids {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;

constexpr double kLeastRadius = 0.5;  // voxels: the grid cannot represent a smaller ball
// Largest cosine between the normals of the two surfaces at the seam. Surfaces with more similar
// normals form no edge there.
constexpr double kSameCosine = 0.9995;
// Search for the centre of the ball on its spine, the curve of all centres: number of steps,
// length below which a step is the last, and longest step.
constexpr int kSpineSteps = 16;
constexpr double kSpineTolerance = 1e-3;  // voxels
constexpr double kLongestSpineStep = 4;   // voxels
// Lower bound of a quotient in findBall(): decrease of the distance to the grid point along the
// spine, divided by the length of the step. It is larger where the spine has a unique nearest
// point.
constexpr double kLeastShrinkage = 0.05;
// The tricubic interpolation at a point reads values up to this distance, voxels.
constexpr double kStencil = 4;
// Largest distance of the seam from the line in which the tangent planes at the two contact points
// of the ball intersect: kSeamShare × radius of the ball + kSeamSlack voxels. Farther from the
// seam, the surfaces face each other without intersecting.
constexpr double kSeamShare = 0.75, kSeamSlack = 2;

/// A position of the rolling ball, in index space.
struct Ball {
  /// Centre, and unit gradients of the distances to both solids there.
  Vec3d centre, normalA, normalB;
  /// Cosine of the angle between the normals, and radius in voxels.
  double cosine = 0, radius = 0;
};

/// Radius of the ball, `reach` (largest distance from the seam to the middle of the arc) and limits
/// of the fillet, in voxels.
struct FilletSize {
  double radius, reach;
  /// Upper bound of the distance from the seam to a contact point of the ball; infinite: not set.
  double bound = HUGE_VAL;

  /// Returns the radius r of the ball between surfaces whose normals have this cosine and which
  /// meet at the angle θ. The middle of its arc is r (1 / sin(θ/2) − 1) from the seam, and at most
  /// `reach`.
  [[nodiscard]] double radiusAt(double cosine) const {
    const double sine = std::sqrt(std::max(0.0, (1 + cosine) / 2));
    return std::min(radius, reach * sine / (1 - sine));
  }
  /// Returns the largest distance from the seam at which the surface changes: r / tan(θ/2), at the
  /// angle θ where `reach` starts to limit the radius r, but at most `bound`.
  [[nodiscard]] double extent() const {
    const double sine = radius / (reach + radius);
    return std::min(bound, radius * std::sqrt(1 - sine * sine) / sine);
  }
};

/// Returns an upper bound of the distance between the seam and the contact points of a ball that
/// touches both solids, voxels. The seam lies in the bounding boxes of both solids, and the contact
/// points within `margin` of these boxes. So the diagonal of their common box with the margin is a
/// bound.
double boundOf(const FloatGrid& a, const FloatGrid& b, const FilletSize& size, double halfWidth) {
  openvdb::CoordBBox common = a.evalActiveVoxelBoundingBox();
  common.intersect(b.evalActiveVoxelBoundingBox());
  const double margin = 2 * size.radius + halfWidth + kStencil + 1;
  return (common.extents().asVec3d() + Vec3d(2 * margin)).length();
}

/// Computes the distances to one solid in a wide band around the seam, in voxels, positive on the
/// side of the ball.
FloatGrid::Ptr widened(const NarrowBand& solid, float sign, const PointSearch& curve,
                       const FilletSize& size, double halfWidth, const BlendOptions& options) {
  FloatGrid::Ptr part = cutOut(vdb(solid), curve, 2 * (size.extent() + halfWidth));
  eikonal::DistanceRequest request;
  request.halfWidth = 2 * size.radius + halfWidth + kStencil + 1;
  request.maxMemory = options.maxMemory;
  request.progress = options.progress;
  part = eikonal::distanceTransform(*part, request);
  if (sign > 0) return part;
  for (auto it = part->beginValueAll(); it; ++it) it.setValue(-*it);
  return part;
}

class BallRoller {
 public:
  BallRoller(const FloatGrid& a, const FloatGrid& b, const FilletSize& size,
             const PointSearch& curve)
      : readA_(a.getConstAccessor()),
        readB_(b.getConstAccessor()),
        a_(a.tree()),
        b_(b.tree()),
        known_(static_cast<double>(a.background()) - kStencil),
        size_(size),
        curve_(curve) {}

  /// Returns the signed distance from a grid point to the fillet, voxels, negative outside the
  /// ball. Empty where the fillet is not the nearest surface.
  std::optional<double> distance(const Coord& point, double halfWidth) {
    const double a = static_cast<double>(readA_.getValue(point)),
                 b = static_cast<double>(readB_.getValue(point));
    const double least = -halfWidth - 1, most = 2 * size_.radius + halfWidth + 1;
    if (a < least || b < least || a > most || b > most) return {};
    const Vec3d x = point.asVec3d();
    Ball ball;
    if (!findBall(x, ball)) return {};
    const Vec3d toCentre = ball.centre - x;
    const double p = toCentre.dot(ball.normalA), q = toCentre.dot(ball.normalB);
    // Outside the angle between the radii to the contact points, the fillet is not the nearest
    // surface.
    if (p < ball.cosine * q || q < ball.cosine * p) return {};
    const Vec3d edge =
        ball.centre - (ball.normalA + ball.normalB) * (ball.radius / (1 + ball.cosine));
    if (!levelset::isNear(curve_, toImath(edge), kSeamShare * ball.radius + kSeamSlack)) return {};
    return ball.radius - toCentre.length();
  }

 private:
  static eikonal::Jet jetAt(eikonal::DenseBlockCache& cache, const Vec3d& p) {
    const eikonal::DenseBlock& block = cache.around(p);
    return block.jet(p - block.origin().asVec3d());
  }

  /// Finds the ball whose centre is nearest to x. The centres s lie on the spine: a(s) = b(s) = r,
  /// with the distances a and b to both solids. Newton's method leads to the spine. Along it, the
  /// secant method is used: where the spine bends around x, the distance to x along the spine
  /// decreases by less than the step.
  bool findBall(const Vec3d& x, Ball& ball) {
    ball.centre = x;
    double before = 0, moved = 0, shrinkage = 1;
    for (int step = 0; step < kSpineSteps; ++step) {
      const eikonal::Jet a = jetAt(a_, ball.centre), b = jetAt(b_, ball.centre);
      if (std::abs(a.value) > known_ || std::abs(b.value) > known_) return false;
      ball.normalA = a.gradient;
      ball.normalB = b.gradient;
      if (!ball.normalA.normalize() || !ball.normalB.normalize()) return false;
      ball.cosine = ball.normalA.dot(ball.normalB);
      if (ball.cosine > kSameCosine) return false;
      ball.radius = size_.radiusAt(ball.cosine);
      if (ball.radius < kLeastRadius) return false;
      const double squaredSine = 1 - ball.cosine * ball.cosine;
      const double da = ball.radius - a.value, db = ball.radius - b.value;
      const Vec3d along = ball.normalA.cross(ball.normalB) / std::sqrt(squaredSine);
      const double remaining = along.dot(x - ball.centre);
      if (std::abs(moved) > kSpineTolerance)
        shrinkage = std::clamp((before - remaining) / moved, kLeastShrinkage, 2.0);
      Vec3d move = ball.normalA * ((da - ball.cosine * db) / squaredSine) +
                   ball.normalB * ((db - ball.cosine * da) / squaredSine) +
                   along * (remaining / shrinkage);
      const double length = move.length();
      if (!std::isfinite(length)) return false;
      if (length > kLongestSpineStep) move *= kLongestSpineStep / length;
      ball.centre += move;
      before = remaining;
      moved = along.dot(move);
      if (length < kSpineTolerance) return true;
    }
    return false;
  }

  FloatGrid::ConstAccessor readA_, readB_;
  eikonal::DenseBlockCache a_, b_;
  double known_;  ///< largest distance at which the interpolant of the distances is valid, voxels
  FilletSize size_;
  const PointSearch& curve_;
};

/// Returns the sorted origins of the leaf blocks that both distance grids contain and that lie
/// within `extent` voxels of the seam curve. Elsewhere no ball touches both solids.
std::vector<Coord> blocksBeside(const FloatTree& a, const FloatTree& b, const PointSearch& curve,
                                double extent) {
  std::vector<Coord> both;
  for (auto leaf = a.cbeginLeaf(); leaf; ++leaf)
    if (!leaf->isEmpty() && b.probeConstLeaf(leaf->origin())) both.push_back(leaf->origin());
  std::vector<char> isNear(both.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, both.size(), 64), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Vec3d centre = both[i].asVec3d() + Vec3d(3.5);
      isNear[i] = levelset::isNear(curve, toImath(centre), extent + 6.1);
    }
  });
  std::vector<Coord> found;
  for (std::size_t i = 0; i < both.size(); ++i)
    if (isNear[i]) found.push_back(both[i]);
  std::sort(found.begin(), found.end());
  return found;
}

struct FilletBlock {
  Coord origin;
  /// Changed grid points: buffer offset, and distance to the fillet in voxels, negative inside the
  /// result.
  std::vector<std::pair<openvdb::Index, float>> values;
};
// Memory of a FilletBlock with all its values, the spare capacity of its vector, and the leaf of
// the result.
constexpr double kBytesPerBlock = sizeof(FilletBlock) + 2 * 512 * 8 + 2300;

void putFillet(const std::vector<FilletBlock>& blocks, FloatGrid& solid) {
  const float background = solid.background();
  const auto scale = static_cast<float>(solid.voxelSize()[0]);
  for (const FilletBlock& block : blocks) {
    if (block.values.empty()) continue;
    LeafNode* leaf = solid.tree().touchLeaf(block.origin);
    for (const auto& [n, value] : block.values) {
      const float scaled = value * scale;
      if (std::abs(scaled) < background)
        leaf->setValueOn(n, scaled);
      else
        leaf->setValueOff(n, std::copysign(background, scaled));
    }
  }
  openvdb::tools::pruneLevelSet(solid.tree());
}

}  // namespace

void addFillet(CsgOperation operation, const SeamOperands& operands, double radius,
               const BlendOptions& options, CsgResult& result) {
  const bool adds = operation == CsgOperation::Union;
  if (options.side == (adds ? BlendSide::Remove : BlendSide::Add)) {
    result.notes.emplace_back(
        adds ? "the fillet of a union only adds material, so --side remove changes nothing"
             : "the fillet of an intersection or difference only removes material, so --side add "
               "changes nothing");
    return;
  }
  const double voxelSize = result.band.voxelSize(), halfWidth = result.band.halfWidth();
  FilletSize size{radius / voxelSize, options.reach.value_or(2 * radius) / voxelSize};
  size.bound = boundOf(vdb(operands.a), vdb(operands.b), size, halfWidth);
  const std::vector<Vec3d> curve = seamCurve(vdb(operands.a).tree(), vdb(operands.b).tree());
  if (curve.empty()) {
    result.notes.emplace_back("the surfaces do not intersect, so there is no crease to round");
    return;
  }
  if (size.radius < 1.5)
    result.notes.push_back(fmt::format(
        "the grid cannot represent a radius of {:.3g} voxels; use smaller voxels", size.radius));

  // === Distances up to the diameter of the ball from both solids
  const PointSearch tree = makePointSearch(curve);
  const CsgSigns signs = csgSigns(operation);
  const auto within = [&](double from, double to) {
    BlendOptions part = options;
    part.progress = subProgress(options.progress, from, to);
    return part;
  };
  const FloatGrid::Ptr a =
      widened(operands.a, signs.first, tree, size, halfWidth, within(0.4, 0.6));
  const FloatGrid::Ptr b =
      widened(operands.b, signs.second, tree, size, halfWidth, within(0.6, 0.8));

  // === Position of the ball for each grid point near the seam
  const std::vector<Coord> origins =
      blocksBeside(a->tree(), b->tree(), tree, size.extent() + halfWidth + 1);
  requireMemory(static_cast<double>(origins.size()) * kBytesPerBlock,
                memoryLimit(options.maxMemory));
  std::vector<FilletBlock> blocks(origins.size());
  constexpr std::size_t kBatch = 512;
  for (std::size_t begin = 0; begin < origins.size(); begin += kBatch) {
    const std::size_t end = std::min(origins.size(), begin + kBatch);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 8), [&](const auto& range) {
      BallRoller roller(*a, *b, size, tree);
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        blocks[i].origin = origins[i];
        for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) {
          const Coord c = origins[i] + LeafNode::offsetToLocalCoord(n);
          if (const std::optional<double> found = roller.distance(c, halfWidth))
            blocks[i].values.emplace_back(n, signs.result * static_cast<float>(*found));
        }
      }
    });
    report(options.progress,
           0.8 + 0.2 * static_cast<double>(end) / static_cast<double>(origins.size()));
  }
  putFillet(blocks, editVdb(result.band));
}

}  // namespace levelset::solids
