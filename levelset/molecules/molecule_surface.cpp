#include "levelset/molecules/molecule_surface.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "levelset/error.h"
#include "levelset/molecules/ball_union.h"
#include "levelset/molecules/excluded_surface.h"
#include "levelset/shapes/shape_band_vdb.h"

namespace levelset {
namespace {

// Blocks of 8³ voxels are left out if their centre is farther from the surface than the half width
// and half of their diagonal. So distances must be known up to there.
constexpr double kBlockVoxels = 7;

}  // namespace

MoleculeSurfaceResult moleculeSurface(const Molecule& molecule, double voxelSize,
                                      const MoleculeSurfaceOptions& options) {
  if (!(options.probe > 0) || !std::isfinite(options.probe))
    throw UsageError(fmt::format("the radius of the probe is {}; give a positive, finite length",
                                 options.probe));
  if (molecule.atoms.empty()) throw InvalidInput("the molecule has no atoms");
  const bool isExcluded = options.kind == MoleculeSurface::Excluded;
  const double larger = options.kind == MoleculeSurface::VanDerWaals ? 0 : options.probe;
  std::vector<Ball> balls;
  ShapeExtent extent;
  for (const Atom& atom : molecule.atoms) {
    const double radius = vanDerWaalsRadius(atom.element),
                 shown = isExcluded ? radius : radius + larger;
    balls.push_back({atom.position, radius + larger});
    extent.bounds.extendBy(atom.position - Imath::V3d(shown));
    extent.bounds.extendBy(atom.position + Imath::V3d(shown));
  }
  ShapeOptions shape{.halfWidth = options.halfWidth,
                     .maxMemory = options.maxMemory,
                     .progress = subProgress(options.progress, 0.4, 1)};
  checkShape(extent, voxelSize, shape);
  const double reach = (options.halfWidth + kBlockVoxels) * voxelSize;
  const BallUnion all(std::move(balls), isExcluded ? options.probe + reach : reach,
                      options.maxMemory, subProgress(options.progress, 0, 0.4));
  MoleculeSurfaceResult result;
  BallUnion::Exposure exposure = all.exposure();
  result.areas = std::move(exposure.areas);
  result.volume = exposure.volume;
  for (const double area : result.areas) extent.area += area;
  if (options.maxMemory != kNoMemoryLimit)
    shape.maxMemory = options.maxMemory - std::min(options.maxMemory, all.bytes());
  if (isExcluded) {
    const ExcludedSurface surface(all, options.probe);
    result.band = makeShape(extent, voxelSize, shape,
                            [&](const Imath::V3d& p) { return surface.distance(p); });
    result.unfinished = surface.unfinished();
  } else {
    result.band =
        makeShape(extent, voxelSize, shape, [&](const Imath::V3d& p) { return all.distance(p); });
  }
  return result;
}

std::vector<double> residueAreas(const Molecule& molecule, const std::vector<double>& areas) {
  std::vector<double> sums(molecule.residues.size());
  for (std::size_t n = 0; n < molecule.atoms.size(); ++n)
    sums[molecule.atoms[n].residue] += areas[n];
  return sums;
}

}  // namespace levelset
