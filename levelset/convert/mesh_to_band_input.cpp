#include "levelset/convert/mesh_to_band_input.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

namespace levelset::convert {
namespace {

using Imath::V3d;
using Imath::V3i;

std::string text(const V3d& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z);
}

bool isFinite(const V3d& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

double largest(const V3d& p) {
  return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

void checkCall(double voxelSize, const MeshToBandOptions& options) {
  if (!(voxelSize > 0) || !std::isfinite(voxelSize))
    throw UsageError(
        fmt::format("the voxel size is {}; give a positive length in world units", voxelSize));
  if (!(options.halfWidth >= 1) || !std::isfinite(options.halfWidth))
    throw UsageError(
        fmt::format("the half width is {} voxels; give at least 1", options.halfWidth));
}

std::uint32_t outermostVertex(const TriMesh& mesh) {
  std::uint32_t result = mesh.triangles[0][0];
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t)
      if (largest(mesh.positions[v]) > largest(mesh.positions[result])) result = v;
  return result;
}

/// Estimates the area of the surface within a box, world units². The area of a triangle that
/// extends beyond the box is multiplied by a fraction: the part of its bounding box within the box,
/// along the axis where this part is smallest.
double areaWithin(const Imath::Box3d& box, const TriMesh& mesh) {
  if (isEverywhere(box)) return surfaceArea(mesh);
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const V3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    double share = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = std::min({a[axis], b[axis], c[axis]}),
                   high = std::max({a[axis], b[axis], c[axis]}),
                   within = std::min(high, box.max[axis]) - std::max(low, box.min[axis]);
      if (within < 0) share = 0;
      if (within >= 0 && high > low) share = std::min(share, within / (high - low));
    }
    area += share * (b - a).cross(c - a).length() / 2;
  }
  return area;
}

/// Estimates the memory in bytes: 12 for each voxel of the band, and 250 for each triangle (its
/// local copy, bounding box and index lists), with prisms 530.
double estimateMemory(const TriMesh& mesh, double voxelSize, const MeshToBandOptions& options) {
  const double halfWidth = std::min(options.halfWidth, options.roi.halfWidth);
  Imath::Box3d box = options.roi.region;
  box.min -= V3d(halfWidth * voxelSize);
  box.max += V3d(halfWidth * voxelSize);
  const double area = areaWithin(box, mesh) / voxelSize / voxelSize;
  const double perTriangle = options.method == DistanceMethod::Prisms ? 530 : 250;
  return 24 * halfWidth * area + perTriangle * static_cast<double>(mesh.triangles.size());
}

void checkPrecision(const TriMesh& mesh, double voxelSize, std::uint32_t outermost) {
  const bool isFloat = mesh.precision == CoordinatePrecision::Float;
  const double here = spacingAt(largest(mesh.positions[outermost]), mesh.precision);
  if (mesh.spacing > voxelSize / 8 && mesh.spacing > here)
    throw InvalidInput(
        fmt::format("before the mesh was moved, its representable coordinates were {:.3g} apart "
                    "(in its present scale), coarser than an eighth of the voxel size {:.6g}; move "
                    "the object to the origin before writing it, or use larger voxels",
                    mesh.spacing, voxelSize));
  const double spacing = here;
  if (spacing > voxelSize / 8)
    throw InvalidInput(
        fmt::format("{} coordinates at vertex {}, {}, are {:.3g} apart, coarser than an "
                    "eighth of the "
                    "voxel size {:.6g}; move the object to the origin before writing it, or use "
                    "larger voxels",
                    isFloat ? "single-precision" : "double-precision", outermost,
                    text(mesh.positions[outermost]), spacing, voxelSize));
}

}  // namespace

void checkElements(const TriMesh& mesh) {
  if (mesh.isEmpty())
    throw InvalidInput("the mesh has no triangles; there is no surface to convert");
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    if (!isFinite(mesh.positions[v]))
      throw InvalidInput(
          fmt::format("vertex {} has the coordinates {}, which are not finite; repair the mesh", v,
                      text(mesh.positions[v])));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t v : mesh.triangles[t])
      if (v >= mesh.positions.size())
        throw InvalidInput(fmt::format(
            "triangle {} refers to vertex {}, but there are only {} vertices; repair the mesh", t,
            v, mesh.positions.size()));
}

void checkMeshInput(const TriMesh& mesh, double voxelSize, const MeshToBandOptions& options) {
  checkCall(voxelSize, options);
  checkElements(mesh);
  const V3d size = bounds(mesh).size();
  checkVoxelSize(voxelSize, std::max({size.x, size.y, size.z}));
  const std::uint32_t outermost = outermostVertex(mesh);
  if (largest(mesh.positions[outermost]) / voxelSize + options.halfWidth >= kIndexLimit)
    throw ResourceLimit(
        fmt::format("vertex {} at {} is {:.3g} voxels from the origin, beyond the range of 32-bit "
                    "indices; use larger voxels, or remove the vertex if it is an outlier",
                    outermost, text(mesh.positions[outermost]),
                    largest(mesh.positions[outermost]) / voxelSize));
  requireMemory(estimateMemory(mesh, voxelSize, options), memoryLimit(options.maxMemory));
  checkPrecision(mesh, voxelSize, outermost);
}

V3i localOrigin(const TriMesh& mesh, double voxelSize) {
  const V3d middle = bounds(mesh).center() / voxelSize;
  const auto down = [](double x) { return static_cast<int>(std::floor(x / 8)) * 8; };
  return {down(middle.x), down(middle.y), down(middle.z)};
}

LocalMesh toLocal(const TriMesh& mesh, const MeshTopology& topology, double voxelSize,
                  const V3i& origin) {
  LocalMesh local;
  local.points.reserve(mesh.positions.size());
  for (const V3d& p : mesh.positions) local.points.push_back(p / voxelSize - V3d(origin));
  local.triangles = topology.triangles;
  return local;
}

}  // namespace levelset::convert

namespace levelset {

void checkVoxelSize(double voxelSize, double longestSide) {
  if (voxelSize > longestSide)
    throw InvalidInput(
        fmt::format("the voxel size {:.6g} is larger than the object, whose longest side is "
                    "{:.6g}; use smaller voxels",
                    voxelSize, longestSide));
}

}  // namespace levelset
