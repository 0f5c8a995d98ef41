#include "levelset/transform/crop.h"

#include <fmt/core.h>

#include <memory>
#include <vector>

#include "levelset/error.h"
#include "levelset/grids/grid_queries_vdb.h"
#include "levelset/vdb.h"

namespace levelset {

NarrowBand cropped(NarrowBand band, const RegionOfInterest& part) {
  using Leaf = openvdb::FloatTree::LeafNodeType;
  if (!(part.halfWidth >= 1))
    throw UsageError(fmt::format(
        "the half width of the region of interest is {} voxels; give at least 1", part.halfWidth));
  if (part.region.isEmpty())
    throw UsageError("the box of the region of interest is empty; give a box with a volume");
  if (!isEverywhere(part.region)) {
    const openvdb::CoordBBox blocks = blocksOf(part.region, vdb(band).transform());
    std::vector<openvdb::Coord> beyond;
    for (auto leaf = vdb(band).tree().cbeginLeaf(); leaf; ++leaf)
      if (!blocks.isInside(leaf->origin())) beyond.push_back(leaf->origin());
    if (!beyond.empty()) {
      // Copy only the blocks that stay.
      const openvdb::FloatGrid& whole = vdb(band);
      openvdb::FloatGrid::Ptr rest = openvdb::FloatGrid::create(whole.background());
      rest->insertMeta(whole);
      rest->setTransform(whole.transform().copy());
      auto tile = whole.tree().cbeginValueAll();
      tile.setMaxDepth(openvdb::FloatTree::DEPTH - 2);
      for (; tile; ++tile)
        if (*tile < 0)
          rest->tree().addTile(openvdb::FloatTree::DEPTH - 1 - tile.getDepth(), tile.getCoord(),
                               *tile, false);
      for (auto leaf = whole.tree().cbeginLeaf(); leaf; ++leaf)
        if (blocks.isInside(leaf->origin())) rest->tree().addLeaf(new Leaf(*leaf));
      if (!band.isOpenSurface()) {
        band = makeBand(rest);
      } else {
        auto beyondBorder = std::make_shared<openvdb::FloatTree>(0.f);
        for (auto leaf = band.shared()->beyond->cbeginLeaf(); leaf; ++leaf)
          if (blocks.isInside(leaf->origin())) beyondBorder->addLeaf(new Leaf(*leaf));
        band = makeOpenBand(rest, beyondBorder);
      }
    }
  }
  return part.halfWidth < band.halfWidth() ? narrowed(std::move(band), part.halfWidth) : band;
}

}  // namespace levelset
