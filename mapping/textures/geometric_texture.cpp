#include "mapping/textures/geometric_texture.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <iterator>
#include <map>
#include <memory>
#include <span>

#include "levelset/csg/blend.h"
#include "levelset/csg/clip.h"
#include "levelset/csg/csg.h"
#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/placement/resample.h"
#include "levelset/solids/components.h"
#include "mapping/layers/layer_resampling.h"
#include "mapping/maps/prism_map.h"
#include "mapping/textures/shared_sides.h"
#include "mapping/textures/texture_warp.h"

namespace mapping {
namespace {

using Imath::Box3d;
using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::UsageError;

constexpr const char* kTexture = "texture";
// Accuracy of the sampled stretch; within it, a flat patch keeps the base's own grid.
constexpr double kStretchError = 0.01;
// Result voxels that the texture's band must extend on each side, so that the high-order
// interpolant at the zero set reads only distances.
constexpr double kBandNeeded = 3;
// Ratio of result to texture voxel size above which the texture is resampled first. Then the cost
// of its band follows the result and not the cube of the ratio.
constexpr double kCoarser = 6;
// A map whose least stretch is below this share of the median counts as compressing.
constexpr double kSqueezed = 0.2;
// Share of the map's tolerance that the solver may use, and the finest useful tolerance.
constexpr double kSolveShare = 0.1, kFinestSolve = 1e-10;

/// Calls `work` and adds its CPU time to `seconds`.
/// @return the result of `work`
template <typename Work>
auto timed(double& seconds, const Work& work) {
  const std::clock_t start = std::clock();
  auto result = work();
  seconds += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  return result;
}

void checkArguments(const NarrowBand& base, const NarrowBand& texture,
                    std::span<const Patch> patches, const TextureOptions& options) {
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
  if (!(options.mapTolerance >= 0) || !std::isfinite(options.mapTolerance)) {
    throw UsageError(fmt::format("{}: the map's tolerance is {}; give texture voxels, at least 0",
                                 kTexture, options.mapTolerance));
  }
  if (options.embedDepth && !std::isfinite(*options.embedDepth)) {
    throw UsageError(fmt::format("{}: the embedding depth is {}; give a length with --embed",
                                 kTexture, *options.embedDepth));
  }
  const double diagonal = base.zeroSetBounds().size().length();
  if (options.embedDepth && std::abs(*options.embedDepth) > diagonal) {
    throw InvalidInput(
        fmt::format("{}: the embedding depth of {:.6g} exceeds the diagonal of the base, {:.6g}; "
                    "give a smaller --embed",
                    kTexture, *options.embedDepth, diagonal));
  }
  if (!(options.blend >= 0) || !std::isfinite(options.blend)) {
    throw UsageError(fmt::format("{}: the blend radius is {}; give a length of at least 0",
                                 kTexture, options.blend));
  }
  if (options.merge != TextureMerge::Alone && base.isOpenSurface()) {
    throw levelset::InvalidInput(
        fmt::format("{}: the base is an open surface, which has no inside; give --alone for the "
                    "texture alone, or map a mesh with --map mesh",
                    kTexture));
  }
  requireSolid(texture, kTexture);
  if (base.isEmpty() || texture.isEmpty()) {
    throw InvalidInput(
        fmt::format("{}: the {} has no surface; give a solid with at least one voxel", kTexture,
                    base.isEmpty() ? "base" : "texture"));
  }
  if (patches.empty())
    throw UsageError(fmt::format("{}: there is no patch; build one with `patch`", kTexture));
  for (const Patch& patch : patches) {
    if (patch.layers.size() < 2 || !(patch.height > 0)) {
      throw InvalidInput(
          fmt::format("{}: the patch has no layers of particles; build it with `patch`", kTexture));
    }
    requirePatchOn(base, patch);
  }
}

double chooseVoxelSize(const NarrowBand& base, const NarrowBand& texture, double minStretch,
                       const TextureOptions& options) {
  if (options.voxelSize) return *options.voxelSize;
  return resultVoxelSize(base.voxelSize(), texture.voxelSize(), minStretch);
}

/// Transform of the result: the base's own grid if the voxel sizes agree, so that merging needs no
/// resampling.
Imath::M44d chooseGrid(const NarrowBand& base, double voxelSize, TextureMerge merge) {
  const bool agrees = std::abs(voxelSize - base.voxelSize()) <= 1e-9 * voxelSize;
  if (agrees && merge != TextureMerge::Alone) return base.indexToWorld();
  Imath::M44d result;
  for (int axis = 0; axis < 3; ++axis) result[axis][axis] = voxelSize;
  return result;
}

/// Adapts a texture to the voxels of the result. Resamples it if they are much coarser, and widens
/// its band so that it covers enough of them after warping.
/// @param least, most  stretch of texture → patch
NarrowBand fitTexture(const NarrowBand& texture, double voxelSize, double least, double most,
                      const TextureOptions& options) {
  NarrowBand fitted = texture;
  const double coarsest = voxelSize / most;  // coarsest texture voxel size that is fine enough
  if (coarsest > kCoarser * texture.voxelSize()) {
    fitted = levelset::resample(texture, coarsest, {.maxMemory = options.maxMemory});
    if (fitted.isEmpty()) {
      throw InvalidInput(
          fmt::format("{}: on the patch the texture is smaller than a voxel of {:.6g}; use "
                      "smaller voxels",
                      kTexture, voxelSize));
    }
  }
  const double needed = kBandNeeded * voxelSize / (least * fitted.voxelSize());
  if (needed <= fitted.halfWidth() * (1 + 1e-6)) return fitted;
  return levelset::redistance(fitted,
                              {.halfWidth = std::ceil(needed), .maxMemory = options.maxMemory});
}

/// Parts of the texture that are mapped onto each patch. A prism map ends a little outside the unit
/// cube. So a texture that extends beyond the given box is clipped at the box, not at the end of
/// the map. At sides that patches share it is clipped two voxels further out, so that tiles
/// overlap. If they met face to face, the grid would show a gap. A texture that only touches the
/// box is not clipped.
class TextureParts {
 public:
  template <typename Fit>
  TextureParts(const NarrowBand& texture, const Box3d& box, std::span<const Patch> patches,
               double voxelSize, bool isCut, const Fit& fit) {
    if (!isCut) {
      parts_.emplace(SharedSides{}, fit(texture));
      ofPatch_.resize(patches.size(), SharedSides{});
      return;
    }
    ofPatch_ = sharedSides(patches);
    constexpr double kBeyond = 2;  // voxels
    double u = HUGE_VAL, v = HUGE_VAL;
    for (const Patch& patch : patches) {
      const ParticleLayer& layer = patch.layers.front();
      u = std::min(u, patch.spacing * static_cast<double>(layer.columns - 1));
      v = std::min(v, patch.spacing * static_cast<double>(layer.rows - 1));
    }
    const double alongU = kBeyond * voxelSize / u * box.size().x,
                 alongV = kBeyond * voxelSize / v * box.size().y;
    for (const SharedSides& sides : ofPatch_) {
      if (parts_.contains(sides)) continue;
      Box3d wider = box;
      if (sides[0]) wider.min.x -= alongU;
      if (sides[1]) wider.max.x += alongU;
      if (sides[2]) wider.min.y -= alongV;
      if (sides[3]) wider.max.y += alongV;
      parts_.emplace(sides, fit(levelset::clip(texture, wider)));
    }
  }
  [[nodiscard]] const NarrowBand& of(std::size_t patch) const { return parts_.at(ofPatch_[patch]); }

 private:
  std::map<SharedSides, NarrowBand> parts_;
  std::vector<SharedSides> ofPatch_;
};

/// A map of the chosen kind, with its measurements.
struct ChosenMap {
  std::unique_ptr<PatchMap> map;
  Distortion distortion = {};
  FoldCertificate certificate = {};
  std::size_t particles = 0;
  V3d residual{0};  ///< at the particles, in u, v and w
  /// Sample points where the patch passes through itself without folding.
  std::size_t overlaps = 0;
  MapSample overlap = {};  ///< one of these points
  RbfSolveReport solve = {};
  bool isExtrapolated = false;  ///< true: no particles support the map below the surface

  /// Stretch that determines the voxel size: the least stretch where the texture is visible.
  /// Isolated folds do not count, nor do parts embedded in the base that a crease compresses.
  [[nodiscard]] double leastStretch(TextureMerge merge) const {
    if (distortion.folded > 0) return distortion.stretch.percent1;
    return merge == TextureMerge::Union ? distortion.leastAbove : distortion.stretch.least;
  }
};

/// Solver tolerance in u, v and w for a map tolerance in texture voxels.
double solveTolerance(const NarrowBand& texture, const V3d& boxSize, double mapTolerance) {
  const double longest = std::max({boxSize.x, boxSize.y, boxSize.z});
  return std::max(kFinestSolve, kSolveShare * mapTolerance * texture.voxelSize() / longest);
}

std::unique_ptr<PrismMap> buildPrismMap(const NarrowBand& base, const Patch& patch,
                                        double embedDepth, const TextureOptions& options) {
  levelset::requireMemory(PrismMap::estimateBytes(patch), options.maxMemory, kTexture);
  levelset::report(options.progress, 0, kTexture);
  // Margin for the texture's band, which extends beyond the texture.
  const double rim = (kBandNeeded + 1) * std::max(base.voxelSize(), options.voxelSize.value_or(0));
  return std::make_unique<PrismMap>(patch, LatticeBorder{.embedDepth = embedDepth, .rim = rim});
}

/// Builds and certifies the map of one patch.
/// @param embedDepth  as a share of the patch's height
ChosenMap makeMap(const NarrowBand& base, const Patch& patch, double embedDepth,
                  const V3d& textureSize, double tolerance, const TextureOptions& options,
                  TextureCost& cost) {
  ChosenMap result;
  if (options.map == TextureMap::Prism) {
    auto prisms =
        timed(cost.setup, [&] { return buildPrismMap(base, patch, embedDepth, options); });
    result.particles = prisms->lattice().nodeCount();
    result.certificate = timed(cost.certificate, [&] {
      const std::vector<MapSample> samples = prisms->samples();
      result.distortion = surveyDistortion(samples, textureSize, patch.mirrored);
      result.overlaps = prisms->countOverlaps(samples, result.overlap);
      return certifyPrisms(*prisms, patch.mirrored);
    });
    result.map = std::move(prisms);
    return result;
  }
  RbfMapOptions rbf = options.rbf;
  rbf.maxMemory = std::min(rbf.maxMemory, options.maxMemory);
  rbf.solveTolerance = tolerance;
  rbf.progress = levelset::subProgress(options.progress, 0, 0.2);
  CertifiedRbf certified = certifiedRbf(patch, embedDepth, rbf, cost);
  result.particles = certified.map->size();
  result.residual = certified.map->axisResidual();
  result.solve = certified.map->solveReport();
  result.distortion = surveyDistortion(certified.samples, textureSize, patch.mirrored);
  result.certificate = std::move(certified.certificate);
  result.isExtrapolated = certified.isExtrapolated;
  result.map = std::move(certified.map);
  return result;
}

/// Combines solver reports: figures of the worst, sums of the counts, and each note once.
void addSolve(const RbfSolveReport& one, TextureReport& report) {
  RbfSolveReport& all = report.solve;
  all.merged += one.merged;
  all.averaged += one.averaged;
  all.directions = std::min(all.directions, one.directions);
  all.condition = std::max(all.condition, one.condition);
  all.isRegularized = all.isRegularized || one.isRegularized;
  all.isIterative = all.isIterative || one.isIterative;
  all.iterations = std::max(all.iterations, one.iterations);
  all.solveResidual = std::max(all.solveResidual, one.solveResidual);
  for (const std::string& note : one.notes) {
    if (std::find(all.notes.begin(), all.notes.end(), note) != all.notes.end()) continue;
    all.notes.push_back(note);
    report.notes.push_back(note);
  }
}

std::string overlapMessage(const ChosenMap& map) {
  const V3d &p = map.overlap.position, &uvw = map.overlap.uvw;
  return fmt::format(
      "{}: the patch passes through itself at {} of {} sample points, one at ({:.6g}, {:.6g}, "
      "{:.6g}), u, v, w = {:.3g}, {:.3g}, {:.3g}, where the texture would have two values; keep "
      "its spline clear of itself, use a lower height, or map its halves one after the other",
      kTexture, map.overlaps, map.distortion.samples, p.x, p.y, p.z, uvw.x, uvw.y, uvw.z);
}

/// Builds the maps of all patches; a skipped patch gets no map. Other folds are errors, or notes if
/// folds are allowed.
std::vector<ChosenMap> makeMaps(const NarrowBand& base, std::span<const Patch> patches,
                                double embedDepth, const V3d& textureSize, double tolerance,
                                const TextureOptions& options, TextureReport& report) {
  std::vector<ChosenMap> maps;
  std::vector<Distortion> distortions;
  std::vector<FoldCertificate> certificates;
  std::size_t extrapolated = 0;
  for (const Patch& patch : patches) {
    const auto done = static_cast<double>(maps.size());
    const auto share = [&](double n) { return 0.2 * n / static_cast<double>(patches.size()); };
    TextureOptions part = options;
    part.progress = levelset::subProgress(options.progress, share(done), share(done + 1));
    ChosenMap chosen =
        makeMap(base, patch, embedDepth / patch.height, textureSize, tolerance, part, report.cost);
    const bool folds =
        chosen.distortion.folded > 0 || chosen.certificate.verdict() == FoldVerdict::Folds;
    if (!folds && chosen.overlaps > 0) {
      const std::string message = overlapMessage(chosen);
      if (!options.skipFolds && !options.allowFolds) throw InvalidInput(message);
      if (!options.skipFolds) report.notes.push_back(message);
    }
    if (options.skipFolds && (folds || chosen.overlaps > 0)) {
      ++report.skipped;
      maps.emplace_back();
      continue;
    }
    std::vector<std::string> notes =
        checkFolds(chosen.distortion, chosen.certificate, options.allowFolds);
    std::move(notes.begin(), notes.end(), std::back_inserter(report.notes));
    extrapolated += chosen.isExtrapolated;
    report.particles += chosen.particles;
    addSolve(chosen.solve, report);
    report.mapResidual = std::max(report.mapResidual, (chosen.residual * textureSize).length());
    distortions.push_back(chosen.distortion);
    certificates.push_back(std::move(chosen.certificate));
    maps.push_back(std::move(chosen));
  }
  report.patches = distortions.size();
  if (distortions.empty()) {
    throw InvalidInput(
        fmt::format("{}: all of {} patches fold; use a lower height or smaller patches", kTexture,
                    patches.size()));
  }
  if (extrapolated > 0) {
    report.notes.push_back(
        fmt::format("below {} of {} patches the surface has a crease or bends too much for the "
                    "embedding depth, so the map is extrapolated there without particles; give a "
                    "smaller --embed, or --map shell",
                    extrapolated, patches.size()));
  }
  if (report.skipped > 0) {
    report.notes.push_back(
        fmt::format("{} of {} patches fold and were left out", report.skipped, patches.size()));
  }
  report.distortion = worstOf(distortions);
  report.certificate = worstOf(certificates);
  return maps;
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
  constexpr double kBytesPerVoxel = 40;  // active share of a block, for three fields
  constexpr double kBytesWarped = 8;  // a value, and its share of the inactive values of the block
  const double bytes = voxels * kBytesPerVoxel + warped * kBytesWarped;
  const Distortion& worst = report.distortion;
  if (bytes > static_cast<double>(options.maxMemory) && !options.voxelSize &&
      worst.stretch.least < kSqueezed * worst.stretch.median) {
    const V3d& p = worst.foldPoint;
    throw levelset::ResourceLimit(
        fmt::format("{}: the map compresses the texture to {:.2g} of its size near ({:.6g}, "
                    "{:.6g}, {:.6g}); voxels fine enough for that, {:.3g}, need about {:.3g} GB; "
                    "give --voxel, a lower height or a flatter position",
                    kTexture, worst.stretch.least, p.x, p.y, p.z, report.voxelSize, bytes / 1e9));
  }
  levelset::requireMemory(bytes, options.maxMemory, kTexture);
}

/// Unites all mapped pieces.
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
          "{}: the patch does not lie on the base: at ({:.6g}, {:.6g}, {:.6g}) the surface is "
          "at least {:.3g} voxels away; build the patch on this base",
          kTexture, p.x, p.y, p.z, distance));
    }
  }
}

RbfMap patchToTexture(const Patch& patch, const RbfMapOptions& options, double embedDepth) {
  std::vector<V3d> points, targets;
  std::vector<char> near;
  for (const ParticleLayer& layer : patch.layers) {
    const int rim = layer.hasRim() ? 1 : 0;
    const auto columns = static_cast<int>(layer.columns), rows = static_cast<int>(layer.rows);
    for (int j = -rim; j < rows + rim; ++j)
      for (int i = -rim; i < columns + rim; ++i) {
        points.push_back(layer.beyond(i, j));
        targets.emplace_back(static_cast<double>(i) / (columns - 1),
                             static_cast<double>(j) / (rows - 1), layer.w);
        near.push_back(layer.w == 0);
      }
  }
  for (const EmbeddedParticle& particle : embeddedParticles(patch, embedDepth)) {
    points.push_back(particle.position);
    targets.push_back(particle.uvw);
    near.push_back(false);
  }
  return {points, targets, near, options};
}

CertifiedRbf certifiedRbf(const Patch& patch, double embedDepth, const RbfMapOptions& options,
                          TextureCost& cost) {
  const auto certify = [&](double held) {
    CertifiedRbf result;
    result.map = timed(
        cost.setup, [&] { return std::make_unique<RbfMap>(patchToTexture(patch, options, held)); });
    result.certificate = timed(cost.certificate, [&] {
      result.samples = sampleRbf(*result.map, patch, embedDepth);
      return certifyRbf(*result.map, patch, embedDepth);
    });
    return result;
  };
  const auto folds = [&](const CertifiedRbf& one) {
    return one.certificate.verdict() == FoldVerdict::Folds ||
           surveyDistortion(one.samples, V3d(1), patch.mirrored).folded > 0;
  };
  CertifiedRbf result = certify(embedDepth);
  if (embedDepth == 0 || !folds(result)) return result;
  CertifiedRbf free = certify(0);
  if (folds(free)) return result;
  free.isExtrapolated = true;
  return free;
}

TextureResult mapTexture(const NarrowBand& base, const NarrowBand& texture, const Patch& patch,
                         const TextureOptions& options) {
  return mapTexture(base, texture, std::span(&patch, 1), options);
}

TextureResult mapTexture(const NarrowBand& base, const NarrowBand& texture,
                         std::span<const Patch> patches, const TextureOptions& options) {
  checkArguments(base, texture, patches, options);
  TextureResult result;
  TextureReport& report = result.report;
  const Box3d box = chooseTextureBox(texture.zeroSetBounds(), options.textureBox);

  // === The maps and their distortion
  const double embedDepth = options.embedDepth ? *options.embedDepth : base.voxelSize();
  const double tolerance = solveTolerance(texture, box.size(), options.mapTolerance);
  const std::vector<ChosenMap> maps =
      makeMaps(base, patches, embedDepth, box.size(), tolerance, options, report);
  double minStretch = HUGE_VAL, maxStretch = 0, bandStretch = HUGE_VAL;
  for (const ChosenMap& chosen : maps) {
    if (!chosen.map) continue;
    minStretch = std::min(minStretch, chosen.leastStretch(options.merge));
    maxStretch = std::max(maxStretch, chosen.distortion.stretch.most);
    // Parts compressed more than this are under a voxel, unless the voxel size follows them.
    bandStretch = std::min(bandStretch, std::max(chosen.leastStretch(options.merge),
                                                 kSqueezed * chosen.distortion.stretch.median));
  }
  report.voxelSize = chooseVoxelSize(base, texture, minStretch, options);
  requireResult(texture, report, maps, options);

  // === Warp the texture, then restore distances: the warped field has the right zero set and
  // signs, but its values are only approximate distances [Brodersen07 §8.3]
  const bool isCut = options.map == TextureMap::Prism &&
                     isBeyond(texture.zeroSetBounds(), box, texture.voxelSize());
  const TextureParts parts(
      texture, box, patches, report.voxelSize, isCut, [&](const NarrowBand& part) {
        return fitTexture(part, report.voxelSize, bandStretch, maxStretch, options);
      });
  std::vector<NarrowBand> pieces;
  std::size_t operations = 0, ghosts = 0, crumbs = 0;
  for (std::size_t n = 0; n < patches.size(); ++n) {
    if (!maps[n].map) continue;
    const auto progress = [&](double from, double to) {
      const auto share = [&](double part) {
        return 0.2 + 0.6 * (static_cast<double>(n) + part) / static_cast<double>(patches.size());
      };
      return levelset::subProgress(options.progress, share(from), share(to));
    };
    Warp warp = timed(report.cost.mapping, [&] {
      return warpTexture(parts.of(n), {box, embedDepth / patches[n].height}, patches[n],
                         *maps[n].map,
                         {.indexToWorld = chooseGrid(base, report.voxelSize, options.merge),
                          .scale = maps[n].distortion.meanStretch,
                          .mapTolerance = options.mapTolerance,
                          .maxMemory = options.maxMemory,
                          .progress = progress(0, 0.8)});
    });
    report.blocksTested += warp.blocksTested;
    report.blocksEvaluated += warp.blocksEvaluated;
    operations += warp.operations;
    ghosts += warp.ghosts;
    crumbs += warp.crumbs;
    report.mapErrorPoints += warp.checked;
    report.mapError = std::max(report.mapError, warp.mapError);
    pieces.push_back(timed(report.cost.distance, [&] {
      return levelset::redistance(std::move(warp.field), {.halfWidth = options.halfWidth,
                                                          .maxMemory = options.maxMemory,
                                                          .progress = progress(0.8, 1)});
    }));
  }
  report.operationsPerPoint =
      static_cast<double>(operations) / (512 * static_cast<double>(report.blocksEvaluated));
  if (ghosts > 0) {
    report.notes.push_back(
        fmt::format("{} grid points far from the patch, which the map sends back into the texture, "
                    "were left out",
                    ghosts));
  }
  if (crumbs > 0) {
    report.notes.push_back(fmt::format(
        "{} isolated inside grid points, less than a tenth of a voxel deep, were left out; "
        "they occur where a flat side coincides with a plane of the grid",
        crumbs));
  }
  result.band = timed(report.cost.merging, [&] {
    return merge(base, join(std::move(pieces), options), options, report);
  });
  levelset::report(options.progress, 1, kTexture);
  return result;
}

}  // namespace mapping
