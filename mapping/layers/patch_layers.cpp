#include "mapping/layers/patch_layers.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "mapping/layers/layer_resampling.h"
#include "mapping/layers/layer_schemes.h"
#include "mapping/layers/relaxation.h"
#include "mapping/patches/patch_space.h"
#include "mapping/surface/surface_field.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::NarrowBand;
using levelset::UsageError;

// The linear system of an RBF map is dense: n³ / 3 operations and n² numbers for n particles.
// Solving for this many particles takes a second or two. They are five to ten voxels apart on a
// patch of 100 to 200 voxels.
constexpr double kParticleBudget = 2000;
constexpr double kSmallestSpacing = 1.5;  // voxels; closer particles carry no more information
constexpr std::size_t kFewest = 4;        // least number of particles along a side
constexpr double kMostParticles = 1e6;

/// Middle of a layer, and the normal and the direction of u at that point.
struct Axis {
  V3d origin, normal, u;
};

Axis axisOf(const NarrowBand& base, const ParticleLayer& surface) {
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

std::vector<ParticleLayer> transformed(const NarrowBand& base, std::vector<ParticleLayer> layers,
                                       double height, const LayerTransform& transform) {
  if (transform.isIdentity()) return layers;
  const Axis axis = axisOf(base, layers.front());
  transformLayers(layers, transform, axis.origin, axis.normal, axis.u, height);
  return layers;
}

struct Counts {
  std::size_t columns, rows;
};

/// Calls refit(layer, counts) for each layer above the surface whose particle spacing along u or v
/// differs by over a quarter from that on the surface. If no spacing is requested and
/// chooseSpacing() for all layers gives more than the spacing on the surface, that value is the
/// reference.
/// @throws ResourceLimit as checkParticleCount
template <typename Refit>
void keepDensity(const NarrowBand& base, std::vector<ParticleLayer>& layers, double height,
                 const PatchOptions& options, const Refit& refit) {
  constexpr double kTolerated = 1.25;
  std::vector<LayerSize> sizes;
  for (const ParticleLayer& layer : transformed(base, layers, height, options.transform))
    sizes.push_back(sizeOf(layer));
  const ParticleLayer& surface = layers.front();
  const auto across = static_cast<double>(surface.columns - 1),
             up = static_cast<double>(surface.rows - 1);
  const double spacing = 0.5 * (sizes[0].u / across + sizes[0].v / up);
  const double wider =
      options.spacing > 0 ? 1 : std::max(1.0, chooseSpacing(base.voxelSize(), sizes) / spacing);
  const auto count = [&](double cells, double stretch) {
    const double share = stretch / wider;
    const bool isFit = share <= kTolerated && share * kTolerated >= 1;
    return countAlong(isFit ? cells : cells * share, 1);
  };
  std::vector<Counts> counts;
  double total = 0;
  for (const LayerSize& size : sizes) {
    const Counts n = {count(across, size.u / sizes[0].u), count(up, size.v / sizes[0].v)};
    total += static_cast<double>(n.columns + 2) * static_cast<double>(n.rows + 2);
    counts.push_back(n);
  }
  checkParticleCount(total, spacing, options);
  for (std::size_t k = 1; k < layers.size(); ++k)
    if (counts[k].columns != layers[k].columns || counts[k].rows != layers[k].rows)
      refit(layers[k], counts[k]);
}

}  // namespace

std::string pointAsOption(const V3d& p) {
  return fmt::format("{},{},{}", p.x, p.y, p.z);
}

void checkPatchOptions(double height, const PatchOptions& options) {
  if (!(height > 0) || !std::isfinite(height)) {
    throw UsageError(fmt::format("the height is {}; give a positive length", height));
  }
  if (options.layers < 2) {
    throw UsageError(fmt::format(
        "the patch has {} layers of particles; give --layers of at least 2", options.layers));
  }
  if (!(options.spacing >= 0) || !std::isfinite(options.spacing)) {
    throw UsageError(
        fmt::format("the spacing of particles is {}; give a positive length", options.spacing));
  }
  const auto [across, up] = options.cells;
  if ((across == 0) != (up == 0) || (across > 0 && std::min(across, up) < 3)) {
    throw UsageError(fmt::format(
        "the patch has {} by {} cells; give at least 3 along u and along v", across, up));
  }
  const LayerTransform& t = options.transform;
  if (!std::isfinite(t.twist) || !std::isfinite(t.bend) || !(t.taper > 0) ||
      !std::isfinite(t.taper)) {
    throw UsageError(
        fmt::format("twist {}, taper {} and bend {} are out of range; give finite angles and a "
                    "positive scale as the taper",
                    t.twist, t.taper, t.bend));
  }
  if (options.scheme != LayerScheme::Spline && (!options.spline.empty() || options.fade)) {
    throw UsageError("--spline and --fade require --particles spline");
  }
  if (options.scheme != LayerScheme::Reduced && (options.parallel || !options.directions.empty())) {
    throw UsageError(
        "directions of the corners (--directions, --parallel) require --particles reduced");
  }
  if (options.parallel && !options.directions.empty()) {
    throw UsageError("--directions and --parallel exclude each other; give one of them");
  }
  if (options.directions.size() > 1 && options.directions.size() != 4) {
    throw UsageError(fmt::format("{} directions are given; give one for all corners, or four",
                                 options.directions.size()));
  }
  for (const V3d& d : options.directions) {
    if (!std::isfinite(d.x) || !std::isfinite(d.y) || !std::isfinite(d.z) || !(d.length() > 0)) {
      throw UsageError(fmt::format("the direction {} is not a vector of finite, nonzero length",
                                   pointAsOption(d)));
    }
  }
  for (const V3d& p : options.spline) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      throw UsageError(fmt::format("the spline's point {} is not finite; give finite coordinates",
                                   pointAsOption(p)));
    }
  }
  for (std::size_t side = 0; side < 4; ++side)
    for (const V3d& p : options.sides[side]) {
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
        throw UsageError(
            fmt::format("the point {} of side {} is not finite; give finite coordinates",
                        pointAsOption(p), side));
      }
    }
}

LayerSize sizeOf(const ParticleLayer& layer) {
  LayerSize size{0, 0};
  for (std::size_t j = 0; j < layer.rows; ++j)
    for (std::size_t i = 0; i < layer.columns; ++i) {
      if (i > 0) size.u += (layer.at(i, j) - layer.at(i - 1, j)).length();
      if (j > 0) size.v += (layer.at(i, j) - layer.at(i, j - 1)).length();
    }
  size.u /= static_cast<double>(layer.rows);
  size.v /= static_cast<double>(layer.columns);
  return size;
}

double particlesAt(double spacing, std::span<const LayerSize> layers) {
  double count = 0;
  for (const LayerSize& layer : layers) count += (layer.u / spacing + 3) * (layer.v / spacing + 3);
  return count;
}

double chooseSpacing(double voxelSize, std::span<const LayerSize> layers, std::size_t times) {
  double sum = 0, product = 0;
  for (const LayerSize& layer : layers) {
    sum += layer.u + layer.v;
    product += layer.u * layer.v;
  }
  sum *= static_cast<double>(times);
  product *= static_cast<double>(times);
  const double count = static_cast<double>(layers.size() * times);
  const double rest = std::max(kParticleBudget, 36 * count) - 9 * count;
  const double spacing = (3 * sum + std::sqrt(9 * sum * sum + 4 * rest * product)) / (2 * rest);
  return std::max(spacing, kSmallestSpacing * voxelSize);
}

std::size_t countAlong(double length, double spacing) {
  const double cells = std::round(length / spacing);
  if (!(cells < kMostParticles)) {
    throw levelset::ResourceLimit(
        fmt::format("{:.3g} particles along a side exceed the limit of {:.0g}; give a larger "
                    "--spacing or less taper",
                    cells, kMostParticles));
  }
  return std::max(kFewest, static_cast<std::size_t>(cells) + 1);
}

void checkParticleCount(double count, double spacing, const PatchOptions& options) {
  levelset::requireMemory(count * 3 * sizeof(V3d), options.maxMemory);
  if (!(count <= kMostParticles)) {
    throw levelset::ResourceLimit(
        fmt::format("a spacing of {:.6g} gives {:.3g} particles, more than the limit of "
                    "{:.0g}; give a larger --spacing",
                    spacing, count, kMostParticles));
  }
}

NarrowBand sweepAbove(const NarrowBand& base, std::span<const V3d> outline, const LayerSize& size,
                      double height, const PatchOptions& options, double lean) {
  // The surface between the sides of a patch may leave the bounding box of the sides: it may bulge
  // by a quarter of the patch's width.
  const double bulge = 0.25 * std::min(size.u, size.v) + lean;
  return sweepPatchSpace(base, outline, bulge, height,
                         {.shared = options.space,
                          .maxMemory = options.maxMemory,
                          .progress = levelset::subProgress(options.progress, 0.1, 0.5)});
}

std::vector<ParticleLayer> layersFromSurface(const NarrowBand& base, const ParticleLayer& surface,
                                             std::span<const V3d> outline, const LayerSize& size,
                                             double height, const PatchOptions& options,
                                             PatchReport& report) {
  if (options.scheme == LayerScheme::Conforming) {
    const NarrowBand space = sweepAbove(base, outline, size, height, options);
    std::vector<ParticleLayer> layers = conformingLayers(space, surface, height, options.layers);
    if (options.cells[0] == 0) {
      keepDensity(base, layers, height, options, [&](ParticleLayer& layer, const Counts& n) {
        // Resampled particles start on the surface like the original particles, even where the
        // surface has relief between them.
        ParticleLayer start = withCounts(surface, n.columns, n.rows);
        const SurfaceField field(base);
        for (V3d& p : start.positions) (void)field.project(p, 0);
        for (V3d& p : start.rim) (void)field.project(p, 0);
        layer = conformingLayer(space, start, height, layer.w);
      });
    }
    return layers;
  }
  const Axis axis = axisOf(base, surface);
  std::vector<V3d> points = {axis.origin};
  points.insert(points.end(), options.spline.begin(), options.spline.end());
  if (options.spline.empty()) points.push_back(axis.origin + axis.normal * height);
  for (std::size_t i = 1; i < points.size(); ++i) {
    if ((points[i] - points[i - 1]).length() < 1e-6 * base.voxelSize()) {
      throw UsageError(fmt::format("the spline has two equal points at {}; leave one out{}",
                                   pointAsOption(points[i]),
                                   i == 1 ? ", because it starts at the patch's centre" : ""));
    }
  }
  const SweepCurve curve(points);
  if (height > curve.length() * (1 + 1e-9)) {
    throw UsageError(fmt::format(
        "the height is {:.6g} but the spline is only {:.6g} long; use a lower height or "
        "a longer spline",
        height, curve.length()));
  }
  SplineSweep sweep = splineLayers(surface, curve, height, options.layers, options.fade);
  report.slowed = sweep.slowed;
  if (options.cells[0] == 0) {
    keepDensity(base, sweep.layers, height, options, [](ParticleLayer& layer, const Counts& n) {
      layer = withCounts(layer, n.columns, n.rows);
    });
  }
  return std::move(sweep.layers);
}

void requireCovered(const NarrowBand& base, const ParticleLayer& layer) {
  if (!base.isOpenSurface()) return;
  const SurfaceField field(base);
  const auto require = [&](const V3d& place) {
    V3d p = place;
    if (field.project(p, 0) && !field.isBeyondBorder(p)) return;
    throw levelset::InvalidInput(fmt::format(
        "the surface breaks off at ({:.6g}, {:.6g}, {:.6g}), within the patch; move the patch "
        "away from the border and holes of the surface",
        place.x, place.y, place.z));
  };
  for (const V3d& p : layer.positions) require(p);
  // Distance between samples, voxels. In a slit four voxels wide, at least two samples then lie
  // more than a voxel beyond the border of the surface.
  constexpr double kStepVoxels = 1;
  const auto steps = [&](const V3d& along) {
    return std::ceil(along.length() / (kStepVoxels * base.voxelSize()));
  };
  for (std::size_t j = 0; j + 1 < layer.rows; ++j)
    for (std::size_t i = 0; i + 1 < layer.columns; ++i) {
      const V3d &a = layer.at(i, j), &b = layer.at(i + 1, j), &c = layer.at(i, j + 1),
                &d = layer.at(i + 1, j + 1);
      const double across = steps(b - a), up = steps(c - a);
      for (double s = 0.5; s < across; ++s)
        for (double t = 0.5; t < up; ++t) {
          const double u = s / across, v = t / up;
          require((a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v);
        }
    }
}

void finishPatch(const NarrowBand& base, const PatchOptions& options, Patch& patch,
                 PatchReport& report) {
  requireCovered(base, patch.layers.front());
  patch.layers = transformed(base, std::move(patch.layers), patch.height, options.transform);
  patch.spacing = meanSpacing(patch);
  patch.scheme = options.scheme;
  report.cellAreaVariation = cellAreaVariation(patch.layers.front());
}

}  // namespace mapping
