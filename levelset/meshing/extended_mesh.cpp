#include "levelset/meshing/extended_mesh.h"

#include <utility>

#include "levelset/meshing/extended/extended_surface.h"
#include "levelset/meshing/world_mesh.h"

namespace levelset {

ExtendedMesh bandToExtendedMesh(const NarrowBand& band, const ExtendedMeshOptions& options) {
  report(options.progress, 0);
  const CellSurface surface = cellsOf(band, false);
  report(options.progress, 0.2);
  const EdgeCrossings crossings = options.original
                                      ? crossingsOfMesh(surface, vdb(band), *options.original)
                                      : crossingsOfField(surface, vdb(band));
  report(options.progress, 0.5);
  ExtendedSurface mesh =
      extendedSurface(surface, crossings, subProgress(options.progress, 0.5, 0.95));
  ExtendedMesh result;
  result.edgeVertices = mesh.edgeVertices;
  result.cornerVertices = mesh.cornerVertices;
  result.crossings = crossings.at.size();
  result.missingCrossings = options.original ? crossings.fromField : 0;
  result.mesh = toWorld(std::move(mesh), band);
  report(options.progress, 1);
  return result;
}

}  // namespace levelset
