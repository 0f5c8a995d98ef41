#include <openvdb/tools/LevelSetAdvect.h>

#include "apps/regress/peers/peer.h"
#include "apps/regress/peers/peer_vdb.h"
#include "levelset/fields/grid.h"
#include "levelset/fields/grid_vdb.h"

namespace regress::peer {

using Imath::V3d;
using levelset::NarrowBand;
using levelset::VectorField;

namespace {

/// Velocity with the interface that OpenVDB's advection needs.
class Velocity {
 public:
  using VectorType = openvdb::Vec3f;
  using ValueType = float;

  Velocity(const VectorField& field, openvdb::math::Transform::ConstPtr transform)
      : field_(&field), transform_(std::move(transform)) {}

  [[nodiscard]] const openvdb::math::Transform& transform() const { return *transform_; }
  [[nodiscard]] VectorType operator()(const openvdb::Vec3d& world, double time) const {
    return VectorType(levelset::toVdb((*field_)(levelset::toImath(world), time)));
  }
  [[nodiscard]] VectorType operator()(const openvdb::Coord& c, double time) const {
    return (*this)(transform_->indexToWorld(c), time);
  }

 private:
  const VectorField* field_;
  openvdb::math::Transform::ConstPtr transform_;
};

}  // namespace

NarrowBand advect(const NarrowBand& band, const VectorField& velocity, double time,
                  bool turnsBack) {
  const auto grid = levelset::vdb(band).deepCopy();
  const Velocity field(velocity, levelset::vdb(band).transformPtr());
  openvdb::tools::LevelSetAdvection<openvdb::FloatGrid, Velocity> advection(*grid, field);
  advection.setSpatialScheme(openvdb::math::HJWENO5_BIAS);
  advection.setTemporalScheme(openvdb::math::TVD_RK3);
  const double gap = turnsBack ? 1e-4 : 0;
  advection.advect(0, static_cast<float>((0.5 - gap) * time));
  advection.advect(static_cast<float>((0.5 + gap) * time), static_cast<float>(time));
  return adopt(grid);
}

VectorField staggered(const VectorField& velocity, double voxelSize) {
  const auto grid = openvdb::Vec3SGrid::create();
  grid->setTransform(levelset::uniformTransform(voxelSize));
  grid->setGridClass(openvdb::GRID_STAGGERED);
  auto accessor = grid->getAccessor();
  const int n = static_cast<int>(std::lround(1 / voxelSize));
  for (openvdb::Coord c(-2); c[0] <= n + 2; ++c[0])
    for (c[1] = -2; c[1] <= n + 2; ++c[1])
      for (c[2] = -2; c[2] <= n + 2; ++c[2]) {
        openvdb::Vec3d value;
        for (int axis = 0; axis < 3; ++axis) {
          openvdb::Vec3d face = c.asVec3d();
          face[axis] -= 0.5;
          value[axis] = velocity(levelset::toImath(grid->indexToWorld(face)), 0)[axis];
        }
        accessor.setValue(c, openvdb::Vec3f(value));
      }
  return levelset::asVectorField(levelset::importField(grid));
}

}  // namespace regress::peer
