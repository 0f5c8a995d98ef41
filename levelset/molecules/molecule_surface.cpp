#include "levelset/molecules/molecule_surface.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "levelset/error.h"
#include "levelset/geometry/surface_components.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/molecules/ball_union.h"
#include "levelset/molecules/excluded_surface.h"
#include "levelset/shapes/shape_band_vdb.h"

namespace levelset {
namespace {

// Blocks of 8³ voxels are left out if their centre is farther from the surface than the half width
// and half of their diagonal. So distances must be known up to there.
constexpr double kBlockVoxels = 7;

/// Cavities of a union of balls.
std::vector<MoleculeCavity> cavitiesOf(const BallUnion& all, std::size_t maxBytes) {
  std::vector<MoleculeCavity> cavities;
  for (BallUnion::Boundary& boundary : all.boundaries(maxBytes))
    if (boundary.volume < 0)
      cavities.push_back({-boundary.volume, boundary.area, std::move(boundary.balls)});
  return cavities;
}

/// Cavities of an excluded solid, by its mesh. The atoms are those whose spheres or arcs are
/// closest.
/// @param area  estimate of that of the solid, world units²
std::vector<MoleculeCavity> cavitiesOf(const NarrowBand& band, const BallUnion& accessible,
                                       double area, std::size_t maxBytes) {
  // Vertices in a square of the edge of a voxel, on average over all directions; bytes of a vertex
  // and its two triangles in the mesh of the grid, in that of the surface, and in its pieces.
  constexpr double kVertices = 1.5, kBytesOfVertex = 100;
  const double edge = band.voxelSize();
  requireMemory(kVertices * kBytesOfVertex * area / (edge * edge), maxBytes);
  const TriMesh mesh = bandToMesh(band);
  const SurfaceComponents pieces = findSurfaceComponents(mesh.positions, mesh.triangles);
  std::vector<std::set<std::uint32_t>> atoms(pieces.figures.size());
  for (std::size_t n = 0; n < mesh.positions.size(); ++n) {
    const std::uint32_t piece = pieces.componentOfVertex[n];
    if (piece == SurfaceComponents::kNoComponent || pieces.figures[piece].volume >= 0) continue;
    const BallUnion::Foot foot = accessible.closest(mesh.positions[n]);
    if (!foot.isExact) continue;
    if (foot.isOnArc) {
      atoms[piece].insert(accessible.arcs()[foot.feature].first);
      atoms[piece].insert(accessible.arcs()[foot.feature].second);
    } else {
      atoms[piece].insert(foot.feature);
    }
  }
  std::vector<MoleculeCavity> cavities;
  for (std::size_t n = 0; n < atoms.size(); ++n)
    if (pieces.figures[n].volume < 0)
      cavities.push_back(
          {-pieces.figures[n].volume, pieces.figures[n].area, {atoms[n].begin(), atoms[n].end()}});
  return cavities;
}

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
  const std::size_t left =
      options.maxMemory == kNoMemoryLimit
          ? kNoMemoryLimit
          : shape.maxMemory - std::min(shape.maxMemory, result.band.memoryUse());
  if (options.volumes) result.volumes = all.volumes(left);
  if (options.cavities) {
    result.cavities =
        isExcluded ? cavitiesOf(result.band, all, extent.area, left) : cavitiesOf(all, left);
    std::stable_sort(result.cavities.begin(), result.cavities.end(),
                     [](const auto& a, const auto& b) { return a.volume > b.volume; });
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
