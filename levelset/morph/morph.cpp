#include "levelset/morph/morph.h"

#include <fmt/core.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "levelset/distance/distance_transform.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/error.h"
#include "levelset/inspect/compare.h"
#include "levelset/morph/speed_morph_vdb.h"
#include "levelset/transform/resample.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::FloatGrid;
using openvdb::FloatTree;
using TreeManager = openvdb::tree::LeafManager<FloatTree>;
using LeafNode = FloatTree::LeafNodeType;

// First guess of the largest distance between the surfaces of solid and target, voxels; doubled
// until it suffices. Also the least accepted distance limit.
constexpr double kFirstReach = 8;
// Progress (0 to 1) after the target is resampled, and after the distances are computed.
constexpr double kUntilResampled = 0.05, kUntilDistances = 0.4;
// Distances must extend this many voxels beyond the points that the surface passes during the
// morph, so that interpolation reads no background values.
constexpr double kBesideSurface = 4;

void checkMorph(const NarrowBand& solid, const NarrowBand& target, const MorphOptions& options) {
  if (options.mask) checkMask(*options.mask);
  if (options.mask && options.method == MorphMethod::Speed)
    throw UsageError("a mask applies only to the method distances; leave out the mask");
  if (options.farthest && !(*options.farthest >= kFirstReach && std::isfinite(*options.farthest)))
    throw UsageError(fmt::format(
        "the morph computes distances up to {} voxels from the surfaces, which is too small; "
        "give at least {}",
        *options.farthest, kFirstReach));
  if (options.steps < 1)
    throw UsageError(fmt::format("the number of steps is {}; give at least 1", options.steps));
  if (!(options.until > 0 && options.until <= 1))
    throw UsageError(fmt::format(
        "the last fraction of the morph is {}; give a number above 0 and up to 1", options.until));
  if (options.tolerance && !(*options.tolerance > 0 && std::isfinite(*options.tolerance)))
    throw UsageError(
        fmt::format("the tolerance is {}; give a positive length", *options.tolerance));
  requireSolid(solid);
  requireSolid(target);
  if (solid.isEmpty() || target.isEmpty())
    throw InvalidInput(
        fmt::format("the {} is empty; give two solids", solid.isEmpty() ? "solid" : "target"));
}

/// Signed distances to the solid (`from`) and to the target (`to`), on the same blocks of one grid.
struct DistancePair {
  FloatGrid::Ptr from, to;

  void shareBlocks() {
    from->tree().topologyUnion(to->tree());
    to->tree().topologyUnion(from->tree());
  }

  /// Returns true when a grid point inside exactly one solid has a distance above `reach` −
  /// kBesideSurface voxels: distances computed up to `reach` do not suffice.
  [[nodiscard]] bool fallsShort(double reach) const {
    const auto limit = static_cast<float>((reach - kBesideSurface) * from->voxelSize()[0]);
    std::atomic<bool> found = false;
    TreeManager manager(from->tree());
    manager.foreach ([&](LeafNode& a, std::size_t) {
      if (found) return;
      const LeafNode& b = *to->tree().probeConstLeaf(a.origin());
      for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) {
        const float x = a.getValue(n), y = b.getValue(n);
        if ((x < 0) != (y < 0) && (std::abs(x) > limit || std::abs(y) > limit)) found = true;
      }
    });
    return found;
  }

  /// Computes the field whose zero set is the surface at the fraction `part` of the morph. A mask
  /// scales the fraction at each point.
  [[nodiscard]] FloatGrid::Ptr at(double part, const std::optional<Mask>& mask) const {
    FloatGrid::Ptr result = from->deepCopy();
    const auto everywhere = static_cast<float>(part);
    const float farInside = from->background(),
                onSide = 1e-3f * static_cast<float>(from->voxelSize()[0]);
    TreeManager manager(result->tree());
    manager.foreach ([&](LeafNode& leaf, std::size_t) {
      const float* b = to->tree().probeConstLeaf(leaf.origin())->buffer().data();
      float* values = leaf.buffer().data();
      for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) {
        float s = everywhere;
        if (mask) {
          const openvdb::Vec3d p = from->indexToWorld(leaf.offsetToGlobalCoord(n));
          s *= static_cast<float>(mask->weight({p.x(), p.y(), p.z()}));
        }
        const float mixed = (1 - s) * values[n] + s * b[n];
        // A point beyond the computed distances both inside the solid and outside the target has
        // the values −background and +background. At the fraction 0.5 of the morph their mean is 0;
        // count the point as inside.
        values[n] = mixed == 0 && values[n] <= -farInside ? -onSide : mixed;
      }
    });
    return result;
  }
};

/// Computes the band at the fraction `part` of the morph.
/// @param distances  redistances a field to the half width of the solid
NarrowBand intermediate(const DistancePair& pair, double part, const MorphOptions& options,
                        const std::function<FloatGrid::Ptr(const FloatGrid&)>& distances) {
  const FloatGrid::Ptr field = pair.at(part, options.mask);
  if (!eikonal::hasZeroCrossing(field->tree()))
    throw InvalidInput(fmt::format(
        "the solid vanishes at fraction {:.3g} of the morph, because it does not overlap "
        "the target; move one of them until they overlap{}",
        part,
        options.until == 1 && !options.mask ? ", or give --steps 1, which returns the target"
                                            : ""));
  return makeBand(distances(*field));
}

}  // namespace

NarrowBand morph(const NarrowBand& solid, const NarrowBand& target, const MorphOptions& options) {
  checkMorph(solid, target, options);
  const NarrowBand goal =
      resampleLike(target, solid,
                   {.maxMemory = options.maxMemory,
                    .progress = subProgress(options.progress, 0, kUntilResampled)});
  // During the morph the surface stays in the box around the active voxels of both solids.
  openvdb::CoordBBox region = vdb(solid).evalActiveVoxelBoundingBox();
  region.expand(vdb(goal).evalActiveVoxelBoundingBox());
  region.expand(static_cast<int>(kBesideSurface));
  const auto distances = [&](const FloatGrid& field, double halfWidth, double from, double to,
                             const std::optional<openvdb::CoordBBox>& within = {}) {
    eikonal::DistanceRequest request;
    request.halfWidth = halfWidth;
    request.region = within;
    request.maxMemory = options.maxMemory;
    request.progress = subProgress(options.progress, from, to);
    return eikonal::distanceTransform(field, request);
  };

  // === Distances wherever the surface will pass
  DistancePair pair;
  const bool isOnTarget = options.until == 1 && !options.mask;
  const bool isFast = options.method == MorphMethod::Speed;
  if (isFast) requireOverlap(vdb(solid), vdb(goal));
  // The result is the target itself.
  const bool isDirect = isOnTarget && options.steps == 1 && !isFast;
  double done = kUntilResampled;
  for (double reach = options.farthest.value_or(kFirstReach); !isDirect; reach *= 2) {
    // Each attempt with a doubled `reach` takes about as long as all earlier attempts together, so
    // it gets half of the remaining progress.
    const double half = (done + kUntilDistances) / 2, quarter = (done + half) / 2;
    pair.from = distances(vdb(solid), reach, done, quarter, region);
    pair.to = distances(vdb(goal), reach, quarter, half, region);
    done = half;
    pair.shareBlocks();
    if (options.farthest || !pair.fallsShort(reach)) break;
  }

  // === Steps of the morph
  std::optional<SpeedMorph> moving;
  if (isFast) moving.emplace(*pair.from, *pair.to, options.maxMemory);
  NarrowBand result;
  const auto fractionOf = [&](int step) {
    return kUntilDistances + (1 - kUntilDistances) * step / options.steps;
  };
  const auto surfaceAt = [&](double part, int i) {
    const double from = fractionOf(i - 1), to = fractionOf(i);
    if (moving) {
      const Progress progress = subProgress(options.progress, from, to);
      if (part == 1)
        moving->converge(progress);
      else
        moving->advanceTo(-std::log1p(-part), progress);
      return makeBand(moving->surface(solid.halfWidth()));
    }
    if (part == 1 && isOnTarget) return goal;
    return intermediate(pair, part, options, [&](const FloatGrid& field) {
      return distances(field, solid.halfWidth(), from, to);
    });
  };
  for (int i = 1; i <= options.steps; ++i) {
    const double part = options.until * i / options.steps;
    result = surfaceAt(part, i);
    if (options.keep) options.keep(result, i);
    report(options.progress, fractionOf(i));
    if (options.tolerance && part < 1 && compare(result, goal).hausdorff() <= *options.tolerance)
      break;
  }
  return result;
}

}  // namespace levelset
