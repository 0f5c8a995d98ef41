#include "levelset/meshing/world_mesh.h"

#include <tbb/parallel_for.h>

#include <utility>

#include "levelset/error.h"

namespace levelset {

CellSurface cellsOf(const NarrowBand& band, bool openSurface) {
  if (!openSurface) requireSolid(band);
  if (band.isEmpty()) {
    throw InvalidInput("the band is empty and has no surface; check the action that computed it");
  }
  CellSurface surface(vdb(band));
  if (!surface.triangleCount()) {
    throw InvalidInput(
        "the band has no zero crossing and so no surface; check the action that "
        "computed it");
  }
  return surface;
}

TriMesh toWorld(IndexMesh mesh, const NarrowBand& band) {
  TriMesh result;
  const Imath::M44d matrix = band.indexToWorld();
  result.positions.resize(mesh.positions.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.positions.size(), 4096),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        matrix.multVecMatrix(toImath(mesh.positions[i]), result.positions[i]);
                      }
                    });
  result.triangles = std::move(mesh.triangles);
  return result;
}

}  // namespace levelset
