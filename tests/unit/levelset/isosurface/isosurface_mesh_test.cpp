// Meshes of isosurfaces directly from volumes: analytic surfaces, topology, borders and refusals.

#include "levelset/isosurface/isosurface_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/volumes/synthetic.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"
#include "tests/support/volumes.h"

namespace isosurface_mesh_test {

using Imath::M44d;
using Imath::V3d;
using Imath::V3i;
using levelset::IsosurfaceMesh;
using levelset::isosurfaceMesh;
using levelset::IsosurfaceMeshOptions;
using levelset::MeshBorder;
using levelset::TriMesh;
using levelset::Volume;
using levelset::VolumeFilter;
using levelset::VolumeGrid;
using levelset::VolumeType;
using support::cubeGrid;
using support::measured;
using support::refusal;
using support::sampled;

VolumeGrid gridOf(const V3i& size, const M44d& map) {
  VolumeGrid grid;
  grid.size = size;
  grid.indexToWorld = map;
  return grid;
}

/// Volume of random integers with few different values, so that many equal the isovalue.
template <typename T>
Volume randomVolume(const V3i& size, VolumeType type, const levelset::VolumeScale& scale = {}) {
  std::mt19937 random(11);
  const VolumeGrid grid = gridOf(size, M44d());
  const auto numbers = std::make_shared<std::vector<T>>(grid.pointCount());
  for (T& number : *numbers) number = static_cast<T>(random() % 5);
  return {grid, type, scale, {numbers, reinterpret_cast<const char*>(numbers->data()), false}};
}

struct Errors {
  double position = 0;  ///< largest distance of a vertex from the unit sphere
  double normal = 0;    ///< largest angle of a normal to that of the sphere, radians
};

/// Errors on a smooth function of which one level is the unit sphere.
Errors errorsOn(int n, VolumeFilter filter) {
  const Volume volume = sampled(
      cubeGrid(n - 1), [](const V3d& p) { return std::exp(-p.length2()) - std::exp(-1.0); });
  const TriMesh mesh = isosurfaceMesh(volume, 0, {.filter = filter}).mesh;
  EXPECT_TRUE(levelset::manifoldness(mesh).isClosedManifold());
  Errors errors;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const V3d &p = mesh.positions[v], &normal = mesh.attributes.normals[v];
    errors.position = std::max(errors.position, std::abs(p.length() - 1));
    errors.normal = std::max(errors.normal, normal.cross(p.normalized()).length());
    EXPECT_GT(normal.dot(p), 0);
  }
  return errors;
}

TEST(IsosurfaceMesh, ConvergesToAnalyticSurface) {
  struct Case {
    VolumeFilter filter;
    double order, error;
  };
  const auto orderOf = [](double coarse, double fine) { return std::log2(coarse / fine); };
  for (const Case& c : {Case{VolumeFilter::Trilinear, 1.98, 2.02e-4},
                        Case{VolumeFilter::Tricubic, 2.99, 3.17e-6}}) {
    const Errors coarse = errorsOn(33, c.filter), fine = errorsOn(65, c.filter);
    EXPECT_GT(orderOf(coarse.position, fine.position), support::measuredOrder(c.order));
    EXPECT_LT(fine.position, measured(c.error));
    EXPECT_GT(orderOf(coarse.normal, fine.normal), support::measuredOrder(3.57));
    EXPECT_LT(fine.normal, measured(4.99e-6));
  }
}

/// Mean angle of normals to those of Marschner and Lobb's signal, relative to that of the usual
/// normals: central differences at both ends of a grid edge, interpolated linearly.
double normalErrorRatio(int size) {
  const Volume volume = levelset::marschnerLobb(size);
  const TriMesh mesh = isosurfaceMesh(volume, 0.5, {.border = MeshBorder::Open}).mesh;
  const M44d toIndex = volume.grid().indexToWorld.inverse();
  double ours = 0, usual = 0;
  std::size_t count = 0;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const V3d at = mesh.positions[v] * toIndex;
    const V3i low(static_cast<int>(at.x), static_cast<int>(at.y), static_cast<int>(at.z));
    if (std::min({low.x, low.y, low.z}) < 3 || std::max({low.x, low.y, low.z}) > size - 5) continue;
    V3d exact, central;
    for (int axis = 0; axis < 3; ++axis) {
      constexpr double kStep = 1e-5;
      V3d step(0);
      step[axis] = kStep;
      exact[axis] = (levelset::marschnerLobbAt(mesh.positions[v] + step) -
                     levelset::marschnerLobbAt(mesh.positions[v] - step)) /
                    (2 * kStep);
      V3i s(0);
      s[axis] = 1;
      const auto difference = [&](const V3i& p) {
        return volume.at(p.x + s.x, p.y + s.y, p.z + s.z) -
               volume.at(p.x - s.x, p.y - s.y, p.z - s.z);
      };
      int along = 0;  // axis of the grid edge: the other coordinates are whole numbers
      for (int a = 1; a < 3; ++a)
        if (std::abs(at[a] - std::round(at[a])) > std::abs(at[along] - std::round(at[along])))
          along = a;
      V3i p(static_cast<int>(std::lround(at.x)), static_cast<int>(std::lround(at.y)),
            static_cast<int>(std::lround(at.z)));
      p[along] = static_cast<int>(at[along]);
      V3i q = p;
      ++q[along];
      const double share = at[along] - p[along];
      central[axis] = (1 - share) * difference(p) + share * difference(q);
    }
    const V3d outward = -exact.normalized();
    ours += std::acos(std::min(1.0, mesh.attributes.normals[v].dot(outward)));
    usual += std::acos(std::min(1.0, (-central.normalized()).dot(outward)));
    ++count;
  }
  EXPECT_GT(count, 5000u);
  return ours / usual;
}

TEST(IsosurfaceMesh, HasSmallerNormalErrorsThanCentralDifferences) {
  // 41 grid points along an axis hardly resolve the signal.
  EXPECT_LT(normalErrorRatio(41), measured(0.69, 0.9));
  EXPECT_LT(normalErrorRatio(81), measured(0.292));
}

TEST(IsosurfaceMesh, IsAClosedManifoldOfRandomNumbers) {
  // All widths around the length of a word of sign bits, with and without the padding.
  for (const int width : {2, 3, 61, 62, 63, 64, 65, 66, 127, 128, 129}) {
    const Volume volume = randomVolume<std::uint8_t>(V3i(width, 6, 5), VolumeType::U8);
    const IsosurfaceMesh made = isosurfaceMesh(volume, 2);
    EXPECT_TRUE(levelset::manifoldness(made.mesh).isClosedManifold()) << width;
    EXPECT_GT(levelset::signedVolume(made.mesh), 0);
    const TriMesh open = isosurfaceMesh(volume, 2, {.border = MeshBorder::Open}).mesh;
    const auto facts = levelset::manifoldness(open);
    EXPECT_EQ(facts.nonManifoldEdges, 0u) << width;
    EXPECT_EQ(facts.misorientedEdges, 0u) << width;
    EXPECT_LT(open.triangles.size(), made.mesh.triangles.size());
    for (const auto& t : open.triangles) {
      const V3d &a = open.positions[t[0]], &b = open.positions[t[1]], &c = open.positions[t[2]];
      EXPECT_GT((b - a).cross(c - a).length(), 1e-9) << "a triangle has no area";
    }
  }
}

TEST(IsosurfaceMesh, DoesNotDependOnTheStoredType) {
  const V3i size(30, 20, 10);
  const TriMesh bytes = isosurfaceMesh(randomVolume<std::uint8_t>(size, VolumeType::U8), 2).mesh;
  for (const TriMesh& other :
       {isosurfaceMesh(randomVolume<std::int8_t>(size, VolumeType::I8), 2).mesh,
        isosurfaceMesh(randomVolume<std::uint16_t>(size, VolumeType::U16), 2).mesh,
        isosurfaceMesh(randomVolume<std::int16_t>(size, VolumeType::I16), 2).mesh,
        isosurfaceMesh(randomVolume<float>(size, VolumeType::F32), 2).mesh,
        // Rescaled numbers, rising and falling.
        isosurfaceMesh(randomVolume<std::int16_t>(size, VolumeType::I16, {0.5, 100}), 101).mesh,
        isosurfaceMesh(randomVolume<std::int16_t>(size, VolumeType::I16, {-0.5, 100}), 99,
                       {.isInsideBelow = true})
            .mesh}) {
    EXPECT_EQ(other.positions, bytes.positions);
    EXPECT_EQ(other.triangles, bytes.triangles);
    EXPECT_EQ(other.attributes.normals, bytes.attributes.normals);
  }
}

TEST(IsosurfaceMesh, ClosesTheBorderWithTheFacesOfTheBox) {
  // A half space cuts the box [0, 7] x [0, 5] x [0, 4].
  const VolumeGrid grid = gridOf({8, 6, 5}, M44d());
  const Volume volume = sampled(grid, [](const V3d& p) { return 2.25 - p.x; });
  const IsosurfaceMesh made = isosurfaceMesh(volume, 0);
  EXPECT_TRUE(levelset::manifoldness(made.mesh).isClosedManifold());
  EXPECT_NEAR(levelset::signedVolume(made.mesh), 2.25 * 5 * 4, 1e-12);
  EXPECT_NEAR(levelset::surfaceArea(made.mesh), 2 * (2.25 * 5 + 2.25 * 4 + 5 * 4), 1e-12);
  EXPECT_EQ(made.borderPoints, 3u * 6 * 5 - 2u * 4 * 3);
  const TriMesh open = isosurfaceMesh(volume, 0, {.border = MeshBorder::Open}).mesh;
  EXPECT_NEAR(levelset::surfaceArea(open), 5 * 4, 1e-12);
  EXPECT_EQ(levelset::manifoldness(open).boundaryEdges, 2u * (5 + 4));
  for (const V3d& normal : open.attributes.normals)
    EXPECT_NEAR((normal - V3d(1, 0, 0)).length(), 0, 1e-6);
  EXPECT_NE(refusal<levelset::InvalidInput>([&] {
              (void)isosurfaceMesh(volume, 0, {.border = MeshBorder::Refuse});
            }).find("border"),
            std::string::npos);
}

TEST(IsosurfaceMesh, FollowsTheMapOfTheGrid) {
  M44d turn, shear;
  turn.rotate(V3d(0.3, -0.5, 0.7));
  shear[1][0] = 0.25;
  M44d scale;
  scale.setScale(V3d(0.1, 0.07, 0.05));
  const auto ball = [](const V3d& p) { return 1 - p.length2(); };
  for (const double mirror : {1.0, -1.0}) {
    M44d map = M44d().setTranslation(V3d(-15, -20, -30)) * scale * shear * turn;
    map = map * M44d().setScale(V3d(mirror, 1, 1));
    const TriMesh mesh = isosurfaceMesh(sampled(gridOf({36, 41, 61}, map), ball), 0).mesh;
    EXPECT_TRUE(levelset::manifoldness(mesh).isClosedManifold());
    EXPECT_NEAR(levelset::signedVolume(mesh), 4.0 / 3 * std::numbers::pi, measured(0.0181));
    double worst = 0;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
      worst =
          std::max(worst, (mesh.attributes.normals[v] - mesh.positions[v].normalized()).length());
    EXPECT_LT(worst, measured(5.02e-8));
  }
}

TEST(IsosurfaceMesh, TurnsOverForValuesBelow) {
  const Volume volume = levelset::sphereVolume(33, 0.6);
  const TriMesh below =
      isosurfaceMesh(volume, 0, {.isInsideBelow = true, .border = MeshBorder::Open}).mesh;
  const TriMesh above = isosurfaceMesh(volume, 0).mesh;
  EXPECT_NEAR(levelset::signedVolume(below), -levelset::signedVolume(above), 1e-12);
  EXPECT_LT(below.attributes.normals[0].dot(below.positions[0]), 0);
}

TEST(IsosurfaceMesh, HasEqualBitsOnAnyNumberOfThreads) {
  const Volume volume = levelset::marschnerLobb(41);
  const auto run = [&] {
    return isosurfaceMesh(volume, 0.5, {.filter = VolumeFilter::Tricubic}).mesh;
  };
  const TriMesh one = support::onThreads(1, run), many = support::onThreads(4, run);
  EXPECT_EQ(one.positions, many.positions);
  EXPECT_EQ(one.triangles, many.triangles);
  EXPECT_EQ(one.attributes.normals, many.attributes.normals);
}

TEST(IsosurfaceMesh, Refuses) {
  const Volume volume = levelset::sphereVolume(9, 0.6);
  EXPECT_THROW((void)isosurfaceMesh(volume, 7), levelset::NoSurface);
  EXPECT_THROW((void)isosurfaceMesh(volume, -7), levelset::NoSurface);
  EXPECT_THROW((void)isosurfaceMesh(volume, std::numeric_limits<double>::quiet_NaN()),
               levelset::UsageError);
  EXPECT_THROW((void)isosurfaceMesh(volume, 0, {.filter = VolumeFilter::BSpline}),
               levelset::UsageError);
  EXPECT_THROW((void)isosurfaceMesh(volume, 0, {.maxMemory = 100}), levelset::ResourceLimit);
  EXPECT_THROW(
      (void)isosurfaceMesh(sampled(gridOf({5, 5, 1}, M44d()), [](const V3d& p) { return p.x; }), 2),
      levelset::InvalidInput);
  EXPECT_THROW((void)isosurfaceMesh(volume, 0, {.progress = [](double p) { return p < 0.3; }}),
               levelset::Cancelled);
}

}  // namespace isosurface_mesh_test
