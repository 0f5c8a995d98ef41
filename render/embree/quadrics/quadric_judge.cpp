#include "render/embree/quadrics/quadric_judge.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "render/meshes/embree_space.h"

namespace render {
namespace {

using Imath::Box3d;
using Imath::V3d;
using Extended = long double;
using Triple = std::array<Extended, 3>;

Triple tripleOf(const V3d& v) {
  return {static_cast<Extended>(v.x), static_cast<Extended>(v.y), static_cast<Extended>(v.z)};
}
Extended product(const Triple& a, const Triple& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Triple along(const Triple& a, const Triple& d, Extended t) {
  return {a[0] + t * d[0], a[1] + t * d[1], a[2] + t * d[2]};
}
Triple crossOf(const Triple& a, const Triple& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// A quadric p∘S p + 2 linear·p + constant = 0 for positions p from a centre, between the planes
/// plane·p = low and plane·p = high.
struct MatrixQuadric {
  Triple centre{};
  std::array<Triple, 3> matrix{};
  Triple linear{}, plane{};
  Extended constant = 0, low = 0, high = 0;
  bool hasEnds = false, isCapped = false;

  void addSquare(const Triple& row, Extended weight) {
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) matrix[i][j] += weight * row[i] * row[j];
  }
  [[nodiscard]] Triple times(const Triple& p) const {
    return {product(matrix[0], p), product(matrix[1], p), product(matrix[2], p)};
  }
  [[nodiscard]] Extended valueAt(const Triple& p) const {
    return product(p, times(p)) + 2 * product(linear, p) + constant;
  }
};

MatrixQuadric matrixOf(const Ball& ball) {
  MatrixQuadric result;
  result.centre = tripleOf(ball.centre);
  for (std::size_t i = 0; i < 3; ++i) result.matrix[i][i] = 1;
  const auto r = static_cast<Extended>(ball.radius);
  result.constant = -r * r;
  return result;
}

MatrixQuadric matrixOf(const Stick& stick) {
  MatrixQuadric result;
  result.centre = tripleOf(stick.a);
  const Triple axis = along(tripleOf(stick.b), tripleOf(stick.a), -1);
  const Extended square = product(axis, axis);
  for (std::size_t i = 0; i < 3; ++i) result.matrix[i][i] = 1;
  result.addSquare(axis, -1 / square);
  const auto r = static_cast<Extended>(stick.radius);
  result.constant = -r * r;
  for (std::size_t i = 0; i < 3; ++i) result.plane[i] = axis[i] / square;
  result.high = 1;
  result.hasEnds = result.isCapped = true;
  return result;
}

MatrixQuadric matrixOf(const Quadric& quadric) {
  MatrixQuadric result;
  result.centre = tripleOf(quadric.position);
  const Triple u = tripleOf(quadric.axes[0]), v = tripleOf(quadric.axes[1]),
               w = tripleOf(quadric.axes[2]);
  std::array<Triple, 3> rows = {crossOf(v, w), crossOf(w, u), crossOf(u, v)};
  const Extended volume = product(u, rows[0]);
  for (Triple& row : rows)
    for (Extended& entry : row) entry /= volume;
  result.addSquare(rows[0], 1);
  result.addSquare(rows[1], 1);
  switch (quadric.kind) {
    case QuadricKind::Ellipsoid:
      result.addSquare(rows[2], 1);
      result.constant = -1;
      break;
    case QuadricKind::Cylinder:
      result.constant = -1;
      break;
    case QuadricKind::Cone:
      result.addSquare(rows[2], -1);
      break;
    case QuadricKind::Paraboloid:
      for (std::size_t i = 0; i < 3; ++i) result.linear[i] = -rows[2][i] / 2;
      break;
    case QuadricKind::OneSheet:
      result.addSquare(rows[2], -1);
      result.constant = -1;
      break;
    case QuadricKind::TwoSheet:
      result.addSquare(rows[2], -1);
      result.constant = 1;
      break;
  }
  result.plane = rows[2];
  result.low = static_cast<Extended>(quadric.range.low);
  result.high = static_cast<Extended>(quadric.range.high);
  result.hasEnds = quadric.kind != QuadricKind::Ellipsoid;
  result.isCapped = result.hasEnds && quadric.isCapped;
  return result;
}

/// Box of the image of the parameter box that contains a quadric.
Box3d looseBox(const Quadric& quadric) {
  double radius = 1;
  QuadricRange range = quadric.range;
  const double most = std::max(std::abs(range.low), std::abs(range.high));
  switch (quadric.kind) {
    case QuadricKind::Ellipsoid:
      range = {-1, 1};
      break;
    case QuadricKind::Paraboloid:
      radius = std::sqrt(most);
      break;
    case QuadricKind::Cylinder:
      break;
    default:
      radius = std::hypot(most, 1.0);
  }
  Box3d box;
  for (const double x : {-radius, radius})
    for (const double y : {-radius, radius})
      for (const double z : {range.low, range.high})
        box.extendBy(quadric.position + quadric.axes[0] * x + quadric.axes[1] * y +
                     quadric.axes[2] * z);
  return box;
}

Box3d looseBox(const Ball& ball) {
  const V3d radius(static_cast<double>(ball.radius));
  return {ball.centre - radius, ball.centre + radius};
}

Box3d looseBox(const Stick& stick) {
  Box3d box = looseBox(Ball{stick.a, stick.radius, 0});
  box.extendBy(looseBox(Ball{stick.b, stick.radius, 0}));
  return box;
}

}  // namespace

struct QuadricJudge::Data {
  QuadricModel model;
  EmbreeSpace space;
  EmbreeTree tree;

  struct Query {
    RTCIntersectContext embree;
    const Camera::Ray* ray = nullptr;
    double start = 0;  // distance of the start of Embree's ray
    double near = 0, nearest = 0;
    bool found = false;
    unsigned primitive = 0;
    int face = 0;  // −1, 1: lower and upper cap
  };

  explicit Data(QuadricModel given) : model(std::move(given)) {
    Box3d box;
    for (unsigned n = 0; n < model.size(); ++n) box.extendBy(boxOf(n));
    space = EmbreeSpace(box);
    tree.open();
    tree.addPrimitives(model.size(), this, bound, intersect, nullptr);
    tree.build();
  }

  template <typename Use>
  decltype(auto) with(unsigned n, const Use& use) const {
    const std::size_t balls = model.balls.size(), sticks = model.sticks.size();
    if (n < balls) return use(model.balls[n]);
    if (n < balls + sticks) return use(model.sticks[n - balls]);
    return use(model.quadrics[n - balls - sticks]);
  }
  [[nodiscard]] Box3d boxOf(unsigned n) const {
    return with(n, [](const auto& primitive) { return looseBox(primitive); });
  }
  [[nodiscard]] MatrixQuadric matrix(unsigned n) const {
    return with(n, [](const auto& primitive) { return matrixOf(primitive); });
  }

  static void bound(const RTCBoundsFunctionArguments* args) {
    const auto& data = *static_cast<const Data*>(args->geometryUserPtr);
    *args->bounds_o = data.space.boundsOf(data.boxOf(args->primID));
  }

  static void intersect(const RTCIntersectFunctionNArguments* args) {
    if (!args->valid[0]) return;
    auto& query = *reinterpret_cast<Query*>(args->context);
    const auto& data = *static_cast<const Data*>(args->geometryUserPtr);
    if (!data.solve(args->primID, query)) return;
    RTCRayN* ray = RTCRayHitN_RayN(args->rayhit, args->N);
    RTCRayN_tfar(ray, args->N, 0) = std::min(
        RTCRayN_tfar(ray, args->N, 0),
        static_cast<float>((query.nearest - query.start) * data.space.scale + EmbreeSpace::kPad));
    RTCHitN* hit = RTCRayHitN_HitN(args->rayhit, args->N);
    RTCHitN_geomID(hit, args->N, 0) = args->geomID;
    RTCHitN_primID(hit, args->N, 0) = args->primID;
  }

  /// Looks for an intersection that is nearer than the nearest so far.
  bool solve(unsigned primitive, Query& query) const {
    const MatrixQuadric q = matrix(primitive);
    const Triple d = tripleOf(query.ray->direction);
    Triple p = along(tripleOf(query.ray->origin), q.centre, -1);
    const Extended moved = -product(p, d) / product(d, d);
    p = along(p, d, moved);
    bool isNearer = false;
    const auto take = [&](Extended t, int face) {
      const auto distance = static_cast<double>(moved + t);
      if (!(distance >= query.near) || !(distance <= query.nearest)) return;
      if (query.found && distance == query.nearest) return;
      query.nearest = distance;
      query.found = isNearer = true;
      query.primitive = primitive;
      query.face = face;
    };
    const Triple image = q.times(d);
    const Extended a = product(d, image), b = product(p, image) + product(q.linear, d),
                   c = q.valueAt(p), square = b * b - a * c;
    if (square >= 0) {
      const Extended root = std::sqrt(square);
      const auto side = [&](Extended t) {
        if (!std::isfinite(t)) return;
        for (int step = 0; step < 2; ++step) {  // Newton
          const Extended slope = 2 * (a * t + b);
          if (slope != 0) t -= (a * t * t + 2 * b * t + c) / slope;
        }
        const Extended height = product(q.plane, along(p, d, t));
        if (!q.hasEnds || (height >= q.low && height <= q.high)) take(t, 0);
      };
      if (b > 0) {
        side((-b - root) / a);
        side(c / (-b - root));
      } else {
        side((-b + root) / a);
        side(c / (-b + root));
      }
    }
    const Extended climb = product(q.plane, d);
    if (q.isCapped && climb != 0)
      for (const int face : {-1, 1}) {
        const Extended t = ((face < 0 ? q.low : q.high) - product(q.plane, p)) / climb;
        if (q.valueAt(along(p, d, t)) <= 0) take(t, face);
      }
    return isNearer;
  }

  [[nodiscard]] JudgedQuadric resultOf(const Query& query) const {
    JudgedQuadric result;
    if (!query.found) return result;
    result.found = true;
    result.distance = query.nearest;
    const MatrixQuadric q = matrix(query.primitive);
    Triple normal = q.plane;
    if (query.face == 0) {
      const Triple p = along(along(tripleOf(query.ray->origin), q.centre, -1),
                             tripleOf(query.ray->direction), static_cast<Extended>(query.nearest));
      normal = along(q.times(p), q.linear, 1);
    }
    const Extended length = std::sqrt(product(normal, normal)) * (query.face < 0 ? -1 : 1);
    for (int n = 0; n < 3; ++n)
      result.normal[n] = static_cast<double>(normal[static_cast<std::size_t>(n)] / length);
    result.colour = with(query.primitive, [](const auto& primitive) -> Imath::C3f {
      if constexpr (requires { primitive.kind; })
        return primitive.colour;
      else
        return unpackedColour(primitive.colour);
    });
    return result;
  }
};

QuadricJudge::QuadricJudge(QuadricModel model) : data_(std::make_unique<Data>(std::move(model))) {}
QuadricJudge::~QuadricJudge() = default;
QuadricJudge::QuadricJudge(QuadricJudge&&) noexcept = default;
QuadricJudge& QuadricJudge::operator=(QuadricJudge&&) noexcept = default;

JudgedQuadric QuadricJudge::firstHit(const Camera::Ray& ray) const {
  const Data& data = *data_;
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
