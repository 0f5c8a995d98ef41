#include <fmt/core.h>
#include <openvdb/tools/Dense.h>

#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/vdb.h"
#include "levelset/volume_files/volume_header.h"

namespace levelset {

Volume volumeOf(const FieldGrid& field, std::size_t maxMemory) {
  const openvdb::FloatGrid::ConstPtr& grid = field.shared()->scalar;
  if (!grid)
    throw InvalidInput(
        "the grid holds vectors, but a volume holds numbers; choose another grid of the file");
  if (!grid->transform().isLinear())
    throw InvalidInput("the grid has a frustum transform; resample it to a regular grid");
  openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
  if (box.empty())
    throw InvalidInput("the grid has no active voxel, so there is no volume; choose another grid");
  box.expand(1);
  const openvdb::Vec3d size(static_cast<double>(box.dim()[0]), static_cast<double>(box.dim()[1]),
                            static_cast<double>(box.dim()[2]));
  const double bytes = size[0] * size[1] * size[2] * sizeof(float);
  const std::size_t limit = memoryLimit(maxMemory);
  if (!(bytes <= static_cast<double>(limit)))
    throw ResourceLimit(fmt::format(
        "the active region of the grid has {} x {} x {} points, which take {:.3g} GB as "
        "a volume and exceed the limit of {:.3g} GB; raise --max-memory",
        size[0], size[1], size[2], bytes * 1e-9, static_cast<double>(limit) * 1e-9));
  // LayoutXYZ: x, and so i, is the fastest index.
  openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box);
  openvdb::tools::copyToDense(*grid, dense);
  const auto at = [&](const openvdb::Vec3d& index) {
    return toImath(grid->transform().indexToWorld(index));
  };
  const openvdb::Vec3d first = box.min().asVec3d();
  const Imath::V3d origin = at(first);
  const auto axis = [&](int n) {
    openvdb::Vec3d step(0.0);
    step[n] = 1;
    return at(first + step) - origin;
  };
  return {VolumeGrid{{box.dim()[0], box.dim()[1], box.dim()[2]},
                     volume_files::affineMap(axis(0), axis(1), axis(2), origin)},
          std::vector<float>(dense.data(), dense.data() + dense.valueCount())};
}

}  // namespace levelset
