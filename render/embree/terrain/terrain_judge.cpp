#include "render/embree/terrain/terrain_judge.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <vector>

#include "render/meshes/embree_space.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::HeightField;
using Extended = long double;

constexpr int kBlock = 8;  // cells along an edge of a block

struct ExtendedVector {
  Extended x, y, z;
};

ExtendedVector difference(const V3d& a, const V3d& b) {
  return {static_cast<Extended>(a.x) - static_cast<Extended>(b.x),
          static_cast<Extended>(a.y) - static_cast<Extended>(b.y),
          static_cast<Extended>(a.z) - static_cast<Extended>(b.z)};
}
Extended inner(const ExtendedVector& a, const ExtendedVector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
ExtendedVector outer(const ExtendedVector& a, const ExtendedVector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
V3d unitOf(const ExtendedVector& v, Extended sign) {
  const Extended scale = sign / std::sqrt(inner(v, v));
  return {static_cast<double>(v.x * scale), static_cast<double>(v.y * scale),
          static_cast<double>(v.z * scale)};
}

/// A triangle of the ground: columns and rows of its corners, counter-clockwise seen from above.
struct GroundTriangle {
  std::array<int, 3> column, row;
};

}  // namespace

struct TerrainJudge::Data {
  struct Query {
    RTCIntersectContext embree;  // first member: Embree returns its address
    const Camera::Ray* ray;
    double start, near, nearest;
    GroundTriangle triangle{};
    std::array<Extended, 3> shares{};  // of the corners, at the intersection
    bool found = false;
  };

  TerrainCaster terrain;
  const HeightField& field;
  int blocksAcross = 0;
  std::vector<unsigned> blocks;  // those with a triangle
  EmbreeSpace space;
  EmbreeTree tree;

  explicit Data(const TerrainCaster& of) : terrain(of), field(terrain.field()) {
    blocksAcross = (field.columns - 2) / kBlock + 1;
    const int blocksUp = (field.rows - 2) / kBlock + 1;
    for (int block = 0; block < blocksAcross * blocksUp; ++block)
      if (!boxOf(static_cast<unsigned>(block)).isEmpty())
        blocks.push_back(static_cast<unsigned>(block));
    if (blocks.empty()) return;
    space = EmbreeSpace(terrain.bounds());
    tree.open();
    tree.addPrimitives(blocks.size(), this, bound, intersect,
                       [](const RTCOccludedFunctionNArguments*) {});
    tree.build();
  }

  [[nodiscard]] V3d pointAt(int column, int row) const {
    return field.point(column, row) * terrain.options().transform;
  }

  /// True if the cell and its neighbours lie in the box that is left out.
  [[nodiscard]] bool isOutside(int column, int row) const {
    if (!terrain.options().outside) return false;
    const Imath::Box3d& box = *terrain.options().outside;
    for (int n = 0; n < 4; ++n) {
      const bool isRight = n % 2 != 0, isUp = n / 2 != 0;
      const int i = isRight ? std::min(column + 2, field.columns - 1) : std::max(column - 1, 0),
                j = isUp ? std::min(row + 2, field.rows - 1) : std::max(row - 1, 0);
      const Imath::V2d p = field.position(i, j);
      if (p.x < box.min.x || p.x > box.max.x || p.y < box.min.y || p.y > box.max.y) return false;
    }
    return true;
  }

  /// Calls visit(triangle) for the triangles of a block.
  template <typename Visit>
  void forEachTriangle(unsigned block, const Visit& visit) const {
    const int left = static_cast<int>(block) % blocksAcross * kBlock,
              low = static_cast<int>(block) / blocksAcross * kBlock;
    for (int j = low; j < std::min(low + kBlock, field.rows - 1); ++j)
      for (int i = left; i < std::min(left + kBlock, field.columns - 1); ++i) {
        if (isOutside(i, j)) continue;
        for (const GroundTriangle& triangle : {GroundTriangle{{i, i + 1, i + 1}, {j, j, j + 1}},
                                               GroundTriangle{{i, i + 1, i}, {j, j + 1, j + 1}}}) {
          bool isWhole = true;
          for (std::size_t n = 0; n < 3; ++n)
            isWhole = isWhole && !field.isMissing(triangle.column[n], triangle.row[n]);
          if (isWhole) visit(triangle);
        }
      }
  }

  [[nodiscard]] Imath::Box3d boxOf(unsigned block) const {
    Imath::Box3d box;
    forEachTriangle(block, [&](const GroundTriangle& triangle) {
      for (std::size_t n = 0; n < 3; ++n)
        box.extendBy(pointAt(triangle.column[n], triangle.row[n]));
    });
    return box;
  }

  static void bound(const RTCBoundsFunctionArguments* args) {
    const auto& data = *static_cast<const Data*>(args->geometryUserPtr);
    *args->bounds_o = data.space.boundsOf(data.boxOf(data.blocks[args->primID]));
  }

  static void intersect(const RTCIntersectFunctionNArguments* args) {
    if (!args->valid[0]) return;
    auto& query = *reinterpret_cast<Query*>(args->context);
    const auto& data = *static_cast<const Data*>(args->geometryUserPtr);
    const double before = query.nearest;
    data.forEachTriangle(data.blocks[args->primID],
                         [&](const GroundTriangle& triangle) { data.meet(triangle, query); });
    if (!query.found || query.nearest >= before) return;
    RTCRayN* ray = RTCRayHitN_RayN(args->rayhit, args->N);
    RTCRayN_tfar(ray, args->N, 0) = std::min(
        RTCRayN_tfar(ray, args->N, 0),
        static_cast<float>((query.nearest - query.start) * data.space.scale + EmbreeSpace::kPad));
    RTCHitN* hit = RTCRayHitN_HitN(args->rayhit, args->N);
    RTCHitN_geomID(hit, args->N, 0) = args->geomID;
    RTCHitN_primID(hit, args->N, 0) = args->primID;
  }

  /// Keeps an intersection with a triangle that is nearer than the nearest so far.
  void meet(const GroundTriangle& triangle, Query& query) const {
    const auto cornerAt = [&](std::size_t n) {
      return pointAt(triangle.column[n], triangle.row[n]);
    };
    const V3d corner = cornerAt(0);
    const ExtendedVector b = difference(cornerAt(1), corner), c = difference(cornerAt(2), corner),
                         from = difference(query.ray->origin, corner),
                         along = difference(query.ray->direction, V3d(0));
    const ExtendedVector across = outer(along, c);
    const Extended area = inner(b, across);
    if (area == 0) return;
    // Neighbours overlap by this share of an edge, so that no ray passes between them.
    constexpr Extended kOverlap = 1e-12L;
    const ExtendedVector turned = outer(from, b);
    const Extended u = inner(from, across) / area, v = inner(along, turned) / area;
    if (!(u >= -kOverlap && v >= -kOverlap && u + v <= 1 + kOverlap)) return;
    const auto distance = static_cast<double>(inner(c, turned) / area);
    if (!(distance >= query.near && distance <= query.nearest)) return;
    const auto isBefore = [](const GroundTriangle& one, const GroundTriangle& other) {
      return std::tie(one.row, one.column) < std::tie(other.row, other.column);
    };
    if (query.found && distance == query.nearest && !isBefore(triangle, query.triangle)) return;
    query.nearest = distance;
    query.found = true;
    query.triangle = triangle;
    query.shares = {1 - u - v, u, v};
  }

  /// Change of the position from a sample to the next one along an axis: half of that between both
  /// neighbours, or that on the known side. Without neighbours the ground is level there.
  [[nodiscard]] ExtendedVector tangent(int column, int row, int right, int up) const {
    const auto isKnown = [&](int i, int j) {
      return i >= 0 && j >= 0 && i < field.columns && j < field.rows && !field.isMissing(i, j);
    };
    const int i = column + right, j = row + up, k = column - right, l = row - up;
    const bool hasNext = isKnown(i, j), hasLast = isKnown(k, l);
    const V3d here = pointAt(column, row);
    if (!hasNext && !hasLast) {  // level
      const V3d step(right * field.spacing.x, up * field.spacing.y, 0);
      return difference((field.point(column, row) + step) * terrain.options().transform, here);
    }
    const V3d next = hasNext ? pointAt(i, j) : here, last = hasLast ? pointAt(k, l) : here;
    ExtendedVector result = difference(next, last);
    const Extended scale = hasNext && hasLast ? 0.5L : 1.0L;
    return {result.x * scale, result.y * scale, result.z * scale};
  }

  [[nodiscard]] JudgedGround resultOf(const Query& query) const {
    JudgedGround result;
    if (!query.found) return result;
    result.found = true;
    result.distance = query.nearest;
    const Extended upwards = terrain.options().transform.determinant() < 0 ? -1 : 1;
    const GroundTriangle& t = query.triangle;
    const V3d corner = pointAt(t.column[0], t.row[0]);
    result.facetNormal = unitOf(outer(difference(pointAt(t.column[1], t.row[1]), corner),
                                      difference(pointAt(t.column[2], t.row[2]), corner)),
                                upwards);
    ExtendedVector along{0, 0, 0}, across{0, 0, 0};
    Extended height = 0;
    const auto add = [](ExtendedVector& to, const ExtendedVector& v, Extended share) {
      to = {to.x + v.x * share, to.y + v.y * share, to.z + v.z * share};
    };
    for (std::size_t n = 0; n < 3; ++n) {
      add(along, tangent(t.column[n], t.row[n], 1, 0), query.shares[n]);
      add(across, tangent(t.column[n], t.row[n], 0, 1), query.shares[n]);
      height += static_cast<Extended>(field.at(t.column[n], t.row[n])) * query.shares[n];
    }
    result.height = static_cast<double>(height);
    result.normal =
        terrain.options().isSmooth ? unitOf(outer(along, across), upwards) : result.facetNormal;
    return result;
  }
};

TerrainJudge::TerrainJudge(const TerrainCaster& terrain) : data_(std::make_unique<Data>(terrain)) {}
TerrainJudge::~TerrainJudge() = default;
TerrainJudge::TerrainJudge(TerrainJudge&&) noexcept = default;
TerrainJudge& TerrainJudge::operator=(TerrainJudge&&) noexcept = default;

JudgedGround TerrainJudge::firstHit(const Camera::Ray& ray) const {
  const Data& data = *data_;
  if (data.blocks.empty()) return {};
  const auto entry = data.space.entryOf(ray.origin, ray.direction, ray.near, ray.far);
  if (!entry) return {};
  Data::Query query;
  rtcInitIntersectContext(&query.embree);
  query.ray = &ray;
  query.start = *entry;
  query.near = ray.near;
  query.nearest = ray.far;
  RTCRayHit rayHit;
  rayHit.ray = data.space.rayFrom(ray.origin + ray.direction * query.start, ray.direction,
                                  ray.far - query.start);
  rayHit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rayHit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(data.tree.scene, &query.embree, &rayHit);
  return data.resultOf(query);
}

}  // namespace render
