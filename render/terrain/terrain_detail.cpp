#include "render/terrain/terrain_detail.h"

#include <fmt/core.h>

#include <cmath>
#include <unordered_map>
#include <utility>

#include "levelset/error.h"
#include "render/terrain/resident_patches.h"
#include "render/terrain/terrain_cut.h"
#include "render/terrain/terrain_view.h"

namespace render {
struct TerrainDetail::Patches {
  std::shared_ptr<const levelset::PatchStore> store;
  PatchGrid grid;
  ResidentPatches resident;

  using Found = std::unordered_map<TerrainPatch, std::shared_ptr<const PatchHeights>, PatchHash>;

  /// Looks patches up. Those that were found stay found while a selection is formed.
  std::shared_ptr<const PatchHeights> find(const TerrainPatch& patch, Found& found) const {
    const auto known = found.find(patch);
    if (known != found.end()) return known->second;
    std::shared_ptr<const PatchHeights> heights = resident.find(patch);
    // In this selection, a patch that is read now is found by a later look.
    if (heights) found.emplace(patch, heights);
    return heights;
  }

  /// Demands the finer patches of coarser neighbours that take too much of the error.
  bool refineBorders(TerrainCut& cut, const TerrainView& view, const std::vector<CutPatch>& leaves,
                     Found& found) const {
    bool hasNew = false;
    for (const CutPatch& leaf : leaves) {
      if (leaf.coarserSides == 0) continue;
      const double allowed = view.allowedError(grid.box(leaf.patch)),
                   own = static_cast<double>(grid.errors(leaf.patch).error);
      const std::shared_ptr<const PatchHeights> heights = find(leaf.patch, found);
      for (std::size_t n = 0; n < kPatchSides.size(); ++n) {
        const double border = static_cast<double>(heights->borderErrors[n]);
        const bool isExact = own + border <= allowed && !std::isinf(border);
        if ((leaf.coarserSides & kPatchSides[n]) == 0 || isExact) continue;
        const auto beside = grid.neighbour(leaf.patch, kPatchSides[n]);
        hasNew = cut.refine(PatchGrid::parent(*beside)) || hasNew;
      }
    }
    return hasNew;
  }
};

TerrainDetail::TerrainDetail(std::shared_ptr<const levelset::PatchStore> store,
                             TerrainDetailOptions options) {
  levelset::requireLengths(store->layout().isGeographic);
  patches_.reset(new Patches{
      store, PatchGrid(store->layout()), {store, options.maxBytes, std::move(options.onArrival)}});
}

TerrainDetail::~TerrainDetail() = default;

TerrainSelection TerrainDetail::select(const Camera& camera, double pixelError, Reading reading) {
  validate(camera);
  if (!(pixelError > 0) || std::isinf(pixelError))
    throw levelset::UsageError(
        fmt::format("the pixel error of a terrain is {}; give a positive number", pixelError));
  ResidentPatches& resident = patches_->resident;
  const TerrainView view(camera, pixelError);
  TerrainCut cut(patches_->grid, view, resident.capacity());
  std::vector<CutPatch> leaves;
  Patches::Found found;
  for (bool hasNew = true; hasNew;) {
    const std::vector<TerrainPatch> needed = cut.needed();
    if (reading == Reading::Now) {
      resident.load(needed);
      if (needed.size() >= resident.capacity()) found.clear();  // some were dropped for others
    } else {
      resident.request(needed);
    }
    leaves = cut.formed(
        [&](const TerrainPatch& patch) { return patches_->find(patch, found) != nullptr; });
    hasNew = patches_->refineBorders(cut, view, leaves, found);
  }
  TerrainSelection selection;
  for (const CutPatch& leaf : leaves) {
    selection.isComplete = selection.isComplete && !leaf.isWantedFiner;
    selection.parts.push_back({leaf.patch.level, leaf.patch.column, leaf.patch.row,
                               leaf.coarserSides, patches_->find(leaf.patch, found)});
  }
  return selection;
}

const levelset::GroundLayout& TerrainDetail::layout() const {
  return patches_->store->layout();
}

std::vector<std::string> TerrainDetail::takeWarnings() {
  return patches_->resident.takeWarnings();
}

bool TerrainDetail::isIdle() const {
  return patches_->resident.isIdle();
}

std::size_t TerrainDetail::memoryUse() const {
  return patches_->resident.count() * ResidentPatches::patchBytes(layout().pyramid.cells);
}

std::size_t TerrainDetail::mostMemoryUse() const {
  return patches_->resident.mostCount() * ResidentPatches::patchBytes(layout().pyramid.cells);
}

}  // namespace render
