#include "mapping/textures/texture_shells.h"

#include <algorithm>
#include <map>
#include <utility>

#include "levelset/error.h"
#include "mapping/maps/lattice_nodes.h"
#include "mapping/textures/texture_maps.h"
#include "mapping/textures/texture_parts.h"
#include "mapping/textures/texture_placement.h"

namespace mapping {
namespace {

using Imath::Box3d;
using Imath::V3d;
using levelset::NarrowBand;

// Voxels of the texture by which a shell reaches beyond the texture's surface. The trilinear
// surface may leave the box of the sign changes between grid points by less than a voxel.
constexpr double kShellMargin = 1;

TextureShell shellOf(const Patch& patch, const TexturePlacement& placement, const Box3d& surface,
                     double voxelSize) {
  const V3d margin(kShellMargin * voxelSize);
  const Box3d reach(placement.toUvw(surface.min - margin), placement.toUvw(surface.max + margin));
  LatticeNodes nodes =
      latticeNodes(patch, {.embedDepth = placement.embedDepth, .reach = reach, .isTight = true});
  TextureShell shell;
  shell.cells = nodes.cells;
  for (int a = 0; a < 3; ++a) {
    const auto axis = static_cast<std::size_t>(a);
    for (const double coordinate : nodes.coordinates[axis]) {
      V3d uvw(0);
      uvw[a] = coordinate;
      shell.coordinates[axis].push_back(placement.toTexture(uvw)[a]);
    }
  }
  Box3d box;
  for (const V3d& p : nodes.positions) box.extendBy(p);
  shell.centre = box.center();
  shell.offsets.reserve(nodes.positions.size());
  for (const V3d& p : nodes.positions) shell.offsets.emplace_back(p - shell.centre);
  return shell;
}

}  // namespace

PlacedTexture placeTexture(const NarrowBand& base, const NarrowBand& texture,
                           std::span<const Patch> patches, const TextureOptions& options) {
  if (options.map != TextureMap::Prism)
    throw levelset::UsageError("only the prism map can be used without warping; give --map shell");
  if (options.merge == TextureMerge::Carve)
    throw levelset::UsageError("a texture that is not warped cannot be subtracted; omit --carve");
  requireTextureArguments(base, texture, patches, options);
  const Box3d own = texture.zeroSetBounds(), box = chooseTextureBox(own, options.textureBox);
  const double embedDepth = options.embedDepth ? *options.embedDepth : base.voxelSize();

  PlacedTexture result;
  std::vector<std::size_t> placed;
  (void)makeMaps(base, texture, patches, {box, embedDepth}, options, result.report,
                 [&](std::size_t n) { placed.push_back(n); });
  const double voxelSize = texture.voxelSize();
  result.report.voxelSize = voxelSize * result.report.distortion.stretch.median;
  // Voxels of the texture on the patches, along the direction of the largest stretch: clipped parts
  // then overlap by at least as many voxels of the texture.
  const TextureParts parts(texture, box, patches, voxelSize * result.report.distortion.stretch.most,
                           isBeyond(own, box, voxelSize),
                           [](const NarrowBand& part) { return part; });
  std::map<SharedSides, std::size_t> groups;
  for (const std::size_t n : placed) {
    const auto [group, isNew] = groups.try_emplace(parts.sidesOf(n), result.groups.size());
    if (isNew) result.groups.push_back({parts.of(n), {}});
    ShellGroup& to = result.groups[group->second];
    to.shells.push_back(shellOf(patches[n], {box, embedDepth / patches[n].height},
                                to.texture.zeroSetBounds(), voxelSize));
  }
  levelset::report(options.progress, 1);
  return result;
}

}  // namespace mapping
