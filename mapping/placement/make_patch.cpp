#include "mapping/placement/make_patch.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "mapping/layers/particle_layers.h"
#include "mapping/layers/patch_layers.h"
#include "mapping/surface/geodesic.h"
#include "mapping/surface/surface_field.h"
#include "mapping/surface/surface_projection.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::UsageError;

void checkPatchArguments(const std::array<V3d, 4>& corners, double height,
                         const PatchOptions& options) {
  checkPatchOptions(height, options);
  for (const V3d& c : corners) {
    if (!std::isfinite(c.x) || !std::isfinite(c.y) || !std::isfinite(c.z))
      throw UsageError(
          fmt::format("the corner {} is not finite; give finite coordinates", pointAsOption(c)));
  }
}

struct Outline {
  std::array<V3d, 4> corners;
  /// Points through which the sides pass between the corners, in the order of PatchOptions::sides.
  PatchSides between;
};

void checkApart(const NarrowBand& base, const Outline& outline) {
  const std::array<V3d, 4>& corners = outline.corners;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j) {
      const double distance = (corners[i] - corners[j]).length();
      if (distance < 2 * base.voxelSize()) {
        throw InvalidInput(
            fmt::format("corners {} and {} both project to {}, {:.3g} voxels apart; sides must "
                        "be at least two voxels long",
                        i, j, pointAsOption(corners[i]), distance / base.voxelSize()));
      }
    }
  constexpr std::array<std::array<std::size_t, 2>, 4> kEnds = {{{0, 1}, {1, 2}, {3, 2}, {0, 3}}};
  for (std::size_t side = 0; side < 4; ++side) {
    std::vector<V3d> knots = {corners[kEnds[side][0]]};
    knots.insert(knots.end(), outline.between[side].begin(), outline.between[side].end());
    knots.push_back(corners[kEnds[side][1]]);
    for (std::size_t i = 1; i < knots.size(); ++i) {
      if ((knots[i] - knots[i - 1]).length() >= 2 * base.voxelSize()) continue;
      throw InvalidInput(
          fmt::format("two points of side {} both project to {}; leave one out (the corners "
                      "are already part of the side)",
                      side, pointAsOption(knots[i])));
    }
  }
}

/// Twice the area spanned at each corner with its neighbours, projected on the normal at the
/// corner, and summed. Positive if the corners are in anticlockwise order seen from outside.
double handedness(const NarrowBand& base, const std::array<V3d, 4>& corners) {
  const SurfaceField field(base);
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const V3d &p = corners[i], &next = corners[(i + 1) % 4], &last = corners[(i + 3) % 4];
    sum += (next - p).cross(last - p).dot(field.normal(p));
  }
  return sum;
}

/// Positive if the corners are in anticlockwise order seen from outside. Unlike handedness(), it
/// uses the directions in which the sides leave the corners. So it also works for a patch wrapped
/// around an edge, whose corners lie above each other.
double handednessOfSides(const NarrowBand& base, const PatchSides& sides) {
  const SurfaceField field(base);
  // Direction in which a side leaves its first or last point, over the nearest tenth of its length.
  const auto leaving = [](const std::vector<V3d>& side, bool isReversed) {
    const std::vector<V3d> tenths = sampleByArcLength(side, 11);
    return isReversed ? (tenths[9] - tenths[10]).normalized()
                      : (tenths[1] - tenths[0]).normalized();
  };
  const std::array<std::array<V3d, 2>, 4> offsets = {
      {{leaving(sides[0], false), leaving(sides[3], false)},
       {leaving(sides[1], false), leaving(sides[0], true)},
       {leaving(sides[2], true), leaving(sides[1], true)},
       {leaving(sides[3], true), leaving(sides[2], false)}}};
  const std::array<V3d, 4> corners = {sides[0].front(), sides[0].back(), sides[2].back(),
                                      sides[2].front()};
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i)
    sum += offsets[i][0].cross(offsets[i][1]).dot(field.normal(corners[i]));
  return sum;
}

/// Checks the orientation of the corners, seen from outside.
/// @return true if the patch is mirrored
bool checkOrientation(const NarrowBand& base, const std::array<V3d, 4>& given,
                      const PatchSides& sides, bool mirror) {
  const std::array<V3d, 4> corners = {sides[0].front(), sides[0].back(), sides[2].back(),
                                      sides[2].front()};
  constexpr double kFlat = 1e-3;
  double area = handedness(base, corners), scale = 0;
  for (std::size_t i = 0; i < 4; ++i) scale += (corners[(i + 1) % 4] - corners[i]).length2();
  if (std::abs(area) < kFlat * scale) area = handednessOfSides(base, sides) * scale / 4;
  if (std::abs(area) < kFlat * scale) {
    throw InvalidInput(fmt::format("the corners {}, {}, {} and {} span no area; move one of them",
                                   pointAsOption(corners[0]), pointAsOption(corners[1]),
                                   pointAsOption(corners[2]), pointAsOption(corners[3])));
  }
  if (area < 0 && !mirror) {
    throw UsageError(
        fmt::format("the corners are in clockwise order seen from outside, which mirrors the "
                    "texture; give them as \"{} {} {} {}\", or accept it with --mirror "
                    "(patch-grid: --mirrored)",
                    pointAsOption(given[0]), pointAsOption(given[3]), pointAsOption(given[2]),
                    pointAsOption(given[1])));
  }
  return area < 0;
}

struct LayerSides {
  double height;
  PatchSides sides;
  LayerSize size;
  [[nodiscard]] std::vector<V3d> outline() const {
    std::vector<V3d> all;
    for (const std::vector<V3d>& side : sides) all.insert(all.end(), side.begin(), side.end());
    return all;
  }
};

LayerSides makeLayerSides(const NarrowBand& band, double height, const std::array<V3d, 4>& corners,
                          const PatchSides& between, const PatchSides* below = nullptr,
                          const PatchSides* ground = nullptr) {
  LayerSides layer{height, makeSides(band, height, corners, between, below, ground), {}};
  layer.size = {sideLengthU(layer.sides), sideLengthV(layer.sides)};
  return layer;
}

/// Projects the corners and the given points on the sides to the surface.
Outline projectOutline(const NarrowBand& base, const std::array<V3d, 4>& corners,
                       const PatchOptions& options, PatchReport& report) {
  Outline outline;
  const auto projected = [&](const V3d& p) {
    const V3d foot = closestSurfacePoint(base, p);
    report.projectionDistance = std::max(report.projectionDistance, (foot - p).length());
    return foot;
  };
  for (std::size_t side = 0; side < 4; ++side) {
    outline.corners[side] = projected(corners[side]);
    for (const V3d& p : options.sides[side]) outline.between[side].push_back(projected(p));
  }
  return outline;
}

/// Builds a layer of particles between its sides. The numbers of columns and rows follow from the
/// spacing, unless options.cells gives them.
ParticleLayer filledLayer(const NarrowBand& band, const NarrowBand& guide, const LayerSides& border,
                          double height, double spacing, const PatchOptions& options,
                          PatchReport& report) {
  ParticleLayer layer;
  layer.height = border.height;
  layer.w = border.height / height;
  layer.columns = options.cells[0] > 0 ? options.cells[0] + 1 : countAlong(border.size.u, spacing);
  layer.rows = options.cells[1] > 0 ? options.cells[1] + 1 : countAlong(border.size.v, spacing);
  const Relaxation relaxation = fillLayer(band, guide, border.sides, layer);
  report.relaxIterations += relaxation.iterations;
  report.isRelaxed = report.isRelaxed && relaxation.isConverged;
  return layer;
}

/// Directions in which the corners and the given points on the sides rise; empty: along ∇φ.
struct Rise {
  std::vector<V3d> corners;
  std::array<std::vector<V3d>, 4> between;
  /// Largest sideways displacement of a corner per unit of height.
  double lean = 0;
};

/// Returns the unit direction in which each corner rises; empty if the corners rise along ∇φ.
/// @throws UsageError for a direction that hardly leads away from the surface
std::vector<V3d> cornerDirections(const NarrowBand& base, const Outline& outline,
                                  const PatchOptions& options) {
  const SurfaceField field(base);
  std::vector<V3d> directions = options.directions;
  if (options.parallel) {
    const V3d middle =
        (outline.corners[0] + outline.corners[1] + outline.corners[2] + outline.corners[3]) / 4.0;
    directions = {field.normal(closestSurfacePoint(base, middle))};
  }
  if (directions.size() == 1) directions.resize(4, directions.front());
  for (std::size_t i = 0; i < directions.size(); ++i) {
    directions[i].normalize();
    constexpr double kLeastCosine = 0.2;  // 78 degrees
    if (directions[i].dot(field.normal(outline.corners[i])) >= kLeastCosine) continue;
    throw UsageError(
        fmt::format("the direction {} hardly leads away from the surface at corner {}, {}; "
                    "give a direction less than 78 degrees from the normal",
                    pointAsOption(directions[i]), i, pointAsOption(outline.corners[i])));
  }
  return directions;
}

Rise riseOf(const NarrowBand& base, const Outline& outline, const PatchOptions& options) {
  Rise rise{.corners = cornerDirections(base, outline, options), .between = {}};
  if (rise.corners.empty()) return rise;
  const SurfaceField field(base);
  for (std::size_t i = 0; i < 4; ++i) {
    const double cosine = rise.corners[i].dot(field.normal(outline.corners[i]));
    rise.lean = std::max(rise.lean, std::sqrt(std::max(0.0, 1 - cosine * cosine)) / cosine);
  }
  constexpr std::array<std::array<std::size_t, 2>, 4> kEnds = {{{0, 1}, {1, 2}, {3, 2}, {0, 3}}};
  for (std::size_t side = 0; side < 4; ++side) {
    const V3d &first = rise.corners[kEnds[side][0]], &last = rise.corners[kEnds[side][1]];
    const std::size_t count = outline.between[side].size();
    for (std::size_t i = 1; i <= count; ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(count + 1);
      rise.between[side].push_back((first * (1 - share) + last * share).normalized());
    }
  }
  return rise;
}

/// Moves the corners and the given points on the sides of the patch from the layer at height `from`
/// to height `to`.
void raiseOutline(const NarrowBand& space, const Rise& rise, double from, double to,
                  Outline& outline) {
  if (rise.corners.empty()) {
    advectPoints(space, from, to, outline.corners);
    for (std::vector<V3d>& points : outline.between) advectPoints(space, from, to, points);
    return;
  }
  raisePoints(space, to, rise.corners, outline.corners);
  for (std::size_t side = 0; side < 4; ++side)
    raisePoints(space, to, rise.between[side], outline.between[side]);
}

/// Scheme B: builds the sides of each layer between its own corners, moved up from the layer below,
/// and fills each layer with particles between its sides.
std::vector<ParticleLayer> reducedLayers(const NarrowBand& base, Outline outline,
                                         std::vector<LayerSides> sides, double height,
                                         const PatchOptions& options, PatchReport& report) {
  const Rise rise = riseOf(base, outline, options);
  const NarrowBand space = sweepAbove(base, sides.front().outline(), sides.front().size, height,
                                      options, rise.lean * height);
  for (std::size_t k = 1; k < options.layers; ++k) {
    const double layer = height * static_cast<double>(k) / static_cast<double>(options.layers - 1);
    raiseOutline(space, rise, sides.back().height, layer, outline);
    sides.push_back(makeLayerSides(space, layer, outline.corners, outline.between,
                                   &sides.back().sides, &sides.front().sides));
  }
  // Sizes that the layers will have after LayerTransform::taper.
  const auto scaleOf = [&](const LayerSides& border) {
    return std::lerp(1.0, options.transform.taper, border.height / height);
  };
  std::vector<LayerSize> sizes;
  for (const LayerSides& border : sides)
    sizes.push_back({border.size.u * scaleOf(border), border.size.v * scaleOf(border)});
  const double spacing =
      options.spacing > 0 ? options.spacing : chooseSpacing(base.voxelSize(), sizes);
  if (options.cells[0] == 0) checkParticleCount(particlesAt(spacing, sizes), spacing, options);
  std::vector<ParticleLayer> layers;
  for (const LayerSides& border : sides) {
    layers.push_back(filledLayer(layers.empty() ? base : space, space, border, height,
                                 spacing / scaleOf(border), options, report));
    const double done = static_cast<double>(layers.size()) / static_cast<double>(sides.size());
    levelset::report(options.progress, 0.5 + 0.5 * done);
  }
  return layers;
}

/// Schemes A and C: builds the layer at w = 0, whose particles then move up to the other layers.
std::vector<ParticleLayer> travellingLayers(const NarrowBand& base, const LayerSides& sides,
                                            double height, const PatchOptions& options,
                                            PatchReport& report) {
  const double spacing = options.spacing > 0
                             ? options.spacing
                             : chooseSpacing(base.voxelSize(), {{sides.size}}, options.layers);
  const ParticleLayer surface = filledLayer(base, base, sides, height, spacing, options, report);
  levelset::report(options.progress, 0.2);
  return layersFromSurface(base, surface, sides.outline(), sides.size, height, options, report);
}

}  // namespace

PatchResult makePatch(const NarrowBand& base, const std::array<V3d, 4>& corners, double height,
                      const PatchOptions& options) {
  checkPatchArguments(corners, height, options);
  PatchResult result;
  Patch& patch = result.patch;
  PatchReport& report = result.report;

  // === The quadrilateral on the surface
  const Outline outline = projectOutline(base, corners, options, report);
  patch.corners = outline.corners;
  checkApart(base, outline);
  patch.height = height;
  std::vector<LayerSides> sides = {makeLayerSides(base, 0, patch.corners, outline.between)};
  patch.mirrored = checkOrientation(base, corners, sides.front().sides, options.mirror);
  const LayerSize size = sides.front().size;
  if (options.spacing > 0)
    checkParticleCount(particlesAt(options.spacing, {{size}}) * static_cast<double>(options.layers),
                       options.spacing, options);
  levelset::report(options.progress, 0.1);

  // === The layers above the surface
  patch.layers = options.scheme == LayerScheme::Reduced
                     ? reducedLayers(base, outline, std::move(sides), height, options, report)
                     : travellingLayers(base, sides.front(), height, options, report);
  report.uLength = size.u;
  report.vLength = size.v;
  finishPatch(base, options, patch, report);
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
      throw UsageError(fmt::format("the size is {}; give two positive lengths", size));
    }
  }
  if (!std::isfinite(rotation)) {
    throw UsageError(fmt::format("the rotation is {}; give an angle", rotation));
  }
  const V3d center = closestSurfacePoint(base, point);
  const SurfaceField field(base);
  const V3d normal = field.normal(center);
  const V3d east = eastOf(normal);
  const V3d north = normal.cross(east);
  const V3d u = east * std::cos(rotation) + north * std::sin(rotation), v = normal.cross(u);
  constexpr std::array<std::array<double, 2>, 4> kSigns = {{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  std::array<V3d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const V3d offset = u * (0.5 * a * kSigns[i][0]) + v * (0.5 * b * kSigns[i][1]);
    const std::optional<V3d> corner = walkStraight(field, 0, center, offset, offset.length());
    if (!corner) {
      throw InvalidInput(fmt::format(
          "the surface breaks off between {} and corner {}; use a smaller size, or give the "
          "corners",
          pointAsOption(center), i));
    }
    corners[i] = *corner;
  }
  return corners;
}

}  // namespace mapping
