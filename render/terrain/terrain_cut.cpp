#include "render/terrain/terrain_cut.h"

#include <algorithm>
#include <cmath>

namespace render {

TerrainCut::TerrainCut(const PatchGrid& grid, const TerrainView& view, std::size_t mostPatches)
    : grid_(grid), view_(view) {
  splits_.resize(grid.layout().pyramid.levels.size());
  std::vector<TerrainPatch> now;
  if (isVisible(grid.root())) now.push_back(grid.root());
  for (std::size_t total = now.size(); !now.empty() && total <= mostPatches;) {
    std::vector<TerrainPatch> finer;
    for (const TerrainPatch& patch : now) {
      if (!isTooCoarse(patch)) continue;
      split(patch);
      const std::vector<TerrainPatch> children = visibleChildren(patch);
      finer.insert(finer.end(), children.begin(), children.end());
    }
    total += finer.size();
    now = std::move(finer);
  }
}

TerrainCut::Node& TerrainCut::node(const TerrainPatch& patch) {
  const auto found = nodes_.find(patch);
  if (found != nodes_.end()) return found->second;
  std::optional<TerrainView::Planes> planes = TerrainView::kAllPlanes;
  if (patch.level < grid_.topLevel()) planes = node(PatchGrid::parent(patch)).crossed;
  if (planes) planes = view_.crossed(grid_.box(patch), *planes);
  return nodes_.emplace(patch, Node{.crossed = planes}).first->second;
}

TerrainPatch TerrainCut::visibleAncestor(TerrainPatch patch) {
  while (!isVisible(patch)) patch = PatchGrid::parent(patch);
  return patch;
}

bool TerrainCut::isTooCoarse(const TerrainPatch& patch) const {
  if (patch.level == 0) return false;
  const double bound = static_cast<double>(grid_.errors(patch).bound);
  return std::isinf(bound) || bound > view_.allowedError(grid_.box(patch));
}

bool TerrainCut::split(const TerrainPatch& patch) {
  Node& here = node(patch);
  if (here.isSplit) return false;
  here.isSplit = true;
  splits_[static_cast<std::size_t>(patch.level)].push_back(patch);
  return true;
}

// From fine to coarse: a patch with finer ones needs its parent, and its neighbours at its own
// level. If a neighbour is invisible, its nearest visible ancestor must not be drawn in its place.
void TerrainCut::balance() {
  if (!isVisible(grid_.root())) return;
  for (int level = 1; level < grid_.topLevel(); ++level) {
    const std::vector<TerrainPatch>& here = splits_[static_cast<std::size_t>(level)];
    for (std::size_t n = 0; n < here.size(); ++n) {  // only coarser levels grow meanwhile
      split(PatchGrid::parent(here[n]));
      for (const PatchSide side : kPatchSides) {
        const std::optional<TerrainPatch> beside = grid_.neighbour(here[n], side);
        if (!beside) continue;
        const TerrainPatch drawn = visibleAncestor(*beside);
        split(drawn == *beside ? PatchGrid::parent(drawn) : drawn);
      }
    }
  }
}

std::vector<TerrainPatch> TerrainCut::visibleChildren(const TerrainPatch& patch) {
  std::vector<TerrainPatch> children;
  for (int n = 0; n < 4; ++n) {
    const std::optional<TerrainPatch> child = grid_.child(patch, n);
    if (child && isVisible(*child)) children.push_back(*child);
  }
  return children;
}

std::vector<TerrainPatch> TerrainCut::needed() {
  std::vector<TerrainPatch> all;
  if (!isVisible(grid_.root())) return all;
  balance();
  all.push_back(grid_.root());
  for (int level = grid_.topLevel(); level > 0; --level) {
    std::vector<TerrainPatch>& here = splits_[static_cast<std::size_t>(level)];
    std::sort(here.begin(), here.end());  // the order must not depend on refine()
    for (const TerrainPatch& patch : here) {
      const std::vector<TerrainPatch> children = visibleChildren(patch);
      all.insert(all.end(), children.begin(), children.end());
    }
  }
  return all;
}

bool TerrainCut::isDivisible(const TerrainPatch& patch,
                             const std::function<bool(const TerrainPatch&)>& isResident) {
  if (!node(patch).isSplit) return false;
  for (const TerrainPatch& child : visibleChildren(patch))
    if (!isResident(child)) return false;
  for (const PatchSide side : kPatchSides) {
    const std::optional<TerrainPatch> beside = grid_.neighbour(patch, side);
    if (!beside) continue;
    const TerrainPatch drawn = visibleAncestor(*beside);
    const Node& there = node(drawn);
    const bool isReached = there.formation == formation_;
    if (drawn == *beside ? !isReached : !(isReached && there.isDivided)) return false;
  }
  return true;
}

bool TerrainCut::isLeaf(const TerrainPatch& patch) {
  const Node& here = node(patch);
  return here.formation == formation_ && !here.isDivided;
}

unsigned TerrainCut::coarserSidesOf(const TerrainPatch& patch) {
  unsigned sides = 0;
  for (const PatchSide side : kPatchSides) {
    const std::optional<TerrainPatch> beside = grid_.neighbour(patch, side);
    if (beside && isLeaf(PatchGrid::parent(*beside))) sides |= side;
  }
  return sides;
}

std::vector<CutPatch> TerrainCut::formed(
    const std::function<bool(const TerrainPatch&)>& isResident) {
  std::vector<CutPatch> leaves;
  if (!isVisible(grid_.root())) return leaves;
  ++formation_;
  std::vector<TerrainPatch> now = {grid_.root()};
  while (!now.empty()) {
    for (const TerrainPatch& patch : now) {
      node(patch).formation = formation_;
      node(patch).isDivided = false;
    }
    std::vector<TerrainPatch> finer;
    for (const TerrainPatch& patch : now) {
      if (patch.level == 0 || !isDivisible(patch, isResident)) {
        leaves.push_back({patch, 0, node(patch).isSplit});
        continue;
      }
      node(patch).isDivided = true;
      const std::vector<TerrainPatch> children = visibleChildren(patch);
      finer.insert(finer.end(), children.begin(), children.end());
    }
    now = std::move(finer);
  }
  for (CutPatch& leaf : leaves)
    if (leaf.patch.level < grid_.topLevel()) leaf.coarserSides = coarserSidesOf(leaf.patch);
  return leaves;
}

}  // namespace render
