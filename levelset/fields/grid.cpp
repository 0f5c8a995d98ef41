#include "levelset/fields/grid.h"

#include <fmt/core.h>
#include <oneapi/tbb/enumerable_thread_specific.h>

#include <cmath>

#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "levelset/tree_hash_vdb.h"

namespace levelset {
namespace {

using Imath::V3d;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3SGrid;

// Positions beyond any tree, NaN among them, still give a valid coordinate.
constexpr double kFarthestIndex = 2147483000.0;

/// Trilinear between the eight grid points about an index position; `pick` reads one number of a
/// value.
template <typename Accessor, typename Pick>
double trilinear(const Accessor& accessor, const openvdb::Vec3d& index, const Pick& pick) {
  Coord low;
  double t[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double cell =
        std::fmax(-kFarthestIndex, std::fmin(kFarthestIndex, std::floor(index[axis])));
    low[axis] = static_cast<int>(cell);
    t[axis] = std::fmax(0.0, std::fmin(1.0, index[axis] - cell));
  }
  double corner[8];
  const auto* leaf = (low[0] & 7) < 7 && (low[1] & 7) < 7 && (low[2] & 7) < 7
                         ? accessor.probeConstLeaf(low)
                         : nullptr;
  if (leaf) {
    const auto* values = leaf->buffer().data() + leaf->coordToOffset(low);
    for (int i = 0; i < 8; ++i)
      corner[i] = static_cast<double>(pick(values[(i & 4 ? 64 : 0) + (i & 2 ? 8 : 0) + (i & 1)]));
  } else {
    for (int i = 0; i < 8; ++i)
      corner[i] = static_cast<double>(
          pick(accessor.getValue(low.offsetBy(i & 4 ? 1 : 0, i & 2 ? 1 : 0, i & 1))));
  }
  for (int i = 0; i < 4; ++i) corner[i] += t[0] * (corner[i + 4] - corner[i]);
  for (int i = 0; i < 2; ++i) corner[i] += t[1] * (corner[i + 2] - corner[i]);
  return corner[0] + t[2] * (corner[1] - corner[0]);
}

/// A grid that many threads sample: each through an accessor of its own. The tree does not change,
/// so nobody need be told of it.
template <typename GridT>
class FieldSampler {
 public:
  using Accessor = openvdb::tree::ValueAccessor<const typename GridT::TreeType, false>;

  FieldSampler(std::shared_ptr<const void> owner, const GridT& grid)
      : owner_(std::move(owner)), grid_(&grid), perThread_(Accessor(grid.tree())) {}

  const Accessor& accessor() { return perThread_.local(); }
  [[nodiscard]] openvdb::Vec3d toIndex(const V3d& world) const {
    return grid_->transform().worldToIndex(toVdb(world));
  }

 private:
  std::shared_ptr<const void> owner_;
  const GridT* grid_;
  oneapi::tbb::enumerable_thread_specific<Accessor> perThread_;
};

ScalarField sampled(std::shared_ptr<const void> owner, const FloatGrid& grid) {
  const auto sampler = std::make_shared<FieldSampler<FloatGrid>>(std::move(owner), grid);
  return [sampler](const V3d& world) {
    return trilinear(sampler->accessor(), sampler->toIndex(world), [](float v) { return v; });
  };
}

template <typename GridT>
void checkField(const GridT& grid, const char* action) {
  if (!grid.transform().isLinear()) {
    throw InvalidInput(
        fmt::format("{}: grid '{}' has a frustum transform; resample it to uniform voxels first",
                    action, grid.getName()));
  }
  const auto refuse = [&](const Coord& at) {
    throw InvalidInput(
        fmt::format("{}: grid '{}' holds NaN or infinity at index [{}, {}, {}]; repair the "
                    "file or make it again",
                    action, grid.getName(), at.x(), at.y(), at.z()));
  };
  if (!openvdb::math::isFinite(grid.background())) refuse(Coord(0));
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    const auto* values = leaf->buffer().data();
    for (openvdb::Index i = 0; i < leaf->SIZE; ++i)
      if (!openvdb::math::isFinite(values[i])) refuse(leaf->offsetToGlobalCoord(i));
  }
  auto tile = grid.tree().cbeginValueAll();
  tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
  for (; tile; ++tile)
    if (!openvdb::math::isFinite(*tile)) refuse(tile.getCoord());
}

}  // namespace

bool FieldGrid::isVector() const {
  return field_->vector != nullptr;
}
bool FieldGrid::isStaggered() const {
  return isVector() && field_->vector->getGridClass() == openvdb::GRID_STAGGERED;
}
std::string FieldGrid::gridClass() const {
  return openvdb::GridBase::gridClassToString(field_->base().getGridClass());
}
std::string FieldGrid::name() const {
  return field_->base().getName();
}
double FieldGrid::voxelSize() const {
  const openvdb::math::Transform& transform = field_->base().transform();
  return transform.hasUniformScale() ? transform.voxelSize()[0] : 0;
}
std::uint64_t FieldGrid::activeVoxelCount() const {
  return field_->base().activeVoxelCount();
}
std::size_t FieldGrid::memoryUse() const {
  return field_->base().memUsage();
}

Imath::Box3d FieldGrid::bounds() const {
  Imath::Box3d box;
  const openvdb::CoordBBox active = field_->base().evalActiveVoxelBoundingBox();
  if (active.empty()) return box;
  for (int corner = 0; corner < 8; ++corner) {
    const openvdb::Vec3d p(corner & 1 ? active.max().x() : active.min().x(),
                           corner & 2 ? active.max().y() : active.min().y(),
                           corner & 4 ? active.max().z() : active.min().z());
    box.extendBy(toImath(field_->base().transform().indexToWorld(p)));
  }
  return box;
}

std::uint64_t FieldGrid::contentHash() const {
  const std::uint64_t hash = field_->scalar ? gridHash(*field_->scalar) : gridHash(*field_->vector);
  return mixHash(hash, static_cast<std::uint64_t>(field_->base().getGridClass()));
}

ScalarField asScalarField(const FieldGrid& grid, const char* action) {
  if (grid.isVector()) {
    throw InvalidInput(
        fmt::format("{}: grid '{}' holds vectors, and a number is needed at each "
                    "point; give a scalar grid",
                    action, grid.name()));
  }
  return sampled(grid.shared(), *grid.shared()->scalar);
}

ScalarField asScalarField(const NarrowBand& band) {
  return sampled(band.shared(), vdb(band));
}

VectorField asVectorField(const FieldGrid& grid, const char* action) {
  if (!grid.isVector()) {
    throw InvalidInput(
        fmt::format("{}: grid '{}' holds numbers, and a vector is needed at each "
                    "point; give a vector grid",
                    action, grid.name()));
  }
  const auto sampler =
      std::make_shared<FieldSampler<Vec3SGrid>>(grid.shared(), *grid.shared()->vector);
  const double half = grid.isStaggered() ? 0.5 : 0;
  return [sampler, half](const V3d& world, double) {
    const openvdb::Vec3d index = sampler->toIndex(world);
    const auto& accessor = sampler->accessor();
    V3d result;
    for (int i = 0; i < 3; ++i) {
      openvdb::Vec3d at = index;
      at[i] += half;
      result[i] = trilinear(accessor, at, [i](const openvdb::Vec3s& v) { return v[i]; });
    }
    return result;
  };
}

FieldGrid importField(const FloatGrid::Ptr& grid, const char* action) {
  checkField(*grid, action);
  return FieldGrid(std::make_shared<const VdbField>(VdbField{.scalar = grid}));
}
FieldGrid importField(const Vec3SGrid::Ptr& grid, const char* action) {
  checkField(*grid, action);
  return FieldGrid(std::make_shared<const VdbField>(VdbField{.vector = grid}));
}

}  // namespace levelset
