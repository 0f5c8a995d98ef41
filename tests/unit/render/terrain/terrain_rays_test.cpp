// Ray casting of height fields: closed forms, brute force, and rays that meet edges and corners.

#include <gtest/gtest.h>

#include <Imath/ImathMatrixAlgo.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/error.h"
#include "render/embree/terrain/terrain_judge.h"
#include "render/terrain/rays/height_walk.h"
#include "render/terrain/rays/terrain_caster.h"
#include "render/terrain/rays/terrain_tables.h"
#include "tests/support/measured.h"
#include "tests/support/terrain_rays.h"

namespace terrain_rays_test {

using Imath::V2d;
using Imath::V3d;
using levelset::HeightField;
using terrain_rays::Numbers;
using terrain_rays::shared;
using namespace render;

TEST(TerrainRays, MeetAPlaneWhereTheyShould) {
  // Heights with few bits, so that the triangles lie in the plane.
  const TerrainCaster caster(shared(support::terrainOf(
      40, 25, {0.5, 0.25}, [](double x, double y) { return 3 + 0.5 * x - 0.25 * y; })));
  Numbers numbers(1);
  double most = 0;
  int hits = 0;
  for (int n = 0; n < 20'000; ++n) {
    const V3d origin = V3d(0, 0, 3) + numbers.inBox(20), direction = numbers.unit();
    const TerrainHit hit = caster.firstHit({origin, direction});
    const V3d normal = V3d(-0.5, 0.25, 1);
    const double t = (3 - normal.dot(origin)) / normal.dot(direction);
    const V3d at = origin + direction * t;
    const bool isIn = t >= 0 && std::abs(at.x) <= 9.75 && std::abs(at.y) <= 3;
    EXPECT_EQ(hit.found, isIn);
    if (!hit.found) continue;
    ++hits;
    most = std::max(most, std::abs(hit.distance - t) * std::abs(normal.dot(direction)));
    EXPECT_NEAR(hit.height, at.z, 1e-12);
    EXPECT_LT((hit.normal - normal.normalized()).length(), 1e-14);
    EXPECT_LT((hit.facetNormal - normal.normalized()).length(), 1e-14);
  }
  EXPECT_GT(hits, 400);
  EXPECT_LT(most, support::doubleRounding(100));  // 40 measured
}

TEST(TerrainRays, MeetAPyramid) {
  // 4 − |x| − |y|, whose edges are edges of the triangles.
  const TerrainCaster caster(shared(support::terrainOf(
      33, 33, {0.25, 0.25}, [](double x, double y) { return 4 - std::abs(x) - std::abs(y); })));
  Numbers numbers(2);
  int hits = 0;
  for (int n = 0; n < 20'000; ++n) {
    const V3d origin = V3d(0, 0, 2) + numbers.inBox(6), direction = numbers.unit();
    double t = std::numeric_limits<double>::infinity();
    for (const double sx : {-1.0, 1.0})
      for (const double sy : {-1.0, 1.0}) {
        const V3d normal(sx, sy, 1);
        const double own = (4 - normal.dot(origin)) / normal.dot(direction);
        const V3d at = origin + direction * own;
        if (own >= 0 && own < t && sx * at.x >= 0 && sy * at.y >= 0 && std::abs(at.x) <= 4 &&
            std::abs(at.y) <= 4)
          t = own;
      }
    const TerrainHit hit = caster.firstHit({origin, direction});
    EXPECT_EQ(hit.found, std::isfinite(t));
    if (!hit.found || !std::isfinite(t)) continue;
    ++hits;
    EXPECT_NEAR(hit.distance, t, 1e-11);
  }
  EXPECT_GT(hits, 3000);
}

TEST(TerrainRays, ConvergeToAConeInSecondOrder) {
  double last = 0;
  for (const int cells : {16, 32, 64}) {
    const TerrainCaster caster(
        shared(support::terrainOf(cells + 1, cells + 1, {4.0 / cells, 4.0 / cells},
                                  [](double x, double y) { return 2 - std::hypot(x, y); })));
    Numbers numbers(3);
    double sum = 0;
    int count = 0;
    for (int n = 0; n < 4000; ++n) {
      // From above, to a point of the cone away from its tip.
      const double angle = numbers.between(0, 6.28), radius = numbers.between(0.6, 1.6);
      const V3d at(radius * std::cos(angle), radius * std::sin(angle), 2 - radius);
      const V3d origin = at + V3d(numbers.between(-0.3, 0.3), numbers.between(-0.3, 0.3), 1);
      const TerrainHit hit = caster.firstHit({origin, (at - origin).normalized()});
      ASSERT_TRUE(hit.found);
      sum += std::pow(hit.distance - (at - origin).length(), 2);
      ++count;
    }
    const double error = std::sqrt(sum / count);
    if (last > 0) {
      EXPECT_GT(last / error, 3.5);
      EXPECT_LT(last / error, 4.5);
    }
    last = error;
  }
}

/// Intersections of a ray with the triangles of a field, in extended precision: the nearest one
/// that is certain, and all that are possible, whose positions in the triangles are uncertain by
/// kDoubt.
struct Possible {
  long double certain = std::numeric_limits<long double>::infinity();
  std::vector<long double> all = {};
};

Possible everyTriangle(const HeightField& field, const Camera::Ray& ray) {
  constexpr long double kDoubt = 1e-9L;
  using L = std::array<long double, 3>;
  const auto minus = [](const V3d& a, const V3d& b) {
    return L{static_cast<long double>(a.x) - b.x, static_cast<long double>(a.y) - b.y,
             static_cast<long double>(a.z) - b.z};
  };
  const auto dot = [](const L& a, const L& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  const auto cross = [](const L& a, const L& b) {
    return L{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  Possible found;
  for (int row = 0; row + 1 < field.rows; ++row)
    for (int column = 0; column + 1 < field.columns; ++column)
      for (const bool isUpper : {false, true}) {
        const V3d a = field.point(column, row),
                  b = isUpper ? field.point(column + 1, row + 1) : field.point(column + 1, row),
                  c = isUpper ? field.point(column, row + 1) : field.point(column + 1, row + 1);
        if (std::isnan(a.z + b.z + c.z)) continue;
        const L d = minus(ray.direction, V3d(0)), e = minus(b, a), f = minus(c, a),
                from = minus(ray.origin, a);
        const L across = cross(d, f), turned = cross(from, e);
        const long double area = dot(e, across);
        if (area == 0) continue;
        const long double u = dot(from, across) / area, v = dot(d, turned) / area,
                          t = dot(f, turned) / area;
        const long double inside = std::min({u, v, 1 - u - v});
        if (!(inside > -kDoubt) || t < ray.near || t > ray.far) continue;
        found.all.push_back(t);
        if (inside > kDoubt) found.certain = std::min(found.certain, t);
      }
  return found;
}

/// A ray of some kind: random, along an axis, through corners and edges, from below, from inside
/// the heights, or nearly level.
Camera::Ray someRay(const HeightField& field, int kind, Numbers& numbers) {
  const Imath::Box3d box = field.bounds();
  const V3d size = box.size();
  const auto within = [&](double margin) {
    return box.min + V3d((size.x + 2 * margin) * numbers() - margin,
                         (size.y + 2 * margin) * numbers() - margin, size.z * numbers());
  };
  V3d target = within(0);
  if (kind % 4 != 0) {  // a corner, or a point of an edge
    const auto pick = [&](int count) {
      return std::min(static_cast<int>(numbers() * count), count - 1);
    };
    const int column = pick(field.columns - 1), row = pick(field.rows - 1);
    const V3d corner = field.point(column, row);
    const V3d other = kind % 4 == 1   ? corner
                      : kind % 4 == 2 ? field.point(column + 1, row)
                                      : field.point(column + 1, row + 1);
    const V3d on = corner * 0.5 + other * 0.5;
    if (!std::isnan(on.z)) target = on;
  }
  V3d origin = within(size.x);
  switch (kind / 4 % 6) {
    case 0:
      origin.z = box.max.z + size.x * numbers();
      break;
    case 1:
      origin.z = box.min.z - size.x * numbers();
      break;
    case 2:
      origin.z = target.z + 1e-3 * size.z * numbers();  // nearly level
      break;
    case 3: {  // along an axis
      const int axis = static_cast<int>(3 * numbers()) % 3;
      origin = target;
      origin[axis] += (numbers() < 0.5 ? -1 : 1) * 2 * size.x;
      break;
    }
    case 4:  // in a plane of the grid
      origin = target + V3d(0, numbers.between(-3, 3), numbers.between(-3, 3));
      if (numbers() < 0.5) std::swap(origin.x, origin.y), std::swap(target.x, target.y);
      break;
    default:
      origin = within(0);
  }
  Camera::Ray ray{origin, target - origin};
  const double length = ray.direction.length();
  ray.direction = length > 0 ? ray.direction / length : V3d(0, 0, -1);
  if (numbers() < 0.2) ray.far = numbers() * 2 * size.x;
  if (numbers() < 0.2) ray.near = numbers() * size.x;
  return ray;
}

void expectEveryTriangle(const HeightField& field, int rays, std::uint64_t seed) {
  const TerrainCaster caster(shared(field));
  Numbers numbers(seed);
  int hits = 0, beyond = 0, impossible = 0, missed = 0, unlikeOcclusion = 0;
  long double most = 0;
  for (int n = 0; n < rays; ++n) {
    const Camera::Ray ray = someRay(field, n, numbers);
    const TerrainHit hit = caster.firstHit(ray);
    const Possible truth = everyTriangle(field, ray);
    unlikeOcclusion += caster.isOccluded(ray) != hit.found;
    missed += !hit.found && std::isfinite(truth.certain);
    if (!hit.found) continue;
    ++hits;
    const auto t = static_cast<long double>(hit.distance);
    long double nearest = std::numeric_limits<long double>::infinity();
    for (const long double one : truth.all) nearest = std::min(nearest, std::abs(one - t));
    impossible += !(nearest < 1e-6L);
    beyond += t > truth.certain + 1e-6L;
    if (nearest < 1e-6L) most = std::max(most, nearest);
  }
  EXPECT_EQ(missed, 0);
  EXPECT_EQ(impossible, 0);
  EXPECT_EQ(beyond, 0);
  EXPECT_EQ(unlikeOcclusion, 0);
  EXPECT_GT(hits, rays / 4);
  EXPECT_LT(static_cast<double>(most), support::measured(9.4e-13));
}

TEST(TerrainRays, AgreeWithATestOfAllTriangles) {
  expectEveryTriangle(support::randomTerrain(7, 5, 0, 5), 100'000, 6);
  expectEveryTriangle(support::randomTerrain(2, 2, 0, 7), 4'000, 8);
  expectEveryTriangle(support::randomTerrain(2, 33, 0, 9), 4'000, 10);
  expectEveryTriangle(support::randomTerrain(18, 3, 0, 11), 4'000, 12);
}

TEST(TerrainRays, PassThroughHoles) {
  expectEveryTriangle(support::randomTerrain(12, 9, 0.15, 13), 20'000, 14);
  // A ray through the middle of a missing triangle, and one through its neighbour.
  HeightField field = support::terrainOf(2, 2, {1, 1}, [](double, double) { return 0; });
  field.heights[field.index(1, 0)] = levelset::kMissingHeight;
  const TerrainCaster caster(shared(field));
  EXPECT_FALSE(caster.firstHit({V3d(0.2, -0.2, 1), V3d(0, 0, -1)}).found);
  EXPECT_TRUE(caster.firstHit({V3d(-0.2, 0.2, 1), V3d(0, 0, -1)}).found);
  field.heights.assign(4, levelset::kMissingHeight);
  const TerrainCaster none(shared(field));
  EXPECT_TRUE(none.bounds().isEmpty());
  EXPECT_FALSE(none.firstHit({V3d(-0.2, 0.2, 1), V3d(0, 0, -1)}).found);
}

/// Numbers of rays from above the ground to below it that miss it. All aim at corners or edges.
int slipped(const HeightField& field, const Imath::M44d& transform, int rays, std::uint64_t seed) {
  const TerrainCaster caster(shared(field), {.transform = transform});
  Numbers numbers(seed);
  const Imath::Box3d box = field.bounds();
  const double above = box.max.z + 1, below = box.min.z - 1;
  int missed = 0;
  for (int n = 0; n < rays; ++n) {
    const auto pick = [&](int count) { return 1 + static_cast<int>(numbers() * (count - 3)); };
    const int column = pick(field.columns), row = pick(field.rows);
    const V3d corner = field.point(column, row);
    const double share = n % 3 == 0 ? 0 : numbers();
    const V3d other = field.point(column + (n % 2), row + (n % 4 == 0 ? 0 : 1));
    const V3d target = corner * (1 - share) + other * share;
    // The steps keep both ends inside the border of the ground.
    V3d step(numbers.between(-0.5, 0.5), numbers.between(-0.5, 0.5), -1);
    if (n % 5 == 0) step.x = 0;
    if (n % 7 == 0) step.y = 0;
    if (n % 11 == 0) step.y = step.x;
    const double reach = std::min(field.spacing.x, field.spacing.y) / (above - below);
    step.x *= reach;
    step.y *= reach;
    V3d from = target - step * (above - target.z), to = target + step * (target.z - below);
    if (n % 13 == 0) std::swap(from, to);
    from = from * transform;
    to = to * transform;
    const V3d along = to - from;
    const TerrainHit hit = caster.firstHit({from, along, 0, 1});
    missed += !hit.found;
  }
  return missed;
}

TEST(TerrainRays, NeverPassBetweenTwoTriangles) {
  const HeightField field = support::randomTerrain(40, 40, 0, 15);
  EXPECT_EQ(slipped(field, {}, 200'000, 16), 0);
  HeightField far = field;
  far.origin = {1e6, -2e6};
  far.spacing = {0.37, 1.21};
  for (float& height : far.heights) height += 4096;
  EXPECT_EQ(slipped(far, {}, 100'000, 17), 0);
  Imath::M44d turned;
  turned.rotate(V3d(0.3, 0.5, 0.7));
  turned[3][0] = 12;
  EXPECT_EQ(slipped(field, turned, 100'000, 18), 0);
}

/// Compares the walk in one call, in short steps, by 16 nodes, and through all cells from the last
/// one on.
void expectAllOrders(const HeightField& field, const TerrainCaster& caster) {
  const TerrainTables& tables = *caster.tables();
  Numbers numbers(20);
  int hits = 0;
  for (int n = 0; n < 1500; ++n) {
    const Camera::Ray ray = someRay(field, n, numbers);
    const HeightKernel::HeightRay grid = tables.gridRay(ray);
    HeightKernel kernel = tables.kernel();
    HeightKernel::HeightWalk whole = tables.start(), steps = whole, reversed = whole;
    kernel.walkHeights(grid, false, 1'000'000, whole);
    while (steps.level <= tables.topLevel) kernel.walkHeights(grid, false, 3, steps);
    for (int row = tables.cellsV - 1; row >= 0; --row)
      for (int column = tables.cellsU - 1; column >= 0; --column)
        kernel.meetCell(grid, column, row, reversed);
    for (const HeightKernel::HeightWalk& other :
         {steps, reversed, walkGround(tables, grid, false, false),
          walkGround(tables, grid, false, hasWideHeights())}) {
      EXPECT_EQ(other.t, whole.t);
      EXPECT_EQ(other.column, whole.column);
      EXPECT_EQ(other.halfRow, whole.halfRow);
    }
    for (const bool isWide : {false, hasWideHeights()})
      EXPECT_EQ(walkGround(tables, grid, true, isWide).t < HeightKernel::kNoRoot,
                whole.t < HeightKernel::kNoRoot);
    hits += whole.t < HeightKernel::kNoRoot;
  }
  EXPECT_GT(hits, 200);
}

/// The errors of a far eye grow with its distance. The boxes of the ground must grow with them,
/// also those of nearly level ground.
TEST(TerrainRays, HaveTheBitsOfAllWalksFromFarAway) {
  HeightField level = support::randomTerrain(70, 50, 0, 4);
  for (float& height : level.heights) height *= 1e-3F;
  for (const HeightField& field : {terrain_rays::hills(70, 50, 3), level}) {
    const TerrainCaster caster(shared(field));
    const TerrainTables& tables = *caster.tables();
    Numbers numbers(23);
    int hits = 0;
    for (const double distance : {1e6, 1e9, 1e11, 1e12, 1e13})
      for (int n = 0; n < 400; ++n) {
        Camera::Ray ray = someRay(field, n, numbers);
        ray.origin -= ray.direction * distance;
        ray.far = Camera::kNoDepth;
        const HeightKernel::HeightRay grid = tables.gridRay(ray);
        HeightKernel kernel = tables.kernel();
        HeightKernel::HeightWalk whole = tables.start();
        kernel.walkHeights(grid, false, 1'000'000, whole);
        for (const bool isWide : {false, hasWideHeights()})
          EXPECT_EQ(walkGround(tables, grid, false, isWide).t, whole.t) << distance;
        hits += whole.t < HeightKernel::kNoRoot;
      }
    EXPECT_GT(hits, 300);
  }
}

TEST(TerrainRays, HaveTheBitsOfAllOrders) {
  for (const auto& [columns, rows] : std::vector<std::pair<int, int>>{
           {2, 2}, {3, 2}, {23, 14}, {5, 4}, {2, 9}, {9, 9}, {18, 70}, {40, 33}}) {
    const auto field =
        shared(support::randomTerrain(columns, rows, columns * rows > 90 ? 0.05 : 0, 19));
    expectAllOrders(*field, TerrainCaster(field));
  }
  // Where single precision has few digits, and where a part is left out.
  HeightField far = support::randomTerrain(40, 33, 0.05, 19);
  for (float& height : far.heights) height += 4e5f;
  const auto field = shared(far);
  expectAllOrders(*field, TerrainCaster(field));
  expectAllOrders(*field,
                  TerrainCaster(field, {.outside = Imath::Box3d(V3d(-9, -20, 0), V3d(5, 4, 1e6))}));
}

TEST(TerrainRays, AreAsExactFarFromTheOrigin) {
  HeightField field = support::randomTerrain(20, 20, 0, 21);
  const TerrainCaster near(shared(field));
  const V3d offset(1'048'576, -2'097'152, 0);  // keeps the bits of origins on a grid of 2^-30
  field.origin += V2d(offset.x, offset.y);
  const TerrainCaster far(shared(field));
  Numbers numbers(22);
  double most = 0;
  for (int n = 0; n < 20'000; ++n) {
    V3d origin = numbers.inBox(12);
    for (int c = 0; c < 3; ++c) origin[c] = std::ldexp(std::round(std::ldexp(origin[c], 20)), -20);
    const V3d direction = numbers.unit();
    const TerrainHit a = near.firstHit({origin, direction}),
                     b = far.firstHit({origin + offset, direction});
    EXPECT_EQ(a.found, b.found);
    EXPECT_EQ(a.distance, b.distance);
    most = std::max(most, (a.normal - b.normal).length());
  }
  EXPECT_EQ(most, 0);
}

TEST(TerrainRays, FollowTheTransform) {
  const HeightField field = support::randomTerrain(15, 12, 0, 23);
  const TerrainCaster plain(shared(field));
  for (const double mirror : {1.0, -1.0}) {
    Imath::M44d transform;
    transform.rotate(V3d(0.4, -1, 2));
    transform = Imath::M44d().setScale(V3d(2, mirror * 0.5, 3)) * transform;
    transform[3][1] = -7;
    const TerrainCaster placed(shared(field), {.transform = transform});
    const TerrainJudge judge(placed);
    Numbers numbers(24);
    int hits = 0;
    for (int n = 0; n < 4000; ++n) {
      const V3d from = numbers.inBox(9), to = numbers.inBox(5);
      const TerrainHit own = plain.firstHit({from, to - from});
      const Camera::Ray ray{from * transform, to * transform - from * transform};
      const TerrainHit hit = placed.firstHit(ray);
      const JudgedGround judged = judge.firstHit(ray);
      ASSERT_EQ(hit.found, own.found);
      ASSERT_EQ(hit.found, judged.found);
      if (!hit.found) continue;
      ++hits;
      EXPECT_NEAR(hit.distance, own.distance, 1e-11);
      EXPECT_NEAR(hit.distance, judged.distance, 1e-11);
      EXPECT_NEAR(hit.height, judged.height, 1e-10);
      EXPECT_LT((hit.facetNormal - judged.facetNormal).length(), 1e-12);
      EXPECT_LT((hit.normal - judged.normal).length(), 1e-9);
      EXPECT_NEAR(hit.normal.length(), 1, 1e-14);
    }
    EXPECT_GT(hits, 500);
    // Extents are those of the samples.
    const V3d direction(0.3, -0.8, 0.4);
    double most = -1e300;
    for (int row = 0; row < field.rows; ++row)
      for (int column = 0; column < field.columns; ++column)
        most = std::max(most, (field.point(column, row) * transform).dot(direction));
    EXPECT_NEAR(placed.extents({direction})[0], most, 1e-12);
  }
}

TEST(TerrainRays, LeaveOutTheCellsInsideABox) {
  const HeightField field = support::terrainOf(11, 9, {1, 1}, [](double x, double) { return x; });
  // The box has the samples from −2 to 3 and from −1 to 2; one cell at each wall stays.
  const TerrainCaster caster(shared(field),
                             {.outside = Imath::Box3d(V3d(-2, -1.5, -9), V3d(3.5, 2, 9))});
  for (double x = -4.95; x < 5; x += 0.1)
    for (double y = -3.95; y < 4; y += 0.1) {
      const bool isIn = x > -1 && x < 2 && y > 0 && y < 1;
      EXPECT_EQ(caster.isOccluded({V3d(x, y, 20), V3d(0, 0, -1)}), !isIn) << x << " " << y;
    }
  // A box that contains the whole ground leaves nothing.
  const TerrainCaster none(shared(field), {.outside = Imath::Box3d(V3d(-9), V3d(9))});
  EXPECT_FALSE(none.isOccluded({V3d(0, 0, 20), V3d(0, 0, -1)}));
  // A small box would leave the ground in front of the solid in it.
  EXPECT_THROW(
      TerrainCaster(shared(field), {.outside = Imath::Box3d(V3d(-1, -1, -9), V3d(1, 1, 9))}),
      levelset::InvalidInput);
  EXPECT_THROW(
      TerrainCaster(shared(field), {.outside = Imath::Box3d(V3d(-3, -3, 0), V3d(3, 3, 9))}),
      levelset::InvalidInput);
}

TEST(TerrainRays, NeedLittleMemory) {
  const TerrainCaster caster(shared(support::randomTerrain(257, 257, 0, 25)));
  const double samples = 257.0 * 257.0;
  EXPECT_LE(static_cast<double>(caster.bytes()), samples * (4 + 8.0 / 3));
  EXPECT_GT(static_cast<double>(caster.bytes()), samples * (4 + 8.0 / 3) * 0.98);
}

TEST(TerrainRays, RefuseWhatHasNoGround) {
  for (const auto& [columns, rows] : {std::pair(1, 1), std::pair(1, 5), std::pair(7, 1)})
    EXPECT_THROW(TerrainCaster(shared(support::randomTerrain(columns, rows, 0, 1))),
                 levelset::InvalidInput);
  HeightField field = support::randomTerrain(5, 5, 0, 2);
  EXPECT_THROW(TerrainCaster(shared(field), {.maxBytes = 16}), levelset::ResourceLimit);
  Imath::M44d flat;
  flat[2][2] = 0;
  EXPECT_THROW(TerrainCaster(shared(field), {.transform = flat}), levelset::InvalidInput);
  Imath::M44d projective;
  projective[0][3] = 1;
  EXPECT_THROW(TerrainCaster(shared(field), {.transform = projective}), levelset::InvalidInput);
  field.isGeographic = true;
  EXPECT_THROW(TerrainCaster(shared(field)), levelset::InvalidInput);
}

}  // namespace terrain_rays_test
