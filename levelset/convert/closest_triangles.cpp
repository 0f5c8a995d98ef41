#include "levelset/convert/closest_triangles.h"

#include <fmt/core.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <atomic>
#include <memory>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/convert/mesh_to_band_input.h"
#include "levelset/convert/prisms/prism_scan.h"
#include "levelset/convert/surface_blocks.h"
#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "levelset/geometry/closest_on_triangle.h"
#include "levelset/geometry/position_table.h"
#include "levelset/memory/memory_limit.h"

namespace levelset {
namespace {

using convert::LocalMesh;
using convert::PrismScan;
using Imath::V3d;
using Imath::V3i;
using IndexLeaf = openvdb::FloatTree::LeafNodeType;
using VectorLeaf = openvdb::Vec3STree::LeafNodeType;

struct LeafPair {
  std::unique_ptr<IndexLeaf> index;
  std::unique_ptr<VectorLeaf> vector;
};

/// Returns all triangles of the mesh, in voxels relative to `origin`, with vertices at equal
/// positions merged.
LocalMesh mergedMesh(const TriMesh& mesh, double voxelSize, const V3i& origin) {
  LocalMesh local;
  local.points.reserve(mesh.positions.size());
  for (const V3d& p : mesh.positions) local.points.push_back(p / voxelSize - V3d(origin));
  convert::PositionTable table(local.points, local.points.size());
  std::vector<std::uint32_t> first(local.points.size());
  for (std::uint32_t v = 0; v < local.points.size(); ++v)
    first[v] = table.findOrInsert(local.points[v], v);
  local.triangles = mesh.triangles;
  for (convert::Triangle& t : local.triangles)
    for (std::uint32_t& v : t) v = first[v];
  return local;
}

LeafPair makeLeafPair(const LocalMesh& mesh, const PrismScan& scan, const V3i& block,
                      const V3i& origin, double voxelSize) {
  const V3i low = block + origin;
  const openvdb::Coord at(low.x, low.y, low.z);
  LeafPair leaves{std::make_unique<IndexLeaf>(at, ClosestTriangles::kNoTriangle, false),
                  std::make_unique<VectorLeaf>(at, openvdb::Vec3s(0), false)};
  for (openvdb::Index i = 0; i < IndexLeaf::SIZE; ++i) {
    const std::uint32_t t = scan.nearest()[i];
    if (t == PrismScan::kNoTriangle) continue;
    const V3d point(block + V3i(static_cast<int>(i >> 6), static_cast<int>(i >> 3 & 7),
                                static_cast<int>(i & 7)));
    // Relative to the grid point, the vector keeps the relative precision of float.
    const V3d vector = closestOnTriangle(V3d(0), mesh.corner(t, 0) - point,
                                         mesh.corner(t, 1) - point, mesh.corner(t, 2) - point)
                           .point *
                       voxelSize;
    leaves.index->setValueOn(i, static_cast<float>(t));
    leaves.vector->setValueOn(
        i, openvdb::Vec3s(static_cast<float>(vector.x), static_cast<float>(vector.y),
                          static_cast<float>(vector.z)));
  }
  return leaves;
}

}  // namespace

ClosestTriangles closestTriangles(const TriMesh& mesh, double voxelSize,
                                  const ClosestTrianglesOptions& options) {
  convert::checkMeshInput(mesh, voxelSize,
                          {.halfWidth = options.halfWidth,
                           .method = DistanceMethod::Prisms,
                           .maxMemory = options.maxMemory});
  constexpr std::size_t kMostTriangles = std::size_t{1} << 24;
  if (mesh.triangles.size() > kMostTriangles)
    throw ResourceLimit(
        fmt::format("the mesh has {} triangles, but a field of indices can number {} only; split "
                    "the mesh",
                    mesh.triangles.size(), kMostTriangles));
  const V3i origin = convert::localOrigin(mesh, voxelSize);
  const LocalMesh local = mergedMesh(mesh, voxelSize, origin);
  const convert::PrismCovering prisms(local, options.halfWidth);
  report(options.progress, 0.2);

  // Each leaf holds an index and a vector for all of its points.
  constexpr std::size_t kLeafBytes = sizeof(IndexLeaf) + sizeof(VectorLeaf) + 512 * 16;
  constexpr std::size_t kCheckedLeaves = 4096;
  std::atomic<std::size_t> leafCount = 0;
  const PrismScan prototype(prisms);
  tbb::enumerable_thread_specific<PrismScan> scans(prototype);
  tbb::enumerable_thread_specific<std::vector<LeafPair>> parts;
  convert::forEachBlock(
      local, options.halfWidth,
      [&](const V3i& block, std::span<const std::uint32_t> candidates) {
        PrismScan& scan = scans.local();
        if (!scan.measure(local, candidates, V3d(block))) return;
        if (const std::size_t count = ++leafCount; count % kCheckedLeaves == 0)
          requireMemory(static_cast<double>(count * kLeafBytes), memoryLimit(options.maxMemory));
        parts.local().push_back(makeLeafPair(local, scan, block, origin, voxelSize));
      },
      subProgress(options.progress, 0.2, 1), {}, convert::prismTest(local, prisms));
  std::vector<LeafPair> leaves;
  for (auto& part : parts) std::move(part.begin(), part.end(), std::back_inserter(leaves));
  std::sort(leaves.begin(), leaves.end(), [](const LeafPair& a, const LeafPair& b) {
    return a.index->origin() < b.index->origin();
  });

  const auto index = openvdb::FloatGrid::create(ClosestTriangles::kNoTriangle);
  const auto vector = openvdb::Vec3SGrid::create();
  for (openvdb::GridBase* grid : {static_cast<openvdb::GridBase*>(index.get()),
                                  static_cast<openvdb::GridBase*>(vector.get())})
    grid->setTransform(uniformTransform(voxelSize));
  for (LeafPair& pair : leaves) {
    index->tree().addLeaf(pair.index.release());
    vector->tree().addLeaf(pair.vector.release());
  }
  index->setName("closest_triangle");
  vector->setName("closest_vector");
  vector->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  report(options.progress, 1);
  return {importField(index), importField(vector)};
}

const OperatorText ClosestTriangleOperator::text{
    .name = "closest-triangle",
    .group = "Conversion",
    .summary = "find the closest triangle of a mesh for each grid point near it",
    .details =
        "The result is a field of the grid points within the half width. It holds numbers of "
        "triangles in the order of the mesh, and -1 elsewhere, or vectors. Any set of triangles is "
        "accepted.",
    .example =
        "levelsmith sphere --radius 1 --voxel 0.1 ! mesh ! closest-triangle --voxel 0.1 ! "
        "info"};

double ClosestTriangleOperator::longestSide(const Options&, Plans operands) {
  return operands[0].longestSide();
}

FieldGrid ClosestTriangleOperator::run(const TriMesh& mesh, const Options& options,
                                       OperatorRun& run) {
  ClosestTriangles result = closestTriangles(
      mesh, options.voxel.edge,
      {.halfWidth = options.halfWidth, .maxMemory = run.maxMemory, .progress = run.progress});
  return options.result == Result::Index ? std::move(result.triangle) : std::move(result.vector);
}

ValuePlan ClosestTriangleOperator::plan(const Options& options, Plans operands,
                                        const OperatorRun&) {
  constexpr double kIndexBytes = 4, kVectorBytes = 12;  // for each active voxel
  ValuePlan plan = operands[0];
  plan.triangles = 0;
  plan.voxelSize = options.voxel.edge;
  plan.halfWidth = options.halfWidth;
  checkVoxelSize(plan.voxelSize, plan.longestSide());
  plan.fieldBytes =
      plan.activeVoxels() * (options.result == Result::Index ? kIndexBytes : kVectorBytes);
  return plan;
}

std::optional<Cost> ClosestTriangleOperator::cost(const Options&, const OperatorPlans& plans) {
  const double triangles = plans.operands[0].triangles, voxels = plans.result.activeVoxels();
  if (triangles == 0) return {};
  return Cost{1e-9 * (3000 * triangles + 250 * voxels), 530 * triangles + 48 * voxels};
}

}  // namespace levelset
