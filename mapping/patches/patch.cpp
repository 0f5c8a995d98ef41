#include "mapping/patches/patch.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "mapping/patches/level_schemes.h"
#include "mapping/patches/particle_levels.h"
#include "mapping/patches/patch_space.h"
#include "mapping/surface/closest_point.h"
#include "mapping/surface/geodesic.h"
#include "mapping/surface/surface_field.h"

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
  const LevelTransform& t = options.transform;
  if (!std::isfinite(t.twist) || !std::isfinite(t.bend) || !(t.taper > 0) ||
      !std::isfinite(t.taper)) {
    throw UsageError(
        fmt::format("{}: twist {}, taper {} and bend {}; give two angles and a positive scale",
                    kPatch, t.twist, t.taper, t.bend));
  }
  if (options.scheme != LevelScheme::Spline && (!options.spline.empty() || options.fade)) {
    throw UsageError(
        fmt::format("{}: a spline and its fading go with the spline scheme only", kPatch));
  }
  for (const V3d& p : options.spline) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      throw UsageError(fmt::format("{}: the spline's point {} is not finite", kPatch, asOption(p)));
    }
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

/// (u/s + 3)(v/s + 3), rims and all, summed over the levels.
double particlesAt(double spacing, const std::vector<LevelSides>& levels) {
  double count = 0;
  for (const LevelSides& level : levels)
    count += (level.uLength / spacing + 3) * (level.vLength / spacing + 3);
  return count;
}

/// The spacing that makes kParticleBudget particles of all levels together.
/// @param times  how often each level comes
double chooseSpacing(const NarrowBand& base, const std::vector<LevelSides>& levels,
                     std::size_t times = 1) {
  double sum = 0, product = 0;
  for (const LevelSides& level : levels) {
    sum += level.uLength + level.vLength;
    product += level.uLength * level.vLength;
  }
  sum *= static_cast<double>(times);
  product *= static_cast<double>(times);
  const double count = static_cast<double>(levels.size() * times);
  const double rest = std::max(kParticleBudget, 36 * count) - 9 * count;
  const double spacing = (3 * sum + std::sqrt(9 * sum * sum + 4 * rest * product)) / (2 * rest);
  return std::max(spacing, kSmallestSpacing * base.voxelSize());
}

std::size_t countAlong(double length, double spacing) {
  return std::max(kFewest, static_cast<std::size_t>(std::lround(length / spacing)) + 1);
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

std::array<V3d, 4> cornersOf(const LevelSides& level) {
  return {level.sides[0].front(), level.sides[0].back(), level.sides[2].back(),
          level.sides[2].front()};
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

/// Counts by the spacing; positions between the sides.
ParticleLevel filledLevel(const NarrowBand& band, const NarrowBand& guide, const LevelSides& border,
                          double height, double spacing, PatchReport& report) {
  ParticleLevel level;
  level.height = border.height;
  level.w = border.height / height;
  level.columns = countAlong(border.uLength, spacing);
  level.rows = countAlong(border.vLength, spacing);
  const Relaxation relaxation = fillLevel(band, guide, border.sides, level);
  report.relaxIterations += relaxation.iterations;
  report.isRelaxed = report.isRelaxed && relaxation.isConverged;
  return level;
}

/// Scheme B: the sides of each level from its own advected corners, and a complete patch between
/// them.
std::vector<ParticleLevel> reducedLevels(const NarrowBand& base, std::vector<LevelSides> sides,
                                         double height, const PatchOptions& options,
                                         PatchReport& report) {
  const NarrowBand space = sweepAbove(base, sides.front(), height, options);
  std::array<V3d, 4> advected = cornersOf(sides.front());
  for (std::size_t k = 1; k < options.levels; ++k) {
    const double level = height * static_cast<double>(k) / static_cast<double>(options.levels - 1);
    advectCorners(space, sides.back().height, level, advected);
    sides.push_back(makeLevelSides(space, level, advected));
  }
  const double spacing = options.spacing > 0 ? options.spacing : chooseSpacing(base, sides);
  std::vector<ParticleLevel> levels;
  for (const LevelSides& border : sides) {
    levels.push_back(
        filledLevel(levels.empty() ? base : space, space, border, height, spacing, report));
    const double done = static_cast<double>(levels.size()) / static_cast<double>(sides.size());
    levelset::report(options.progress, 0.5 + 0.5 * done, kPatch);
  }
  return levels;
}

/// The middle of a level, and directions there.
struct Axis {
  V3d origin, normal, u;
};

Axis axisOf(const NarrowBand& base, const ParticleLevel& surface) {
  const std::size_t i = (surface.columns - 1) / 2, j = (surface.rows - 1) / 2;
  const std::size_t right = surface.columns / 2, above = surface.rows / 2;
  Axis axis;
  axis.origin =
      (surface.at(i, j) + surface.at(right, j) + surface.at(i, above) + surface.at(right, above)) /
      4.0;
  const SurfaceField field(base);
  (void)field.project(axis.origin, 0);
  axis.normal = field.normal(axis.origin);
  const V3d u = surface.at(i + 1, j) - surface.at(i, j);
  axis.u = (u - axis.normal * axis.normal.dot(u)).normalized();
  return axis;
}

/// Schemes A and C: one patch on the surface, whose particles travel.
std::vector<ParticleLevel> levelsFromSurface(const NarrowBand& base, const LevelSides& sides,
                                             double height, const PatchOptions& options,
                                             PatchReport& report) {
  const double spacing =
      options.spacing > 0 ? options.spacing : chooseSpacing(base, {sides}, options.levels);
  const ParticleLevel surface = filledLevel(base, base, sides, height, spacing, report);
  levelset::report(options.progress, 0.2, kPatch);
  if (options.scheme == LevelScheme::Conforming) {
    const NarrowBand space = sweepAbove(base, sides, height, options);
    return conformingLevels(space, surface, height, options.levels);
  }
  const Axis axis = axisOf(base, surface);
  std::vector<V3d> points = {axis.origin};
  points.insert(points.end(), options.spline.begin(), options.spline.end());
  if (options.spline.empty()) points.push_back(axis.origin + axis.normal * height);
  for (std::size_t i = 1; i < points.size(); ++i) {
    if ((points[i] - points[i - 1]).length() < 1e-6 * base.voxelSize()) {
      throw UsageError(fmt::format("{}: the spline stands still at {}; leave one point out{}",
                                   kPatch, asOption(points[i]),
                                   i == 1 ? ", it begins at the patch's centre by itself" : ""));
    }
  }
  const SweepCurve curve(points);
  if (height > curve.length() * (1 + 1e-9)) {
    throw UsageError(
        fmt::format("{}: the height is {:.6g} and the spline only {:.6g} long; lower the height or "
                    "lengthen the spline",
                    kPatch, height, curve.length()));
  }
  SplineSweep sweep = splineLevels(surface, curve, height, options.levels, options.fade);
  report.slowed = sweep.slowed;
  return std::move(sweep.levels);
}

}  // namespace

std::size_t Patch::particleCount() const {
  std::size_t count = 0;
  for (const ParticleLevel& level : levels) count += level.positions.size() + level.rim.size();
  return count;
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
  const double uLength = sides.front().uLength, vLength = sides.front().vLength;
  levelset::report(options.progress, 0.1, kPatch);

  // === Levels above it
  patch.levels = options.scheme == LevelScheme::Reduced
                     ? reducedLevels(base, std::move(sides), height, options, report)
                     : levelsFromSurface(base, sides.front(), height, options, report);
  if (!options.transform.isIdentity()) {
    const Axis axis = axisOf(base, patch.levels.front());
    transformLevels(patch.levels, options.transform, axis.origin, axis.normal, axis.u, height);
  }
  patch.spacing = meanSpacing(patch);
  report.uLength = uLength;
  report.vLength = vLength;
  report.cellAreaVariation = cellAreaVariation(patch.levels.front());
  return result;
}

V3d eastOf(const V3d& normal) {
  const V3d reference = std::abs(normal.x) < 0.9 ? V3d(1, 0, 0) : V3d(0, 1, 0);
  return (reference - normal * normal.dot(reference)).normalized();
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
  const V3d east = eastOf(normal);
  const V3d north = normal.cross(east);
  const V3d u = east * std::cos(rotation) + north * std::sin(rotation), v = normal.cross(u);
  constexpr std::array<std::array<double, 2>, 4> kSigns = {{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  std::array<V3d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const V3d way = u * (0.5 * a * kSigns[i][0]) + v * (0.5 * b * kSigns[i][1]);
    const std::optional<V3d> corner = walkStraight(field, 0, center, way, way.length());
    if (!corner) {
      throw InvalidInput(fmt::format(
          "{}: the surface breaks off on the way from {} to corner {}; choose a smaller "
          "size or give the corners",
          kPatch, asOption(center), i));
    }
    corners[i] = *corner;
  }
  return corners;
}

}  // namespace mapping
