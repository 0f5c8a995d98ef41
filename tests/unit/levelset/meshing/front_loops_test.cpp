#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "levelset/meshing/front/advancing_front.h"
#include "tests/support/measured.h"

/// Fronts that start from given loops.
namespace front_loops_test {

using Imath::V3d;
using levelset::advanceFront;
using levelset::FrontLoops;
using levelset::FrontMesh;
using levelset::FrontSurface;
using support::doubleRounding;

constexpr double kLength = 0.1;

/// Plane z = 0.
class Plane : public FrontSurface {
 public:
  [[nodiscard]] std::optional<Foot> project(const V3d& position) const override {
    return Foot{V3d(position.x, position.y, 0), V3d(0, 0, 1)};
  }
  [[nodiscard]] double edgeLength(const V3d&) const override { return kLength; }
};

/// Adds a polygon with `count` corners, counter-clockwise or clockwise.
void addPolygon(FrontLoops& loops, const V3d& centre, double radius, int count, bool isClockwise) {
  std::vector<std::uint32_t>& loop = loops.loops.emplace_back();
  for (int i = 0; i < count; ++i) {
    const double angle = (isClockwise ? -2 : 2) * std::numbers::pi * i / count;
    loop.push_back(static_cast<std::uint32_t>(loops.positions.size()));
    loops.positions.push_back(centre + radius * V3d(std::cos(angle), std::sin(angle), 0));
    loops.normals.emplace_back(0, 0, 1);
  }
}

double polygonArea(double radius, int count) {
  return 0.5 * count * radius * radius * std::sin(2 * std::numbers::pi / count);
}

double areaOf(const FrontMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const V3d& a = mesh.positions[t[0]];
    sum += (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a).z / 2;
  }
  return sum;
}

/// Expects a mesh whose border consists of the edges of the loops.
void expectWithin(const FrontMesh& mesh, const FrontLoops& start) {
  EXPECT_TRUE(mesh.isClosed);
  std::set<std::array<std::uint32_t, 2>> sides, border;
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(sides.insert({t[i], t[(i + 1) % 3]}).second);
  for (const auto& [a, b] : sides)
    if (!sides.contains({b, a})) border.insert({a, b});
  std::set<std::array<std::uint32_t, 2>> given;
  for (const auto& loop : start.loops)
    for (std::size_t i = 0; i < loop.size(); ++i)
      given.insert({loop[i], loop[(i + 1) % loop.size()]});
  EXPECT_EQ(border, given);
  for (std::size_t v = 0; v < start.positions.size(); ++v)
    EXPECT_EQ(mesh.positions[v], start.positions[v]);
}

levelset::AdvancingFrontOptions optionsFor(double area) {
  return {.longest = kLength,
          .expectedTriangles = static_cast<std::size_t>(area / (0.433 * kLength * kLength))};
}

TEST(FrontLoops, FillAPolygon) {
  FrontLoops start;
  addPolygon(start, V3d(0), 1, 60, false);
  const double area = polygonArea(1, 60);
  const FrontMesh mesh = advanceFront(Plane(), start, optionsFor(area));
  expectWithin(mesh, start);
  EXPECT_NEAR(areaOf(mesh), area, doubleRounding(100));
}

TEST(FrontLoops, FillAPolygonWithTwoHoles) {
  FrontLoops start;
  addPolygon(start, V3d(0), 1, 64, false);
  addPolygon(start, V3d(0.45, 0, 0), 0.3, 18, true);
  addPolygon(start, V3d(-0.45, 0.1, 0), 0.25, 15, true);
  const double area = polygonArea(1, 64) - polygonArea(0.3, 18) - polygonArea(0.25, 15);
  const FrontMesh mesh = advanceFront(Plane(), start, optionsFor(area));
  expectWithin(mesh, start);
  EXPECT_NEAR(areaOf(mesh), area, doubleRounding(100));
}

}  // namespace front_loops_test
