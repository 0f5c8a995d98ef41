#include "levelset/mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace levelset {

double spacingAt(double magnitude, CoordinatePrecision precision) {
  if (precision == CoordinatePrecision::Double)
    return std::nextafter(magnitude, std::numeric_limits<double>::infinity()) - magnitude;
  const auto stored = static_cast<float>(magnitude);
  return static_cast<double>(std::nextafter(stored, std::numeric_limits<float>::infinity())) -
         static_cast<double>(stored);
}

double coordinateSpacing(const TriMesh& mesh) {
  double greatest = 0;
  for (const Imath::V3d& p : mesh.positions)
    for (int axis = 0; axis < 3; ++axis) greatest = std::max(greatest, std::abs(p[axis]));
  return std::max(mesh.spacing, spacingAt(greatest, mesh.precision));
}

Imath::Box3d bounds(const TriMesh& mesh) {
  Imath::Box3d box;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle) box.extendBy(mesh.positions[v]);
  return box;
}

double signedVolume(const TriMesh& mesh) {
  if (mesh.isEmpty()) return 0;
  const Imath::V3d centre = bounds(mesh).center();
  double sixfold = 0;
  for (const auto& t : mesh.triangles) {
    const Imath::V3d a = mesh.positions[t[0]] - centre, b = mesh.positions[t[1]] - centre,
                     c = mesh.positions[t[2]] - centre;
    sixfold += a.dot(b.cross(c));
  }
  return sixfold / 6;
}

double surfaceArea(const TriMesh& mesh) {
  double twofold = 0;
  for (const auto& t : mesh.triangles) {
    const Imath::V3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]],
                     &c = mesh.positions[t[2]];
    twofold += (b - a).cross(c - a).length();
  }
  return twofold / 2;
}

}  // namespace levelset
