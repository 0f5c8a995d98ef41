#include <openvdb/tools/FastSweeping.h>
#include <openvdb/tools/LevelSetFilter.h>

#include "apps/regress/peers/peer.h"
#include "apps/regress/peers/peer_vdb.h"

namespace regress::peer {

using levelset::NarrowBand;

NarrowBand dilate(const NarrowBand& band, int voxels) {
  const auto grid = openvdb::tools::dilateSdf(levelset::vdb(band), voxels);
  openvdb::tools::changeLevelSetBackground(
      grid->tree(), static_cast<float>((band.halfWidth() + voxels) * band.voxelSize()));
  return adopt(grid);
}

NarrowBand curvatureFlow(const NarrowBand& band, double time) {
  const auto grid = levelset::vdb(band).deepCopy();
  openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
  // OpenVDB's speed is (k1 + k2) / 2, half of ours. Its time step of h²/3 is a step of h²/6 of our
  // time; h is the voxel size.
  const double h = band.voxelSize(), step = h * h / 6;
  for (long left = std::lround(time / step); left > 0; --left) filter.meanCurvature();
  return adopt(grid);
}

NarrowBand gaussian(const NarrowBand& band) {
  const auto grid = levelset::vdb(band).deepCopy();
  openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
  filter.gaussian(1);
  return adopt(grid);
}

}  // namespace regress::peer
