#include "levelset/deform/cage/cage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "levelset/deform/cage/cage_kernels.h"
#include "levelset/error.h"
#include "tests/support/cages.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"
#include "tests/support/threads.h"

namespace cage_test {

using namespace levelset;
using Imath::V3d;
using support::doubleRounding;
using support::measured;

/// A prism over an L, which is not convex: planes of its faces pass through its inside.
TriMesh cornerCage() {
  const std::vector<V3d> outline = {V3d(0, 0, 0), V3d(2, 0, 0), V3d(2, 1, 0),
                                    V3d(1, 1, 0), V3d(1, 2, 0), V3d(0, 2, 0)};
  TriMesh mesh;
  for (const double z : {0.0, 1.0})
    for (const V3d& p : outline) mesh.positions.push_back(p + V3d(0, 0, z));
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {0, 5, 3},  {3, 5, 4},
                    {6, 7, 8}, {6, 8, 9}, {6, 9, 11}, {9, 10, 11}};
  for (std::uint32_t n = 0; n < 6; ++n) {
    const std::uint32_t m = (n + 1) % 6;
    mesh.triangles.push_back({n, m, n + 6});
    mesh.triangles.push_back({m, m + 6, n + 6});
  }
  return mesh;
}

class RandomPoints {
 public:
  double number() { return uniform_(generator_); }
  V3d point() {
    const double x = number(), y = number();
    return {x, y, number()};
  }

 private:
  std::mt19937 generator_{7};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

/// Points in the L: anywhere, beside faces, in planes of faces and close to these planes.
std::vector<V3d> pointsInside() {
  RandomPoints random;
  std::vector<V3d> points;
  for (int n = 0; n < 40; ++n) {
    const V3d p = random.point();
    points.emplace_back(0.5 + 0.45 * p.x, 1 + 0.95 * p.y, 0.5 + 0.45 * p.z);
    points.emplace_back(1 + 0.95 * p.x, 0.5 + 0.45 * p.y, 0.5 + 0.45 * p.z);
    const double off = 0.2 * std::pow(10.0, -n / 3.0);
    points.emplace_back(0.5 + 0.45 * p.x, 1 + off, 0.5 + 0.45 * p.z);
    points.emplace_back(1 + 0.95 * p.x, off, 0.5 + 0.45 * p.z);
  }
  points.emplace_back(0.3, 1, 0.4);
  points.emplace_back(1, 0.3, 0.4);
  return points;
}

/// Points on faces, edges and vertices of the L.
std::vector<V3d> pointsOnSurface() {
  std::vector<V3d> points = cornerCage().positions;
  points.insert(points.end(), {V3d(0.7, 0, 0.6), V3d(1, 1.3, 0.2), V3d(0.4, 0.3, 1), V3d(1.5, 0, 0),
                               V3d(1, 1, 0.3), V3d(0.5, 0.25, 0), V3d(2, 0.5, 0.5)});
  return points;
}

std::vector<V3d> pointsOutside() {
  RandomPoints random;
  std::vector<V3d> points = {V3d(1.5, 1.5, 0.5), V3d(3, 0, 0), V3d(1, 3, 0.5)};
  for (int n = 0; n < 20; ++n) points.push_back(V3d(-2, 0, 0) + random.point());
  return points;
}

std::vector<V3d> joined(std::vector<V3d> a, const std::vector<V3d>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

CageDeformation deformedBy(const std::function<V3d(const V3d&)>& map, CageCoordinates kind) {
  return {cornerCage(), support::transformed(cornerCage(), map), kind};
}

/// Largest errors of positions and derivatives against an affine map.
std::pair<double, double> errorsAgainst(const CageDeformation& cage, const std::vector<V3d>& points,
                                        const std::function<V3d(const V3d&)>& map) {
  double position = 0, slope = 0;
  for (const V3d& p : points) {
    const DeformationJet jet = cage.jet(p);
    position = std::max(position, (jet.position - map(p)).length() / (1 + p.length()));
    for (int axis = 0; axis < 3; ++axis) {
      V3d unit(0);
      unit[axis] = 1;
      const V3d exact = map(unit) - map(V3d(0));
      slope = std::max(slope, (jet.slopes[static_cast<std::size_t>(axis)] - exact).length());
    }
  }
  return {position, slope};
}

TEST(Cage, MeanValueCoordinatesReproduceAffineMaps) {
  const auto affine = [](const V3d& p) {
    return V3d(1.2 * p.x + 0.4 * p.y - 3, 0.8 * p.y - 0.5 * p.z, p.x + 1.5 * p.z + 2);
  };
  const CageDeformation cage = deformedBy(affine, CageCoordinates::MeanValue);
  const auto [inside, insideSlope] = errorsAgainst(cage, pointsInside(), affine);
  const auto [onSurface, surfaceSlope] = errorsAgainst(cage, pointsOnSurface(), affine);
  const auto [outside, outsideSlope] = errorsAgainst(cage, pointsOutside(), affine);
  EXPECT_LT(inside, measured(1.9e-15));
  EXPECT_LT(insideSlope, measured(2.9e-13));
  EXPECT_LT(onSurface, measured(2.4e-16));
  EXPECT_LT(surfaceSlope, measured(2.1e-9));  // 1e-6 of the diagonal from a vertex
  EXPECT_LT(outside, measured(9.6e-14));
  EXPECT_LT(outsideSlope, measured(2.8e-12));
}

TEST(Cage, GreenCoordinatesReproduceSimilarities) {
  const auto similar = [](const V3d& p) { return support::turned(p, 2) * 1.7 + V3d(1, 2, -3); };
  const CageDeformation cage = deformedBy(similar, CageCoordinates::Green);
  const auto [inside, insideSlope] = errorsAgainst(cage, pointsInside(), similar);
  const auto [onSurface, surfaceSlope] = errorsAgainst(cage, pointsOnSurface(), similar);
  EXPECT_LT(inside, measured(1.7e-14));
  EXPECT_LT(insideSlope, measured(2.4e-14));
  // Extrapolated from a point 1e-6 of the diagonal inside.
  EXPECT_LT(onSurface, measured(2e-11));
  EXPECT_LT(surfaceSlope, measured(3.1e-7));
}

TEST(Cage, CoordinatesSumToOneAndToThePoint) {
  double mean = 0, green = 0, beyond = 0;
  const auto same = [](const V3d& p) { return p; };
  const CageDeformation meanCage = deformedBy(same, CageCoordinates::MeanValue),
                        greenCage = deformedBy(same, CageCoordinates::Green);
  const auto offsOf = [&](const CageDeformation& cage, const V3d& p, double wanted) {
    const CageDeformation::Coordinates c = cage.coordinatesAt(p);
    double sum = -wanted;
    V3d place = p * -wanted;
    for (std::size_t n = 0; n < c.vertices.size(); ++n) {
      sum += c.vertices[n];
      place += cage.rest()[n] * c.vertices[n];
    }
    for (std::size_t t = 0; t < c.triangles.size(); ++t) {
      const auto& [i, j, k] = cage.triangles()[t];
      place += cage::cageTriangle(cage.rest()[i], cage.rest()[j], cage.rest()[k]).normal *
               c.triangles[t];
    }
    return std::max(std::abs(sum), place.length() / (1 + p.length()));
  };
  for (const V3d& p : joined(joined(pointsInside(), pointsOnSurface()), pointsOutside()))
    mean = std::max(mean, offsOf(meanCage, p, 1));
  for (const V3d& p : joined(pointsInside(), pointsOnSurface()))
    green = std::max(green, offsOf(greenCage, p, 1));
  for (const V3d& p : pointsOutside()) beyond = std::max(beyond, offsOf(greenCage, p, 0));
  EXPECT_LT(mean, measured(8.3e-14));
  EXPECT_LT(green, measured(8.2e-12));
  EXPECT_LT(beyond, measured(3.9e-17));
}

TEST(Cage, DerivativesAreLimitsOfDifferences) {
  RandomPoints random;
  TriMesh moved = cornerCage();
  for (V3d& p : moved.positions) p += random.point() * 0.3;
  for (const CageCoordinates kind : {CageCoordinates::MeanValue, CageCoordinates::Green}) {
    const CageDeformation cage(cornerCage(), moved, kind);
    double worst = 0;
    for (const V3d& p : pointsInside()) {
      const DeformationJet jet = cage.jet(p);
      const double step = 1e-4;
      for (int axis = 0; axis < 3; ++axis) {
        V3d d(0);
        d[axis] = step;
        if (p.y < 2 * step && axis == 1) continue;  // the difference would cross a face
        const V3d difference =
            (cage.at(p - d * 2) - cage.at(p + d * 2) + (cage.at(p + d) - cage.at(p - d)) * 8) /
            (12 * step);
        worst = std::max(worst, (difference - jet.slopes[static_cast<std::size_t>(axis)]).length());
      }
    }
    EXPECT_LT(worst, measured(kind == CageCoordinates::Green ? 1.5e-11 : 4.4e-12));
  }
}

/// The definition of the mean-value weights: directions from x over the unit sphere, with the face
/// that a ray hits. The Green coordinates: sums over small triangles.
TEST(Cage, CoordinatesAgreeWithNumericalIntegrals) {
  const TriMesh rest = support::boxCage(V3d(0), V3d(1), 1);
  const V3d x(0.45, 0.6, 0.55);
  const CageDeformation mean(rest, rest, CageCoordinates::MeanValue),
      green(rest, rest, CageCoordinates::Green);
  std::vector<double> weights(8, 0), shares(8, 0), normals(12, 0);
  constexpr int kRays = 400;
  double total = 0;
  for (int i = 0; i < kRays; ++i)
    for (int j = 0; j < 2 * kRays; ++j) {
      const double z = 2 * (i + 0.5) / kRays - 1, turn = std::numbers::pi * (j + 0.5) / kRays;
      const V3d ray(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn),
                    z);
      for (const auto& t : rest.triangles) {
        const V3d a = rest.positions[t[0]] - x, b = rest.positions[t[1]] - x,
                  c = rest.positions[t[2]] - x;
        const double u = ray.dot(b.cross(c)), v = ray.dot(c.cross(a)), w = ray.dot(a.cross(b));
        if (!(u >= 0 && v >= 0 && w >= 0)) continue;
        const double volume = a.dot(b.cross(c)), distance = volume / (u + v + w);
        const V3d hat = V3d(u, v, w) / (u + v + w);
        for (int n = 0; n < 3; ++n) weights[t[static_cast<std::size_t>(n)]] += hat[n] / distance;
        total += 1 / distance;
        break;
      }
    }
  constexpr int kParts = 200;
  for (std::size_t t = 0; t < 12; ++t) {
    const auto& [i, j, k] = rest.triangles[t];
    const V3d a = rest.positions[i], b = rest.positions[j] - a, c = rest.positions[k] - a;
    const V3d normal = b.cross(c).normalized();
    for (int m = 0; m < kParts; ++m)
      for (int n = 0; n < kParts - m; ++n)
        for (int up = 0; up < (n + 1 < kParts - m ? 2 : 1); ++up) {
          const double u = (m + (1 + up) / 3.0) / kParts, v = (n + (1 + up) / 3.0) / kParts;
          const V3d d = a + b * u + c * v - x;
          const double area = 0.5 / (kParts * kParts) / (4 * std::numbers::pi);
          const double flux = d.dot(normal) / std::pow(d.length(), 3) * area;
          shares[i] += (1 - u - v) * flux;
          shares[j] += u * flux;
          shares[k] += v * flux;
          normals[t] += area / d.length();
        }
  }
  const auto meanAt = mean.coordinatesAt(x), greenAt = green.coordinatesAt(x);
  double meanOff = 0, greenOff = 0;
  for (std::size_t n = 0; n < 8; ++n) {
    meanOff = std::max(meanOff, std::abs(meanAt.vertices[n] - weights[n] / total));
    greenOff = std::max(greenOff, std::abs(greenAt.vertices[n] - shares[n]));
  }
  for (std::size_t t = 0; t < 12; ++t)
    greenOff = std::max(greenOff, std::abs(greenAt.triangles[t] - normals[t]));
  EXPECT_LT(meanOff, measured(4.1e-7));
  EXPECT_LT(greenOff, measured(7.7e-7));
}

TEST(Cage, FacesMoveLinearlyWithMeanValueCoordinates) {
  RandomPoints random;
  TriMesh moved = cornerCage();
  for (V3d& p : moved.positions) p += random.point() * 0.3;
  const CageDeformation cage(cornerCage(), moved, CageCoordinates::MeanValue);
  double worst = 0;
  for (const auto& [i, j, k] : cage.triangles())
    for (const V3d& share :
         {V3d(0.2, 0.3, 0.5), V3d(0.9, 0.05, 0.05), V3d(0.5, 0.5, 0), V3d(1, 0, 0)}) {
      const V3d p = cage.rest()[i] * share.x + cage.rest()[j] * share.y + cage.rest()[k] * share.z,
                q = cage.moved()[i] * share.x + cage.moved()[j] * share.y +
                    cage.moved()[k] * share.z;
      worst = std::max(worst, (cage.at(p) - q).length());
    }
  EXPECT_LT(worst, doubleRounding(4));
}

TEST(Cage, TheIdentityKeepsTheBits) {
  for (const CageCoordinates kind : {CageCoordinates::MeanValue, CageCoordinates::Green}) {
    const CageDeformation cage(cornerCage(), cornerCage(), kind);
    EXPECT_TRUE(cage.isIdentity());
    for (const V3d& p : joined(pointsInside(), pointsOnSurface())) {
      EXPECT_EQ(cage.at(p), p);
      EXPECT_EQ(cage.jet(p).determinant(), 1);
    }
  }
}

TEST(Cage, FacingInwardsIsTheSame) {
  TriMesh moved = cornerCage();
  moved.positions[3] += V3d(0.2, 0.1, 0.3);
  const CageDeformation out(cornerCage(), moved, CageCoordinates::Green),
      in(support::reversed(cornerCage()), support::reversed(moved), CageCoordinates::Green);
  EXPECT_LT((out.at(V3d(0.5, 0.6, 0.4)) - in.at(V3d(0.5, 0.6, 0.4))).length(), doubleRounding(8));
}

std::string refusal(const TriMesh& rest, const TriMesh& moved, CageCoordinates kind) {
  try {
    (void)CageDeformation(rest, moved, kind);
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "";
}

TEST(Cage, RefusesMeshesThatAreNoCages) {
  const TriMesh whole = cornerCage();
  const auto said = [&](const TriMesh& rest, const TriMesh& moved, const char* words,
                        CageCoordinates kind = CageCoordinates::MeanValue) {
    const std::string message = refusal(rest, moved, kind);
    EXPECT_NE(message.find(words), std::string::npos) << message;
  };
  said({}, {}, "no triangles");
  TriMesh open = whole;
  open.triangles.pop_back();
  said(open, open, "not closed");
  TriMesh turned = whole;
  std::swap(turned.triangles[2][0], turned.triangles[2][1]);
  said(turned, turned, "face opposite sides");
  TriMesh flat = whole;
  flat.positions[4] = flat.positions[5];
  said(flat, flat, "no area");
  TriMesh crossing = whole;
  crossing.positions[3] = V3d(3, 3, 0);
  said(crossing, crossing, "intersects itself");
  TriMesh broken = whole;
  broken.positions[0].x = NAN;
  said(broken, whole, "not finite");
  said(whole, broken, "not finite");
  TriMesh more = whole;
  more.positions.emplace_back(0, 0, 0);
  said(whole, more, "12 vertices, but the moved cage 13");
  said(whole, support::reversed(whole), "different triangles");
  TriMesh index = whole;
  index.triangles[0][0] = 99;
  said(index, index, "a vertex that the cage lacks");
  said(whole, flat, "of the moved cage", CageCoordinates::Green);
  const CageDeformation green(whole, whole, CageCoordinates::Green);
  EXPECT_THROW(green.requireDefined({V3d(1.5, 1.5, 0.5)}, "vertex"), InvalidInput);
  EXPECT_NO_THROW(green.requireDefined(pointsInside(), "vertex"));
  EXPECT_NO_THROW(green.requireDefined(pointsOnSurface(), "vertex"));
}

}  // namespace cage_test
