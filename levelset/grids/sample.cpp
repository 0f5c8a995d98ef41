#include "levelset/grids/sample.h"

#include <optional>

#include "levelset/grids/interpolate_vdb.h"
#include "levelset/vdb.h"

namespace levelset {

struct BandSampler::Impl {
  NarrowBand band;  // keeps the tree of the accessor alive
  openvdb::FloatGrid::ConstAccessor accessor;
  std::optional<openvdb::FloatGrid::ConstAccessor> beyond;
  Interpolation interpolation;
  Imath::M44d indexToWorld, worldToIndex;

  Impl(const NarrowBand& source, Interpolation method)
      : band(source),
        accessor(vdb(band).getConstAccessor()),
        interpolation(method),
        indexToWorld(source.indexToWorld()),
        worldToIndex(indexToWorld.inverse()) {
    if (band.shared()->beyond) beyond.emplace(*band.shared()->beyond);
  }

  [[nodiscard]] openvdb::Vec3d toIndex(const Imath::V3d& world) const {
    Imath::V3d index;
    worldToIndex.multVecMatrix(world, index);
    return toVdb(index);
  }

  [[nodiscard]] double valueAt(const openvdb::Vec3d& index) const {
    return interpolation == Interpolation::Trilinear ? SampleBlock<2>(accessor, index).value()
                                                     : SampleBlock<4>(accessor, index).value();
  }

  /// Transforms a gradient with respect to index coordinates to world space. As a covector, it is
  /// multiplied by the transposed inverse of indexToWorld.
  [[nodiscard]] Imath::V3d covectorToWorld(const openvdb::Vec3d& g) const {
    const Imath::M44d& m = worldToIndex;
    Imath::V3d world;
    for (int j = 0; j < 3; ++j) world[j] = m[j][0] * g[0] + m[j][1] * g[1] + m[j][2] * g[2];
    return world;
  }
};

BandSampler::BandSampler(const NarrowBand& band, Interpolation interpolation)
    : impl_(std::make_unique<Impl>(band, interpolation)) {}
BandSampler::~BandSampler() = default;
BandSampler::BandSampler(BandSampler&&) noexcept = default;
BandSampler& BandSampler::operator=(BandSampler&&) noexcept = default;

double BandSampler::value(const Imath::V3d& world) const {
  return impl_->valueAt(impl_->toIndex(world));
}

Imath::V3d BandSampler::gradient(const Imath::V3d& world) const {
  const openvdb::Vec3d index = impl_->toIndex(world);
  return impl_->covectorToWorld(impl_->interpolation == Interpolation::Trilinear
                                    ? SampleBlock<2>(impl_->accessor, index).gradient()
                                    : SampleBlock<4>(impl_->accessor, index).gradient());
}

Imath::V3d BandSampler::normal(const Imath::V3d& world) const {
  const openvdb::Vec3d index = impl_->toIndex(world);
  openvdb::Vec3d difference;
  for (int axis = 0; axis < 3; ++axis) {
    openvdb::Vec3d step(0, 0, 0);
    step[axis] = 0.5;
    difference[axis] = impl_->valueAt(index + step) - impl_->valueAt(index - step);
  }
  return impl_->covectorToWorld(difference).normalized();
}

bool BandSampler::isInBand(const Imath::V3d& world) const {
  const openvdb::Vec3d index = impl_->toIndex(world);
  return impl_->interpolation == Interpolation::Trilinear
             ? SampleBlock<2>(index).allActive(impl_->accessor)
             : SampleBlock<4>(index).allActive(impl_->accessor);
}

double BandSampler::beyondBorder(const Imath::V3d& world) const {
  const auto& beyond = impl_->beyond;
  if (!beyond) return 0;
  return SampleBlock<2>(*beyond, impl_->toIndex(world)).value() * impl_->band.voxelSize();
}

}  // namespace levelset
