#include "levelset/fields/grid.h"

#include <fmt/core.h>
#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "levelset/grid_tools_vdb.h"
#include "levelset/grids/interpolate_vdb.h"

namespace levelset {
namespace {

using Imath::V3d;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3SGrid;

// Positions beyond this index coordinate, and NaN, are clamped to it, so that they fit into int.
constexpr double kFarthestIndex = 2147483000.0;

/// Grid cell that holds a position on one axis: index of its lower grid point, and the position as
/// a fraction of the cell.
struct Cell {
  int low;
  double share;

  explicit Cell(double index) {
    // NaN fails the first comparison, so it becomes kFarthestIndex.
    const double near = index < kFarthestIndex ? index : kFarthestIndex;
    const double inside = near > -kFarthestIndex ? near : -kFarthestIndex;
    const int towardsZero = static_cast<int>(inside);
    low = towardsZero - (static_cast<double>(towardsZero) > inside);
    share = inside - low;
  }
};

/// Values of the N³ grid points from the corner `low` upwards. A view of the leaf when one leaf
/// holds them all, otherwise a copy gathered from several leaves. SampleBlock (interpolate_vdb.h)
/// does not serve here: it always copies, and it holds no vectors.
template <typename Value, int N>
class PointBlock {
 public:
  template <typename Accessor>
  PointBlock(const Accessor& accessor, const Coord& low) {
    const Coord place(low[0] & 7, low[1] & 7, low[2] & 7);
    const auto* leaf = accessor.probeConstLeaf(low);
    if (leaf && place[0] <= 8 - N && place[1] <= 8 - N && place[2] <= 8 - N) {
      first_ = leaf->buffer().data() + leaf->coordToOffset(low);
      strideX_ = 64, strideY_ = 8;
      return;
    }
    first_ = gathered_, strideX_ = N * N, strideY_ = N;
    gatherSamples<N>(accessor, low, gathered_);
  }
  PointBlock(const PointBlock&) = delete;
  PointBlock& operator=(const PointBlock&) = delete;

  /// Interpolates trilinearly between eight of the grid points.
  /// @param first  lowest of the eight grid points, relative to `low`
  /// @param t  fractions of the position between the grid points, along x, y and z
  /// @param pick  selects one component of a value
  template <typename Pick>
  [[nodiscard]] double trilinear(const Coord& first, const double (&t)[3], const Pick& pick) const {
    const Value* values = first_ + first[0] * strideX_ + first[1] * strideY_ + first[2];
    const auto between = [](double a, double b, double share) { return a + share * (b - a); };
    const auto alongZ = [&](const Value* v) {
      return between(static_cast<double>(pick(v[0])), static_cast<double>(pick(v[1])), t[2]);
    };
    const auto alongY = [&](const Value* v) {
      return between(alongZ(v), alongZ(v + strideY_), t[1]);
    };
    return between(alongY(values), alongY(values + strideX_), t[0]);
  }

 private:
  const Value* first_;
  int strideX_, strideY_;
  Value gathered_[N * N * N];
};

/// Read access to a grid for several threads. Each thread has its own accessor. The tree never
/// changes, so the accessors need not be registered with it.
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
    const openvdb::Vec3d index = sampler->toIndex(world);
    const Cell x(index[0]), y(index[1]), z(index[2]);
    const PointBlock<float, 2> block(sampler->accessor(), {x.low, y.low, z.low});
    return block.trilinear(Coord(0), {x.share, y.share, z.share}, [](float v) { return v; });
  };
}

using VectorSampler = FieldSampler<Vec3SGrid>;

/// Interpolates a vector grid that stores all three components at the grid points.
V3d centredVector(VectorSampler& sampler, const V3d& world) {
  const openvdb::Vec3d index = sampler.toIndex(world);
  const Cell x(index[0]), y(index[1]), z(index[2]);
  const PointBlock<openvdb::Vec3s, 2> block(sampler.accessor(), {x.low, y.low, z.low});
  V3d result;
  for (int i = 0; i < 3; ++i)
    result[i] = block.trilinear(Coord(0), {x.share, y.share, z.share},
                                [i](const openvdb::Vec3s& v) { return v[i]; });
  return result;
}

/// Interpolates a staggered vector grid. It stores component i half a voxel below the grid point
/// along axis i.
V3d staggeredVector(VectorSampler& sampler, const V3d& world) {
  const openvdb::Vec3d index = sampler.toIndex(world);
  const Cell x(index[0]), y(index[1]), z(index[2]);
  const PointBlock<openvdb::Vec3s, 3> block(sampler.accessor(), {x.low, y.low, z.low});
  V3d result;
  for (int i = 0; i < 3; ++i) {
    Coord first(0);
    double t[3] = {x.share, y.share, z.share};
    first[i] = t[i] < 0.5 ? 0 : 1;
    t[i] += first[i] ? -0.5 : 0.5;
    result[i] = block.trilinear(first, t, [i](const openvdb::Vec3s& v) { return v[i]; });
  }
  return result;
}

template <typename GridT>
void checkField(const GridT& grid) {
  if (!grid.transform().isLinear()) {
    throw InvalidInput(fmt::format(
        "grid '{}' has a frustum transform; resample it to uniform voxels first", grid.getName()));
  }
  const auto refuse = [&](const Coord& at) {
    throw InvalidInput(
        fmt::format("grid '{}' holds NaN or infinity at index [{}, {}, {}]; repair the "
                    "file or write it again",
                    grid.getName(), at.x(), at.y(), at.z()));
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

ScalarField asScalarField(const FieldGrid& grid) {
  if (grid.isVector()) {
    throw InvalidInput(
        fmt::format("grid '{}' holds vectors, but a number is needed at each "
                    "point; give a scalar grid",
                    grid.name()));
  }
  return sampled(grid.shared(), *grid.shared()->scalar);
}

ScalarField asScalarField(const NarrowBand& band) {
  return sampled(band.shared(), vdb(band));
}

VectorField asVectorField(const FieldGrid& grid) {
  if (!grid.isVector()) {
    throw InvalidInput(
        fmt::format("grid '{}' holds numbers, but a vector is needed at each "
                    "point; give a vector grid",
                    grid.name()));
  }
  const auto sampler =
      std::make_shared<FieldSampler<Vec3SGrid>>(grid.shared(), *grid.shared()->vector);
  if (grid.isStaggered())
    return [sampler](const V3d& world, double) { return staggeredVector(*sampler, world); };
  return [sampler](const V3d& world, double) { return centredVector(*sampler, world); };
}

FieldGrid importField(const FloatGrid::Ptr& grid) {
  checkField(*grid);
  return FieldGrid(std::make_shared<const VdbField>(VdbField{.scalar = grid}));
}
FieldGrid importField(const Vec3SGrid::Ptr& grid) {
  checkField(*grid);
  return FieldGrid(std::make_shared<const VdbField>(VdbField{.vector = grid}));
}

}  // namespace levelset
