#include "levelset/isosurface/isosurface.h"

#include <fmt/core.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/isosurface/filtered_surface.h"
#include "levelset/isosurface/trilinear_surface.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using trilinear::TrilinearSurface;
using BandLeaf = openvdb::FloatTree::LeafNodeType;

// Memory of a leaf block with its share of the tree's nodes, bytes.
constexpr double kBytesPerBandLeaf = 2300;

/// Refuses a range that no value, or every value, lies in.
[[noreturn]] void refuseRange(const Volume& volume, VolumeFilter filter, bool isInside) {
  if (filter != VolumeFilter::Trilinear)
    throw NoSurface(fmt::format(
        "the filter {} has no surface here: {} value belongs to the solid; it smooths or exceeds "
        "the samples, which go from {:.6g} to {:.6g}; choose an isovalue further between them, or "
        "another filter",
        factsOf(filter).name, isInside ? "every" : "no", volume.lowest(), volume.highest()));
  throw NoSurface(fmt::format(
      "{} value of the volume belongs to the solid: its samples go from {:.6g} to {:.6g}; choose "
      "an isovalue between them ('histogram' suggests some)",
      isInside ? "every" : "no", volume.lowest(), volume.highest()));
}

void checkIsosurface(const Volume& volume, const ValueRange& range,
                     const IsosurfaceOptions& options) {
  for (const std::optional<double>& limit : {range.low, range.high})
    if (limit && !std::isfinite(*limit))
      throw UsageError(fmt::format("the isovalue is {}; give a finite number", *limit));
  if (!range.low && !range.high) throw UsageError("there is no isovalue; give one");
  if (range.low && range.high && !(*range.low < *range.high))
    throw UsageError(fmt::format("the lower limit {} is not below the upper limit {}; swap them",
                                 *range.low, *range.high));
  if (!(options.halfWidth > 1) || !std::isfinite(options.halfWidth))
    throw UsageError(
        fmt::format("the half width is {} voxels; give more than 1", options.halfWidth));
  if (options.voxelSize < 0 || !std::isfinite(options.voxelSize))
    throw UsageError(
        fmt::format("the voxel size is {}; give a positive length", options.voxelSize));
  if (options.filter == VolumeFilter::Box)
    throw UsageError("the filter box is not continuous, so it has no surface; choose another");
  const Imath::V3i size = volume.size();
  if (std::min({size.x, size.y, size.z}) < 2)
    throw InvalidInput(fmt::format(
        "the volume has {} x {} x {} grid points, but a solid needs two along each axis; use a "
        "volume, not a slice",
        size.x, size.y, size.z));
  // Other filters have values beyond those of the samples. The search for pieces decides there.
  if (options.filter != VolumeFilter::Trilinear) return;
  const bool hasInside = (!range.low || volume.highest() > *range.low) &&
                         (!range.high || volume.lowest() < *range.high);
  const bool hasOutside = (range.low && volume.lowest() <= *range.low) ||
                          (range.high && volume.highest() >= *range.high);
  if (!hasInside || !hasOutside) refuseRange(volume, options.filter, hasInside);
}

/// Origins of the blocks of 8³ grid points that the band may reach, in ascending order, relative to
/// the base of the surface.
template <class Surface>
std::vector<openvdb::Coord> findBlocks(const Surface& surface, double reach,
                                       std::size_t maxMemory) {
  openvdb::MaskTree blocks;
  openvdb::tree::ValueAccessor<openvdb::MaskTree> accessor(blocks);
  std::size_t count = 0;
  for (std::size_t item = 0; item < surface.itemCount(); ++item) {
    openvdb::Vec3d low, high;
    surface.bound(item, low, high);
    openvdb::Coord from, to;
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = static_cast<int>(std::ceil(low[axis] - reach)) & ~7;
      to[axis] = static_cast<int>(std::floor(high[axis] + reach)) & ~7;
    }
    for (int x = from[0]; x <= to[0]; x += 8)
      for (int y = from[1]; y <= to[1]; y += 8)
        for (int z = from[2]; z <= to[2]; z += 8) {
          const openvdb::Coord at(x, y, z);
          if (accessor.probeConstLeaf(at)) continue;
          accessor.touchLeaf(at);
          if (++count % 4096 == 0)
            requireMemory(static_cast<double>(count) * kBytesPerBandLeaf, maxMemory);
        }
  }
  requireMemory(static_cast<double>(count) * kBytesPerBandLeaf, maxMemory);
  std::vector<openvdb::Coord> origins;
  origins.reserve(count);
  for (auto leaf = blocks.cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
  std::sort(origins.begin(), origins.end());
  return origins;
}

/// Measures the distances of the grid points of a block. @return null: the band does not reach it
template <class Surface>
std::unique_ptr<BandLeaf> measureBlock(const Surface& surface, const openvdb::Coord& block,
                                       double halfWidth, double voxelSize, float background) {
  auto leaf = std::make_unique<BandLeaf>(block + surface.base(), background, false);
  float* values = leaf->buffer().data();
  typename Surface::Hint hint;
  for (openvdb::Index n = 0; n < BandLeaf::SIZE; ++n) {
    // Successive grid points are neighbours, so that the closest piece of one is a good guess for
    // the next.
    openvdb::Coord local(static_cast<int>(n >> 6), static_cast<int>((n >> 3) & 7),
                         static_cast<int>(n & 7));
    if (local[0] & 1) local[1] = 7 - local[1];
    if (local[1] & 1) local[2] = 7 - local[2];
    const openvdb::Index at = BandLeaf::coordToOffset(local);
    const openvdb::Vec3d place = (block + local).asVec3d();
    const double distance = surface.distance(place, halfWidth, hint);
    const bool isInside = surface.isInside(place);
    values[at] = isInside ? -background : background;
    if (!(distance < halfWidth)) continue;
    const auto world = static_cast<float>(distance * voxelSize);
    if (!(world < background)) continue;
    values[at] = isInside && world > 0 ? -world : world;  // a distance of 0 counts as outside
    leaf->setValueOn(at);
  }
  if (leaf->isEmpty()) leaf.reset();
  return leaf;
}

/// Builds the band of a surface. `makeSurface` finds the surface.
template <class MakeSurface>
IsosurfaceResult bandOf(const Volume& volume, const IsosurfaceOptions& options,
                        const MakeSurface& makeSurface) {
  const Imath::V3d spacing = volume.grid().spacing();
  const double voxelSize =
      options.voxelSize > 0 ? options.voxelSize : std::min({spacing.x, spacing.y, spacing.z});
  const std::size_t limit = memoryLimit(options.maxMemory);
  const auto grid = emptyLevelSet(uniformTransform(voxelSize), options.halfWidth);
  report(options.progress, 0);

  const auto surface = makeSurface(voxelSize, limit, subProgress(options.progress, 0, 0.2));
  IsosurfaceResult result;
  result.report = surface.report();
  if (result.report.pieces == 0) refuseRange(volume, options.filter, result.report.closedArea > 0);
  if (options.border == VolumeBorder::Refuse && result.report.closedArea > 0)
    throw InvalidInput(fmt::format(
        "the solid reaches the border of the volume on an area of {:.6g} square units, where "
        "nothing is known beyond; crop less, choose another isovalue, or close it with --border "
        "close",
        result.report.closedArea));

  const std::vector<openvdb::Coord> blocks = findBlocks(surface, options.halfWidth, limit);
  // Slices, so that cancelling takes effect quickly and the reports come from one thread.
  constexpr std::size_t kSlice = 512;
  std::vector<std::unique_ptr<BandLeaf>> slice(std::min(kSlice, blocks.size()));
  bool anyInside = false;
  for (std::size_t from = 0; from < blocks.size(); from += kSlice) {
    const std::size_t count = std::min(kSlice, blocks.size() - from);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t n) {
      slice[n] =
          measureBlock(surface, blocks[from + n], options.halfWidth, voxelSize, grid->background());
    });
    for (std::size_t n = 0; n < count; ++n) {
      if (!slice[n]) continue;
      const float* values = slice[n]->buffer().data();
      anyInside = anyInside || std::any_of(values, values + BandLeaf::SIZE,
                                           [](float value) { return value < 0; });
      grid->tree().addLeaf(slice[n].release());
    }
    report(options.progress,
           0.2 + 0.8 * static_cast<double>(from + count) / static_cast<double>(blocks.size()));
  }
  if (!anyInside)
    throw NoSurface(
        "no grid point lies inside the solid, because it is thinner than a voxel everywhere; use "
        "a smaller --voxel");
  openvdb::tools::signedFloodFill(grid->tree());
  result.band = makeBand(grid);
  return result;
}

}  // namespace

IsosurfaceResult isosurface(const Volume& volume, const ValueRange& range,
                            const IsosurfaceOptions& options) {
  checkIsosurface(volume, range, options);
  const auto make = [&]<class Surface>(auto&&... filter) {
    return bandOf(
        volume, options, [&](double voxelSize, std::size_t limit, const Progress& progress) {
          return Surface(volume, filter..., range, voxelSize, options.halfWidth, limit, progress);
        });
  };
  if (options.filter == VolumeFilter::Trilinear)
    return make.template operator()<TrilinearSurface>();
  return make.template operator()<FilteredSurface>(options.filter);
}

}  // namespace levelset
