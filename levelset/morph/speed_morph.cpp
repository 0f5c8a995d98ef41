#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "levelset/components/regions.h"
#include "levelset/distance/distance_transform.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/error.h"
#include "levelset/hamilton_jacobi/cut_off.h"
#include "levelset/hamilton_jacobi/normal_motion_vdb.h"
#include "levelset/morph/speed_morph_vdb.h"

namespace levelset {
namespace {

using SpeedLeaf = openvdb::FloatTree::LeafNodeType;

// Cut-off of the fifth-order scheme, voxels [Brodersen07]: the speed is full up to kFullSpeed and
// zero at the end of the working band.
constexpr double kFullSpeed = 3, kWorkingWidth = 6;
// Travel of the surface before the band is redistanced, voxels.
constexpr double kSpeedTravel = 1;
// Longest step: the Courant number in three dimensions, and the time in which V = φ − φ_target may
// change by itself, since V_t ≈ −V.
constexpr double kSpeedCourant = 0.3, kSpeedRelaxation = 0.2;
// The morph is steady when the speed beside the surface is below kSettled voxels, or when no grid
// point has changed sides for kPatience units of time. e⁻⁵ is below 0.01.
constexpr double kSettled = 0.01, kPatience = 5;
// Largest distance from the target, voxels, that a steady surface may have.
constexpr double kArrived = 1;

std::vector<const SpeedLeaf*> leavesOf(const openvdb::FloatGrid& grid) {
  std::vector<const SpeedLeaf*> leaves;
  grid.tree().getNodes(leaves);
  return leaves;
}

/// Copies the values of `field` to the leaves of `like`.
openvdb::FloatGrid::Ptr onLeavesOf(const openvdb::FloatGrid& like,
                                   const openvdb::FloatGrid& field) {
  const openvdb::FloatGrid::Ptr result = like.deepCopy();
  std::vector<SpeedLeaf*> leaves;
  result->tree().getNodes(leaves);
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    const openvdb::FloatGrid::ConstAccessor accessor(field.tree());
    for (openvdb::Index n = 0; n < SpeedLeaf::SIZE; ++n)
      leaves[i]->setValueOnly(n, accessor.getValue(leaves[i]->offsetToGlobalCoord(n)));
  });
  return result;
}

/// Returns true when a grid point changed sides between two fields of the same topology.
bool changedSides(const openvdb::FloatGrid& before, const openvdb::FloatGrid& after) {
  const auto a = leavesOf(before), b = leavesOf(after);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (openvdb::Index n = 0; n < SpeedLeaf::SIZE; ++n)
      if ((a[i]->getValue(n) < 0) != (b[i]->getValue(n) < 0)) return true;
  return false;
}

double cutOffAt(double phi, double voxelSize) {
  return flow::cutOff(phi, kFullSpeed * voxelSize, kWorkingWidth * voxelSize);
}

}  // namespace

void requireOverlap(const openvdb::FloatGrid& solid, const openvdb::FloatGrid& target) {
  const RegionMap map(target);
  const std::vector<Region>& regions = map.regions();
  std::vector<char> overlaps(regions.size(), 0);
  overlaps[RegionMap::kInfinite] = 1;
  openvdb::FloatGrid::ConstAccessor accessor = solid.getConstAccessor();
  for (auto it = map.labels().cbeginValueAll(); it; ++it) {
    const auto region = static_cast<std::size_t>(*it);
    if (overlaps[region]) continue;
    openvdb::CoordBBox box;
    it.getBoundingBox(box);
    for (auto c = box.begin(); c && !overlaps[region]; ++c)
      overlaps[region] = (accessor.getValue(*c) < 0) == regions[region].inside;
  }
  for (std::size_t i = 0; i < regions.size(); ++i)
    if (!overlaps[i])
      throw InvalidInput(
          regions[i].inside
              ? "a connected part of the target does not overlap the solid, and the speed method "
                "cannot reach it; move one of them until they overlap, or use --method distances"
              : "a cavity of the target lies inside the solid, and the speed method cannot open "
                "it; "
                "use --method distances");
}

SpeedMorph::SpeedMorph(const openvdb::FloatGrid& solid, const openvdb::FloatGrid& target,
                       std::size_t maxMemory)
    : target_(target), maxMemory_(maxMemory), phi_(solid.deepCopy()) {
  redistance();
}

openvdb::FloatGrid::Ptr SpeedMorph::surface(double halfWidth) const {
  eikonal::DistanceRequest request;
  request.halfWidth = halfWidth;
  request.maxMemory = maxMemory_;
  return eikonal::distanceTransform(*phi_, request);
}

void SpeedMorph::redistance() {
  if (!eikonal::hasZeroCrossing(phi_->tree()))
    throw InvalidInput(
        "the solid vanishes during the morph, because it hardly overlaps the target; move one of "
        "them until they overlap");
  phi_ = surface(kWorkingWidth);
  goal_ = onLeavesOf(*phi_, target_);
  travelled_ = 0;
}

double SpeedMorph::largestSpeed(double width) const {
  const double h = phi_->voxelSize()[0];
  const auto phi = leavesOf(*phi_), goal = leavesOf(*goal_);
  std::vector<double> largest(phi.size(), 0);
  tbb::parallel_for(std::size_t{0}, phi.size(), [&](std::size_t i) {
    for (auto it = phi[i]->cbeginValueOn(); it; ++it) {
      const auto value = static_cast<double>(*it);
      if (std::abs(value) < width * h)
        largest[i] = std::max(
            largest[i], cutOffAt(value, h) *
                            std::abs(value - static_cast<double>(goal[i]->getValue(it.pos()))));
    }
  });
  double result = 0;
  for (const double speed : largest) result = std::max(result, speed);
  return result / h;
}

void SpeedMorph::step(double longest) {
  const double h = phi_->voxelSize()[0], fastest = largestSpeed(kWorkingWidth);
  double dt = std::min(longest, kSpeedRelaxation);
  if (fastest * dt > kSpeedCourant) dt = kSpeedCourant / fastest;
  const flow::NormalMotion motion{*goal_,
                                  [h](double phi, double goal) {
                                    return flow::NormalTerms{cutOffAt(phi, h) * (phi - goal), 0};
                                  },
                                  false};
  const openvdb::FloatGrid::Ptr moved = flow::normalStep(*phi_, motion, {}, dt);
  time_ += dt;
  if (changedSides(*phi_, *moved)) lastChange_ = time_;
  phi_ = moved;
  travelled_ += fastest * dt;
  if (travelled_ >= kSpeedTravel) redistance();
}

void SpeedMorph::advanceTo(double time, const Progress& progress) {
  const double from = time_;
  while (time_ < time) {
    // A rest that rounding leaves is no step.
    if (time - time_ < 1e-12 * time) break;
    step(time - time_);
    report(progress, std::min(1.0, (time_ - from) / (time - from)));
  }
}

void SpeedMorph::converge(const Progress& progress) {
  const double from = time_;
  while (largestSpeed(1) > kSettled && time_ - std::max(lastChange_, from) < kPatience) {
    step(kSpeedRelaxation);
    report(progress, 1 - std::exp(from - time_));
  }
  redistance();
  if (const double left = largestSpeed(1); left > kArrived)
    throw NumericalError(fmt::format(
        "the morph is steady {:.3g} voxels from the target; give smaller voxels, or use "
        "--method distances",
        left));
}

}  // namespace levelset
