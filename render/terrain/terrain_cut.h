#pragma once

#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "render/terrain/terrain_patch.h"
#include "render/terrain/terrain_view.h"

namespace render {

/// A patch to draw, and the sides on which its neighbour is one level coarser.
struct CutPatch {
  TerrainPatch patch;
  unsigned coarserSides = 0;   ///< set of PatchSide
  bool isWantedFiner = false;  ///< its finer patches are wanted, but they are not resident
};

/// Chooses the patches of a terrain that a picture needs. Levels of drawn neighbours differ by at
/// most one. Patches outside the frustum, and those without a known sample, are not drawn.
/// @pre grid and view outlive the object
class TerrainCut {
 public:
  /// @param mostPatches  levels below the one with this number of patches are not considered
  TerrainCut(const PatchGrid& grid, const TerrainView& view, std::size_t mostPatches);

  /// Demands the finer patches of a patch. The next needed() and formed() heed it.
  /// @return false if they have been demanded before
  /// @pre the patch is visible and not of level 0
  bool refine(const TerrainPatch& patch) { return split(patch); }
  /// Patches whose heights the picture needs, coarser levels first. The ancestors of a patch are
  /// before it. Levels of neighbours are balanced here.
  [[nodiscard]] std::vector<TerrainPatch> needed();
  /// Forms the patches to draw from those whose heights are there. A patch with a missing visible
  /// child is drawn itself. @pre needed() was called after refine(), and the root is resident
  [[nodiscard]] std::vector<CutPatch> formed(
      const std::function<bool(const TerrainPatch&)>& isResident);

 private:
  struct Node {
    std::optional<TerrainView::Planes> crossed;  // unset: invisible
    bool isSplit = false;                        // its children are wanted
    int formation = 0;                           // number of the last formed() that reached it
    bool isDivided = false;                      // in that formation, its children are there
  };

  Node& node(const TerrainPatch& patch);
  [[nodiscard]] bool isVisible(const TerrainPatch& patch) {
    return node(patch).crossed.has_value();
  }
  /// The patch or its nearest ancestor that is visible. @pre the root is visible
  [[nodiscard]] TerrainPatch visibleAncestor(TerrainPatch patch);
  [[nodiscard]] bool isTooCoarse(const TerrainPatch& patch) const;
  bool split(const TerrainPatch& patch);
  void balance();
  [[nodiscard]] std::vector<TerrainPatch> visibleChildren(const TerrainPatch& patch);
  [[nodiscard]] bool isDivisible(const TerrainPatch& patch,
                                 const std::function<bool(const TerrainPatch&)>& isResident);
  [[nodiscard]] bool isLeaf(const TerrainPatch& patch);
  [[nodiscard]] unsigned coarserSidesOf(const TerrainPatch& patch);

  const PatchGrid& grid_;
  const TerrainView& view_;
  std::unordered_map<TerrainPatch, Node, PatchHash> nodes_;
  std::vector<std::vector<TerrainPatch>> splits_;  // for each level
  int formation_ = 0;
};

}  // namespace render
