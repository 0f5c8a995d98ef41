#include <algorithm>
#include <cstddef>
#include <vector>

#include "render/bricks/surface_bricks_vdb.h"

namespace render {
namespace {

using Imath::V3i;
using openvdb::Coord;
using openvdb::CoordBBox;

/// Reader of a volume's field, or of the coefficients of the quasi-interpolating spline.
class VolumeReader : public GridReader {
 public:
  VolumeReader(const VolumeSurface& surface, Filter filter) : surface_(surface), filter_(filter) {}
  void copyPadded(const Coord& origin, int before, int after, float* out) override {
    copy(V3i(origin.x() - before, origin.y() - before, origin.z() - before),
         V3i(BrickPool::kBlock + before + after), out);
  }
  void read(HaloBlock& block) override {
    const Coord low = block.origin + block.points.min(), size = block.points.dim();
    block.value.resize(block.points.volume());
    copy(V3i(low.x(), low.y(), low.z()), V3i(size.x(), size.y(), size.z()), block.value.data());
  }

 private:
  void copy(const V3i& low, const V3i& size, float* out) {
    if (filter_ != Filter::BSplineQi) return surface_.copyField(low, size, out);
    const V3i wide = size + V3i(2);
    field_.resize(static_cast<std::size_t>(wide.x) * static_cast<std::size_t>(wide.y) *
                  static_cast<std::size_t>(wide.z));
    surface_.copyField(low - V3i(1), wide, field_.data());
    const std::ptrdiff_t stepY = wide.z, stepX = static_cast<std::ptrdiff_t>(wide.y) * wide.z;
    for (int x = 1; x <= size.x; ++x)
      for (int y = 1; y <= size.y; ++y) {
        const float* f = field_.data() + x * stepX + y * stepY + 1;
        const auto at = [&](std::ptrdiff_t step) { return static_cast<double>(f[step]); };
        for (int z = 0; z < size.z; ++z, ++f) {
          const double own = at(0);
          const double bend =
              at(-stepX) + at(stepX) + at(-stepY) + at(stepY) + at(-1) + at(1) - 6 * own;
          *out++ = static_cast<float>(own - bend / 6);
        }
      }
  }

  const VolumeSurface& surface_;
  Filter filter_;
  std::vector<float> field_;
};

class VolumeBricks : public GridSource {
 public:
  VolumeBricks(const VolumeSurface& surface, Filter filter) : surface_(surface), filter_(filter) {}
  [[nodiscard]] std::vector<Coord> blocks() const override {
    std::vector<Coord> origins;
    for (const V3i& block : surface_.blocks(filter_))
      origins.emplace_back(block.x, block.y, block.z);
    return origins;
  }
  [[nodiscard]] CoordBBox cells() const override {
    const auto [first, last] = surface_.cells(filter_);
    return {Coord(first.x, first.y, first.z), Coord(last.x, last.y, last.z)};
  }
  [[nodiscard]] std::size_t storedBlocks() const override {
    const V3i size = surface_.volume().size();
    std::size_t count = 1;
    for (int a = 0; a < 3; ++a)
      count *= static_cast<std::size_t>((size[a] + BrickPool::kBlock - 1) / BrickPool::kBlock);
    return count;
  }
  [[nodiscard]] bool isStored(const Coord& origin) const override {
    const V3i size = surface_.volume().size();
    return CoordBBox(Coord(0), Coord(size.x - 1, size.y - 1, size.z - 1)).isInside(origin);
  }
  [[nodiscard]] std::unique_ptr<GridReader> reader() const override {
    return std::make_unique<VolumeReader>(surface_, filter_);
  }

 private:
  const VolumeSurface& surface_;
  Filter filter_;
};

}  // namespace

std::unique_ptr<GridSource> volumeSource(const VolumeSurface& surface, Filter filter) {
  return std::make_unique<VolumeBricks>(surface, filter);
}

}  // namespace render
