#include "mapping/patches/patch_space.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/eikonal/redistance.h"
#include "levelset/error.h"
#include "levelset/sample.h"
#include "levelset/solids/resample.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::NarrowBand;

constexpr double kMarginVoxels = 6;   // of distances beyond the highest level, for the filters
constexpr double kCoarseVoxels = 20;  // that a height is worth; with fewer, levels would be inexact
constexpr double kCoarsest = 4;       // times the base's voxel
constexpr double kThinnest = 12;      // coarse voxels through the base's box
constexpr double kFaithful = 0.25;    // coarse voxels by which a coarse surface may be off

bool isFaithful(const NarrowBand& coarse, std::span<const V3d> places) {
  const levelset::BandSampler sampler(coarse, levelset::Interpolation::Tricubic);
  return std::all_of(places.begin(), places.end(), [&](const V3d& p) {
    return std::abs(sampler.value(p)) <= kFaithful * coarse.voxelSize();
  });
}

/// The base on a coarser grid; the base itself when that would lose its surface.
NarrowBand coarsen(const NarrowBand& base, std::span<const V3d> places, double height,
                   const PatchSpaceOptions& options) {
  if (height < 2 * kCoarseVoxels * base.voxelSize()) return base;
  const V3d extent = base.zeroSetBounds().size();
  const double thickness = std::min({extent.x, extent.y, extent.z}) / base.voxelSize();
  double factor = std::floor(
      std::min({kCoarsest, height / (kCoarseVoxels * base.voxelSize()), thickness / kThinnest}));
  for (; factor >= 2; --factor) {
    const NarrowBand coarse =
        levelset::resample(base, factor * base.voxelSize(), {.maxMemory = options.maxMemory});
    if (isFaithful(coarse, places)) return coarse;
  }
  return base;
}

/// Is the band wide enough as it is?
bool reaches(const NarrowBand& base, double height) {
  return base.halfWidth() * base.voxelSize() >= height + kMarginVoxels * base.voxelSize();
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
    throw levelset::InvalidInput(fmt::format(
        "patch: the band of the open surface reaches {:.6g} voxels, and the height {:.6g} "
        "needs more; make it with surface-band --half-width {}, or lower the patch",
        base.halfWidth(), height, std::ceil(needed - kRounding)));
  }
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
  if (reaches(base, crowd.height) || base.isOpenSurface()) return {};
  // Boxes and the whole reach equally far from the surface, so areas of surface compare them. A
  // grid point costs some four times as much in a box, for the search along its faces.
  constexpr double kBoxCost = 3;
  const double around = 2 * (crowd.height + kMarginVoxels * base.voxelSize());
  const double boxes =
      static_cast<double>(crowd.count) * (crowd.uSize + around) * (crowd.vSize + around);
  if (kBoxCost * boxes < areaOf(base)) return {};
  try {
    const NarrowBand coarse = coarsen(base, crowd.places, crowd.height, options);
    return levelset::redistance(coarse,
                                {.halfWidth = crowd.height / coarse.voxelSize() + kMarginVoxels,
                                 .maxMemory = options.maxMemory,
                                 .progress = options.progress});
  } catch (const levelset::ResourceLimit&) {
    return {};
  }
}

}  // namespace mapping
