#include "levelset/distance/surface/zero_set.h"

#include <limits>

#include "levelset/error.h"

namespace levelset::eikonal {

ZeroSet readZeroSet(const openvdb::FloatGrid& field, const BlockSelection& within,
                    const BlockSelection* edgesWithin, const Progress& progress) {
  ZeroSet surface{field.constTreePtr(),
                  edgesWithin ? SharpPatches(field, *edgesWithin, progress) : SharpPatches(),
                  {}};
  surface.points = findSurfacePoints(*surface.interpolated, within, surface.patches);
  if (!surface.points.thin.empty()) {
    surface.interpolated = thicken(field.tree(), surface.points.thin);
    surface.points = findSurfacePoints(*surface.interpolated, within, surface.patches);
  }
  if (surface.points.size() >= std::numeric_limits<std::uint32_t>::max())
    throw ResourceLimit(
        "more than 2^32 grid points lie beside the surface; use larger "
        "voxels");
  return surface;
}

}  // namespace levelset::eikonal
