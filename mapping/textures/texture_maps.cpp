#include "mapping/textures/texture_maps.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "levelset/error.h"
#include "mapping/layers/layer_resampling.h"
#include "mapping/maps/prism_map.h"
#include "mapping/textures/texture_placement.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;

// Share of TextureOptions::mapTolerance that the solver of an RBF map may use, and the smallest
// solver tolerance in u, v and w.
constexpr double kSolveShare = 0.1, kFinestSolve = 1e-10;

/// Solver tolerance in u, v and w for a map tolerance in texture voxels.
double solveTolerance(const NarrowBand& texture, const V3d& boxSize, double mapTolerance) {
  const double longest = std::max({boxSize.x, boxSize.y, boxSize.z});
  return std::max(kFinestSolve, kSolveShare * mapTolerance * texture.voxelSize() / longest);
}

std::unique_ptr<PrismMap> buildPrismMap(const NarrowBand& base, const Patch& patch,
                                        double embedDepth, const TextureOptions& options) {
  levelset::requireMemory(PrismMap::estimateBytes(patch), options.maxMemory);
  levelset::report(options.progress, 0);
  // Margin around the lattice, world units, for the texture's band, which extends beyond the
  // texture.
  const double rim =
      (kTextureBandNeeded + 1) * std::max(base.voxelSize(), options.voxelSize.value_or(0));
  return std::make_unique<PrismMap>(patch, LatticeBorder{.embedDepth = embedDepth, .rim = rim});
}

/// Builds and certifies the map of one patch.
/// @param embedDepth  depth of the texture below the surface, as a share of the patch's height
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

/// Adds one solver report to the report of all maps. Keeps the worst values and each note once, and
/// sums the merged particles.
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
      "the patch passes through itself at {} of {} sample points, one at ({:.6g}, {:.6g}, "
      "{:.6g}), u, v, w = {:.3g}, {:.3g}, {:.3g}, where the texture would have two values; keep "
      "its spline clear of itself, use a lower height, or map its halves one after the other",
      map.overlaps, map.distortion.samples, p.x, p.y, p.z, uvw.x, uvw.y, uvw.z);
}

/// Measurements of the maps built so far, from which the report is computed.
struct MapFigures {
  std::vector<Distortion> distortions;
  std::vector<FoldCertificate> certificates;
  std::size_t extrapolated = 0;
};

/// Decides if a patch is left out because its map folds or the patch passes through itself.
/// @throws InvalidInput for a patch that passes through itself if that is not allowed
bool isLeftOut(const ChosenMap& chosen, const TextureOptions& options, TextureReport& report) {
  const bool folds =
      chosen.distortion.folded > 0 || chosen.certificate.verdict() == FoldVerdict::Folds;
  if (!folds && chosen.overlaps > 0) {
    const std::string message = overlapMessage(chosen);
    if (!options.skipFolds && !options.allowFolds) throw InvalidInput(message);
    if (!options.skipFolds) report.notes.push_back(message);
  }
  return options.skipFolds && (folds || chosen.overlaps > 0);
}

/// Adds the measurements of one map to `figures` and the report. Moves its certificate out.
/// @throws InvalidInput for folds that are not allowed
void addMap(ChosenMap& chosen, const V3d& textureSize, const TextureOptions& options,
            MapFigures& figures, TextureReport& report) {
  std::vector<std::string> notes =
      checkFolds(chosen.distortion, chosen.certificate, options.allowFolds);
  std::move(notes.begin(), notes.end(), std::back_inserter(report.notes));
  figures.extrapolated += chosen.isExtrapolated;
  report.particles += chosen.particles;
  addSolve(chosen.solve, report);
  report.mapResidual = std::max(report.mapResidual, (chosen.residual * textureSize).length());
  figures.distortions.push_back(chosen.distortion);
  figures.certificates.push_back(std::move(chosen.certificate));
}

/// Adds the measurements of all maps to the report.
/// @throws InvalidInput if all patches were left out
void reportMaps(const MapFigures& figures, std::size_t patches, TextureReport& report) {
  report.patches = figures.distortions.size();
  if (figures.distortions.empty()) {
    throw InvalidInput(
        fmt::format("all of {} patches fold; use a lower height or smaller patches", patches));
  }
  if (figures.extrapolated > 0) {
    report.notes.push_back(
        fmt::format("below {} of {} patches the surface has a crease or bends too much for the "
                    "embedding depth, so the map is extrapolated there without particles; give a "
                    "smaller --embed, or --map shell",
                    figures.extrapolated, patches));
  }
  if (report.skipped > 0) {
    report.notes.push_back(
        fmt::format("{} of {} patches fold and were left out", report.skipped, patches));
  }
  report.distortion = worstOf(figures.distortions);
  report.certificate = worstOf(figures.certificates);
}

}  // namespace

std::vector<ChosenMap> makeMaps(const NarrowBand& base, const NarrowBand& texture,
                                std::span<const Patch> patches, const TextureExtent& extent,
                                const TextureOptions& options, TextureReport& report,
                                const std::function<void(std::size_t)>& use) {
  const V3d textureSize = extent.box.size();
  const double tolerance = solveTolerance(texture, textureSize, options.mapTolerance);
  std::vector<ChosenMap> maps;
  MapFigures figures;
  for (const Patch& patch : patches) {
    const auto done = static_cast<double>(maps.size());
    const auto share = [&](double n) { return 0.2 * n / static_cast<double>(patches.size()); };
    TextureOptions part = options;
    part.progress = levelset::subProgress(options.progress, share(done), share(done + 1));
    ChosenMap chosen = makeMap(base, patch, extent.embedDepth / patch.height, textureSize,
                               tolerance, part, report.cost);
    if (isLeftOut(chosen, options, report)) {
      ++report.skipped;
      maps.emplace_back();
      continue;
    }
    addMap(chosen, textureSize, options, figures, report);
    if (use) {
      use(maps.size());
      chosen.map.reset();
    }
    maps.push_back(std::move(chosen));
  }
  reportMaps(figures, patches.size(), report);
  return maps;
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

}  // namespace mapping
