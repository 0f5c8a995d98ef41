#include "mapping/patch.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "mapping/closest_point.h"
#include "mapping/geodesic.h"
#include "mapping/particle_levels.h"
#include "mapping/patch_space.h"
#include "mapping/surface_field.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::UsageError;

constexpr const char* kPatch = "patch";
// The map's system is dense: n³ / 3 operations and n² numbers. This many particles cost a second or
// two, and lie some five to ten voxels apart on a patch of a hundred or two.
constexpr double kParticleBudget = 2000;
constexpr double kSmallestSpacing = 1.5;  // voxels; closer ones say the same thing twice
constexpr std::size_t kFewest = 4;        // particles along a side

/// As one would give it on the command line, to the last bit.
std::string asOption(const V3d& p) {
  return fmt::format("{},{},{}", p.x, p.y, p.z);
}

void checkPatchArguments(const std::array<V3d, 4>& corners, double height,
                         const PatchOptions& options) {
  if (!(height > 0) || !std::isfinite(height)) {
    throw UsageError(fmt::format("{}: the height is {}; give a positive length", kPatch, height));
  }
  if (options.levels < 2) {
    throw UsageError(
        fmt::format("{}: {} levels of particles; give at least 2", kPatch, options.levels));
  }
  if (!(options.spacing >= 0) || !std::isfinite(options.spacing)) {
    throw UsageError(fmt::format("{}: the spacing of particles is {}; give a positive length",
                                 kPatch, options.spacing));
  }
  for (const V3d& c : corners) {
    if (!std::isfinite(c.x) || !std::isfinite(c.y) || !std::isfinite(c.z)) {
      throw UsageError(fmt::format("{}: the corner {} is not finite", kPatch, asOption(c)));
    }
  }
}

void checkApart(const NarrowBand& base, const std::array<V3d, 4>& corners) {
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j) {
      const double distance = (corners[i] - corners[j]).length();
      if (distance < 2 * base.voxelSize()) {
        throw InvalidInput(fmt::format(
            "{}: corners {} and {} both fall on {}, {:.3g} voxels apart; a patch needs sides of at "
            "least two voxels",
            kPatch, i, j, asOption(corners[i]), distance / base.voxelSize()));
      }
    }
}

/// Positive when the corners run anticlockwise seen from outside: twice the area that each corner
/// spans with its neighbours, against the normal there.
double handedness(const NarrowBand& base, const std::array<V3d, 4>& corners) {
  const SurfaceField field(base);
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const V3d &p = corners[i], &next = corners[(i + 1) % 4], &last = corners[(i + 3) % 4];
    sum += (next - p).cross(last - p).dot(field.normal(p));
  }
  return sum;
}

/// @return true when mirrored
bool checkOrientation(const NarrowBand& base, const std::array<V3d, 4>& given,
                      const std::array<V3d, 4>& corners, bool mirror) {
  const double area = handedness(base, corners);
  double scale = 0;
  for (std::size_t i = 0; i < 4; ++i) scale += (corners[(i + 1) % 4] - corners[i]).length2();
  if (std::abs(area) < 1e-3 * scale) {
    throw InvalidInput(fmt::format(
        "{}: the corners {}, {}, {} and {} span no area; move one of them", kPatch,
        asOption(corners[0]), asOption(corners[1]), asOption(corners[2]), asOption(corners[3])));
  }
  if (area < 0 && !mirror) {
    throw UsageError(fmt::format(
        "{}: the corners run clockwise seen from outside, which would mirror the "
        "texture; give them as "
        "\"{} {} {} {}\" or ask for --mirror",
        kPatch, asOption(given[0]), asOption(given[3]), asOption(given[2]), asOption(given[1])));
  }
  return area < 0;
}

struct LevelSides {
  double height;
  PatchSides sides;
  double uLength, vLength;
};

/// (u/s + 1)(v/s + 1), summed over the levels.
double particlesAt(double spacing, const std::vector<LevelSides>& levels) {
  double count = 0;
  for (const LevelSides& level : levels)
    count += (level.uLength / spacing + 1) * (level.vLength / spacing + 1);
  return count;
}

/// The spacing that makes kParticleBudget particles of all levels together.
double chooseSpacing(const NarrowBand& base, const std::vector<LevelSides>& levels) {
  double sum = 0, product = 0;
  for (const LevelSides& level : levels) {
    sum += level.uLength + level.vLength;
    product += level.uLength * level.vLength;
  }
  const double count = static_cast<double>(levels.size());
  const double rest = std::max(kParticleBudget, 16 * count) - count;
  const double spacing = (sum + std::sqrt(sum * sum + 4 * rest * product)) / (2 * rest);
  return std::max(spacing, kSmallestSpacing * base.voxelSize());
}

std::size_t countAlong(double length, double spacing) {
  return std::max(kFewest, static_cast<std::size_t>(std::lround(length / spacing)) + 1);
}

double meanSpacing(const Patch& patch) {
  double sum = 0, count = 0;
  for (const ParticleLevel& level : patch.levels)
    for (std::size_t j = 0; j < level.rows; ++j)
      for (std::size_t i = 0; i < level.columns; ++i) {
        if (i > 0) sum += (level.at(i, j) - level.at(i - 1, j)).length(), ++count;
        if (j > 0) sum += (level.at(i, j) - level.at(i, j - 1)).length(), ++count;
      }
  return sum / count;
}

void checkParticleCount(double count, double spacing, const PatchOptions& options) {
  levelset::requireMemory(count * 3 * sizeof(V3d), options.maxMemory, kPatch);
  constexpr double kMostParticles = 1e6;
  if (count > kMostParticles) {
    throw levelset::ResourceLimit(fmt::format(
        "{}: a spacing of {:.6g} would make {:.3g} particles, more than {:.0g}; take a wider "
        "one",
        kPatch, spacing, count, kMostParticles));
  }
}

LevelSides makeLevelSides(const NarrowBand& band, double height,
                          const std::array<V3d, 4>& corners) {
  LevelSides level{height, makeSides(band, height, corners), 0, 0};
  level.uLength = sideLengthU(level.sides);
  level.vLength = sideLengthV(level.sides);
  return level;
}

/// Distances throughout patch space, from the sides on the surface.
NarrowBand sweepAbove(const NarrowBand& base, const LevelSides& surface, double height,
                      const PatchOptions& options) {
  std::vector<V3d> border;
  for (const std::vector<V3d>& side : surface.sides)
    border.insert(border.end(), side.begin(), side.end());
  // Inner particles may lie outside the box of the sides: a patch may bulge by a quarter of its
  // width.
  const double bulge = 0.25 * std::min(surface.uLength, surface.vLength);
  return sweepPatchSpace(base, border, bulge, height,
                         {.maxMemory = options.maxMemory,
                          .progress = levelset::subProgress(options.progress, 0.1, 0.5)});
}

}  // namespace

std::size_t Patch::particleCount() const {
  std::size_t count = 0;
  for (const ParticleLevel& level : levels) count += level.positions.size();
  return count;
}

PatchResult makePatch(const NarrowBand& base, const std::array<V3d, 4>& corners, double height,
                      const PatchOptions& options) {
  checkPatchArguments(corners, height, options);
  PatchResult result;
  Patch& patch = result.patch;
  PatchReport& report = result.report;

  // === The quadrilateral on the surface
  for (std::size_t i = 0; i < 4; ++i) {
    patch.corners[i] = closestSurfacePoint(base, corners[i], kPatch);
    report.projectionDistance =
        std::max(report.projectionDistance, (patch.corners[i] - corners[i]).length());
  }
  checkApart(base, patch.corners);
  patch.mirrored = checkOrientation(base, corners, patch.corners, options.mirror);
  patch.height = height;
  std::vector<LevelSides> sides = {makeLevelSides(base, 0, patch.corners)};
  if (options.spacing > 0)
    checkParticleCount(particlesAt(options.spacing, sides) * static_cast<double>(options.levels),
                       options.spacing, options);
  levelset::report(options.progress, 0.1, kPatch);

  // === Scheme B: sides of each level from its own advected corners …
  const NarrowBand space = sweepAbove(base, sides.front(), height, options);
  std::array<V3d, 4> advected = patch.corners;
  for (std::size_t k = 1; k < options.levels; ++k) {
    const double level = height * static_cast<double>(k) / static_cast<double>(options.levels - 1);
    advectCorners(space, sides.back().height, level, advected);
    sides.push_back(makeLevelSides(space, level, advected));
  }

  // … and a complete patch between them
  const double spacing = options.spacing > 0 ? options.spacing : chooseSpacing(base, sides);
  for (const LevelSides& border : sides) {
    ParticleLevel level;
    level.height = border.height;
    level.w = border.height / height;
    level.columns = countAlong(border.uLength, spacing);
    level.rows = countAlong(border.vLength, spacing);
    const bool isSurface = patch.levels.empty();
    const Relaxation relaxation = fillLevel(isSurface ? base : space, space, border.sides, level);
    report.relaxIterations += relaxation.iterations;
    report.isRelaxed = report.isRelaxed && relaxation.isConverged;
    patch.levels.push_back(std::move(level));
    const double done =
        static_cast<double>(patch.levels.size()) / static_cast<double>(sides.size());
    levelset::report(options.progress, 0.5 + 0.5 * done, kPatch);
  }
  patch.spacing = meanSpacing(patch);
  report.uLength = sides.front().uLength;
  report.vLength = sides.front().vLength;
  report.cellAreaVariation = cellAreaVariation(patch.levels.front());
  return result;
}

std::array<V3d, 4> cornersAround(const NarrowBand& base, const V3d& point, double a, double b,
                                 double rotation) {
  for (const double size : {a, b}) {
    if (!(size > 0) || !std::isfinite(size)) {
      throw UsageError(fmt::format("{}: the size is {}; give two positive lengths", kPatch, size));
    }
  }
  if (!std::isfinite(rotation)) {
    throw UsageError(fmt::format("{}: the rotation is {}; give an angle", kPatch, rotation));
  }
  const V3d center = closestSurfacePoint(base, point, kPatch);
  const SurfaceField field(base);
  const V3d normal = field.normal(center);
  const V3d reference = std::abs(normal.x) < 0.9 ? V3d(1, 0, 0) : V3d(0, 1, 0);
  const V3d east = (reference - normal * normal.dot(reference)).normalized();
  const V3d north = normal.cross(east);
  const V3d u = east * std::cos(rotation) + north * std::sin(rotation), v = normal.cross(u);
  constexpr std::array<std::array<double, 2>, 4> kSigns = {{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  std::array<V3d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const V3d way = u * (0.5 * a * kSigns[i][0]) + v * (0.5 * b * kSigns[i][1]);
    corners[i] = walkStraight(field, center, way, way.length());
  }
  return corners;
}

}  // namespace mapping
