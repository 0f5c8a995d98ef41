#include "levelset/meshing/band_to_mesh.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include "levelset/error.h"
#include "levelset/meshing/cells/cell_surface.h"
#include "levelset/meshing/decimate.h"
#include "levelset/meshing/sharp/sharp_surface.h"

namespace levelset {
namespace {

void validate(const NarrowBand& band, const BandToMeshOptions& options) {
  if (!(options.adaptivity >= 0 && options.adaptivity <= 1)) {
    throw UsageError(fmt::format("adaptivity {} is outside [0, 1]; give a number in that range",
                                 options.adaptivity));
  }
  if (options.sharp && options.adaptivity > 0) {
    throw UsageError("sharp and adaptivity exclude each other; omit one of them");
  }
  if (!options.openSurface) requireSolid(band);
  if (band.isEmpty()) {
    throw InvalidInput("the band is empty and has no surface; check the action that computed it");
  }
}

TriMesh toWorld(const IndexMesh& mesh, const NarrowBand& band) {
  TriMesh result;
  const Imath::M44d matrix = band.indexToWorld();
  result.positions.resize(mesh.positions.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.positions.size(), 4096),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        matrix.multVecMatrix(toImath(mesh.positions[i]), result.positions[i]);
                      }
                    });
  return result;
}

}  // namespace

TriMesh bandToMesh(const NarrowBand& band, const BandToMeshOptions& options) {
  validate(band, options);
  report(options.progress, 0);
  const CellSurface surface(vdb(band));
  if (!surface.triangleCount()) {
    throw InvalidInput(
        "the band has no zero crossing and so no surface; check the action that "
        "computed it");
  }
  report(options.progress, 0.3);
  IndexMesh mesh =
      options.sharp
          ? IndexMesh(sharpSurface(surface, vdb(band), subProgress(options.progress, 0.3, 0.9)))
          : marchCells(surface);
  if (options.adaptivity > 0) {
    report(options.progress, 0.4);
    mesh = decimate(mesh, options.adaptivity);
  }
  report(options.progress, 0.9);
  TriMesh result = toWorld(mesh, band);
  result.triangles = std::move(mesh.triangles);
  report(options.progress, 1);
  return result;
}

}  // namespace levelset
