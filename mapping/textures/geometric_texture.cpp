#include "mapping/textures/geometric_texture.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "levelset/components/components.h"
#include "levelset/csg/blend.h"
#include "levelset/csg/csg.h"
#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/transform/resample.h"
#include "mapping/textures/texture_maps.h"
#include "mapping/textures/texture_parts.h"
#include "mapping/textures/texture_warp.h"

namespace mapping {
namespace {

using Imath::Box3d;
using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;

// Relative error of the sampled stretch. If stretched texture voxels are smaller than the base's by
// less than this share, the base's voxel size is kept.
constexpr double kStretchError = 0.01;
// Ratio of result to texture voxel size above which the texture is resampled first. The cost of the
// texture's band then depends on the result's voxels, and not on the cube of the ratio.
constexpr double kCoarser = 6;
// A map whose least stretch is below this share of the median stretch counts as compressing.
constexpr double kSqueezed = 0.2;
double chooseVoxelSize(const NarrowBand& base, const NarrowBand& texture, double minStretch,
                       const TextureOptions& options) {
  if (options.voxelSize) return *options.voxelSize;
  return resultVoxelSize(base.voxelSize(), texture.voxelSize(), minStretch);
}

/// Index-to-world transform of the result: that of the base if the voxel sizes agree and the base
/// is merged, so that merging needs no resampling. Otherwise a scaling by the voxel size.
Imath::M44d chooseGrid(const NarrowBand& base, double voxelSize, TextureMerge merge) {
  const bool agrees = std::abs(voxelSize - base.voxelSize()) <= 1e-9 * voxelSize;
  if (agrees && merge != TextureMerge::Alone) return base.indexToWorld();
  Imath::M44d result;
  for (int axis = 0; axis < 3; ++axis) result[axis][axis] = voxelSize;
  return result;
}

/// Adapts a texture to the voxels of the result. Resamples the texture if the result's voxels are
/// much coarser. Widens the texture's band so that after warping it still covers kTextureBandNeeded
/// voxels of the result.
/// @param least, most  smallest and largest stretch of the map from the texture to the patches
NarrowBand fitTexture(const NarrowBand& texture, double voxelSize, double least, double most,
                      const TextureOptions& options) {
  NarrowBand fitted = texture;
  const double coarsest = voxelSize / most;  // coarsest texture voxel size that is fine enough
  if (coarsest > kCoarser * texture.voxelSize()) {
    fitted = levelset::resample(texture, coarsest, {.maxMemory = options.maxMemory});
    if (fitted.isEmpty()) {
      throw InvalidInput(
          fmt::format("on the patch the texture is smaller than a voxel of {:.6g}; use "
                      "smaller voxels",
                      voxelSize));
    }
  }
  const double needed = kTextureBandNeeded * voxelSize / (least * fitted.voxelSize());
  if (needed <= fitted.halfWidth() * (1 + 1e-6)) return fitted;
  return levelset::redistance(fitted,
                              {.halfWidth = std::ceil(needed), .maxMemory = options.maxMemory});
}

/// Checks the memory estimate of the result, from the voxel count of the texture, before anything
/// is allocated.
void requireResult(const NarrowBand& texture, const TextureReport& report,
                   std::span<const ChosenMap> maps, const TextureOptions& options) {
  const double voxelSize = report.voxelSize;
  double voxels = 0, warped = 0;
  for (const ChosenMap& map : maps) {
    if (!map.map) continue;
    const double finer = texture.voxelSize() * map.distortion.meanStretch / voxelSize;
    const double width =
        std::max(1.0, options.halfWidth / std::max(1.0, texture.halfWidth() * finer));
    voxels +=
        static_cast<double>(texture.activeVoxelCount()) * std::max(1e-3, finer * finer) * width;
    // The entire band of the texture is warped, even if it is wider than the result's band.
    warped = std::max(warped, static_cast<double>(texture.activeVoxelCount()) * std::pow(finer, 3));
  }
  // Bytes of an active voxel in three fields (the warped texture, its redistanced copy, the
  // result), with its share of the inactive values of the block.
  constexpr double kBytesPerVoxel = 40;
  // Bytes of an active voxel of the warped texture, with its share of the inactive values of the
  // block.
  constexpr double kBytesWarped = 8;
  const double bytes = voxels * kBytesPerVoxel + warped * kBytesWarped;
  const Distortion& worst = report.distortion;
  if (bytes > static_cast<double>(options.maxMemory) && !options.voxelSize &&
      worst.stretch.least < kSqueezed * worst.stretch.median) {
    const V3d& p = worst.foldPoint;
    throw levelset::ResourceLimit(
        fmt::format("the map compresses the texture to {:.2g} of its size near ({:.6g}, "
                    "{:.6g}, {:.6g}); voxels fine enough for that, {:.3g}, need about {:.3g} GB; "
                    "give --voxel, a lower height or a flatter position",
                    worst.stretch.least, p.x, p.y, p.z, report.voxelSize, bytes / 1e9));
  }
  levelset::requireMemory(bytes, options.maxMemory);
}

/// Range of the stretch of all maps, from which the voxel size and the half width of the texture's
/// band are chosen.
struct StretchRange {
  double least = HUGE_VAL, most = 0;
  /// Least stretch for which the texture's band is widened. Regions of the texture that the map
  /// compresses more are thinner than a voxel of the result, unless the voxel size is chosen for
  /// them.
  double ofBand = HUGE_VAL;
};

StretchRange stretchRange(std::span<const ChosenMap> maps, TextureMerge merge) {
  StretchRange range;
  for (const ChosenMap& chosen : maps) {
    if (!chosen.map) continue;
    range.least = std::min(range.least, chosen.leastStretch(merge));
    range.most = std::max(range.most, chosen.distortion.stretch.most);
    range.ofBand = std::min(range.ofBand, std::max(chosen.leastStretch(merge),
                                                   kSqueezed * chosen.distortion.stretch.median));
  }
  return range;
}

/// Warps the texture into the patches, one after the other, and sums the counts of all warps for
/// the report.
class TextureWarper {
 public:
  /// Keeps references to the arguments.
  TextureWarper(const NarrowBand& base, std::span<const Patch> patches, const TextureParts& parts,
                const Box3d& box, double embedDepth, const TextureOptions& options,
                TextureReport& report)
      : base_(base),
        patches_(patches),
        parts_(parts),
        box_(box),
        embedDepth_(embedDepth),
        options_(options),
        report_(report) {}

  /// Warps the texture into patch `n`, then restores distances: the warped field has the right zero
  /// set and signs, but its values are only approximate distances [Brodersen07 §8.3].
  NarrowBand warpInto(std::size_t n, const ChosenMap& chosen) {
    Warp warp = timed(report_.cost.mapping, [&] {
      return warpTexture(parts_.of(n), {box_, embedDepth_ / patches_[n].height}, patches_[n],
                         *chosen.map,
                         {.indexToWorld = chooseGrid(base_, report_.voxelSize, options_.merge),
                          .scale = chosen.distortion.meanStretch,
                          .mapTolerance = options_.mapTolerance,
                          .maxMemory = options_.maxMemory,
                          .progress = progress(n, 0, 0.8)});
    });
    count(warp);
    return timed(report_.cost.distance, [&] {
      return levelset::redistance(std::move(warp.field), {.halfWidth = options_.halfWidth,
                                                          .maxMemory = options_.maxMemory,
                                                          .progress = progress(n, 0.8, 1)});
    });
  }

  /// Adds the operations per point over all patches, and notes about omitted grid points, to the
  /// report.
  void finish() {
    report_.operationsPerPoint =
        static_cast<double>(operations_) / (512 * static_cast<double>(report_.blocksEvaluated));
    if (ghosts_ > 0) {
      report_.notes.push_back(fmt::format(
          "{} grid points far from the patch, which the map sends back into the texture, "
          "were left out",
          ghosts_));
    }
    if (crumbs_ > 0) {
      report_.notes.push_back(fmt::format(
          "{} isolated inside grid points, less than a tenth of a voxel deep, were left out; "
          "they occur where a flat side coincides with a plane of the grid",
          crumbs_));
    }
  }

 private:
  void count(const Warp& warp) {
    report_.blocksTested += warp.blocksTested;
    report_.blocksEvaluated += warp.blocksEvaluated;
    operations_ += warp.operations;
    ghosts_ += warp.ghosts;
    crumbs_ += warp.crumbs;
    report_.mapErrorPoints += warp.checked;
    report_.mapError = std::max(report_.mapError, warp.mapError);
  }

  [[nodiscard]] levelset::Progress progress(std::size_t n, double from, double to) const {
    const auto share = [&](double part) {
      return 0.2 + 0.6 * (static_cast<double>(n) + part) / static_cast<double>(patches_.size());
    };
    return levelset::subProgress(options_.progress, share(from), share(to));
  }

  const NarrowBand& base_;
  std::span<const Patch> patches_;
  const TextureParts& parts_;
  const Box3d& box_;
  double embedDepth_;
  const TextureOptions& options_;
  TextureReport& report_;
  std::size_t operations_ = 0, ghosts_ = 0, crumbs_ = 0;
};

/// Unites the textures mapped onto all patches.
NarrowBand join(std::vector<NarrowBand> pieces, const TextureOptions& options) {
  if (pieces.size() == 1) return std::move(pieces.front());
  return levelset::combine(levelset::CsgOperation::Union, pieces, {.maxMemory = options.maxMemory})
      .band;
}

NarrowBand merge(const NarrowBand& base, NarrowBand warped, const TextureOptions& options,
                 TextureReport& report) {
  if (options.merge == TextureMerge::Alone) return warped;
  const auto operation = options.merge == TextureMerge::Union ? levelset::CsgOperation::Union
                                                              : levelset::CsgOperation::Difference;
  const levelset::Progress progress = levelset::subProgress(options.progress, 0.8, 1);
  levelset::CsgResult result;
  if (options.blend > 0) {
    result = levelset::blend(operation, base, warped, options.blend,
                             {.maxMemory = options.maxMemory, .progress = progress});
  } else {
    const std::array<NarrowBand, 2> solids = {base, warped};
    result = levelset::combine(operation, solids,
                               {.maxMemory = options.maxMemory, .progress = progress});
  }
  for (std::string& note : result.notes) report.notes.push_back(std::move(note));
  if (options.merge != TextureMerge::Carve) return result.band;
  levelset::SliversDropped clean = levelset::dropSlivers(result.band, warped);
  if (clean.count > 0) {
    report.notes.push_back(
        fmt::format("{} slivers thinner than a voxel, left where the texture ends at the base's "
                    "surface, were removed; change --embed so that the texture ends away from it",
                    clean.count));
  }
  return std::move(clean.band);
}

}  // namespace

double resultVoxelSize(double base, double texture, double minStretch) {
  const double fine = texture * minStretch;
  return fine < (1 - kStretchError) * base ? fine : base;
}

void requirePatchOn(const NarrowBand& base, const Patch& patch) {
  const levelset::BandSampler sampler(base);
  for (const V3d& p : patch.layers.front().positions) {
    const double distance = std::abs(sampler.value(p)) / base.voxelSize();
    if (distance > 1) {
      throw InvalidInput(fmt::format(
          "the patch does not lie on the base: at ({:.6g}, {:.6g}, {:.6g}) the surface is "
          "at least {:.3g} voxels away; build the patch on this base",
          p.x, p.y, p.z, distance));
    }
  }
}

TextureResult mapTexture(const NarrowBand& base, const NarrowBand& texture, const Patch& patch,
                         const TextureOptions& options) {
  return mapTexture(base, texture, std::span(&patch, 1), options);
}

TextureResult mapTexture(const NarrowBand& base, const NarrowBand& texture,
                         std::span<const Patch> patches, const TextureOptions& options) {
  requireTextureArguments(base, texture, patches, options);
  TextureResult result;
  TextureReport& report = result.report;
  const Box3d box = chooseTextureBox(texture.zeroSetBounds(), options.textureBox);
  const double embedDepth = options.embedDepth ? *options.embedDepth : base.voxelSize();

  // === Maps and voxel size
  const std::vector<ChosenMap> maps =
      makeMaps(base, texture, patches, {box, embedDepth}, options, report);
  const StretchRange stretch = stretchRange(maps, options.merge);
  report.voxelSize = chooseVoxelSize(base, texture, stretch.least, options);
  requireResult(texture, report, maps, options);

  // === Warped pieces
  const bool isCut = options.map == TextureMap::Prism &&
                     isBeyond(texture.zeroSetBounds(), box, texture.voxelSize());
  const TextureParts parts(
      texture, box, patches, report.voxelSize, isCut, [&](const NarrowBand& part) {
        return fitTexture(part, report.voxelSize, stretch.ofBand, stretch.most, options);
      });
  TextureWarper warper(base, patches, parts, box, embedDepth, options, report);
  std::vector<NarrowBand> pieces;
  for (std::size_t n = 0; n < patches.size(); ++n)
    if (maps[n].map) pieces.push_back(warper.warpInto(n, maps[n]));
  warper.finish();

  // === Result
  result.band = timed(report.cost.merging, [&] {
    return merge(base, join(std::move(pieces), options), options, report);
  });
  levelset::report(options.progress, 1);
  return result;
}

}  // namespace mapping
