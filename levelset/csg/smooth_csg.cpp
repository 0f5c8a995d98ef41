#include "levelset/csg/smooth_csg.h"

#include <fmt/core.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "levelset/csg/csg_vdb.h"
#include "levelset/csg/seam_operands.h"
#include "levelset/distance/distance_transform.h"
#include "levelset/distance/redistance.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/error.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using SmoothLeaf = openvdb::FloatTree::LeafNodeType;

// Distance up to which the operands are read, as a multiple of the radius K. On the smooth surface
// the smaller distance is at most K/4, and the other one at most K larger.
constexpr double kReadRadii = 1.25;

/// Returns an index box that contains all grid points within `extent` voxels of the zero set of a
/// solid.
CoordBBox boxAround(const FloatGrid& grid, double extent) {
  CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (!box.empty()) box.expand(static_cast<int>(std::ceil(std::min(extent, 1e8))));
  return box;
}

/// Returns the distances to a solid, up to `width` voxels, inside a box of grid points.
FloatGrid::Ptr widenedIn(const CoordBBox& box, const NarrowBand& solid, double width,
                         const SmoothCsgOptions& options, const Progress& progress) {
  if (solid.halfWidth() >= width) return vdb(solid).deepCopy();
  eikonal::DistanceRequest request;
  request.halfWidth = width;
  request.region = box;
  request.maxMemory = options.maxMemory;
  request.progress = progress;
  return eikonal::distanceTransform(vdb(solid), request);
}

/// Replaces the plain minimum in `field` by the smooth one where both operands have distances that
/// differ by less than the radius K.
/// @param width   distance up to which `a` and `b` contain distances, world units
/// @return        the number of changed values
std::size_t applySmoothMinimum(FloatGrid& field, const FloatGrid& a, const FloatGrid& b,
                               const CsgSigns& signs, double radius, double width) {
  std::set<Coord> origins;
  for (auto leaf = a.tree().cbeginLeaf(); leaf; ++leaf)
    if (b.tree().probeConstLeaf(leaf->origin())) origins.insert(leaf->origin());
  const float background = field.background();
  std::size_t changed = 0;
  for (const Coord& origin : origins) {
    const SmoothLeaf& leafA = *a.tree().probeConstLeaf(origin);
    const SmoothLeaf& leafB = *b.tree().probeConstLeaf(origin);
    SmoothLeaf* target = nullptr;
    for (openvdb::Index n = 0; n < SmoothLeaf::SIZE; ++n) {
      const double u = signs.first * leafA.getValue(n), v = signs.second * leafB.getValue(n);
      const double gap = radius - std::abs(u - v);
      if (!(gap > 0) || std::abs(u) >= width || std::abs(v) >= width) continue;
      const double smooth = signs.result * (std::min(u, v) - gap * gap / (4 * radius));
      if (std::abs(smooth) >= background) {
        // Outside the band of the result only the sign matters.
        const float hard = field.tree().getValue(origin + SmoothLeaf::offsetToLocalCoord(n));
        if (std::abs(hard) >= background && (hard < 0) == (smooth < 0)) continue;
      }
      if (!target) target = field.tree().touchLeaf(origin);
      ++changed;
      if (std::abs(smooth) < background)
        target->setValueOn(n, static_cast<float>(smooth));
      else
        target->setValueOff(n, static_cast<float>(std::copysign(background, smooth)));
    }
  }
  return changed;
}

void checkOperands(const NarrowBand& a, const NarrowBand& b, const SmoothCsgOptions& options) {
  if (!std::isfinite(options.radius) || options.radius < 0)
    throw UsageError(
        fmt::format("the radius is {}; give a length of zero or more", options.radius));
  requireSolid(a);
  requireSolid(b);
  if (a.isEmpty() || b.isEmpty())
    throw InvalidInput("one of the solids is empty; give two solids with a surface");
}

}  // namespace

CsgResult smoothCombine(CsgOperation operation, const NarrowBand& first, const NarrowBand& second,
                        const SmoothCsgOptions& options) {
  checkOperands(first, second, options);

  // === Plain CSG, which is the result where the distances differ by K or more
  const solids::SeamOperands operands =
      solids::onOneGrid(first, second, {options.maxMemory, subProgress(options.progress, 0, 0.2)});
  const std::array<NarrowBand, 2> pair = {operands.a, operands.b};
  CsgResult result = combine(
      operation, pair,
      {.maxMemory = options.maxMemory, .progress = subProgress(options.progress, 0.2, 0.4)});
  result.notes.insert(result.notes.begin(), operands.notes.begin(), operands.notes.end());
  if (options.radius == 0) return result;

  // === Distances of both operands, as far as the smooth surface and its stencils need them
  const double voxel = result.band.voxelSize();
  const double width = kReadRadii * options.radius / voxel + kReadBySurface + 2;
  CoordBBox box = boxAround(vdb(operands.a), width);
  box.intersect(boxAround(vdb(operands.b), width));
  if (box.empty()) return result;
  FloatGrid::Ptr a, b;
  try {
    a = widenedIn(box, operands.a, width, options, subProgress(options.progress, 0.4, 0.55));
    b = widenedIn(box, operands.b, width, options, subProgress(options.progress, 0.55, 0.7));
  } catch (const InvalidInput&) {
    return result;  // an operand has no surface in the box
  }

  // === The smooth minimum, and distances to its zero set
  const FloatGrid::Ptr field = vdb(result.band).deepCopy();
  const double known = std::min<double>(a->background(), b->background());
  if (applySmoothMinimum(*field, *a, *b, csgSigns(operation), options.radius, known) == 0)
    return result;
  if (!eikonal::hasZeroCrossing(field->tree()))
    throw InvalidInput(fmt::format("the result is empty with a radius of {}; give a smaller radius",
                                   options.radius));
  eikonal::DistanceRequest request;
  request.halfWidth = result.band.halfWidth();
  request.maxMemory = options.maxMemory;
  request.progress = subProgress(options.progress, 0.7, 1);
  result.band = makeBand(eikonal::distanceTransform(*field, request));
  return result;
}

template <CsgOperation operation>
NarrowBand SmoothCsgOperator<operation>::run(std::vector<NarrowBand> operands,
                                             const Options& options, OperatorRun& run) {
  CsgResult result = smoothCombine(
      operation, operands[0], operands[1],
      {.radius = options.radius, .maxMemory = run.maxMemory, .progress = run.progress});
  run.notes = std::move(result.notes);
  return std::move(result.band);
}

template <CsgOperation operation>
ValuePlan SmoothCsgOperator<operation>::plan(const Options&, Plans operands, const OperatorRun&) {
  return planCombined(operation, operands);
}

template struct SmoothCsgOperator<CsgOperation::Union>;
template struct SmoothCsgOperator<CsgOperation::Intersection>;
template struct SmoothCsgOperator<CsgOperation::Difference>;

namespace {

constexpr const char* kSmoothDetails =
    "The surface is the zero set of a smooth minimum (or maximum) of both exact distances. It "
    "differs from the plain result only where the distances to both solids differ by less than the "
    "radius, and by a quarter of the radius at most. Unlike 'blend', it joins solids that do not "
    "touch where the gap is below half the "
    "radius.";

}  // namespace

const OperatorText SmoothUnionOperator::text{
    .name = "smooth-union",
    .group = "Solids",
    .summary = "union of two solids with a smooth seam",
    .details = kSmoothDetails,
    .example =
        "levelsmith sphere --radius 1 --voxel 0.05 ! sphere --radius 0.7 --center 1.3,0,0 --voxel "
        "0.05 ! smooth-union --radius 0.4 ! measure"};

const OperatorText SmoothIntersectionOperator::text{
    .name = "smooth-intersection",
    .group = "Solids",
    .summary = "intersection of two solids with a smooth edge",
    .details = kSmoothDetails,
    .example =
        "levelsmith sphere --radius 1 --voxel 0.05 ! sphere --radius 1 --center 1.2,0,0 --voxel "
        "0.05 ! smooth-intersection --radius 0.2 ! measure"};

const OperatorText SmoothDifferenceOperator::text{
    .name = "smooth-difference",
    .group = "Solids",
    .summary = "the first solid minus the second, with a smooth edge",
    .details = kSmoothDetails,
    .example =
        "levelsmith sphere --radius 1 --voxel 0.05 ! sphere --radius 0.7 --center 1.1,0,0 --voxel "
        "0.05 ! smooth-difference --radius 0.2 ! measure"};

}  // namespace levelset
