#include "levelset/convert/solid_surface.h"

#include <fmt/core.h>

#include <array>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "levelset/convert/mesh_to_band_input.h"
#include "levelset/convert/surface_blocks.h"
#include "levelset/error.h"
#include "levelset/mesh_sign/open_surface.h"
#include "levelset/mesh_sign/self_intersections.h"
#include "levelset/mesh_sign/separating_surface.h"

namespace levelset::convert {
namespace {

using Imath::V3d;
using Imath::V3i;

/// Finds the self-intersections of a mesh at the first call of get() and keeps them.
class SelfIntersections {
 public:
  SelfIntersections(const TriMesh& mesh, const MeshTopology& topology, Progress progress)
      : mesh_(mesh), topology_(topology), progress_(std::move(progress)) {}
  const std::vector<TrianglePair>& get() {
    if (!searched_) pairs_ = findSelfIntersections(topology_.triangles, mesh_.positions, progress_);
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
  std::vector<TrianglePair> pairs_;
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

}  // namespace

SolidSurface solidSurface(const TriMesh& mesh, double voxelSize, const MeshToBandOptions& options,
                          const Progress& progress) {
  // === Topology and method
  MeshTopology topology = findTopology(mesh);
  report(progress, 0.08);
  SignCertificate certificate;
  certificate.closed = topology.isClosed();
  certificate.boundaryEdges = topology.boundaryEdges;
  certificate.nonManifoldEdges = topology.nonManifoldEdges;
  certificate.droppedTriangles = topology.dropped;
  if (topology.triangles.empty())
    throw InvalidInput(
        "every triangle of the mesh is degenerate, so there is no surface to convert; repair the "
        "mesh");
  SelfIntersections selfIntersections(mesh, topology, subProgress(progress, 0.08, 0.67));
  certificate.method = chooseMethod(options, topology, selfIntersections);
  if (certificate.method == SignMode::Closed) checkClosed(topology, options.nesting);

  // === Signs
  const V3i origin = localOrigin(mesh, voxelSize);
  LocalMesh local = toLocal(mesh, topology, voxelSize, origin);
  SignField field(local, topology, ruleFor(certificate.method, options.nesting),
                  subProgress(progress, 0.67, 0.83));
  certificate.flipped = field.isFlipped();
  const bool byParity =
      certificate.method == SignMode::Closed && options.nesting == Nesting::Parity;
  if (topology.boundary.empty() && !byParity)
    local = separatingSurface(local, selfIntersections.get(), field.isFlipped() ? -1 : 1,
                              subProgress(progress, 0.83, 1));
  certificate.selfIntersections = selfIntersections.count();
  return {origin, std::move(local), std::move(field), certificate};
}

void addOpenSurface(SolidSurface& surface, double reach, std::size_t maxMemory,
                    const Progress& progress) {
  LocalMesh& mesh = surface.mesh;
  const SignField& field = surface.field;
  std::vector<V3i> seeds;
  std::mutex mutex;
  forEachBlock(
      mesh, reach,
      [&](const V3i& block, std::span<const std::uint32_t>) {
        if (field.isUnambiguousIn(block)) return;
        const std::lock_guard lock(mutex);
        seeds.push_back(block);
      },
      progress);
  for (const std::array<V3d, 3>& t :
       findOpenSurface(field, std::move(seeds), maxMemory, progress)) {
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.insert(mesh.points.end(), t.begin(), t.end());
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
}

}  // namespace levelset::convert
