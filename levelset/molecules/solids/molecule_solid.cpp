#include "levelset/molecules/solids/molecule_solid.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include "levelset/molecules/ball_union.h"
#include "levelset/molecules/solids/rod_union.h"
#include "levelset/shapes/shape_band_vdb.h"

namespace levelset {
namespace {

// As in moleculeSurface(): the centre of a block may lie this much deeper than the band.
constexpr double kSolidBlockVoxels = 7;

}  // namespace

MoleculeSolidResult moleculeSolid(const Molecule& molecule, double voxelSize,
                                  const MoleculeModelOptions& model,
                                  const MoleculeSolidOptions& options) {
  checkMoleculeModel(molecule, model);
  MoleculeSolidResult result;
  const bool hasSticks = hasMoleculeSticks(model.style);
  std::vector<Ball> balls;
  ShapeExtent extent;
  for (const Atom& atom : molecule.atoms) {
    const double radius = moleculeBallRadius(atom, model);
    balls.push_back({atom.position, radius});
    extent.bounds.extendBy(atom.position - Imath::V3d(radius));
    extent.bounds.extendBy(atom.position + Imath::V3d(radius));
    extent.area += 4 * std::numbers::pi * radius * radius;
  }
  std::vector<Rod> rods;
  if (hasSticks)
    for (const auto& [first, second] : moleculeBonds(molecule, model.bonds)) {
      const double length = (balls[first].centre - balls[second].centre).length();
      if (!(length > 0)) continue;  // bonds of the file may have none
      rods.push_back({first, second, model.stickRadius});
      extent.area += 2 * std::numbers::pi * model.stickRadius * length;
    }
  result.balls = balls.size();
  result.bonds = rods.size();
  ShapeOptions shape{.halfWidth = options.halfWidth,
                     .maxMemory = options.maxMemory,
                     .progress = subProgress(options.progress, 0.4, 1)};
  checkShape(extent, voxelSize, shape);
  const Progress first = subProgress(options.progress, 0, 0.4);
  const double reach = (options.halfWidth + kSolidBlockVoxels) * voxelSize;
  const auto left = [&](std::size_t used) {
    return options.maxMemory == kNoMemoryLimit
               ? kNoMemoryLimit
               : options.maxMemory - std::min(options.maxMemory, used);
  };
  if (!hasSticks) {
    const BallUnion all(std::move(balls), reach, options.maxMemory, first);
    result.volume = all.exposure().volume;
    shape.maxMemory = left(all.bytes());
    result.band =
        makeShape(extent, voxelSize, shape, [&](const Imath::V3d& p) { return all.distance(p); });
    return result;
  }
  const RodUnion all(balls, rods, options.maxMemory, first);
  shape.maxMemory = left(all.bytes());
  const double depth = options.halfWidth * voxelSize * (1 + 1e-6);
  result.band = makeShape(extent, voxelSize, shape,
                          [&](const Imath::V3d& p) { return all.distance(p, depth); });
  return result;
}

}  // namespace levelset
