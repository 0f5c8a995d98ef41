// Tests sharp meshing at random positions and rotations. Round solids must show no edge, cubes and
// cylinders must show theirs.
//
//   sharp_mesh_bench [SOLIDS OF EACH KIND]

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "apps/regress/truth/exact_band.h"
#include "levelset/meshing/sharp/sharp_surface.h"

namespace {

using Imath::V3d;
using regress::Truth;

std::mt19937 generator(1);

double between(double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(generator);
}
V3d somewhere() {
  return {between(0, 1), between(0, 1), between(0, 1)};
}
V3d direction() {
  for (;;) {
    const V3d v = somewhere() - V3d(0.5);
    if (v.length() > 0.1 && v.length() < 0.5) return v.normalized();
  }
}
/// Rotates the solid at random and moves it by less than a voxel.
Truth placed(const Truth& solid) {
  Imath::M44d matrix;
  matrix.setEulerAngles(V3d(between(0, 3), between(0, 3), between(0, 3)));
  return regress::moved(solid, matrix * Imath::M44d().setTranslation(somewhere()));
}
/// Random radius; small ones are more frequent.
double smallRadius() {
  return 1.2 + 7.8 * between(0, 1) * between(0, 1);
}

struct Findings {
  std::size_t solids = 0, withEdges = 0, triangles = 0, turnedOver = 0, off = 0;
  double vertex = 0, corner = 0;  ///< largest distances, voxels
};

void look(const Truth& solid, const std::vector<V3d>& corners, Findings& found) {
  const levelset::NarrowBand band = regress::exactBand(solid, 1);
  const levelset::CellSurface surface(levelset::vdb(band));
  const levelset::SharpMesh mesh = levelset::sharpSurface(surface, levelset::vdb(band), {});
  ++found.solids;
  found.withEdges += std::any_of(mesh.sheets.begin(), mesh.sheets.end(),
                                 [](const auto& sheets) { return sheets.count > 1; });
  for (const openvdb::Vec3d& p : mesh.positions) {
    const double distance = std::abs(solid.distance(levelset::toImath(p)));
    found.vertex = std::max(found.vertex, distance);
    found.off += distance > 0.05;
  }
  for (const V3d& corner : corners) {
    double least = std::numeric_limits<double>::max();
    for (const openvdb::Vec3d& p : mesh.positions)
      least = std::min(least, (levelset::toImath(p) - corner).length());
    found.corner = std::max(found.corner, least);
  }
  found.triangles += mesh.triangles.size();
  for (const auto& [a, b, c] : mesh.triangles) {
    const V3d p = levelset::toImath(mesh.positions[a]), q = levelset::toImath(mesh.positions[b]),
              r = levelset::toImath(mesh.positions[c]);
    const V3d area = (q - p).cross(r - p), middle = (p + q + r) / 3.0;
    if (area.length() > 0.01)
      found.turnedOver +=
          solid.distance(middle + 0.1 * area.normalized()) < solid.distance(middle) - 0.01;
  }
}

template <typename Make>
void show(const char* kind, int count, const Make& make) {
  Findings found;
  for (int i = 0; i < count; ++i) {
    std::vector<V3d> corners;
    const Truth solid = make(corners);
    look(solid, corners, found);
  }
  fmt::print(
      "{:<26} {:5} solids, {:5} with edges; vertices off by up to {:.3f} voxel ({} by over 0.05), "
      "corners by {:.3f}; {} of {} triangles turned over\n",
      kind, found.solids, found.withEdges, found.vertex, found.off, found.corner, found.turnedOver,
      found.triangles);
}

}  // namespace

int main(int count, char** arguments) {
  const int solids = count > 1 ? std::atoi(arguments[1]) : 1000;
  show("tori", solids, [](auto&) {
    const double tube = smallRadius();
    return regress::torus(somewhere(), direction(), tube * between(1.2, 3.2), tube);
  });
  show("balls", solids, [](auto&) { return regress::ball(somewhere(), smallRadius()); });
  show("capsules", solids, [](auto&) {
    const double radius = smallRadius();
    const V3d middle = somewhere(), reach = direction() * (2 * radius);
    return regress::capsule(middle - reach, middle + reach, radius);
  });
  show("boxes, rounded", solids, [](auto&) {
    const double radius = smallRadius();
    const V3d size(between(2, 12), between(2, 12), between(2, 12));
    return placed(regress::box(V3d(0), size, radius));
  });
  show("cubes of 20 to 40 voxels", solids / 10, [](std::vector<V3d>& corners) {
    const double edge = between(20, 40);
    Imath::M44d matrix;
    matrix.setEulerAngles(V3d(between(0, 3), between(0, 3), between(0, 3)));
    matrix = matrix * Imath::M44d().setTranslation(somewhere());
    for (int i = 0; i < 8; ++i)
      corners.push_back(V3d(i & 4 ? edge : -edge, i & 2 ? edge : -edge, i & 1 ? edge : -edge) / 2 *
                        matrix);
    return regress::moved(regress::box(V3d(0), V3d(edge)), matrix);
  });
  for (const double radius : {8.0, 12.0, 15.0, 20.0, 30.0})
    show(fmt::format("cylinders of radius {}", radius).c_str(), solids / 50, [=](auto&) {
      return regress::cylinder(somewhere(), direction(), radius, between(14, 18));
    });
}
