#include "levelset/points/surface/points_to_band.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/distance/distance_transform.h"
#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "levelset/points/field/meshless.h"
#include "levelset/points/field/multilevel_partition.h"
#include "levelset/points/field/oriented_points.h"
#include "levelset/points/field/rbf_field.h"
#include "levelset/points/surface/signed_field.h"

namespace levelset {
namespace {

using Imath::V3d;
using points::OrientedPoints;
using points::PointField;
using SupportLeaf = openvdb::FloatTree::LeafNodeType;

void checkOptions(const OrientedPoints& points, double voxelSize,
                  const PointsToBandOptions& options) {
  constexpr std::size_t kFewest = 6, kMost = 1000;
  if (options.neighbours != 0 && (options.neighbours < kFewest || options.neighbours > kMost))
    throw UsageError(fmt::format("the number of neighbours is {}; give {} to {}",
                                 options.neighbours, kFewest, kMost));
  if (options.neighbours != 0 && options.method == PointMethod::RadialBasis)
    throw UsageError("a radial basis function has no number of neighbours; leave it out");
  if (!std::isfinite(options.halfWidth) || options.halfWidth < 1)
    throw UsageError(
        fmt::format("the half width is {} voxels; give at least 1", options.halfWidth));
  if (!(options.tolerance > 0) || !std::isfinite(options.tolerance))
    throw UsageError(
        fmt::format("the tolerance is {} spacings; give a positive number", options.tolerance));
  if (!(options.lambda >= 0) || !std::isfinite(options.lambda))
    throw UsageError(fmt::format("lambda is {}; give 0 or more", options.lambda));
  const V3d size = points.box.size();
  checkVoxelSize(voxelSize, std::max({size.x, size.y, size.z}));
  double reach = 0;
  for (int axis = 0; axis < 3; ++axis)
    reach = std::max(reach, std::abs(points.centre[axis]) + size.length());
  if (!(reach / voxelSize < kIndexLimit))
    throw ResourceLimit(
        fmt::format("the points extend to {:.3g} voxels from the origin, beyond the range of "
                    "32-bit indices; use larger voxels or move the points to the origin",
                    reach / voxelSize));
}

PointField fieldOf(const OrientedPoints& points, const PointsToBandOptions& options) {
  const std::size_t neighbours =
      options.neighbours > 0 ? options.neighbours : defaultNeighbours(options.method);
  switch (options.method) {
    case PointMethod::Meshless:
      return points::meshless(points, neighbours, options.maxMemory,
                              subProgress(options.progress, 0.1, 0.3));
    case PointMethod::MovingLeastSquares:
      return points::movingLeastSquares(points, neighbours);
    case PointMethod::MultilevelPartition:
      return points::multilevelPartition(
          points, neighbours, options.tolerance * points.medianSpacing, options.maxMemory,
          subProgress(options.progress, 0.1, 0.3));
    case PointMethod::RadialBasis:
      return points::rbfField(points, {.tolerance = options.tolerance * points.medianSpacing,
                                       .lambda = options.lambda,
                                       .maxMemory = options.maxMemory,
                                       .progress = subProgress(options.progress, 0.1, 0.3)});
  }
  return {};
}

/// Support of the surface in one leaf of the band.
struct LeafSupport {
  double area = 0, unsupportedArea = 0, largestGap = 0;
};

/// Distance from a place on the surface to the closest point whose normal does not oppose that of
/// the surface, in spacings about that point. The far side of a thin sheet has no such point near.
double gapAt(const OrientedPoints& points, const V3d& at, const V3d& normal,
             std::vector<FoundItem>& found) {
  const FoundItem first = points.search.closest(at, std::numeric_limits<double>::infinity());
  if (points.normals[first.index].dot(normal) > 0)
    return std::sqrt(first.squared) / points.spacings[first.index];
  constexpr std::size_t kCandidates = 16;
  points.search.closest(at, kCandidates, found);
  for (const FoundItem& f : found)
    if (points.normals[f.index].dot(normal) > 0)
      return std::sqrt(f.squared) / points.spacings[f.index];
  constexpr double kFar = 10;  // farther than all of them
  return std::max(kFar, std::sqrt(found.back().squared) / points.spacings[found.back().index]);
}

/// Computes the distances from the surface to the cloud, at the grid points beside the surface.
LeafSupport supportOf(const openvdb::FloatGrid& band, const OrientedPoints& points,
                      SupportLeaf& leaf) {
  LeafSupport support;
  const double voxel = band.voxelSize()[0];
  auto read = band.getConstAccessor();
  std::vector<FoundItem> found;
  for (auto value = leaf.beginValueOn(); value; ++value) {
    const openvdb::Coord index = value.getCoord();
    const double phi = read.getValue(index);
    V3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      openvdb::Coord step(0);
      step[axis] = 1;
      gradient[axis] =
          (double{read.getValue(index + step)} - read.getValue(index - step)) / (2 * voxel);
    }
    const V3d at =
        voxel * V3d(index.x(), index.y(), index.z()) - points.centre - phi * gradient.normalized();
    const double gap = gapAt(points, at, gradient, found);
    value.setValue(static_cast<float>(gap));
    // The integral of a hat function of the distance is the area.
    const double area = voxel * voxel * (1 - std::abs(phi) / voxel);
    support.area += area;
    if (gap > kSupportRadius) support.unsupportedArea += area;
    support.largestGap = std::max(support.largestGap, gap);
  }
  return support;
}

/// Distances from the surface to the cloud. Adds their figures to the certificate.
FieldGrid supportField(const openvdb::FloatGrid& band, const OrientedPoints& points,
                       SupportCertificate& certificate) {
  auto grid = openvdb::FloatGrid::create(0);
  grid->setTransform(band.transform().copy());
  grid->setName("support");
  const double voxel = band.voxelSize()[0];
  for (auto leaf = band.tree().cbeginLeaf(); leaf; ++leaf) {
    std::optional<SupportLeaf> beside;
    for (auto value = leaf->cbeginValueOn(); value; ++value)
      if (std::abs(*value) < voxel) {
        if (!beside) beside.emplace(leaf->origin(), 0.0F);
        beside->setValueOn(value.pos(), 0);
      }
    if (beside) grid->tree().addLeaf(new SupportLeaf(*beside));
  }
  std::vector<SupportLeaf*> leaves;
  grid->tree().getNodes(leaves);
  std::vector<LeafSupport> supports(leaves.size());
  tbb::parallel_for(std::size_t{0}, leaves.size(),
                    [&](std::size_t i) { supports[i] = supportOf(band, points, *leaves[i]); });
  for (const LeafSupport& s : supports) {
    certificate.area += s.area;
    certificate.unsupportedArea += s.unsupportedArea;
    certificate.largestGap = std::max(certificate.largestGap, s.largestGap);
  }
  return importField(grid);
}

/// Adds the distances of the points from the surface.
void addResiduals(const NarrowBand& band, const OrientedPoints& points,
                  SupportCertificate& certificate) {
  const ScalarField distance = asScalarField(band);
  const double limit = band.halfWidth() * band.voxelSize();
  std::vector<float> residuals(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    residuals[i] = static_cast<float>(std::abs(distance(points.positions[i] + points.centre)));
  });
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum += residuals[i];
    if (residuals[i] >= limit || residuals[i] > points.spacings[i]) ++certificate.farPoints;
  }
  certificate.meanResidual = sum / static_cast<double>(points.size()) / points.medianSpacing;
}

}  // namespace

std::size_t defaultNeighbours(PointMethod method) {
  switch (method) {
    case PointMethod::Meshless:
      return 12;
    case PointMethod::MovingLeastSquares:
      return 16;
    case PointMethod::MultilevelPartition:
      return 15;
    case PointMethod::RadialBasis:
      return 1;
  }
  return 0;
}

std::string describe(const SupportCertificate& c) {
  return fmt::format(
      "{} points, spacing {:.3g}; {:.2g} % of the surface is a guess, the largest gap is {:.2g} "
      "spacings; points lie {:.2g} spacings from the surface in the mean, {} far from it",
      c.points, c.medianSpacing, 100 * c.unsupportedShare(), c.largestGap, c.meanResidual,
      c.farPoints);
}

PointsToBandResult pointsToBand(const PointCloud& cloud, double voxelSize,
                                const PointsToBandOptions& options) {
  report(options.progress, 0);
  const OrientedPoints points = points::orient(cloud, options.maxMemory);
  checkOptions(points, voxelSize, options);
  const double opposedShare =
      static_cast<double>(points.opposed) / static_cast<double>(points.size());
  if (opposedShare > kOpposedLimit && !options.acceptUnsupported)
    throw InvalidInput(fmt::format(
        "the normals of {:.0f} % of the points oppose those of their neighbours, so they do not "
        "tell inside from outside; compute them with `normals`, with more neighbours if the points "
        "are "
        "noisy, or accept them with --accept-sign",
        100 * opposedShare));
  report(options.progress, 0.1);
  PointField near = fieldOf(points, options);
  const std::size_t centres = near.centres;
  const points::SignedField field(points, std::move(near));
  points::SampleFrame frame{points.centre, points.box, voxelSize};
  constexpr double kMargin = 0.1;  // of the diagonal
  const V3d margin(kMargin * points.box.size().length() + 4 * voxelSize);
  frame.box.min -= margin;
  frame.box.max += margin;
  std::vector<openvdb::Coord> blocks;
  blocks.reserve(points.size());
  for (const V3d& p : points.positions) blocks.push_back(points::blockAt(frame, p));
  openvdb::FloatGrid::Ptr samples = points::sampleField(
      [&field](const points::CubePositions& at, points::CubeValues& values,
               points::FieldMemory& memory,
               double bound) { field.values(at, values, memory, bound); },
      frame, std::move(blocks), options.maxMemory, subProgress(options.progress, 0.3, 0.7));
  const std::size_t droppedParts = points::dropPartsWithoutPoints(*samples, points);
  eikonal::DistanceRequest request;
  request.halfWidth = options.halfWidth;
  request.maxMemory = options.maxMemory;
  request.progress = subProgress(options.progress, 0.7, 0.95);
  NarrowBand band = makeBand(eikonal::distanceTransform(std::move(samples), request));

  SupportCertificate certificate{.points = points.size(),
                                 .centres = centres,
                                 .medianSpacing = points.medianSpacing,
                                 .droppedParts = droppedParts,
                                 .opposedShare = opposedShare};
  FieldGrid support = supportField(vdb(band), points, certificate);
  addResiduals(band, points, certificate);
  if (options.onCertificate) options.onCertificate(certificate);
  if (certificate.unsupportedShare() > kUnsupportedLimit && !options.acceptUnsupported)
    throw InvalidInput(
        fmt::format("{:.2g} % of the surface is a guess, since no point lies near it (the largest "
                    "gap is {:.2g} "
                    "spacings); add points there, or accept the guess with --accept-sign",
                    100 * certificate.unsupportedShare(), certificate.largestGap));
  report(options.progress, 1);
  return {std::move(band), certificate, std::move(support)};
}

}  // namespace levelset
