#include "mapping/patches/patch_space.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/transform/resample.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::NarrowBand;

// Number of voxels by which distances extend beyond the highest layer; interpolation stencils read
// them.
constexpr double kMarginVoxels = 6;
// Least number of voxels of the coarser grid in the height of a patch; fewer make the layers
// inexact.
constexpr double kCoarseVoxels = 20;
// Largest voxel size of the coarser grid, as a multiple of the base's voxel size.
constexpr double kCoarsest = 4;
// Least number of voxels of the coarser grid across the shortest side of the base's bounding box.
constexpr double kVoxelsAcross = 12;
// Largest |φ| of the coarser grid at the border of the patch, in voxels of that grid.
constexpr double kFaithful = 0.25;

bool isFaithful(const NarrowBand& coarse, std::span<const V3d> border) {
  const levelset::BandSampler sampler(coarse, levelset::Interpolation::Tricubic);
  return std::all_of(border.begin(), border.end(), [&](const V3d& p) {
    return std::abs(sampler.value(p)) <= kFaithful * coarse.voxelSize();
  });
}

/// Factor by which the voxels may be larger than the base's, for layers up to a height in world
/// units; 1: no coarser grid.
double coarsestFactor(const NarrowBand& base, double height) {
  if (height < 2 * kCoarseVoxels * base.voxelSize()) return 1;
  const V3d extent = base.zeroSetBounds().size();
  const double thickness = std::min({extent.x, extent.y, extent.z}) / base.voxelSize();
  return std::max(1.0, std::floor(std::min({kCoarsest, height / (kCoarseVoxels * base.voxelSize()),
                                            thickness / kVoxelsAcross})));
}

/// Resamples the base to a coarser grid; empty if no point of the coarser grid lies inside the
/// base.
std::optional<NarrowBand> coarsened(const NarrowBand& base, double factor,
                                    const PatchSpaceOptions& options) {
  try {
    return levelset::resample(base, factor * base.voxelSize(), {.maxMemory = options.maxMemory});
  } catch (const levelset::InvalidInput&) {
    return {};
  }
}

/// Returns the base on a coarser grid, or the base itself if a coarser grid would lose its surface.
NarrowBand coarsen(const NarrowBand& base, std::span<const V3d> border, double height,
                   const PatchSpaceOptions& options) {
  for (double factor = coarsestFactor(base, height); factor >= 2; --factor) {
    const auto coarse = coarsened(base, factor, options);
    if (coarse && isFaithful(*coarse, border)) return *coarse;
  }
  return base;
}

/// True if the band of the base already extends to the height.
bool reaches(const NarrowBand& base, double height) {
  return base.halfWidth() * base.voxelSize() >= height + kMarginVoxels * base.voxelSize();
}

/// True if the shared distances extend to the height and are as accurate as distances computed for
/// this patch alone.
bool serves(const NarrowBand& shared, const NarrowBand& base, std::span<const V3d> border,
            double height) {
  constexpr double kRounding = 1 + 1e-9;
  if (!reaches(shared, height / kRounding)) return false;
  if (shared.voxelSize() <= base.voxelSize() * kRounding) return true;
  return shared.voxelSize() <= coarsestFactor(base, height) * base.voxelSize() * kRounding &&
         isFaithful(shared, border);
}

double areaOf(const NarrowBand& base) {
  const double h = base.voxelSize();
  return static_cast<double>(base.activeVoxelCount()) * h * h / (2 * base.halfWidth());
}

}  // namespace

NarrowBand sweepPatchSpace(const NarrowBand& base, std::span<const V3d> border, double bulge,
                           double height, const PatchSpaceOptions& options) {
  const double needed = height / base.voxelSize() + kMarginVoxels;
  if (reaches(base, height)) return base;
  if (base.isOpenSurface()) {
    constexpr double kRounding = 1e-6;
    if (base.halfWidth() >= needed - kRounding) return base;
    throw levelset::InvalidInput(
        fmt::format("the band of the open surface extends to {:.6g} voxels, and the height {:.6g} "
                    "needs more; build it with surface-band --half-width {}, or use a lower patch",
                    base.halfWidth(), height, std::ceil(needed - kRounding)));
  }
  if (options.shared && serves(*options.shared, base, border, height)) return *options.shared;
  const NarrowBand coarse = coarsen(base, border, height, options);
  const double reach = height + kMarginVoxels * coarse.voxelSize();
  Imath::Box3d box;
  for (const V3d& p : border) box.extendBy(p);
  box.min -= V3d(reach + bulge);
  box.max += V3d(reach + bulge);
  return levelset::redistance(coarse, {.halfWidth = reach / coarse.voxelSize(),
                                       .region = box,
                                       .maxMemory = options.maxMemory,
                                       .progress = options.progress});
}

std::optional<NarrowBand> sweepSharedSpace(const NarrowBand& base, const PatchCrowd& crowd,
                                           const PatchSpaceOptions& options) {
  if (base.isEmpty() || base.isOpenSurface() || reaches(base, crowd.highest)) return {};
  const double factor = coarsestFactor(base, crowd.lowest);
  // One region around the entire base and one box per patch both extend equally far from the
  // surface, so their costs are compared by surface area. In a box around one patch, a grid point
  // costs at least three times as much, because of the search along the box faces. With a coarser
  // grid, one region is always chosen, because each box would resample the entire base.
  constexpr double kBoxCost = 3;
  const double around = 2 * (crowd.highest + kMarginVoxels * base.voxelSize());
  const double boxes =
      static_cast<double>(crowd.count) * (crowd.uSize + around) * (crowd.vSize + around);
  if (crowd.count < 2 || (factor < 2 && !(kBoxCost * boxes > areaOf(base)))) return {};
  const std::size_t room = levelset::memoryLimit(options.maxMemory) / 4;
  try {
    const auto coarse = factor < 2 ? std::optional(base) : coarsened(base, factor, options);
    if (!coarse) return {};
    return levelset::redistance(*coarse,
                                {.halfWidth = crowd.highest / coarse->voxelSize() + kMarginVoxels,
                                 .maxMemory = room,
                                 .progress = options.progress});
  } catch (const levelset::ResourceLimit&) {
    return {};
  }
}

}  // namespace mapping
