#include <Imath/ImathBoxAlgo.h>
#include <embree3/rtcore.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "render/embree/bcc_cell_vdb.h"
#include "render/embree/embree_renderer.h"
#include "render/embree/field_march.h"
#include "render/embree/judge_blocks_vdb.h"
#include "render/embree/parts/judged_parts.h"
#include "render/embree/surface_spline_vdb.h"
#include "render/embree/tetra_cell_vdb.h"
#include "render/embree/volume_tree_vdb.h"
#include "render/meshes/embree_space.h"
#include "render/meshes/mesh_rays.h"
#include "render/shading/principal_direction.h"
#include "render/shading/surface_shape.h"

namespace render {
namespace {

using Imath::Box3d;
using Imath::V3d;

struct RaySolid {
  openvdb::FloatTree::ConstPtr tree;
  openvdb::CoordBBox cells = openvdb::CoordBBox::inf();  // cells in which the surface is drawn
  bool isVolume;
  double voxelSize;
  Imath::M44d indexToWorld, worldToIndex;
  std::vector<SurfaceBlock> blocks;
  std::uint32_t id;
  std::size_t index;        // index in Scene::solids
  std::size_t number;       // index in EmbreeScene::Impl::solids (those with a surface)
  const EmbreeSpace* view;  // scaled space of Embree's rays, the same for all solids
  Filter filter;
  Imath::C3f colour;
  double opacity;

  [[nodiscard]] DrawnField field() const { return {*tree, filter, cells}; }
  [[nodiscard]] SurfaceShape shapeAt(const V3d& world) const {
    if (filter == Filter::BccQuadratic) return bccShape(*tree, world * worldToIndex);
    if (tetrahedralDegree(filter) > 0) return tetraShape(*tree, world * worldToIndex, filter);
    return surfaceShape(*tree, world * worldToIndex, filter);
  }
};

/// State for Embree's callbacks in addition to its single-precision ray: the ray in double
/// precision and the best hit so far.
struct RayQuery {
  RTCIntersectContext embree;  // first member: Embree returns its address
  // World space. The origin is moved along the ray to its entry into the box of the scene.
  V3d origin, direction;
  // End of the search, distance from `origin`, world units. It is the same for all blocks, so that
  // a hit has the same bits in any order of the blocks.
  double limit;
  double nearest;
  double scale;
  const RaySolid* solid = nullptr;
  // If not null, receives all crossings of the ray, one list for each solid.
  std::vector<std::vector<SideChange>>* changes = nullptr;
};

IndexRay indexRayOf(const RayQuery& query, const RaySolid& solid) {
  V3d origin, direction;
  solid.worldToIndex.multVecMatrix(query.origin, origin);
  solid.worldToIndex.multDirMatrix(query.direction, direction);
  return {origin, direction};
}

std::optional<double> crossingOf(const RayQuery& query, const RaySolid& solid, unsigned primitive,
                                 Search search) {
  return findCrossing(solid.field(), solid.blocks[primitive], indexRayOf(query, solid), 0,
                      query.limit, search);
}

void boundBlock(const RTCBoundsFunctionArguments* args) {
  const auto& solid = *static_cast<const RaySolid*>(args->geometryUserPtr);
  const Box3d box = Imath::transform(solid.blocks[args->primID].bounds(), solid.indexToWorld);
  *args->bounds_o = solid.view->boundsOf(box);
}

void intersectBlock(const RTCIntersectFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto& query = *reinterpret_cast<RayQuery*>(args->context);
  const auto& solid = *static_cast<const RaySolid*>(args->geometryUserPtr);
  if (query.changes) {
    addCrossings(solid.field(), solid.blocks[args->primID], indexRayOf(query, solid), 0,
                 (*query.changes)[solid.number]);
    return;
  }
  const auto t = crossingOf(query, solid, args->primID, Search::FirstCrossing);
  if (!t || *t > query.nearest) return;
  if (query.solid && *t == query.nearest && solid.number >= query.solid->number) return;
  query.nearest = *t;
  query.solid = &solid;
  // The padding keeps other blocks that may contain a hit at the same distance within the range of
  // Embree's ray.
  RTCRayN* ray = RTCRayHitN_RayN(args->rayhit, args->N);
  RTCRayN_tfar(ray, args->N, 0) = std::min(
      RTCRayN_tfar(ray, args->N, 0), static_cast<float>(*t * query.scale + EmbreeSpace::kPad));
  RTCHitN* hit = RTCRayHitN_HitN(args->rayhit, args->N);
  RTCHitN_geomID(hit, args->N, 0) = args->geomID;
  RTCHitN_primID(hit, args->N, 0) = args->primID;
}

void occludeBlock(const RTCOccludedFunctionNArguments* args) {
  if (!args->valid[0]) return;
  const auto& query = *reinterpret_cast<const RayQuery*>(args->context);
  const auto& solid = *static_cast<const RaySolid*>(args->geometryUserPtr);
  if (crossingOf(query, solid, args->primID, Search::AnyCrossing))
    RTCRayN_tfar(args->ray, args->N, 0) = -std::numeric_limits<float>::infinity();
}

/// Sorts the crossings of a ray with one solid by distance. Removes pairs of an entry and an exit
/// at equal distance, because they cancel.
void putInOrder(std::vector<SideChange>& changes) {
  std::stable_sort(changes.begin(), changes.end(),
                   [](const SideChange& a, const SideChange& b) { return a.t < b.t; });
  std::vector<SideChange> kept;
  for (const SideChange& change : changes) {
    if (!kept.empty() && kept.back().t == change.t && kept.back().enters != change.enters)
      kept.pop_back();
    else
      kept.push_back(change);
  }
  changes = std::move(kept);
}

/// A point where a ray enters or leaves the result of the CSG expression, or a solid if there is no
/// expression.
struct CsgChange {
  double t;
  std::size_t solid;
  bool isFlipped;
};

/// Calls visit(change) for each point where the ray enters or leaves the result of `csg`, in order,
/// until visit() returns false. Without an expression, visits the crossings of all solids.
/// @param changes  crossings of the ray, one list for each solid
template <typename Visit>
void walkChanges(const CsgExpression& csg, std::vector<std::vector<SideChange>>& changes,
                 const Visit& visit) {
  std::vector<char> inside(changes.size(), 0);
  for (std::size_t s = 0; s < changes.size(); ++s) {
    putInOrder(changes[s]);
    if (!changes[s].empty()) inside[s] = changes[s][0].enters ? 0 : 1;
  }
  std::vector<std::size_t> next(changes.size(), 0);
  for (;;) {
    std::optional<CsgChange> change;
    for (std::size_t s = 0; s < changes.size(); ++s)
      if (next[s] < changes[s].size() && (!change || changes[s][next[s]].t < change->t))
        change = CsgChange{changes[s][next[s]].t, s, false};
    if (!change) return;
    const bool before = csg.holds(inside.data());
    for (std::size_t s = 0; s < changes.size(); ++s)
      while (next[s] < changes[s].size() && changes[s][next[s]].t == change->t)
        inside[s] = changes[s][next[s]++].enters ? 1 : 0;
    const bool after = csg.holds(inside.data());
    if (before == after && !csg.isEmpty()) continue;
    change->isFlipped = !csg.isEmpty() && (inside[change->solid] != 0) != after;
    if (!visit(*change)) return;
  }
}

void requireRay(const V3d& origin, const V3d& direction) {
  const double sum = origin.x + origin.y + origin.z + direction.x + direction.y + direction.z;
  if (std::isfinite(sum) && direction != V3d(0)) return;
  throw levelset::UsageError(
      fmt::format("a ray from {},{},{} along {},{},{} has no direction or is not finite; "
                  "give finite numbers and "
                  "a nonzero direction",
                  origin.x, origin.y, origin.z, direction.x, direction.y, direction.z));
}

}  // namespace

namespace {

/// Crossings of a ray with the operands of the expression: solids, then Bézier volumes.
struct SceneChanges {
  std::vector<std::vector<SideChange>> lists;  ///< for each operand; SideChange::t from `moved`
  std::optional<RayQuery> query;               ///< none when the ray misses all solids
  double moved = 0;                            ///< distance from the ray's origin, world units
  double limit = 0;                            ///< end of the search from `moved`, world units
  std::vector<std::vector<JudgedParts::Crossing>> onBeziers;  ///< for each Bézier operand
};

}  // namespace

struct EmbreeScene::Impl {
  std::vector<RaySolid> solids;
  CsgExpression csg;  // uses indices of `solids`, then of the operands of `parts`
  MeshRays meshes;
  std::optional<FieldMarch> fields;  // set for a blended scene; then `solids` is empty
  JudgedParts parts;
  bool isOpaque;
  Box3d allBounds;  // world-space box of the solids, meshes and interfaces
  Box3d bounds;     // world-space box of the grid cells that the solids' surfaces cross
  EmbreeSpace view;
  EmbreeTree tree;

  Impl(const Scene& source, Filter filter);

  void gather(const Scene& source, Filter filter);
  void build();
  /// Builds a query for a ray, and Embree's single-precision ray for it. Returns nothing when the
  /// ray misses the box of the scene. `moved` receives the distance from `origin` to the query's
  /// origin.
  std::optional<RayQuery> prepare(const V3d& origin, const V3d& direction, double near, double far,
                                  double& moved, RTCRay& ray) const;
  /// All crossings of the ray up to the far side of the scene, one list for each solid.
  [[nodiscard]] std::vector<std::vector<SideChange>> allChanges(RayQuery& query, RTCRay ray) const;
  /// First point, up to the limit, where the ray enters or leaves the result of `csg`.
  std::optional<CsgChange> findCsg(const SceneChanges& changes) const;
  /// Crossings of a ray with all operands of the expression, or with all solids without one.
  [[nodiscard]] SceneChanges changesOf(const V3d& origin, const V3d& direction, double near,
                                       double far) const;
  [[nodiscard]] Hit hitOf(const SceneChanges& all, const CsgChange& change) const;
  /// @pre the direction is finite and not zero
  [[nodiscard]] Hit intersectSolids(const V3d& origin, const V3d& direction, double near,
                                    double far) const;
  /// First hit with a part that has a judge of its own. @param onlyOpaque  as JudgedParts
  [[nodiscard]] Hit intersectParts(const Camera::Ray& ray, bool onlyOpaque = false) const;
  void complete(Hit& hit, const RayQuery& query, const RaySolid& solid, double moved,
                double t) const;
};

EmbreeScene::Impl::Impl(const Scene& source, Filter filter)
    : meshes(source), parts(source), isOpaque(source.isOpaque()) {
  if (source.isBlended()) {
    fields.emplace(source);
    allBounds = source.bounds();
    return;
  }
  gather(source, filter);
  allBounds = bounds;
  allBounds.extendBy(meshes.bounds());
  allBounds.extendBy(parts.bounds());
  if (allBounds.isEmpty()) allBounds = source.volumeBounds();
  if (bounds.isEmpty()) return;
  build();
}

void EmbreeScene::Impl::gather(const Scene& source, Filter filter) {
  for (std::size_t i = 0; i < source.solids.size(); ++i) {
    const Solid& solid = source.solids[i];
    if (solid.isEmpty(filter) || (!source.csg.isEmpty() && !source.csg.uses(i))) continue;
    RaySolid entry;
    entry.isVolume = solid.volume != nullptr;
    if (solid.volume) {
      entry.tree = treeOf(*solid.volume);
      const auto [first, last] = solid.volume->cells(filter);
      entry.cells = {openvdb::Coord(first.x, first.y, first.z),
                     openvdb::Coord(last.x, last.y, last.z)};
    } else {
      entry.tree = levelset::vdb(solid.band).treePtr();
    }
    entry.voxelSize = solid.voxelSize();
    entry.indexToWorld = solid.indexToWorld();
    // The cubes of the partition are centred at the grid points.
    if (tetrahedralDegree(filter) > 0)
      entry.indexToWorld = Imath::M44d().setTranslation(V3d(-0.5)) * entry.indexToWorld;
    entry.worldToIndex = entry.indexToWorld.inverse();
    entry.filter = filter;
    entry.blocks = surfaceBlocks(entry.field());
    entry.id = solid.id;
    entry.index = i;
    entry.colour = solid.colour;
    entry.opacity = solid.opacity;
    for (const SurfaceBlock& block : entry.blocks)
      bounds.extendBy(Imath::transform(block.bounds(), entry.indexToWorld));
    if (!entry.blocks.empty()) solids.push_back(std::move(entry));
  }
  std::stable_sort(solids.begin(), solids.end(), [](const RaySolid& a, const RaySolid& b) {
    const double u = a.voxelSize, v = b.voxelSize;
    return u != v ? u < v : a.id < b.id;
  });
  std::vector<int> numbers(source.solids.size() + source.beziers.size(), -1);
  for (std::size_t s = 0; s < solids.size(); ++s) {
    solids[s].number = s;
    numbers[solids[s].index] = static_cast<int>(s);
  }
  for (std::size_t n = 0; n < parts.operandCount(); ++n)
    numbers[source.solids.size() + parts.operand(n)] = static_cast<int>(solids.size() + n);
  csg = source.csg.renumbered(numbers);
  if (bounds.isEmpty()) return;
  view = EmbreeSpace(bounds);
}

void EmbreeScene::Impl::build() {
  tree.open();
  for (RaySolid& solid : solids) {
    solid.view = &view;
    tree.addPrimitives(
        solid.blocks.size(), &solid,
        [](const RTCBoundsFunctionArguments* args) { boundBlock(args); },
        [](const RTCIntersectFunctionNArguments* args) { intersectBlock(args); },
        [](const RTCOccludedFunctionNArguments* args) { occludeBlock(args); });
  }
  tree.build();
}

std::optional<RayQuery> EmbreeScene::Impl::prepare(const V3d& origin, const V3d& direction,
                                                   double near, double far, double& moved,
                                                   RTCRay& ray) const {
  requireRay(origin, direction);
  if (!tree.scene) return std::nullopt;
  const auto entry = view.entryOf(origin, direction, near, far);
  if (!entry) return std::nullopt;
  moved = *entry;
  RayQuery query;
  rtcInitIntersectContext(&query.embree);
  query.origin = origin + direction * moved;
  query.direction = direction;
  query.limit = query.nearest = far - moved;
  query.scale = view.scale;
  ray = view.rayFrom(query.origin, direction, query.limit);
  return query;
}

std::vector<std::vector<SideChange>> EmbreeScene::Impl::allChanges(RayQuery& query,
                                                                   RTCRay ray) const {
  std::vector<std::vector<SideChange>> changes(solids.size());
  query.changes = &changes;
  RTCRayHit all;
  all.ray = ray;
  // This is beyond the end of the scaled scene, whose diagonal is 1. The crossings after `limit`
  // also count: the first one with a solid shows if the ray starts inside it.
  all.ray.tfar = 2;
  all.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  all.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(tree.scene, &query.embree, &all);
  query.changes = nullptr;
  return changes;
}

std::optional<CsgChange> EmbreeScene::Impl::findCsg(const SceneChanges& changes) const {
  std::optional<CsgChange> first;
  std::vector<std::vector<SideChange>> lists = changes.lists;
  walkChanges(csg, lists, [&](const CsgChange& change) {
    if (change.t <= changes.limit) first = change;
    return false;
  });
  return first;
}

SceneChanges EmbreeScene::Impl::changesOf(const V3d& origin, const V3d& direction, double near,
                                          double far) const {
  SceneChanges all;
  RTCRay ray;
  all.query = prepare(origin, direction, near, far, all.moved, ray);
  if (all.query)
    all.lists = allChanges(*all.query, ray);
  else
    all.moved = 0;
  all.limit = all.query ? all.query->limit : far;
  all.lists.resize(solids.size() + parts.operandCount());
  for (std::size_t n = 0; n < parts.operandCount(); ++n) {
    all.onBeziers.push_back(parts.operandCrossings(n, {origin, direction, near}));
    for (const JudgedParts::Crossing& crossing : all.onBeziers.back())
      all.lists[solids.size() + n].push_back({crossing.hit.distance - all.moved, crossing.enters});
  }
  return all;
}

Hit EmbreeScene::Impl::hitOf(const SceneChanges& all, const CsgChange& change) const {
  Hit hit;
  hit.isFlipped = change.isFlipped;
  if (change.solid < solids.size()) {
    complete(hit, *all.query, solids[change.solid], all.moved, change.t);
    return hit;
  }
  for (const JudgedParts::Crossing& crossing : all.onBeziers[change.solid - solids.size()])
    if (crossing.hit.distance - all.moved == change.t) hit = crossing.hit;
  hit.isFlipped = change.isFlipped;
  if (hit.isFlipped) hit.normal = hit.facetNormal = -hit.normal;
  return hit;
}

void EmbreeScene::Impl::complete(Hit& hit, const RayQuery& query, const RaySolid& solid,
                                 double moved, double t) const {
  hit.found = true;
  hit.distance = moved + t;
  hit.position = query.origin + query.direction * t;
  hit.id = solid.id;
  hit.solid = solid.index;
  hit.colour = solid.colour;
  hit.opacity = solid.opacity;
  const SurfaceShape shape = solid.shapeAt(hit.position);
  if (solid.isVolume) {
    addVolumeShape(hit, shape, solid.worldToIndex, solid.voxelSize, query.direction);
    addVolumeDirection(hit, shape, solid.worldToIndex);
  } else {
    addShape(hit, shape, solid.indexToWorld, query.direction);
    addDirection(hit, shape, solid.indexToWorld);
  }
}

EmbreeScene::EmbreeScene(const Scene& scene, Filter filter)
    : impl_(std::make_unique<Impl>(scene, filter)) {}
EmbreeScene::~EmbreeScene() = default;
EmbreeScene::EmbreeScene(EmbreeScene&&) noexcept = default;

Hit EmbreeScene::Impl::intersectParts(const Camera::Ray& ray, bool onlyOpaque) const {
  if (parts.isEmpty()) return {};
  requireRay(ray.origin, ray.direction);
  return parts.firstHit(ray, onlyOpaque);
}

Hit EmbreeScene::Impl::intersectSolids(const V3d& origin, const V3d& direction, double near,
                                       double far) const {
  if (fields) {
    requireRay(origin, direction);
    return fields->intersect(origin, direction, near, far);
  }
  if (!csg.isEmpty()) {
    const SceneChanges changes = changesOf(origin, direction, near, far);
    const auto change = findCsg(changes);
    return change ? hitOf(changes, *change) : Hit();
  }
  Hit hit;
  double moved;
  RTCRayHit rayHit;
  auto query = prepare(origin, direction, near, far, moved, rayHit.ray);
  if (!query) return hit;
  rayHit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rayHit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(tree.scene, &query->embree, &rayHit);
  if (query->solid) complete(hit, *query, *query->solid, moved, query->nearest);
  return hit;
}

Hit EmbreeScene::intersect(const V3d& origin, const V3d& direction, double near, double far) const {
  Hit nearest = impl_->intersectSolids(origin, direction, near, far);
  const auto end = [&] { return nearest.found ? nearest.distance : far; };
  if (!impl_->meshes.isEmpty()) {
    const Hit onMesh = impl_->meshes.intersect(origin, direction, near, end());
    if (onMesh.found) nearest = onMesh;
  }
  const Hit onPart = impl_->intersectParts({origin, direction, near, end()});
  return onPart.found ? onPart : nearest;
}

std::vector<Hit> EmbreeScene::intersectVisible(const V3d& origin, const V3d& direction, double near,
                                               double far) const {
  std::vector<Hit> hits;
  if (impl_->isOpaque) {
    const Hit hit = intersect(origin, direction, near, far);
    if (hit.found) hits.push_back(hit);
    return hits;
  }
  const Hit onOpaque = impl_->intersectParts({origin, direction, near, far}, /*onlyOpaque=*/true);
  if (onOpaque.found) far = onOpaque.distance;
  const std::vector<Hit> onBeziers = impl_->parts.transparentHits({origin, direction, near, far});
  auto nextBezier = onBeziers.begin();
  double share = 1;
  // Adds the hits with meshes and transparent Bézier volumes up to the distance `end` along the
  // ray. Returns true when a surface behind them is visible.
  const auto addTransparent = [&](double end) {
    while (share >= kLeastTransmittance) {
      const bool isBezier = nextBezier != onBeziers.end() && nextBezier->distance < end;
      const Hit onMesh =
          impl_->meshes.intersect(origin, direction, near, isBezier ? nextBezier->distance : end);
      if (!onMesh.found && !isBezier) break;
      const Hit& hit = onMesh.found ? onMesh : *nextBezier++;
      hits.push_back(hit);
      share *= 1 - hit.opacity;
      if (onMesh.found) near = onMesh.beyond();
    }
    return share >= kLeastTransmittance;
  };
  if (impl_->fields) {  // blended surfaces are opaque
    const Hit onSolid = impl_->intersectSolids(origin, direction, near, far);
    if (addTransparent(onSolid.found ? onSolid.distance : far) && onSolid.found)
      hits.push_back(onSolid);
    return hits;
  }
  const SceneChanges changes = impl_->changesOf(origin, direction, near, far);
  std::vector<std::vector<SideChange>> lists = changes.lists;
  walkChanges(impl_->csg, lists, [&](const CsgChange& change) {
    if (change.t > changes.limit || !addTransparent(changes.moved + change.t)) return false;
    const Hit hit = impl_->hitOf(changes, change);
    hits.push_back(hit);
    share *= 1 - hit.opacity;
    return share >= kLeastTransmittance;
  });
  if (addTransparent(far) && onOpaque.found) hits.push_back(onOpaque);
  return hits;
}

double EmbreeScene::transmittance(const V3d& origin, const V3d& direction, double far) const {
  if (impl_->isOpaque) return isOccluded(origin, direction, 0, far) ? 0 : 1;
  double share = 1;
  for (const Hit& hit : intersectVisible(origin, direction, 0, far)) share *= 1 - hit.opacity;
  return share;
}

bool EmbreeScene::isOccluded(const V3d& origin, const V3d& direction, double near,
                             double far) const {
  if (impl_->meshes.isOccluded(origin + direction * near, direction, far - near)) return true;
  if (impl_->intersectParts({origin, direction, near, far}).found) return true;
  if (impl_->fields) {
    requireRay(origin, direction);
    return impl_->fields->isOccluded(origin, direction, near, far);
  }
  if (!impl_->csg.isEmpty())
    return impl_->findCsg(impl_->changesOf(origin, direction, near, far)).has_value();
  double moved;
  RTCRay ray;
  auto query = impl_->prepare(origin, direction, near, far, moved, ray);
  if (!query) return false;
  rtcOccluded1(impl_->tree.scene, &query->embree, &ray);
  return ray.tfar < 0;
}

double EmbreeScene::thickness(const V3d& origin, const V3d& direction, double near,
                              double far) const {
  if (impl_->fields) {
    requireRay(origin, direction);
    return impl_->fields->thickness(origin, direction, near, far);
  }
  double moved;
  RTCRay ray;
  auto query = impl_->prepare(origin, direction, near, far, moved, ray);
  if (!query) return 0;
  auto changes = impl_->allChanges(*query, ray);
  // Without a CSG expression, a point is inside when any solid contains it.
  const auto isWithin = [&](const std::vector<char>& inside) {
    if (!impl_->csg.isEmpty()) return impl_->csg.holds(inside.data());
    return std::find(inside.begin(), inside.end(), 1) != inside.end();
  };
  // Bézier volumes of the expression count as absent; requirePicture() refuses them.
  std::vector<char> inside(changes.size() + impl_->parts.operandCount(), 0);
  std::vector<std::pair<SideChange, std::size_t>> all;
  for (std::size_t s = 0; s < changes.size(); ++s) {
    putInOrder(changes[s]);
    if (!changes[s].empty() && !changes[s][0].enters) inside[s] = 1;
    for (const SideChange& change : changes[s]) all.emplace_back(change, s);
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return a.first.t < b.first.t; });
  double length = 0, from = 0;
  for (const auto& [change, solid] : all) {
    const double to = std::min(change.t, query->limit);
    if (isWithin(inside)) length += to - from;
    from = to;
    inside[solid] = change.enters ? 1 : 0;
  }
  return length;
}

const Box3d& EmbreeScene::bounds() const {
  return impl_->allBounds;
}

}  // namespace render
