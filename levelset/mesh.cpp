#include "levelset/mesh.h"

namespace levelset {

Imath::Box3d bounds(const TriMesh& mesh) {
  Imath::Box3d box;
  for (const Imath::V3d& p : mesh.positions) box.extendBy(p);
  return box;
}

double signedVolume(const TriMesh& mesh) {
  if (mesh.positions.empty()) return 0;
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
