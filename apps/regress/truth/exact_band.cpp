#include "apps/regress/truth/exact_band.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/vdb.h"

namespace regress {

using Imath::V3d;
using levelset::NarrowBand;

namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

void fillBlock(const openvdb::Coord& origin, const Distance& distance, openvdb::FloatGrid& grid) {
  const float background = grid.background();
  auto leaf = std::make_unique<Leaf>(origin, background);
  for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
    // A value that rounds to the background is not part of the band, so rounding comes first.
    const auto value = static_cast<float>(
        distance(levelset::toImath(grid.indexToWorld(leaf->offsetToGlobalCoord(i)))));
    if (std::abs(value) < background)
      leaf->setValueOn(i, value);
    else
      leaf->setValueOff(i, std::copysign(background, value));
  }
  grid.tree().addLeaf(leaf.release());
}

}  // namespace

NarrowBand exactBand(const Truth& truth, double voxelSize, double halfWidth) {
  const auto grid = levelset::emptyLevelSet(levelset::uniformTransform(voxelSize), halfWidth);
  const double background = halfWidth * voxelSize,
               reachOfBlock = 3.5 * std::numbers::sqrt3 * voxelSize;
  const double extent = truth.reach + background + voxelSize;
  const auto block = [&](double world) {
    return static_cast<int>(std::floor(world / voxelSize)) & ~7;
  };
  const V3d low = truth.centre - V3d(extent), high = truth.centre + V3d(extent);
  openvdb::Coord c;
  for (c[0] = block(low.x); c[0] <= block(high.x); c[0] += 8)
    for (c[1] = block(low.y); c[1] <= block(high.y); c[1] += 8)
      for (c[2] = block(low.z); c[2] <= block(high.z); c[2] += 8) {
        const V3d middle = levelset::toImath(grid->indexToWorld(c.asVec3d() + openvdb::Vec3d(3.5)));
        const double value = truth.distance(middle);
        if (std::abs(value) < background + reachOfBlock)
          fillBlock(c, truth.distance, *grid);
        else if (value < 0)
          grid->tree().addTile(1, c, -grid->background(), false);
      }
  grid->pruneGrid();
  return levelset::makeBand(grid);
}

NarrowBand perturbedBand(const Truth& truth, double voxelSize, double wave) {
  NarrowBand band = exactBand(truth, voxelSize);
  openvdb::FloatGrid& grid = levelset::editVdb(band);
  const double background = static_cast<double>(grid.background()), step = 4 * wave;
  for (auto it = grid.beginValueOn(); it; ++it) {
    const V3d p = levelset::toImath(grid.indexToWorld(it.getCoord())) / step;
    const double slope = 1.5 + 0.8 * std::sin(p.x) * std::sin(p.y) * std::sin(p.z);
    it.setValue(
        static_cast<float>(std::clamp(static_cast<double>(*it) * slope, -background, background)));
  }
  return band;
}

}  // namespace regress
