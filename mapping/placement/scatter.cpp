#include "mapping/placement/scatter.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "levelset/error.h"
#include "levelset/progress_gate.h"
#include "mapping/distortion/distortion.h"
#include "mapping/layers/patch_layers.h"
#include "mapping/maps/layer_map.h"
#include "mapping/patches/patch_space.h"
#include "mapping/placement/make_patch.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;

// Largest number of positions tried for each requested patch.
constexpr std::size_t kTriesPerPatch = 3;
// A patch at a spare position may come closer to others than their least distance: down to this
// share of it.
constexpr double kGapShare = 0.75;

/// A random number in [−1, 1) for the position with this index, independent of the other positions.
double luckAt(std::uint64_t seed, std::size_t index) {
  std::uint64_t z = seed + (index + 1) * 0x9e3779b97f4a7c15;  // splitmix64
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  z ^= z >> 31;
  return 2 * (static_cast<double>(z >> 11) * 0x1p-53) - 1;
}

/// Angle about the normal from eastOf(normal), the default direction of u, to a direction; radians.
double angleTowards(const SurfacePoint& point, const V3d& direction) {
  const V3d flat = direction - point.normal * point.normal.dot(direction);
  if (!(flat.length() > 1e-6 * direction.length()) || !(direction.length() > 0)) return 0;
  const V3d east = eastOf(point.normal), north = point.normal.cross(east);
  return std::atan2(flat.dot(north), flat.dot(east));
}

PatchSite siteAt(const NarrowBand& base, const SurfacePoint& point, std::size_t index,
                 const ScatterOptions& options) {
  double rotation = options.rotation + options.jitter * luckAt(options.density.seed, index);
  if (options.direction) {
    const V3d direction = options.direction(point.position, 0);
    if (!std::isfinite(direction.length())) {
      throw levelset::UsageError(
          fmt::format("the direction at ({:.6g}, {:.6g}, {:.6g}) is not finite; give a field that "
                      "is finite on the surface",
                      point.position.x, point.position.y, point.position.z));
    }
    rotation += angleTowards(point, direction);
  }
  return {cornersAround(base, point.position, options.uSize * point.scale,
                        options.vSize * point.scale, rotation),
          point.scale};
}

PatchOptions atScale(const PatchOptions& options, double scale) {
  PatchOptions result = options;
  result.spacing *= scale;
  return result;
}

bool doesFold(const Patch& patch) {
  return surveyDistortion(sampleLayerMap(patch, 0), V3d(1), patch.mirrored).folded > 0;
}

/// A patch at one position, or the reason why none could be built.
struct Attempt {
  std::optional<Patch> patch;
  PatchSite site = {};
  std::string cause;
};

Attempt tryAt(const NarrowBand& base, const SurfacePoint& point, std::size_t index, double height,
              const ScatterOptions& options) {
  Attempt attempt;
  try {
    attempt.site = siteAt(base, point, index, options);
    PatchOptions part = atScale(options.patch, point.scale);
    // The caller gave no corners, so clockwise ones are a failed attempt and no error.
    part.mirror = true;
    PatchResult made = makePatch(base, attempt.site.corners, height * point.scale, part);
    Patch& patch = made.patch;
    const auto isHalf = [&](double length, double asked) {
      return length < 0.5 * asked * point.scale;
    };
    if (patch.mirrored || isHalf(made.report.uLength, options.uSize) ||
        isHalf(made.report.vLength, options.vSize)) {
      attempt.cause = "the surface bends too much for a patch of this size; use smaller patches";
      return attempt;
    }
    if (!options.allowFolds && doesFold(patch)) {
      attempt.cause = "the patch would fold; use a lower height or smaller patches";
    } else {
      attempt.patch = std::move(patch);
    }
  } catch (const InvalidInput& error) {
    attempt.cause = error.what();
  }
  return attempt;
}

/// Computes the distances to the base that all patches share, if that pays. Spline patches need no
/// distances.
std::optional<NarrowBand> sweepFor(const NarrowBand& base, const PatchCrowd& crowd,
                                   const PatchOptions& options) {
  if (options.scheme == LayerScheme::Spline) return {};
  return sweepSharedSpace(base, crowd,
                          {.maxMemory = options.maxMemory, .progress = options.progress});
}

/// Number of positions to try, from the front of points.points, which is in order of priority.
std::size_t triesOf(const ScatteredPoints& points) {
  return std::min(points.points.size(), kTriesPerPatch * points.wanted);
}

PatchCrowd crowdOf(const ScatteredPoints& points, double height, const ScatterOptions& options) {
  double smallest = HUGE_VAL, largest = 0;
  for (std::size_t n = 0; n < triesOf(points); ++n) {
    smallest = std::min(smallest, points.points[n].scale);
    largest = std::max(largest, points.points[n].scale);
  }
  return {points.wanted, options.uSize * largest, options.vSize * largest, height * smallest,
          height * largest};
}

PatchCrowd crowdOf(const std::vector<PatchSite>& sites, double height) {
  double u = 0, v = 0, smallest = HUGE_VAL, largest = 0;
  for (const PatchSite& site : sites) {
    const auto& [a, b, c, d] = site.corners;
    u = std::max({u, (b - a).length(), (c - d).length()});
    v = std::max({v, (d - a).length(), (c - b).length()});
    smallest = std::min(smallest, site.scale);
    largest = std::max(largest, site.scale);
  }
  return {sites.size(), u, v, height * smallest, height * largest};
}

bool isFarFrom(const SurfacePoint& point, std::span<const SurfacePoint> others, double distance) {
  return std::all_of(others.begin(), others.end(), [&](const SurfacePoint& other) {
    const double kept = distance * 0.5 * (point.scale + other.scale);
    return !(surfaceDistance(point, other, 0.25 * kept) < kept);
  });
}

}  // namespace

ScatterResult scatter(const NarrowBand& base, double height, const ScatterOptions& options) {
  checkPatchOptions(height, options.patch);
  ScatterOptions parts = options;
  parts.density.progress = levelset::subProgress(options.density.progress, 0, 0.2);
  parts.patch.progress = {};
  const ScatteredPoints points = scatterPoints(base, parts.density);
  ScatterResult result;

  parts.patch.progress = levelset::subProgress(options.density.progress, 0.2, 0.4);
  const std::optional<NarrowBand> space =
      sweepFor(base, crowdOf(points, height, options), parts.patch);
  parts.patch.progress = {};
  parts.patch.space = space ? &*space : nullptr;

  // === The chosen positions
  std::vector<Attempt> attempts(points.wanted);
  const levelset::Progress progress = levelset::subProgress(options.density.progress, 0.4, 0.9);
  levelset::ProgressGate gate(progress, points.wanted);
  tbb::parallel_for(std::size_t{0}, points.wanted, [&](std::size_t n) {
    attempts[n] = tryAt(base, points.points[n], n, height, parts);
    gate.advance(1);
  });
  std::vector<SurfacePoint> taken;
  const auto take = [&](Attempt& attempt, const SurfacePoint& point) {
    if (attempt.patch) {
      result.patches.push_back(std::move(*attempt.patch));
      result.sites.push_back(attempt.site);
      taken.push_back(point);
    } else if (result.leftOut++ == 0) {
      result.cause = attempt.cause;
    }
  };
  for (std::size_t n = 0; n < points.wanted; ++n) take(attempts[n], points.points[n]);

  // === The next positions in order of priority, in the gaps where no patch could be built
  const std::size_t tries = triesOf(points);
  const double kept = std::isfinite(points.distance) ? points.distance : 0;
  for (std::size_t n = points.wanted; n < tries && taken.size() < points.wanted; ++n) {
    const SurfacePoint& point = points.points[n];
    if (!isFarFrom(point, taken, kGapShare * kept)) continue;
    Attempt attempt = tryAt(base, point, n, height, parts);
    take(attempt, point);
    levelset::report(options.density.progress, 0.9);
  }
  if (result.patches.empty()) {
    throw InvalidInput(
        fmt::format("no patch could be built at any of {} positions; the first failed because: {}",
                    result.leftOut, result.cause));
  }
  result.distance = leastDistance(taken, base.zeroSetBounds().size().length(), kept);
  levelset::report(options.density.progress, 1);
  return result;
}

std::vector<Patch> makePatches(const NarrowBand& base, const std::vector<PatchSite>& sites,
                               double height, const PatchOptions& options) {
  checkPatchOptions(height, options);
  constexpr double kSweep = 0.3;
  PatchOptions sweeping = options;
  sweeping.progress = levelset::subProgress(options.progress, 0, kSweep);
  const std::optional<NarrowBand> space = sweepFor(base, crowdOf(sites, height), sweeping);
  std::vector<Patch> patches;
  patches.reserve(sites.size());
  for (const PatchSite& site : sites) {
    PatchOptions scaled = atScale(options, site.scale);
    scaled.space = space ? &*space : nullptr;
    const auto share = [&](double n) {
      return kSweep + (1 - kSweep) * n / static_cast<double>(sites.size());
    };
    const auto done = static_cast<double>(patches.size());
    scaled.progress = levelset::subProgress(options.progress, share(done), share(done + 1));
    patches.push_back(makePatch(base, site.corners, height * site.scale, scaled).patch);
  }
  return patches;
}

}  // namespace mapping
