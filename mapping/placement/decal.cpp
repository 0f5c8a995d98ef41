#include "mapping/placement/decal.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "levelset/error.h"
#include "mapping/layers/particle_layers.h"
#include "mapping/layers/patch_layers.h"
#include "mapping/placement/make_patch.h"
#include "mapping/surface/geodesic.h"
#include "mapping/surface/surface_field.h"
#include "mapping/surface/surface_projection.h"
#include "mapping/surface/surface_walk.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::UsageError;

// Sine of 1.1 degrees, the least angle between the given direction of u and the surface normal.
constexpr double kLeastTangent = 0.02;

/// Centre of the exponential map of one layer, and the unit directions of u and v at the centre.
struct DecalFrame {
  V3d center, u, v;
};

DecalFrame frameAt(const SurfaceField& field, const V3d& center, const V3d& direction,
                   bool isMirrored) {
  const V3d normal = field.normal(center);
  const double length = direction.length();
  const V3d tangent = direction - normal * normal.dot(direction);
  if (!(tangent.length() > kLeastTangent * length)) {
    throw UsageError(
        fmt::format("the direction {} is normal to the surface at {}, whose normal is "
                    "{:.3g},{:.3g},{:.3g}; give a direction along the surface",
                    pointAsOption(direction), pointAsOption(center), normal.x, normal.y, normal.z));
  }
  const V3d u = tangent.normalized(), v = normal.cross(u);
  return {center, u, isMirrored ? -v : v};
}

/// Coordinate of a particle along its row or column, from −1 to 1.
double signedShare(std::size_t i, std::size_t count) {
  return 2 * static_cast<double>(i) / static_cast<double>(count - 1) - 1;
}

/// Half side of the largest square around the centre that does not contain the particle, in the (u,
/// v) plane, world units.
double squareRadius(const ParticleLayer& layer, std::size_t index, double radius) {
  return radius * std::max(std::abs(signedShare(index % layer.columns, layer.columns)),
                           std::abs(signedShare(index / layer.columns, layer.rows)));
}

std::string smallerRadius(double radius) {
  return fmt::format("use a radius below {:.4g}", radius);
}

/// Traces a geodesic from the centre of the frame to each particle of the layer, and stores its
/// end.
/// @throws InvalidInput where the surface breaks off
void walkToParticles(const NarrowBand& band, const DecalFrame& frame, double radius,
                     ParticleLayer& layer) {
  layer.positions.assign(layer.columns * layer.rows, frame.center);
  // Length of each geodesic that could not be traced, world units.
  std::vector<double> missing(layer.positions.size(), 0);
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, layer.positions.size(), 16), [&](const auto& range) {
        const SurfaceField field(band);
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
          const V3d offset = frame.u * (radius * signedShare(n % layer.columns, layer.columns)) +
                             frame.v * (radius * signedShare(n / layer.columns, layer.rows));
          const double length = offset.length();
          if (length < 1e-9 * radius) continue;
          SurfaceWalk walk(field, layer.height, frame.center, offset);
          if (!walk.advance(length)) missing[n] = length - walk.walked();
          layer.positions[n] = walk.position();
        }
      });
  double most = std::numeric_limits<double>::infinity();
  std::size_t first = 0;
  for (std::size_t n = 0; n < missing.size(); ++n) {
    if (missing[n] == 0) continue;
    const double u = signedShare(n % layer.columns, layer.columns),
                 v = signedShare(n / layer.columns, layer.rows);
    const double length = radius * std::hypot(u, v);
    const double reached = squareRadius(layer, n, radius) * (1 - missing[n] / length);
    if (reached >= most) continue;
    most = reached;
    first = n;
  }
  if (!std::isfinite(most)) return;
  throw InvalidInput(fmt::format(
      "the surface breaks off or is too sharp to be followed at {}, {:.4g} from the centre {}; "
      "{}",
      pointAsOption(layer.positions[first]),
      radius * std::hypot(signedShare(first % layer.columns, layer.columns),
                          signedShare(first / layer.columns, layer.rows)) -
          missing[first],
      pointAsOption(frame.center), smallerRadius(most)));
}

std::vector<V3d> particleNormals(const NarrowBand& band, const ParticleLayer& layer) {
  const SurfaceField field(band);
  std::vector<V3d> normals;
  for (const V3d& p : layer.positions) normals.push_back(field.normal(p));
  return normals;
}

/// Projection of a cell's area vector onto the surface normals at its corners, up to a factor.
/// Without mirroring, it is positive if the cell is not inverted.
double facing(const ParticleLayer& layer, const std::vector<V3d>& normals, std::size_t column,
              std::size_t row) {
  const std::size_t a = row * layer.columns + column, b = a + 1, c = a + layer.columns, d = c + 1;
  const V3d area =
      (layer.positions[d] - layer.positions[a]).cross(layer.positions[c] - layer.positions[b]);
  return area.dot(normals[a] + normals[b] + normals[c] + normals[d]);
}

/// Defect of a layer that is nearest to its centre, and half the side of the largest square without
/// it, world units.
struct Trouble {
  double radius = std::numeric_limits<double>::infinity();
  V3d place{0};
  /// Part of the message after "the decal". Its {} is replaced by `place`; advice on the radius
  /// follows it.
  const char* sentence = "";
  void note(double at, const V3d& where, const char* what) {
    if (at < radius) *this = {at, where, what};
  }
};

/// Finds cells that are inverted, or that pass through the solid because it is thinner than a cell.
void findFolds(const ParticleLayer& layer, const std::vector<V3d>& normals, double radius,
               bool isMirrored, Trouble& trouble) {
  constexpr double kOpposite = -0.5;
  for (std::size_t j = 0; j + 1 < layer.rows; ++j)
    for (std::size_t i = 0; i + 1 < layer.columns; ++i) {
      const std::size_t a = j * layer.columns + i;
      double at = 0;
      for (const std::size_t n : {a, a + 1, a + layer.columns, a + layer.columns + 1})
        at = std::max(at, squareRadius(layer, n, radius));
      const bool isOpposite = normals[a].dot(normals[a + 1]) < kOpposite ||
                              normals[a].dot(normals[a + layer.columns]) < kOpposite;
      if (isOpposite) {
        trouble.note(
            at, layer.positions[a],
            "goes around a part at {} that is thinner than its particle spacing; use a smaller "
            "--spacing, or ");
      }
      const double area = facing(layer, normals, i, j);
      if ((isMirrored ? -area : area) <= 0) {
        trouble.note(at, layer.positions[a],
                     "folds at {}, where geodesics from its centre cross; ");
      }
    }
}

/// Finds particles that nearly coincide but are at least kNeighbours rows or columns apart in the
/// layer.
void findOverlaps(const ParticleLayer& layer, const std::vector<V3d>& normals, double radius,
                  Trouble& trouble) {
  constexpr double kNear = 0.75;  // largest distance of coinciding particles, particle spacings
  constexpr long kNeighbours = 3;
  const double spacing = 2 * radius / static_cast<double>(layer.columns - 1);
  using Bucket = std::tuple<long, long, long>;
  const auto cellOf = [&](const V3d& p) {
    return Bucket(std::lround(p.x / spacing), std::lround(p.y / spacing),
                  std::lround(p.z / spacing));
  };
  std::map<Bucket, std::vector<std::size_t>> cells;
  for (std::size_t n = 0; n < layer.positions.size(); ++n)
    cells[cellOf(layer.positions[n])].push_back(n);
  const auto look = [&](std::size_t n, std::size_t m) {
    const auto apart = [](std::size_t x, std::size_t y) {
      return std::abs(static_cast<long>(x) - static_cast<long>(y));
    };
    if (std::max(apart(n % layer.columns, m % layer.columns),
                 apart(n / layer.columns, m / layer.columns)) < kNeighbours)
      return;
    if ((layer.positions[n] - layer.positions[m]).length() > kNear * spacing ||
        normals[n].dot(normals[m]) < 0)
      return;
    trouble.note(std::max(squareRadius(layer, n, radius), squareRadius(layer, m, radius)),
                 layer.positions[n], "overlaps itself at {}; ");
  };
  for (std::size_t n = 0; n < layer.positions.size(); ++n) {
    const auto [x, y, z] = cellOf(layer.positions[n]);
    for (int k = 0; k < 27; ++k) {
      const auto found = cells.find({x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1});
      if (found == cells.end()) continue;
      for (const std::size_t m : found->second)
        if (m > n) look(n, m);
    }
  }
}

/// Checks that a layer is a valid part of a decal.
/// @throws InvalidInput if the layer folds, overlaps itself or passes through the solid
void requireSound(const NarrowBand& band, const ParticleLayer& layer, double radius,
                  bool isMirrored) {
  const std::vector<V3d> normals = particleNormals(band, layer);
  Trouble trouble;
  findFolds(layer, normals, radius, isMirrored, trouble);
  findOverlaps(layer, normals, radius, trouble);
  if (!std::isfinite(trouble.radius)) return;
  throw InvalidInput(fmt::format(
      "the decal {}{}", fmt::format(fmt::runtime(trouble.sentence), pointAsOption(trouble.place)),
      smallerRadius(0.95 * trouble.radius)));
}

/// Builds one layer: the exponential map on φ = height around the centre of the frame.
ParticleLayer decalLayer(const NarrowBand& band, const DecalFrame& frame, double radius,
                         double height, double w, std::size_t count, bool isMirrored) {
  ParticleLayer layer;
  layer.columns = layer.rows = count;
  layer.w = w;
  layer.height = height;
  walkToParticles(band, frame, radius, layer);
  requireSound(band, layer, radius, isMirrored);
  addRim(band, layer);
  return layer;
}

/// Geodesics from the centre to the middles of the sides.
std::vector<std::vector<V3d>> spokes(const NarrowBand& band, const DecalFrame& frame,
                                     double radius) {
  const SurfaceField field(band);
  std::vector<std::vector<V3d>> result;
  for (const V3d& offset : {frame.u, -frame.u, frame.v, -frame.v}) {
    SurfaceWalk walk(field, 0, frame.center, offset);
    std::vector<V3d> path = {frame.center};
    const double pieces = std::ceil(radius / band.voxelSize());
    for (int i = 0; i < static_cast<int>(pieces) && walk.advance(radius / pieces); ++i)
      path.push_back(walk.position());
    result.push_back(std::move(path));
  }
  return result;
}

/// Moves the frame up by one layer. The centre moves along ∇φ, and so do the ends of `paths`, the
/// geodesics from it to the middles of the sides.
/// @return mean ratio of the new lengths of the paths to the old ones
double raiseFrame(const NarrowBand& space, double from, double to, DecalFrame& frame,
                  std::vector<std::vector<V3d>>& paths) {
  std::vector<V3d> points = {frame.center};
  for (const std::vector<V3d>& path : paths) points.push_back(path.back());
  advectPoints(space, from, to, points);
  const SurfaceField field(space);
  const V3d before = field.normal(frame.center), after = field.normal(points[0]);
  frame = {points[0], carried(frame.u, before, after), carried(frame.v, before, after)};
  double growth = 0;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const double length = pathLength(paths[i]);
    std::vector<V3d> path = geodesicLike(field, to, frame.center, points[i + 1], paths[i]);
    if (path.empty()) path = geodesic(field, to, frame.center, points[i + 1]);
    if (path.empty()) {
      throw InvalidInput(fmt::format(
          "at height {:.4g} no path connects the centre of the decal with its sides; use a lower "
          "height or --particles conforming",
          to));
    }
    growth += pathLength(path) / length / static_cast<double>(paths.size());
    paths[i] = std::move(path);
  }
  return growth;
}

std::vector<ParticleLayer> reducedDecal(const NarrowBand& base, DecalFrame frame, double radius,
                                        const ParticleLayer& surface, double height,
                                        const PatchOptions& options) {
  const NarrowBand space =
      sweepAbove(base, surface.positions, {2 * radius, 2 * radius}, height, options);
  std::vector<std::vector<V3d>> paths = spokes(base, frame, radius);
  std::vector<ParticleLayer> layers = {surface};
  for (std::size_t k = 1; k < options.layers; ++k) {
    const double w = static_cast<double>(k) / static_cast<double>(options.layers - 1);
    radius *= raiseFrame(space, layers.back().height, w * height, frame, paths);
    layers.push_back(
        decalLayer(space, frame, radius, w * height, w, surface.columns, options.mirror));
    levelset::report(options.progress, 0.5 + 0.5 * w);
  }
  return layers;
}

void checkDecalArguments(const NarrowBand& base, const V3d& direction, double radius, double height,
                         const PatchOptions& options) {
  checkPatchOptions(height, options);
  if (!(radius > 0) || !std::isfinite(radius))
    throw UsageError(fmt::format("the radius is {}; give a positive length", radius));
  if (!std::isfinite(direction.x) || !std::isfinite(direction.y) || !std::isfinite(direction.z) ||
      direction.length() == 0) {
    throw UsageError(
        fmt::format("the direction {} is not a vector of finite, nonzero length; give a "
                    "direction along the surface",
                    pointAsOption(direction)));
  }
  for (const std::vector<V3d>& side : options.sides)
    if (!side.empty())
      throw UsageError("points along sides require a patch with corners; use `patch`");
  if (radius < 2 * base.voxelSize()) {
    throw InvalidInput(
        fmt::format("the radius {:.4g} is under two voxels of {:.4g}; use a "
                    "larger radius, or resample the base",
                    radius, base.voxelSize()));
  }
  const double diagonal = base.zeroSetBounds().size().length();
  if (radius > 10 * diagonal) {
    throw InvalidInput(
        fmt::format("the radius {:.4g} is over ten times the base's diagonal of {:.4g}; use a "
                    "smaller radius",
                    radius, diagonal));
  }
}

}  // namespace

PatchResult makeDecal(const NarrowBand& base, const V3d& at, const V3d& direction, double radius,
                      double height, const PatchOptions& options) {
  if (base.isEmpty()) {
    throw InvalidInput("the base has no surface; give a solid with at least one voxel");
  }
  checkDecalArguments(base, direction, radius, height, options);
  PatchResult result;
  const V3d center = closestSurfacePoint(base, at);
  result.report.projectionDistance = (center - at).length();
  const DecalFrame frame =
      frameAt(SurfaceField(base), center, direction.normalized(), options.mirror);

  const LayerSize size{2 * radius, 2 * radius};
  const double spacing = options.spacing > 0
                             ? options.spacing
                             : chooseSpacing(base.voxelSize(), {{size}}, options.layers);
  checkParticleCount(particlesAt(spacing, {{size}}) * static_cast<double>(options.layers), spacing,
                     options);
  const ParticleLayer surface =
      decalLayer(base, frame, radius, 0, 0, countAlong(2 * radius, spacing), options.mirror);
  levelset::report(options.progress, 0.1);

  Patch& patch = result.patch;
  patch.height = height;
  patch.mirrored = options.mirror;
  const std::size_t last = surface.columns - 1;
  patch.corners = {surface.at(0, 0), surface.at(last, 0), surface.at(last, last),
                   surface.at(0, last)};
  patch.layers = options.scheme == LayerScheme::Reduced
                     ? reducedDecal(base, frame, radius, surface, height, options)
                     : layersFromSurface(base, surface, surface.positions, size, height, options,
                                         result.report);
  result.report.uLength = size.u;
  result.report.vLength = size.v;
  finishPatch(base, options, patch, result.report);
  return result;
}

}  // namespace mapping
