#include "levelset/distance/surface/zero_set.h"

namespace levelset::eikonal {

ZeroSet readZeroSet(const openvdb::FloatGrid& field, const BlockSelection& within,
                    const BlockSelection* edgesWithin, const Progress& progress) {
  ZeroSet surface{field.constTreePtr(),
                  edgesWithin ? SharpPatches(field, *edgesWithin, progress) : SharpPatches(),
                  {}};
  std::vector<openvdb::Coord> thin;
  surface.points =
      findSurfacePoints(*surface.interpolated, within, surface.patches, &thin, &surface.gridPoints);
  if (!thin.empty()) {
    surface.interpolated = thicken(field.tree(), thin);
    surface.points = findSurfacePoints(*surface.interpolated, within, surface.patches, nullptr,
                                       &surface.gridPoints);
  }
  return surface;
}

}  // namespace levelset::eikonal
