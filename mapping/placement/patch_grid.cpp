#include "mapping/placement/patch_grid.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "levelset/error.h"
#include "mapping/layers/layer_schemes.h"
#include "mapping/layers/particle_layers.h"
#include "mapping/layers/patch_layers.h"
#include "mapping/layers/relaxation.h"
#include "mapping/placement/make_patch.h"
#include "mapping/surface/geodesic.h"
#include "mapping/surface/surface_field.h"
#include "mapping/surface/surface_projection.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::UsageError;

// Target for the number of particles of one tile on all layers, the same as for a single patch.
constexpr double kMostPerTile = 2000;
// Target for the number of particles of all tiles on all layers; relaxation slows down with it.
constexpr double kMostPerGrid = 20000;
constexpr std::size_t kFewestCells = 4;  // cells along each side of a tile

void checkGrid(const PatchGridOptions& grid) {
  constexpr std::size_t kMostTiles = 100'000;
  if (grid.columns == 0 || grid.rows == 0 || grid.columns > kMostTiles || grid.rows > kMostTiles ||
      grid.columns * grid.rows > kMostTiles) {
    throw UsageError(fmt::format("the grid has {} by {} tiles; give 1 to {} in all", grid.columns,
                                 grid.rows, kMostTiles));
  }
  if (!(grid.shift >= 0 && grid.shift < 1)) {
    throw UsageError(fmt::format(
        "the shift of every second row is {}; give a share of a tile, 0 to below 1", grid.shift));
  }
}

/// Number of cells of a tile along u and v.
std::array<std::size_t, 2> cellsPerTile(const NarrowBand& base, const LayerSize& whole,
                                        const PatchGridOptions& grid, const PatchOptions& options) {
  if (options.cells[0] > 0) return options.cells;
  const double tiles = static_cast<double>(grid.columns * grid.rows);
  const double u = whole.u / static_cast<double>(grid.columns),
               v = whole.v / static_cast<double>(grid.rows);
  const double perLayer =
      std::min(kMostPerTile, kMostPerGrid / tiles) / static_cast<double>(options.layers);
  const double spacing = options.spacing > 0
                             ? options.spacing
                             : std::max(std::sqrt(u * v / perLayer), 1.5 * base.voxelSize());
  const auto cells = [&](double length) {
    return std::max(kFewestCells, static_cast<std::size_t>(std::lround(length / spacing)));
  };
  const std::array<std::size_t, 2> result = {cells(u), cells(v)};
  checkParticleCount(static_cast<double>((result[0] + 3) * (result[1] + 3)) * tiles *
                         static_cast<double>(options.layers),
                     spacing, options);
  return result;
}

/// Particle layers that are cut into tiles.
struct Sheet {
  std::vector<ParticleLayer> layers;  ///< all with equal counts
  bool isRing = false;                ///< true: the last column equals the first
  /// Height of the top layer above the surface, world units.
  double height = 0;
  bool isMirrored = false;
  LayerScheme scheme = LayerScheme::Reduced;
};

struct Tile {
  std::size_t column, row;    ///< column and row of the tile's first particle in the sheet
  std::size_t columns, rows;  ///< number of cells along u and v
  bool isTurnedU, isTurnedV;
};

/// Cuts the part of a layer that belongs to a tile. Its rim consists of particles of the
/// neighbouring tiles, or of the layer's rim at the border of the layer.
ParticleLayer cut(const ParticleLayer& whole, const Tile& tile, bool isRing) {
  ParticleLayer part;
  part.columns = tile.columns + 1;
  part.rows = tile.rows + 1;
  part.w = whole.w;
  part.height = whole.height;
  const auto across = static_cast<int>(tile.columns), up = static_cast<int>(tile.rows);
  const auto around = static_cast<int>(whole.columns) - 1;
  const auto at = [&](int i, int j) {
    int column = static_cast<int>(tile.column) + (tile.isTurnedU ? across - i : i);
    const int row = static_cast<int>(tile.row) + (tile.isTurnedV ? up - j : j);
    if (isRing) column = (column + around) % around;
    return whole.beyond(column, row);
  };
  for (int j = 0; j <= up; ++j)
    for (int i = 0; i <= across; ++i) part.positions.push_back(at(i, j));
  if (!whole.hasRim()) return part;
  part.rim.resize(2 * (part.columns + part.rows) + 4);
  for (int j = -1; j <= up + 1; ++j)
    for (int i = -1; i <= across + 1; ++i)
      if (i < 0 || j < 0 || i > across || j > up) part.rim[part.rimIndex(i, j)] = at(i, j);
  return part;
}

Patch tilePatch(const Sheet& sheet, const Tile& tile) {
  Patch patch;
  patch.height = sheet.height;
  patch.mirrored = sheet.isMirrored != (tile.isTurnedU != tile.isTurnedV);
  for (const ParticleLayer& layer : sheet.layers)
    patch.layers.push_back(cut(layer, tile, sheet.isRing));
  const ParticleLayer& surface = patch.layers.front();
  const std::size_t right = tile.columns, top = tile.rows;
  patch.corners = {surface.at(0, 0), surface.at(right, 0), surface.at(right, top),
                   surface.at(0, top)};
  patch.spacing = meanSpacing(patch);
  patch.scheme = sheet.scheme;
  return patch;
}

std::vector<Patch> cutTiles(const Sheet& sheet, const PatchGridOptions& grid) {
  const std::size_t across = (sheet.layers.front().columns - 1) / grid.columns,
                    up = (sheet.layers.front().rows - 1) / grid.rows;
  const auto moved =
      static_cast<std::size_t>(std::lround(grid.shift * static_cast<double>(across)));
  std::vector<Patch> patches;
  for (std::size_t j = 0; j < grid.rows; ++j) {
    const std::size_t first = j % 2 == 1 ? moved : 0;
    const std::size_t count = first > 0 && !sheet.isRing ? grid.columns - 1 : grid.columns;
    for (std::size_t i = 0; i < count; ++i)
      patches.push_back(tilePatch(sheet, {first + i * across, j * up, across, up,
                                          grid.mirrorU && i % 2 == 1, grid.mirrorV && j % 2 == 1}));
  }
  return patches;
}

/// An axis (`from`, unit direction `along`, `length`) and two unit directions perpendicular to it.
/// `out` points to the border between the last and the first column of tiles, `side` a quarter turn
/// further.
struct RoundFrame {
  V3d from, along, out, side;
  double length;
  [[nodiscard]] V3d direction(double angle) const {
    return out * std::cos(angle) + side * std::sin(angle);
  }
  [[nodiscard]] V3d pointAt(double share) const { return from + along * (length * share); }
};

RoundFrame roundFrame(const NarrowBand& base, const V3d& from, const V3d& to, double rotation) {
  const V3d offset = to - from;
  if (!(offset.length() >= 2 * base.voxelSize()) || !std::isfinite(offset.length())) {
    throw UsageError(
        fmt::format("the axis from {} to {} is under two voxels long; give two "
                    "points that are further apart",
                    pointAsOption(from), pointAsOption(to)));
  }
  if (!std::isfinite(rotation))
    throw UsageError(fmt::format("the rotation is {}; give an angle", rotation));
  const V3d along = offset.normalized();
  const V3d reference = std::abs(along.x) < 0.9 ? V3d(1, 0, 0) : V3d(0, 1, 0);
  const V3d east = (reference - along * along.dot(reference)).normalized();
  const V3d north = along.cross(east);
  const V3d out = east * std::cos(rotation) + north * std::sin(rotation);
  return {from, along, out, along.cross(out), offset.length()};
}

/// Finds the first intersection of the surface with a line that comes from outside, perpendicular
/// to the axis.
/// @throws InvalidInput if there is none
V3d seenFromOutside(const SurfaceField& field, const V3d& axis, const V3d& direction, double far,
                    double background) {
  double outer = far, inner = far;
  while (inner > 0) {
    const double phi = field.value(axis + direction * inner);
    if (phi <= 0) break;
    outer = inner;
    inner -= std::max(0.9 * std::min(phi, background), 0.1 * field.voxelSize());
  }
  if (inner <= 0 || inner == far) {
    throw InvalidInput(
        fmt::format("the line from the axis at {} along {:.3g},{:.3g},{:.3g} meets no surface; "
                    "the axis must be inside the base, and end before the base does",
                    pointAsOption(axis), direction.x, direction.y, direction.z));
  }
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (inner + outer);
    (field.value(axis + direction * middle) > 0 ? outer : inner) = middle;
  }
  return axis + direction * (0.5 * (inner + outer));
}

/// Builds the layer at w = 0 all around the axis. Particles of the first and last row are evenly
/// spaced along the row, those of the other rows lie at equal angles about the axis.
ParticleLayer roundLayer(const NarrowBand& base, const RoundFrame& frame, std::size_t columns,
                         std::size_t rows) {
  const SurfaceField field(base);
  const Imath::Box3d box = base.zeroSetBounds();
  const double far = box.size().length() + (frame.from - box.center()).length() + frame.length;
  const double background = base.halfWidth() * base.voxelSize();
  ParticleLayer layer;
  layer.columns = columns + 1;
  layer.rows = rows + 1;
  for (std::size_t j = 0; j <= rows; ++j) {
    const V3d axis = frame.pointAt(static_cast<double>(j) / static_cast<double>(rows));
    const bool isBorder = j == 0 || j == rows;
    const std::size_t count = isBorder ? 4 * columns : columns;
    std::vector<V3d> ring;
    for (std::size_t i = 0; i < count; ++i) {
      const double angle =
          2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
      ring.push_back(seenFromOutside(field, axis, frame.direction(angle), far, background));
    }
    ring.push_back(ring.front());
    if (isBorder) {
      ring = sampleByArcLength(ring, columns + 1);
      for (std::size_t i = 1; i < columns; ++i) (void)field.project(ring[i], 0);
    }
    layer.positions.insert(layer.positions.end(), ring.begin(), ring.end());
  }
  return layer;
}

/// Checks that the surface around the axis is a single sheet, without jumps.
/// @throws InvalidInput where neighbouring particles are too far apart
void requireOneSheet(const ParticleLayer& layer) {
  // Largest distance of neighbouring particles along u or v, as a multiple of the mean distance in
  // that direction.
  constexpr double kFarthest = 4;
  for (const auto& [across, up] : {std::pair<std::size_t, std::size_t>{1, 0}, {0, 1}}) {
    std::vector<std::pair<double, V3d>> steps;
    double sum = 0;
    for (std::size_t j = up; j < layer.rows; ++j)
      for (std::size_t i = across; i < layer.columns; ++i) {
        const V3d& p = layer.at(i, j);
        steps.emplace_back((p - layer.at(i - across, j - up)).length(), p);
        sum += steps.back().first;
      }
    for (const auto& [length, place] : steps) {
      if (length <= kFarthest * sum / static_cast<double>(steps.size())) continue;
      throw InvalidInput(fmt::format(
          "seen from the axis the surface jumps at {}; move the axis or its ends so that each "
          "line from the axis meets only one sheet",
          pointAsOption(place)));
    }
  }
}

/// Adds the rim of a closed ring: around the axis it repeats particles of the ring, and at the two
/// ends it continues the columns straight.
void addRoundRim(const NarrowBand& band, ParticleLayer& layer) {
  addRim(band, layer);
  const auto last = static_cast<int>(layer.columns) - 1, rows = static_cast<int>(layer.rows);
  for (const int row : {-1, rows}) layer.rim[layer.rimIndex(last, row)] = layer.beyond(0, row);
  for (int row = -1; row <= rows; ++row) {
    layer.rim[layer.rimIndex(-1, row)] = layer.beyond(last - 1, row);
    layer.rim[layer.rimIndex(last + 1, row)] = layer.beyond(1, row);
  }
}

void settleRound(const NarrowBand& band, ParticleLayer& layer, PatchReport& report) {
  const Relaxation relaxation = relax(band, layer, true);
  report.relaxIterations += relaxation.iterations;
  report.isRelaxed = report.isRelaxed && relaxation.isConverged;
  addRoundRim(band, layer);
}

std::vector<ParticleLayer> roundLayers(const NarrowBand& base, ParticleLayer surface,
                                       const LayerSize& size, double height,
                                       const PatchOptions& options, PatchReport& report) {
  const NarrowBand space = sweepAbove(base, surface.positions, size, height, options);
  if (options.scheme == LayerScheme::Conforming)
    return conformingLayers(space, surface, height, options.layers);
  std::vector<ParticleLayer> layers = {std::move(surface)};
  for (std::size_t k = 1; k < options.layers; ++k) {
    ParticleLayer layer = layers.back();
    layer.w = static_cast<double>(k) / static_cast<double>(options.layers - 1);
    layer.height = layer.w * height;
    advectPoints(space, layers.back().height, layer.height, layer.positions);
    settleRound(space, layer, report);
    layers.push_back(std::move(layer));
    levelset::report(options.progress, 0.5 + 0.5 * layer.w);
  }
  return layers;
}

}  // namespace

PatchGridResult makePatchGrid(const NarrowBand& base, const std::array<V3d, 4>& corners,
                              double height, const PatchGridOptions& grid,
                              const PatchOptions& options) {
  checkGrid(grid);
  checkPatchOptions(height, options);
  std::array<V3d, 4> feet;
  for (std::size_t i = 0; i < 4; ++i) feet[i] = closestSurfacePoint(base, corners[i]);
  const LayerSize straight = {0.5 * ((feet[1] - feet[0]).length() + (feet[2] - feet[3]).length()),
                              0.5 * ((feet[3] - feet[0]).length() + (feet[2] - feet[1]).length())};
  PatchOptions whole = options;
  const auto [across, up] = cellsPerTile(base, straight, grid, options);
  whole.cells = {across * grid.columns, up * grid.rows};
  PatchResult result = makePatch(base, corners, height, whole);
  const Sheet sheet{std::move(result.patch.layers), false, height, result.patch.mirrored,
                    options.scheme};
  return {cutTiles(sheet, grid), result.report};
}

PatchGridResult makePatchGridAround(const NarrowBand& base, const V3d& from, const V3d& to,
                                    double rotation, double height, const PatchGridOptions& grid,
                                    const PatchOptions& options) {
  if (base.isEmpty()) {
    throw InvalidInput("the base has no surface; give a solid with at least one voxel");
  }
  checkGrid(grid);
  checkPatchOptions(height, options);
  if (grid.columns < 3)
    throw UsageError(
        fmt::format("there are {} tiles around the axis; give at least 3", grid.columns));
  if (grid.mirrorU && grid.columns % 2 == 1) {
    throw UsageError(
        fmt::format("with --mirror u or both the number of tiles around must be even, so that "
                    "the last matches the first; {} is odd",
                    grid.columns));
  }
  if (options.scheme == LayerScheme::Spline || !options.transform.isIdentity() || options.mirror) {
    throw UsageError(
        "--particles spline, --twist, --taper, --bend and --mirrored cannot be combined "
        "with tiles around an axis");
  }
  const RoundFrame frame = roundFrame(base, from, to, rotation);
  PatchGridResult result;
  const LayerSize rough = sizeOf(roundLayer(base, frame, 64, 16));
  const auto [across, up] = cellsPerTile(base, rough, grid, options);
  ParticleLayer surface = roundLayer(base, frame, across * grid.columns, up * grid.rows);
  requireOneSheet(surface);
  requireCovered(base, surface);
  settleRound(base, surface, result.report);
  const LayerSize size = sizeOf(surface);
  result.report.uLength = size.u;
  result.report.vLength = size.v;
  result.report.cellAreaVariation = cellAreaVariation(surface);
  levelset::report(options.progress, 0.1);
  const Sheet sheet{roundLayers(base, std::move(surface), size, height, options, result.report),
                    true, height, false, options.scheme};
  result.patches = cutTiles(sheet, grid);
  return result;
}

}  // namespace mapping
