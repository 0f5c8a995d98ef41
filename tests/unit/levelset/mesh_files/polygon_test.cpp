// Splitting of polygons into triangles by readers.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_file.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"

namespace polygon_test {

using levelset::TriMesh;
using support::refusal;

TriMesh readObj(const std::string& text) {
  const support::TemporaryFolder folder;
  support::writeText(folder / "a.obj", text);
  return levelset::readMesh(folder / "a.obj");
}

double area(const TriMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Imath::V3d a = mesh.positions[t[0]];
    const double part = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a).z / 2;
    EXPECT_GE(part, 0) << "a triangle is reversed";
    sum += part;
  }
  return sum;
}

/// Flat polygon with these corners, in the plane z = 3.
TriMesh polygon(const std::vector<Imath::V2d>& corners) {
  std::string obj, face = "f";
  for (std::size_t i = 0; i < corners.size(); ++i) {
    obj += fmt::format("v {} {} 3\n", corners[i].x, corners[i].y);
    face += fmt::format(" {}", i + 1);
  }
  return readObj(obj + face + "\n");
}

TEST(Polygon, SplitsConcavePolygonsWithinThem) {
  // Areas by the shoelace formula. A fan from the first corner would reverse triangles.
  EXPECT_DOUBLE_EQ(area(polygon({{0, 0}, {4, 0}, {1, 1}, {0, 4}})), 4);
  EXPECT_DOUBLE_EQ(area(polygon({{1, 1}, {0, 4}, {0, 0}, {4, 0}})), 4);
  EXPECT_DOUBLE_EQ(area(polygon({{4, 0}, {1, 1}, {0, 4}, {0, 0}})), 4);
  const std::vector<Imath::V2d> comb = {{0, 0}, {7, 0}, {7, 3}, {6, 3}, {6, 1}, {5, 1},
                                        {5, 3}, {4, 3}, {4, 1}, {3, 1}, {3, 3}, {2, 3},
                                        {2, 1}, {1, 1}, {1, 3}, {0, 3}};
  const TriMesh mesh = polygon(comb);
  EXPECT_EQ(mesh.triangles.size(), comb.size() - 2);
  EXPECT_DOUBLE_EQ(area(mesh), 7 + 4 * 2);
}

TEST(Polygon, SplitsAStarOfAThousandCornersInEitherOrientation) {
  std::vector<Imath::V2d> star;
  double twice = 0;
  for (int i = 0; i < 1000; ++i) {
    const double angle = 2 * M_PI * i / 1000, radius = i % 2 ? 1 : 5;
    star.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  for (std::size_t i = 0; i < star.size(); ++i) twice += star[i].cross(star[(i + 1) % star.size()]);
  EXPECT_NEAR(area(polygon(star)), twice / 2, support::measured(2.68e-13));
  std::reverse(star.begin(), star.end());  // seen from below: reversed completely
  const TriMesh mesh = polygon(star);
  EXPECT_EQ(mesh.triangles.size(), 998u);
}

TEST(Polygon, SplitsHugeConvexPolygonsFast) {
  std::vector<Imath::V2d> circle;
  for (int i = 0; i < 200000; ++i)
    circle.emplace_back(std::cos(2 * M_PI * i / 200000), std::sin(2 * M_PI * i / 200000));
  const TriMesh mesh = polygon(circle);
  EXPECT_NEAR(area(mesh), M_PI, support::measured(5.17e-10));
  // The result is no fan, in which all triangles would lie in each other's bounding boxes.
  std::vector<std::size_t> faces(circle.size(), 0);
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t) ++faces[v];
  EXPECT_LT(*std::max_element(faces.begin(), faces.end()), 50u);
}

TEST(Polygon, RefusesPolygonsThatAreTooComplexToSplit) {
  std::string obj, face = "f";
  for (int i = 0; i < 60000; ++i) {
    obj += fmt::format("v {} {} 0\n", i / 2, i % 2 ? 1 : 50);
    face += fmt::format(" {}", i + 1);
  }
  const std::string text = obj + "v 0 -9 0\n" + face + " 60001\n";
  const std::string sentence = refusal<levelset::InvalidInput>([&] { (void)readObj(text); });
  EXPECT_NE(sentence.find("too complex"), std::string::npos) << sentence;
}

}  // namespace polygon_test
