#include <algorithm>
#include <array>
#include <cmath>

#include "render/embree/surface_spline_vdb.h"
#include "render/mapped/texture_rays_vdb.h"

namespace render {

using Imath::V3d;
using openvdb::Coord;

namespace {
constexpr int kBlockEdge = 8;
}  // namespace

TextureRays::TextureRays(const levelset::NarrowBand& band)
    : band_(band),
      worldToIndex_(band.indexToWorld().inverse()),
      blocks_(surfaceBlocks({levelset::vdb(band_).tree()})) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) indexSlopes_[i][j] = worldToIndex_[i][j];
}

bool TextureRays::isInside(const Reader& reader, const V3d& index) {
  const V3d base(std::floor(index.x), std::floor(index.y), std::floor(index.z)), a = index - base;
  const Coord low(static_cast<int>(base.x), static_cast<int>(base.y), static_cast<int>(base.z));
  double value = 0;
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      for (int k = 0; k < 2; ++k)
        value += (i ? a.x : 1 - a.x) * (j ? a.y : 1 - a.y) * (k ? a.z : 1 - a.z) *
                 static_cast<double>(reader.getValue(low.offsetBy(i, j, k)));
  return value < 0;
}

const SurfaceBlock* TextureRays::blockAt(const Coord& origin) const {
  const auto found = std::lower_bound(
      blocks_.begin(), blocks_.end(), origin,
      [](const SurfaceBlock& block, const Coord& at) { return block.origin < at; });
  return found != blocks_.end() && found->origin == origin ? &*found : nullptr;
}

std::optional<double> TextureRays::firstCrossing(const V3d& from, const V3d& to,
                                                 double near) const {
  const IndexRay ray(from, to - from);
  const DrawnField field{levelset::vdb(band_).tree()};
  Coord block;
  std::array<double, 3> next{};  // parameters at which the segment leaves the block along each axis
  const auto setNext = [&](int a) {
    const bool isForward = ray.direction[a] > 0;
    next[static_cast<std::size_t>(a)] =
        ray.isParallel[a] ? HUGE_VAL : ray.plane(a, block[a] + (isForward ? kBlockEdge : 0));
  };
  for (int a = 0; a < 3; ++a) {
    block[a] = static_cast<int>(std::floor(ray.at(a, near))) & ~(kBlockEdge - 1);
    setNext(a);
  }
  for (;;) {
    if (const SurfaceBlock* found = blockAt(block))
      if (const auto share = findCrossing(field, *found, ray, near, 1, Search::FirstCrossing))
        return share;
    const int a = static_cast<int>(std::min_element(next.begin(), next.end()) - next.begin());
    if (!(next[static_cast<std::size_t>(a)] < 1)) return std::nullopt;
    block[a] += ray.direction[a] > 0 ? kBlockEdge : -kBlockEdge;
    setNext(a);
  }
}

SurfaceShape TextureRays::shapeAt(const V3d& index) const {
  return surfaceShape(levelset::vdb(band_).tree(), index, Filter::Trilinear);
}

}  // namespace render
