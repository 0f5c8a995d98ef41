#include "levelset/convert/surface_band.h"

#include <fmt/core.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>

#include "levelset/convert/mesh_to_band_input.h"
#include "levelset/convert/pseudonormals.h"
#include "levelset/convert/surface_blocks.h"
#include "levelset/error.h"
#include "levelset/geometry/closest_on_triangle.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/mesh_sign/triangle_distance.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using convert::LocalMesh;
using convert::Pseudonormals;
using Imath::V3d;
using Imath::V3i;
using SurfaceLeaf = openvdb::FloatTree::LeafNodeType;

// Voxels by which the band extends the surface beyond its border. Tricubic interpolation reads two
// voxels along each axis, about 3.5 along the diagonal.
constexpr double kBeyondBorder = 3.5;
// Distance below which a grid point counts as on the surface, voxels.
constexpr double kTouching = 1e-6;

/// Bounding sphere of a triangle, in voxels. It excludes far triangles from the search for the
/// closest one.
struct Sphere {
  V3d center;
  double radius;
};

std::vector<Sphere> spheresOf(const LocalMesh& mesh) {
  std::vector<Sphere> spheres;
  spheres.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Imath::Box3d box;
    for (std::size_t k = 0; k < 3; ++k) box.extendBy(mesh.corner(t, k));
    spheres.push_back({box.center(), 0.5 * box.size().length()});
  }
  return spheres;
}

/// Signed distance of a grid point from the surface.
struct SignedPoint {
  double value = 0;       ///< signed distance, voxels
  bool isActive = false;  ///< the grid point belongs to the band
  double beyond = 0;  ///< distance of the closest point on the extension from the border, voxels
};

class SideOfSurface {
 public:
  SideOfSurface(const LocalMesh& mesh, const Pseudonormals& normals, double reach)
      : mesh_(mesh), normals_(normals), spheres_(spheresOf(mesh)), reach_(reach) {}

  /// Radius of the search for triangles, voxels. It covers the extension of the surface beyond its
  /// border.
  [[nodiscard]] double search() const {
    return std::sqrt(reach_ * reach_ + kBeyondBorder * kBeyondBorder);
  }

  /// Computes the signed distance of a grid point.
  /// @param p           position of the grid point in the frame of the mesh, voxels
  /// @param distance    distance of the grid point from the nearest triangle, voxels
  /// @param candidates  triangles that may be nearest
  [[nodiscard]] SignedPoint at(const V3d& p, double distance,
                               std::span<const std::uint32_t> candidates) const {
    double best = HUGE_VAL;
    std::uint32_t nearest = 0;
    TriangleFoot<V3d> foot;
    for (const std::uint32_t t : candidates) {
      const Sphere& sphere = spheres_[t];
      const double most = distance + sphere.radius + 1e-3;
      if ((p - sphere.center).length2() > most * most) continue;
      const TriangleFoot<V3d> at =
          closestOnTriangle(p, mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2));
      const double squared = (p - at.point).length2();
      if (squared >= best) continue;
      best = squared;
      nearest = t;
      foot = at;
    }
    const Pseudonormals::Direction direction = normals_.at(nearest, foot.part);
    const V3d offset = p - foot.point;
    const double ahead = offset.dot(direction.normal);
    if (!direction.onBorder) {
      const double length = distance < kTouching ? 0 : distance;
      return {ahead < 0 ? -length : length, length < reach_};
    }
    // If the closest point is on the border, the value is the signed distance from the plane
    // through this point, perpendicular to the border's pseudonormal there. It continues the
    // distance smoothly beyond the border.
    const double beyond = (offset - direction.normal * ahead).length();
    const bool isOn =
        direction.normal != V3d(0) && beyond <= kBeyondBorder && std::abs(ahead) < reach_;
    return {std::abs(ahead) < kTouching ? 0 : ahead, isOn, beyond};
  }

 private:
  const LocalMesh& mesh_;
  const Pseudonormals& normals_;
  std::vector<Sphere> spheres_;
  double reach_;
};

struct SurfaceGrids {
  openvdb::FloatGrid::Ptr grid;
  openvdb::FloatTree::Ptr beyond;
};

SurfaceGrids measureBlocks(const LocalMesh& mesh, const SideOfSurface& side, const V3i& origin,
                           double voxelSize, double halfWidth, std::size_t maxMemory,
                           const Progress& progress) {
  const float background = backgroundOf(halfWidth, voxelSize);
  tbb::enumerable_thread_specific<convert::BlockDistance> scratch(
      [&] { return convert::BlockDistance(side.search()); });
  using Leaves = std::vector<std::unique_ptr<SurfaceLeaf>>;
  tbb::enumerable_thread_specific<Leaves> parts, beyondParts;
  std::atomic<std::size_t> leafCount{0};
  const auto visit = [&](const V3i& block, std::span<const std::uint32_t> candidates) {
    convert::BlockDistance& distance = scratch.local();
    if (!distance.measure(mesh, candidates, V3d(block))) return;
    const V3i corner = block + origin;
    auto leaf = std::make_unique<SurfaceLeaf>(openvdb::Coord(corner.x, corner.y, corner.z),
                                              background, false);
    std::unique_ptr<SurfaceLeaf> beyond;
    float* values = leaf->buffer().data();
    for (openvdb::Index i = 0; i < SurfaceLeaf::SIZE; ++i) {
      const double d = distance.distances()[i];
      if (d >= side.search()) continue;
      const openvdb::Coord local = SurfaceLeaf::offsetToLocalCoord(i);
      const SignedPoint point =
          side.at(V3d(block) + V3d(local.x(), local.y(), local.z()), d, candidates);
      values[i] = point.value < 0 ? -background : background;
      if (!point.isActive) continue;
      values[i] = std::clamp(static_cast<float>(point.value * voxelSize), -background, background);
      leaf->setValueOn(i);
      if (!(point.beyond > 0)) continue;
      if (!beyond) beyond = std::make_unique<SurfaceLeaf>(leaf->origin(), 0.f, false);
      beyond->setValueOn(i, static_cast<float>(point.beyond));
    }
    if (leaf->isEmpty()) return;
    const std::size_t added = beyond ? 2 : 1;
    parts.local().push_back(std::move(leaf));
    if (beyond) beyondParts.local().push_back(std::move(beyond));
    constexpr std::size_t kStep = 4096;
    const std::size_t count = leafCount.fetch_add(added, std::memory_order_relaxed) + added;
    if (count % kStep < added)
      requireMemory(
          static_cast<double>(count) * (sizeof(SurfaceLeaf) + SurfaceLeaf::SIZE * sizeof(float)),
          maxMemory);
  };
  convert::forEachBlock(mesh, side.search(), visit, progress);
  const auto addAll = [](tbb::enumerable_thread_specific<Leaves>& from, openvdb::FloatTree& tree) {
    Leaves all;
    for (auto& part : from)
      for (auto& leaf : part) all.push_back(std::move(leaf));
    std::sort(all.begin(), all.end(),
              [](const auto& a, const auto& b) { return a->origin() < b->origin(); });
    for (auto& leaf : all) tree.addLeaf(leaf.release());
  };
  SurfaceGrids grids{emptyLevelSet(uniformTransform(voxelSize), halfWidth),
                     std::make_shared<openvdb::FloatTree>(0.f)};
  addAll(parts, grids.grid->tree());
  addAll(beyondParts, *grids.beyond);
  return grids;
}

/// Returns true when the sign change between two neighbouring grid points is not at the surface,
/// but half way between the front of one part of the surface and the back of another. At the
/// surface, the two distances differ by at most a voxel. If the parts are close together, the
/// difference may be small too. Then the next grid points on both sides show it: away from the sign
/// change, the values change in the opposite direction.
/// @param here, next signed distances at the two grid points, world units
/// @param last, after values of the grid points before `here` and behind `next`; null: inactive
bool isContradiction(float here, float next, const float* last, const float* after, float voxel) {
  if ((here < 0) == (next < 0)) return false;
  const float change = next - here;
  if (std::abs(change) > 1.05f * voxel) return true;
  return last && after && (here - *last) * change < 0 && (*after - next) * change < 0;
}

/// Deactivates the voxels next to a sign change that is not at the surface.
/// @return number of deactivated voxels
std::size_t removeContradictions(openvdb::FloatGrid& grid) {
  const float voxel = static_cast<float>(grid.voxelSize()[0]), background = grid.background();
  openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid.tree());
  std::vector<std::vector<openvdb::Index>> cuts(leaves.leafCount());
  leaves.foreach ([&](const SurfaceLeaf& leaf, std::size_t n) {
    auto accessor = grid.getConstAccessor();
    for (auto it = leaf.cbeginValueOn(); it; ++it) {
      bool isCut = false;
      for (int k = 0; k < 6 && !isCut; ++k) {
        openvdb::Coord step(0);
        step[k / 2] = k % 2 ? 1 : -1;
        const openvdb::Coord c = it.getCoord();
        float next, last, after;
        if (!accessor.probeValue(c + step, next)) continue;
        const bool hasLast = accessor.probeValue(c - step, last),
                   hasAfter = accessor.probeValue(c + step + step, after);
        isCut = isContradiction(*it, next, hasLast ? &last : nullptr, hasAfter ? &after : nullptr,
                                voxel);
      }
      if (isCut) cuts[n].push_back(it.pos());
    }
  });
  std::size_t count = 0;
  for (std::size_t n = 0; n < cuts.size(); ++n)
    for (const openvdb::Index i : cuts[n]) {
      SurfaceLeaf& leaf = leaves.leaf(n);
      leaf.setValueOff(i, leaf.getValue(i) < 0 ? -background : background);
      ++count;
    }
  return count;
}

void checkSurface(const Pseudonormals& normals, const V3i& origin, double voxelSize) {
  if (const auto& edge = normals.unorientedEdge()) {
    const auto text = [&](const V3d& p) {
      const V3d world = (p + V3d(origin)) * voxelSize;
      return fmt::format("({:.6g}, {:.6g}, {:.6g})", world.x, world.y, world.z);
    };
    throw InvalidInput(
        edge->faces > 2
            ? fmt::format("at the edge from {} to {}, {} faces meet, so the surface has no front "
                          "and back there; split the surface at this edge",
                          text(edge->from), text(edge->to), edge->faces)
            : fmt::format("at the edge from {} to {}, two faces have opposite orientations; "
                          "orient all faces alike (a Moebius strip has only one side: cut it)",
                          text(edge->from), text(edge->to)));
  }
  if (normals.borderEdges() == 0)
    throw InvalidInput("the mesh has no border; 'level-set' converts a closed mesh to a solid");
}

}  // namespace

SurfaceBandResult surfaceBand(const TriMesh& mesh, double voxelSize,
                              const SurfaceBandOptions& options) {
  if (!(options.halfWidth >= kMinSurfaceHalfWidth) || !std::isfinite(options.halfWidth))
    throw UsageError(fmt::format("the half width is {} voxels; give at least {}", options.halfWidth,
                                 kMinSurfaceHalfWidth));
  convert::checkMeshInput(mesh, voxelSize,
                          {.halfWidth = options.halfWidth, .maxMemory = options.maxMemory});
  report(options.progress, 0);
  const convert::MeshTopology topology = convert::findTopology(mesh);
  if (topology.triangles.empty())
    throw InvalidInput(
        "every triangle of the mesh is degenerate, so there is no surface to convert; repair the "
        "mesh");
  const V3i origin = convert::localOrigin(mesh, voxelSize);
  const LocalMesh local = convert::toLocal(mesh, topology, voxelSize, origin);
  const Pseudonormals normals(local);
  checkSurface(normals, origin, voxelSize);
  const SideOfSurface side(local, normals, options.halfWidth);
  const SurfaceGrids grids =
      measureBlocks(local, side, origin, voxelSize, options.halfWidth,
                    memoryLimit(options.maxMemory), subProgress(options.progress, 0.1, 1));
  SurfaceBandResult result;
  result.removedVoxels = removeContradictions(*grids.grid);
  result.band = makeOpenBand(grids.grid, grids.beyond);
  result.borderEdges = normals.borderEdges();
  result.droppedTriangles = topology.dropped;
  report(options.progress, 1);
  return result;
}

}  // namespace levelset
