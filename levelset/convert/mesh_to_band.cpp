#include "levelset/convert/mesh_to_band.h"

#include <fmt/core.h>

#include <algorithm>

#include "levelset/convert/band_assembly.h"
#include "levelset/convert/mesh_to_band_input.h"
#include "levelset/convert/solid_surface.h"
#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

namespace levelset {
namespace {

using convert::LocalMesh;
using convert::SignField;
using Imath::V3d;
using Imath::V3i;

void checkResult(const openvdb::FloatGrid& grid, const SignCertificate& certificate,
                 const MeshToBandOptions& options) {
  bool anyInside = false;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf && !anyInside; ++leaf)
    for (auto it = leaf->cbeginValueAll(); it && !anyInside; ++it) anyInside = *it < 0;
  if (!anyInside && certificate.closed)
    throw InvalidInput(
        "no grid point lies inside the object, which is everywhere thinner than a "
        "voxel; use smaller voxels");
  if (!anyInside && !options.acceptSign)
    throw InvalidInput(fmt::format(
        "the mesh encloses no volume: its winding number exceeds 1/2 at no grid point "
        "({} boundary edges); close it first, use smaller voxels, or accept distances without an "
        "inside with --accept-sign",
        certificate.boundaryEdges));
  if (certificate.ambiguousShare > kAmbiguousLimit && !options.acceptSign)
    throw InvalidInput(fmt::format(
        "inside and outside are a guess at {:.2g} % of the voxels next to the "
        "surface ({} boundary edges, {} non-manifold); close the holes, or accept the guess "
        "with --accept-sign",
        100 * certificate.ambiguousShare, certificate.boundaryEdges, certificate.nonManifoldEdges));
}

}  // namespace

std::string describe(const SignCertificate& c) {
  return fmt::format(
      "sign by {}: {}, {} boundary edges, {} non-manifold edges, {} self-intersections, {} "
      "triangles dropped, {}{}",
      c.method == SignMode::Winding ? "winding number" : "crossings of a closed mesh",
      c.closed ? "closed" : "not closed", c.boundaryEdges, c.nonManifoldEdges,
      c.selfIntersections < 0 ? std::string("not searched for")
                              : fmt::format("{}", c.selfIntersections),
      c.droppedTriangles, c.flipped ? "orientation reversed, " : "",
      c.ambiguousShare < 1 ? fmt::format("ambiguous at {:.2g} % of the voxels next to the surface",
                                         100 * c.ambiguousShare)
                           : std::string("ambiguous at every voxel next to the surface"));
}

MeshToBandResult meshToBand(const TriMesh& mesh, double voxelSize,
                            const MeshToBandOptions& options) {
  convert::checkMeshInput(mesh, voxelSize, options);
  const Progress progress = monotonicProgress(options.progress);
  const std::size_t maxMemory = memoryLimit(options.maxMemory);
  report(progress, 0);

  convert::SolidSurface surface =
      convert::solidSurface(mesh, voxelSize, options, subProgress(progress, 0, 0.6));
  const LocalMesh& local = surface.mesh;
  const SignField& field = surface.field;
  SignCertificate& certificate = surface.certificate;
  const V3i& origin = surface.origin;
  const Imath::Box3d meshBounds = bounds(mesh);
  if (options.onMeshRead) options.onMeshRead();
  if (field.isOpen())
    convert::addOpenSurface(surface, options.halfWidth, maxMemory, subProgress(progress, 0.5, 0.6));

  // === Distances
  const RegionOfInterest part = field.isOpen() ? RegionOfInterest() : options.roi;
  const double halfWidth = std::min(options.halfWidth, part.halfWidth);
  std::optional<openvdb::CoordBBox> region;
  if (!isEverywhere(part.region)) {
    Imath::Box3d reached = meshBounds;
    const V3d rim((halfWidth + 1) * voxelSize);
    reached = {reached.min - rim, reached.max + rim};
    for (int axis = 0; axis < 3; ++axis) {
      reached.min[axis] = std::max(reached.min[axis], part.region.min[axis]);
      reached.max[axis] = std::min(reached.max[axis], part.region.max[axis]);
    }
    if (reached.isEmpty())
      throw NoSurface(
          "the requested region does not intersect the band of the mesh; choose a region that "
          "does");
    region = blocksOf(reached, *uniformTransform(voxelSize));
  }
  const auto grid =
      convert::assembleBand(local, field, origin, voxelSize, halfWidth, options.method, region,
                            maxMemory, subProgress(progress, 0.6, 1));
  certificate.ambiguousShare = convert::ambiguousShare(*grid, field, origin);
  if (options.onCertificate) options.onCertificate(certificate);
  checkResult(*grid, certificate, options);
  report(progress, 1);
  return {makeBand(grid), certificate};
}

}  // namespace levelset
