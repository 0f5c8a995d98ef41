#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// Patches on a surface: a quadrilateral whose sides are geodesics, and the particles above it that
/// carry texture coordinates [Brodersen07 §8.2].
namespace mapping {

/// One layer of particles on a grid of u and v. With LayerScheme::Reduced and no LayerTransform,
/// the particles lie on the iso-surface φ = height of the base.
struct ParticleLayer {
  std::size_t columns = 0, rows = 0;  ///< along u, along v; each at least 2
  double w = 0;                       ///< texture coordinate of the layer
  double height = 0;                  ///< w × height of the patch, world units
  std::vector<Imath::V3d> positions;  ///< rows × columns, row major: index = row * columns + column
  /// Particles one spacing beyond each end of the rows and columns, continued straight along the
  /// surface, see beyond(); empty: no rim.
  std::vector<Imath::V3d> rim = {};

  [[nodiscard]] const Imath::V3d& at(std::size_t column, std::size_t row) const {
    return positions[row * columns + column];
  }
  /// Index in `rim`, which has 2 (columns + rows) + 4 particles: the row before the first row, the
  /// row after the last, the column before the first column, the column after the last.
  /// @pre column is −1 or columns, or row is −1 or rows
  [[nodiscard]] std::size_t rimIndex(int column, int row) const {
    const auto c = static_cast<std::size_t>(column + 1), r = static_cast<std::size_t>(row);
    if (row == -1) return c;
    if (r == rows) return columns + 2 + c;
    return 2 * (columns + 2) + (column == -1 ? r : rows + r);
  }
  /// Particle of the layer or of its rim.
  /// @pre hasRim(); column from −1 to columns, row from −1 to rows
  [[nodiscard]] const Imath::V3d& beyond(int column, int row) const {
    const bool isInside = column >= 0 && static_cast<std::size_t>(column) < columns && row >= 0 &&
                          static_cast<std::size_t>(row) < rows;
    return isInside ? at(static_cast<std::size_t>(column), static_cast<std::size_t>(row))
                    : rim[rimIndex(column, row)];
  }
  [[nodiscard]] bool hasRim() const { return !rim.empty(); }
};

enum class LayerScheme {
  /// Scheme B: each layer is built on its own, between corners (for a decal: around a centre) that
  /// are moved up from the layer below.
  Reduced,
  /// Scheme A: each particle at w = 0 follows ∇φ to the top layer; its positions on inner layers
  /// lie on the straight line from its start to its end.
  Conforming,
  /// Scheme C: the particles at w = 0 travel along a curve, PatchOptions::spline, and rotate with
  /// it.
  Spline
};

struct Patch {
  std::array<Imath::V3d, 4> corners;  ///< on the base surface, anticlockwise seen from outside
  double height = 0;                  ///< height of the top layer, world units
  /// True: the corners are in clockwise order seen from outside, so that the texture is mirrored.
  bool mirrored = false;
  std::vector<ParticleLayer> layers;  ///< from the surface (w = 0) outwards (w = 1)
  double spacing = 0;                 ///< mean distance of neighbouring particles, world units
  /// Scheme by which the layers were built; empty: unknown, as in older files.
  std::optional<LayerScheme> scheme = {};
  [[nodiscard]] std::size_t particleCount() const;
};

/// Mean distance of neighbouring particles within the layers, world units.
[[nodiscard]] double meanSpacing(const Patch& patch);

/// Measurements of a new patch.
struct PatchReport {
  double uLength = 0, vLength = 0;  ///< mean lengths of the rows and columns at w = 0, world units
  double cellAreaVariation = 0;     ///< standard deviation / mean of the cell areas at w = 0
  std::size_t relaxIterations = 0;  ///< iterations of the relaxation, summed over all layers
  /// True: in every layer, the last iteration moved no particle by more than 1e-3 voxel.
  bool isRelaxed = true;
  /// Largest distance from a given corner or side point to the surface, world units. For a decal:
  /// distance from the given centre.
  double projectionDistance = 0;
  /// Spline only: number of particles that were slowed, so as not to hit neighbours or move
  /// backwards.
  std::size_t slowed = 0;
};

/// Transform of the layers that grows with w, about the axis of the patch: its normal at the
/// middle.
struct LayerTransform {
  double twist = 0;  ///< radians, anticlockwise seen from outside, at w = 1
  double taper = 1;  ///< scale across the axis at w = 1, positive
  double bend = 0;   ///< radians that the axis leans towards u at w = 1
  [[nodiscard]] bool isIdentity() const { return twist == 0 && taper == 1 && bend == 0; }
};

struct PatchOptions {
  std::size_t layers = 6;  ///< at least 2
  LayerScheme scheme = LayerScheme::Reduced;
  /// Spline only: points of the curve after the patch's centre. Empty: the curve is straight along
  /// the normal at the centre. The height is measured along the curve.
  std::vector<Imath::V3d> spline = {};
  bool fade = false;  ///< Spline only: the relief of the surface fades to zero along the curve
  LayerTransform transform = {};
  /// Points near the surface through which the sides 0 → 1, 1 → 2, 3 → 2 and 0 → 3 pass, in this
  /// order. A side consists of the shortest paths between successive points, and may have a corner
  /// at each point.
  std::array<std::vector<Imath::V3d>, 4> sides = {};
  /// For LayerScheme::Reduced only: straight directions in which the corners rise, instead of along
  /// ∇φ. Give one for all corners, or one for each. Directions at points on the sides are
  /// interpolated. Where a surface bends strongly, parallel directions keep the upper layers from
  /// spreading [Brodersen07 fig. 8.4].
  std::vector<Imath::V3d> directions = {};
  bool parallel =
      false;  ///< all corners rise along the normal at the centre; LayerScheme::Reduced only
  /// Particle spacing, world units; 0: chosen from the sizes of the patch and the voxels.
  double spacing = 0;
  /// Cells along u and v, the same on all layers, each at least 3; 0, 0: chosen from the spacing.
  std::array<std::size_t, 2> cells = {0, 0};
  bool mirror = false;  ///< accept corners in clockwise order seen from outside
  /// Result of sweepSharedSpace: distances to the base that many patches share; it must outlive the
  /// call. Without it, or where it does not extend to the height, distances are computed around the
  /// patch.
  const levelset::NarrowBand* space = nullptr;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

}  // namespace mapping
