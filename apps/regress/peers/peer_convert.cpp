#include <openvdb/tools/FastSweeping.h>
#include <openvdb/tools/GridTransformer.h>
#include <openvdb/tools/LevelSetPlatonic.h>
#include <openvdb/tools/LevelSetRebuild.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/MeshToVolume.h>

#include "apps/regress/peers/peer.h"
#include "apps/regress/peers/peer_vdb.h"

namespace regress::peer {

using Imath::V3d;
using levelset::NarrowBand;
using openvdb::FloatGrid;

namespace {

openvdb::Vec3f toVec3f(const V3d& v) {
  return openvdb::Vec3f(levelset::toVdb(v));
}

}  // namespace

NarrowBand sphere(double radius, const V3d& centre, double voxelSize) {
  return adopt(openvdb::tools::createLevelSetSphere<FloatGrid>(
      static_cast<float>(radius), toVec3f(centre), static_cast<float>(voxelSize)));
}

NarrowBand box(const V3d& size, const V3d& centre, double voxelSize) {
  const openvdb::math::BBox<openvdb::Vec3f> bounds(toVec3f(centre - size / 2),
                                                   toVec3f(centre + size / 2));
  return adopt(
      openvdb::tools::createLevelSetBox<FloatGrid>(bounds, *levelset::uniformTransform(voxelSize)));
}

NarrowBand fromMesh(const levelset::TriMesh& mesh, double voxelSize) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  for (const V3d& p : mesh.positions) points.emplace_back(levelset::toVdb(p));
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  return adopt(openvdb::tools::meshToLevelSet<FloatGrid>(*levelset::uniformTransform(voxelSize),
                                                         points, triangles, 3.0f));
}

NarrowBand rebuild(const NarrowBand& band) {
  const auto halfWidth = static_cast<float>(band.halfWidth());
  return adopt(openvdb::tools::levelSetRebuild(levelset::vdb(band), 0.0f, halfWidth));
}

NarrowBand sweep(const NarrowBand& band) {
  return adopt(openvdb::tools::sdfToSdf(levelset::vdb(band)));
}

NarrowBand resample(const NarrowBand& band, double voxelSize) {
  auto grid = FloatGrid::create(static_cast<float>(band.halfWidth() * voxelSize));
  grid->setTransform(levelset::uniformTransform(voxelSize));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  openvdb::tools::resampleToMatch<openvdb::tools::QuadraticSampler>(levelset::vdb(band), *grid);
  return adopt(grid);
}

}  // namespace regress::peer
