#include "apps/viewer/model/surface_discs.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "levelset/vdb.h"

namespace viewer {
namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

void addPoints(const Leaf& leaf, const openvdb::FloatGrid& grid, double voxel,
               SurfaceDiscs& points) {
  const double reach = 0.5 * std::sqrt(3.0) * voxel;
  const auto accessor = grid.getConstAccessor();
  for (auto value = leaf.cbeginValueOn(); value; ++value) {
    const auto phi = static_cast<double>(*value);
    if (std::abs(phi) > reach) continue;
    const openvdb::Coord at = value.getCoord();
    const auto difference = [&](int x, int y, int z) {
      const openvdb::Coord step(x, y, z);
      return static_cast<double>(accessor.getValue(at + step) - accessor.getValue(at - step));
    };
    openvdb::Vec3d normal(difference(1, 0, 0), difference(0, 1, 0), difference(0, 0, 1));
    if (!normal.normalize()) continue;
    const openvdb::Vec3d foot = grid.indexToWorld(at.asVec3d() - normal * (phi / voxel));
    openvdb::Vec3d outward = grid.transform().baseMap()->applyJacobian(normal);
    outward.normalize();
    points.positions.emplace_back(levelset::toImath(foot));
    points.normals.emplace_back(levelset::toImath(outward));
  }
}

}  // namespace

SurfaceDiscs surfaceDiscs(const levelset::NarrowBand& band) {
  SurfaceDiscs all;
  if (band.isEmpty()) return all;
  const double voxel = band.voxelSize();
  all.radius = static_cast<float>(1.25 * 0.5 * std::sqrt(3.0) * voxel);
  const openvdb::FloatGrid& grid = levelset::vdb(band);
  std::vector<const Leaf*> leaves;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) leaves.push_back(leaf.getLeaf());
  constexpr std::size_t kLeaves = 256;  // leaves of a part of the work
  std::vector<SurfaceDiscs> parts((leaves.size() + kLeaves - 1) / kLeaves);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
    for (std::size_t i = part * kLeaves; i < std::min(leaves.size(), (part + 1) * kLeaves); ++i)
      addPoints(*leaves[i], grid, voxel, parts[part]);
  });
  for (SurfaceDiscs& part : parts) {
    all.positions.insert(all.positions.end(), part.positions.begin(), part.positions.end());
    all.normals.insert(all.normals.end(), part.normals.begin(), part.normals.end());
    part = {};
  }
  return all;
}

}  // namespace viewer
