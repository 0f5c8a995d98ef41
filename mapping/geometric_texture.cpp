#include "mapping/geometric_texture.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/eikonal/redistance.h"
#include "levelset/error.h"
#include "levelset/sample.h"
#include "levelset/solids/blend.h"
#include "levelset/solids/csg.h"
#include "mapping/distortion.h"
#include "mapping/texture_warp.h"

namespace mapping {
namespace {

using Imath::Box3d;
using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::UsageError;

constexpr const char* kTexture = "texture";
// The stretch is sampled, and known to about this: a flat patch keeps the base's own grid.
constexpr double kStretchError = 0.01;
// Voxels of the result that the texture's band has to reach on each side, so that the high-order
// interpolant beside the zero set reads nothing but distances.
constexpr double kBandNeeded = 3;

void checkArguments(const NarrowBand& base, const NarrowBand& texture, const Patch& patch,
                    const TextureOptions& options) {
  const auto requirePositive = [](double value, const char* name) {
    if (!(value > 0) || !std::isfinite(value)) {
      throw UsageError(
          fmt::format("{}: the {} is {}; give a positive number", kTexture, name, value));
    }
  };
  if (options.voxelSize) requirePositive(*options.voxelSize, "voxel size");
  if (!(options.halfWidth >= 1) || !std::isfinite(options.halfWidth)) {
    throw UsageError(fmt::format("{}: the half width is {}; give at least 1 voxel", kTexture,
                                 options.halfWidth));
  }
  if (options.sink && !std::isfinite(*options.sink)) {
    throw UsageError(fmt::format("{}: the sink is {}; give a length", kTexture, *options.sink));
  }
  if (!(options.blend >= 0) || !std::isfinite(options.blend)) {
    throw UsageError(fmt::format("{}: the blend radius is {}; give a length of at least 0",
                                 kTexture, options.blend));
  }
  if (base.isEmpty() || texture.isEmpty()) {
    throw InvalidInput(
        fmt::format("{}: the {} has no surface; give a solid with at least one voxel", kTexture,
                    base.isEmpty() ? "base" : "texture"));
  }
  if (patch.levels.size() < 2 || !(patch.height > 0)) {
    throw InvalidInput(
        fmt::format("{}: the patch has no levels of particles; make it with `patch`", kTexture));
  }
}

void checkPatchOnBase(const NarrowBand& base, const Patch& patch) {
  const levelset::BandSampler sampler(base);
  for (const V3d& p : patch.levels.front().positions) {
    const double distance = std::abs(sampler.value(p)) / base.voxelSize();
    if (distance > 1) {
      throw InvalidInput(
          fmt::format("{}: the patch does not lie on the base, at ({:.6g}, {:.6g}, {:.6g}) they "
                      "are {:.3g} voxels or "
                      "more apart; make the patch on this base",
                      kTexture, p.x, p.y, p.z, distance));
    }
  }
}

Box3d chooseBox(const NarrowBand& texture, const TextureOptions& options) {
  const Box3d box = options.textureBox ? *options.textureBox : texture.zeroSetBounds();
  const V3d size = box.isEmpty() ? V3d(0) : box.size();
  if (!(size.x > 0 && size.y > 0 && size.z > 0) || !std::isfinite(size.x * size.y * size.z)) {
    throw InvalidInput(
        fmt::format("{}: the texture box has no volume, its size is {:.6g} × {:.6g} × "
                    "{:.6g}; give a low and a high corner",
                    kTexture, size.x, size.y, size.z));
  }
  if (options.textureBox && !box.intersects(texture.zeroSetBounds())) {
    throw InvalidInput(
        fmt::format("{}: the texture box holds nothing of the texture; give one that its "
                    "surface passes through",
                    kTexture));
  }
  return box;
}

void checkFolds(const Distortion& distortion, TextureReport& report, bool allowFolds) {
  if (distortion.minJacobian > 0) return;
  const std::string sentence = fmt::format(
      "the patch folds at ({:.6g}, {:.6g}, {:.6g}), u, v, w = {:.3g}, {:.3g}, {:.3g}, where the "
      "map's "
      "Jacobian is {:.3g} of its mean",
      distortion.foldPlace.x, distortion.foldPlace.y, distortion.foldPlace.z, distortion.foldUvw.x,
      distortion.foldUvw.y, distortion.foldUvw.z, distortion.minJacobian);
  if (!allowFolds) {
    throw InvalidInput(
        fmt::format("{}: {}; lower its height or choose a flatter place", kTexture, sentence));
  }
  report.notes.push_back(sentence);
}

double chooseVoxelSize(const NarrowBand& base, const NarrowBand& texture, double minStretch,
                       const TextureOptions& options) {
  if (options.voxelSize) return *options.voxelSize;
  return resultVoxelSize(base.voxelSize(), texture.voxelSize(), minStretch);
}

/// The base's own grid where the voxels agree, so that merging needs no resampling.
Imath::M44d chooseGrid(const NarrowBand& base, double voxelSize, TextureMerge merge) {
  const bool agrees = std::abs(voxelSize - base.voxelSize()) <= 1e-9 * voxelSize;
  if (agrees && merge != TextureMerge::Alone) return base.indexToWorld();
  Imath::M44d result;
  for (int axis = 0; axis < 3; ++axis) result[axis][axis] = voxelSize;
  return result;
}

/// Blocks of the result by the texture's own count, before anything is allocated.
void requireResult(const NarrowBand& texture, double voxelSize, double meanStretch,
                   const TextureOptions& options) {
  const double finer = texture.voxelSize() * meanStretch / voxelSize;
  const double width =
      std::max(1.0, options.halfWidth / std::max(1.0, texture.halfWidth() * finer));
  const double voxels =
      static_cast<double>(texture.activeVoxelCount()) * std::max(1e-3, finer * finer) * width;
  constexpr double kBytesPerVoxel = 40;  // active share of a block, and three fields of them
  levelset::requireMemory(voxels * kBytesPerVoxel, options.maxMemory, kTexture);
}

/// A texture whose band, once it is warped, still reaches some voxels of the result.
NarrowBand widen(const NarrowBand& texture, double voxelSize, double minStretch,
                 const TextureOptions& options) {
  const double needed = kBandNeeded * voxelSize / (minStretch * texture.voxelSize());
  if (needed <= texture.halfWidth() * (1 + 1e-6)) return texture;
  return levelset::redistance(texture,
                              {.halfWidth = std::ceil(needed), .maxMemory = options.maxMemory});
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
  return result.band;
}

}  // namespace

double resultVoxelSize(double base, double texture, double minStretch) {
  const double fine = texture * minStretch;
  return fine < (1 - kStretchError) * base ? fine : base;
}

RbfMap patchToTexture(const Patch& patch, const RbfMapOptions& options) {
  std::vector<V3d> points, targets;
  std::vector<char> near;
  for (const ParticleLevel& level : patch.levels)
    for (std::size_t j = 0; j < level.rows; ++j)
      for (std::size_t i = 0; i < level.columns; ++i) {
        points.push_back(level.at(i, j));
        targets.emplace_back(static_cast<double>(i) / static_cast<double>(level.columns - 1),
                             static_cast<double>(j) / static_cast<double>(level.rows - 1), level.w);
        near.push_back(level.w == 0);
      }
  return {points, targets, near, options};
}

TextureResult mapTexture(const NarrowBand& base, const NarrowBand& texture, const Patch& patch,
                         const TextureOptions& options) {
  checkArguments(base, texture, patch, options);
  checkPatchOnBase(base, patch);
  TextureResult result;
  TextureReport& report = result.report;
  const Box3d box = chooseBox(texture, options);

  // === The map, and what it does to lengths
  RbfMapOptions rbf = options.rbf;
  rbf.maxMemory = std::min(rbf.maxMemory, options.maxMemory);
  rbf.progress = levelset::subProgress(options.progress, 0, 0.2);
  const RbfMap map = patchToTexture(patch, rbf);
  const double sink = options.sink ? *options.sink : base.voxelSize();
  const Distortion distortion = surveyDistortion(map, patch, box.size(), sink / patch.height);
  checkFolds(distortion, report, options.allowFolds);
  report.particles = map.size();
  report.minJacobian = distortion.minJacobian;
  report.minStretch = distortion.minStretch;
  report.maxStretch = distortion.maxStretch;
  report.mapResidual = (map.axisResidual() * box.size()).length();
  report.voxelSize = chooseVoxelSize(base, texture, distortion.minStretch, options);

  // === Warp, and make a distance of it again [Brodersen07, ERR-23 in our notes]
  requireResult(texture, report.voxelSize, distortion.meanStretch, options);
  const TexturePlacement placement{box, sink / patch.height};
  Warp warp = warpTexture(widen(texture, report.voxelSize, distortion.minStretch, options),
                          placement, patch, map,
                          {.indexToWorld = chooseGrid(base, report.voxelSize, options.merge),
                           .scale = distortion.meanStretch,
                           .maxMemory = options.maxMemory,
                           .progress = levelset::subProgress(options.progress, 0.2, 0.7)});
  report.blocksTested = warp.blocksTested;
  report.blocksEvaluated = warp.blocksEvaluated;
  if (warp.ghosts > 0) {
    report.notes.push_back(
        fmt::format("{} grid points far from the patch, which the map sends back into the texture, "
                    "were left out",
                    warp.ghosts));
  }
  NarrowBand warped = levelset::redistance(
      std::move(warp.field), {.halfWidth = options.halfWidth,
                              .maxMemory = options.maxMemory,
                              .progress = levelset::subProgress(options.progress, 0.7, 0.8)});
  result.band = merge(base, std::move(warped), options, report);
  levelset::report(options.progress, 1, kTexture);
  return result;
}

}  // namespace mapping
