#include "levelset/convert/mesh_to_band.h"

#include <fmt/core.h>

#include <algorithm>
#include <mutex>

#include "levelset/convert/band_assembly.h"
#include "levelset/convert/mesh_to_band_input.h"
#include "levelset/convert/surface_blocks.h"
#include "levelset/error.h"
#include "levelset/memory_limit.h"
#include "levelset/mesh_sign/open_surface.h"
#include "levelset/mesh_sign/self_intersections.h"
#include "levelset/mesh_sign/separating_surface.h"

namespace levelset {
namespace {

using convert::LocalMesh;
using convert::MeshTopology;
using convert::SignField;
using Imath::V3d;
using Imath::V3i;

/// Wraps a progress callback so that the fraction never decreases. Two stages of meshToBand report
/// overlapping intervals.
Progress monotonic(const Progress& progress) {
  if (!progress) return {};
  return [&progress, high = 0.0](double fraction) mutable {
    high = std::max(high, fraction);
    return progress(high);
  };
}

/// Finds the self-intersections of a mesh at the first call of get() and keeps them.
class SelfIntersections {
 public:
  SelfIntersections(const TriMesh& mesh, const MeshTopology& topology, Progress progress)
      : mesh_(mesh), topology_(topology), progress_(std::move(progress)) {}
  const std::vector<convert::TrianglePair>& get() {
    if (!searched_)
      pairs_ = convert::findSelfIntersections(topology_.triangles, mesh_.positions, progress_);
    searched_ = true;
    return pairs_;
  }
  /// Number of pairs of intersecting triangles; −1 before the first call of get().
  [[nodiscard]] std::ptrdiff_t count() const { return searched_ ? std::ssize(pairs_) : -1; }

 private:
  const TriMesh& mesh_;
  const MeshTopology& topology_;
  Progress progress_;
  bool searched_ = false;
  std::vector<convert::TrianglePair> pairs_;
};

SignMode chooseMethod(const MeshToBandOptions& options, const MeshTopology& topology,
                      SelfIntersections& selfIntersections) {
  if (options.sign != SignMode::Auto) return options.sign;
  if (!topology.isClosed()) return SignMode::Winding;
  if (!options.searchSelfIntersections) return SignMode::Closed;
  return selfIntersections.get().empty() ? SignMode::Closed : SignMode::Winding;
}

void checkClosed(const MeshTopology& topology, Nesting nesting) {
  if (topology.oddEdges > 0)
    throw InvalidInput(
        fmt::format("the mesh is not closed: {} edges have one face and {} have three or "
                    "more; use --sign winding, or close it first",
                    topology.boundaryEdges, topology.nonManifoldEdges));
  if (nesting == Nesting::Orientation && !topology.boundary.empty())
    throw InvalidInput(
        fmt::format("at {} edges neighbouring faces have opposite orientations, so --nested "
                    "orientation cannot decide which components are solid; use --nested parity",
                    topology.boundary.size()));
}

SignField::Rule ruleFor(SignMode method, Nesting nesting) {
  if (method == SignMode::Winding) return SignField::Rule::Winding;
  return nesting == Nesting::Parity ? SignField::Rule::Parity : SignField::Rule::Orientation;
}

/// Adds to the mesh the surface that spans its holes: the part of the boundary between inside and
/// outside that is not on the mesh.
void addOpenSurface(LocalMesh& mesh, const SignField& field, double halfWidth,
                    std::size_t maxMemory, const Progress& progress) {
  std::vector<V3i> seeds;
  std::mutex mutex;
  convert::forEachBlock(
      mesh, halfWidth,
      [&](const V3i& block, std::span<const std::uint32_t>) {
        if (field.isUnambiguousIn(block)) return;
        const std::lock_guard lock(mutex);
        seeds.push_back(block);
      },
      progress);
  for (const std::array<V3d, 3>& t :
       convert::findOpenSurface(field, std::move(seeds), maxMemory, progress)) {
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.insert(mesh.points.end(), t.begin(), t.end());
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
}

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
  const Progress progress = monotonic(options.progress);
  const std::size_t maxMemory = memoryLimit(options.maxMemory);
  report(progress, 0);

  // === Topology and method
  MeshTopology topology = convert::findTopology(mesh);
  report(progress, 0.05);
  SignCertificate certificate;
  certificate.closed = topology.isClosed();
  certificate.boundaryEdges = topology.boundaryEdges;
  certificate.nonManifoldEdges = topology.nonManifoldEdges;
  certificate.droppedTriangles = topology.dropped;
  if (topology.triangles.empty())
    throw InvalidInput(
        "every triangle of the mesh is degenerate, so there is no surface to convert; repair the "
        "mesh");
  SelfIntersections selfIntersections(mesh, topology, subProgress(progress, 0.05, 0.4));
  certificate.method = chooseMethod(options, topology, selfIntersections);
  if (certificate.method == SignMode::Closed) checkClosed(topology, options.nesting);

  // === Signs
  const V3i origin = convert::localOrigin(mesh, voxelSize);
  LocalMesh local = convert::toLocal(mesh, topology, voxelSize, origin);
  const SignField field(local, topology, ruleFor(certificate.method, options.nesting),
                        subProgress(progress, 0.4, 0.5));
  certificate.flipped = field.isFlipped();
  const bool byParity =
      certificate.method == SignMode::Closed && options.nesting == Nesting::Parity;
  if (topology.boundary.empty() && !byParity)
    local = convert::separatingSurface(local, selfIntersections.get(), field.isFlipped() ? -1 : 1,
                                       subProgress(progress, 0.5, 0.6));
  certificate.selfIntersections = selfIntersections.count();
  const Imath::Box3d meshBounds = bounds(mesh);
  std::vector<convert::Triangle>().swap(topology.triangles);  // frees memory; `local` has a copy
  if (options.onMeshRead) options.onMeshRead();
  if (field.isOpen())
    addOpenSurface(local, field, options.halfWidth, maxMemory, subProgress(progress, 0.5, 0.6));

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
