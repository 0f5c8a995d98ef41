#include "levelset/meshing/band_to_mesh.h"

#include <fmt/core.h>
#include <utility>

#include "levelset/error.h"
#include "levelset/meshing/decimate.h"
#include "levelset/meshing/sharp/sharp_surface.h"
#include "levelset/meshing/world_mesh.h"

namespace levelset {
namespace {

void validate(const BandToMeshOptions& options) {
  if (!(options.adaptivity >= 0 && options.adaptivity <= 1)) {
    throw UsageError(fmt::format("adaptivity {} is outside [0, 1]; give a number in that range",
                                 options.adaptivity));
  }
  if (options.sharp && options.adaptivity > 0) {
    throw UsageError("sharp and adaptivity exclude each other; omit one of them");
  }
}

}  // namespace

TriMesh bandToMesh(const NarrowBand& band, const BandToMeshOptions& options) {
  validate(options);
  report(options.progress, 0);
  const CellSurface surface = cellsOf(band, options.openSurface);
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
  TriMesh result = toWorld(std::move(mesh), band);
  report(options.progress, 1);
  return result;
}

}  // namespace levelset
