#include "levelset/transform/transform.h"

#include <fmt/core.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "levelset/error.h"
#include "levelset/transform/moved_grid_vdb.h"
#include "levelset/transform/resample_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::FloatTree;

/// Checks that a matrix is finite, affine and invertible.
void requireAffine(const Imath::M44d& matrix) {
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      if (std::isfinite(matrix[i][j])) continue;
      throw UsageError(
          fmt::format("the matrix has {} in row {}, column {}; its elements must be "
                      "finite",
                      matrix[i][j], i + 1, j + 1));
    }
  if (matrix[0][3] != 0 || matrix[1][3] != 0 || matrix[2][3] != 0 || matrix[3][3] != 1) {
    throw UsageError(
        fmt::format("the last column of the matrix is {},{},{},{}; it must be 0,0,0,1 "
                    "(points are row vectors: a translation is the last row)",
                    matrix[0][3], matrix[1][3], matrix[2][3], matrix[3][3]));
  }
  const Stretch stretch = stretchOf(matrix);
  if (!(stretch.least > 1e-12 * stretch.greatest)) {
    throw UsageError(
        fmt::format("the matrix is singular (its smallest and largest stretch are {} and {}); "
                    "use an invertible matrix",
                    stretch.least, stretch.greatest));
  }
}

/// Limit of the magnitude of coordinates and stretches, so that volumes do not overflow double
/// precision.
constexpr double kFarthest = 1e100;
/// Largest accepted rounding error of the world position of a grid's origin, voxels.
constexpr double kPositionTolerance = 1e-6;

/// Checks that double precision resolves the world position of a grid's origin to
/// kPositionTolerance voxels.
void requirePrecision(const Imath::M44d& indexToWorld, double voxelSize) {
  double farthest = 0;
  for (int axis = 0; axis < 3; ++axis)
    farthest = std::max(farthest, std::abs(indexToWorld[3][axis]));
  const double spacing = spacingAt(farthest, CoordinatePrecision::Double);
  if (spacing <= kPositionTolerance * voxelSize) return;
  throw InvalidInput(fmt::format(
      "at {:.3g} from the origin, double precision resolves only {:.2g}, too coarse for "
      "voxels of {:.3g}; move the solid less far, or use larger voxels",
      farthest, spacing, voxelSize));
}

void requireStretch(const Stretch& stretch) {
  if (stretch.greatest < kFarthest && stretch.least > 1 / kFarthest) return;
  throw InvalidInput(fmt::format(
      "the matrix stretches by {:.3g} to {:.3g}, and coordinates or volumes would overflow; "
      "change the unit of length",
      stretch.least, stretch.greatest));
}

void scaleDistances(openvdb::FloatGrid& grid, double scale, float background) {
  const auto scaled = [=](float value, bool isOn) {
    if (!isOn) return std::copysign(background, value);
    return std::clamp(static_cast<float>(static_cast<double>(value) * scale), -background,
                      background);
  };
  openvdb::tree::LeafManager<FloatTree> leaves(grid.tree());
  leaves.foreach ([&](FloatTree::LeafNodeType& leaf, std::size_t) {
    float* values = leaf.buffer().data();
    for (openvdb::Index i = 0; i < FloatTree::LeafNodeType::SIZE; ++i)
      values[i] = scaled(values[i], leaf.isValueOn(i));
  });
  for (auto it = grid.tree().beginValueOff(); it; ++it)
    if (it.getDepth() < FloatTree::DEPTH - 1) it.setValue(scaled(*it, false));
  grid.tree().root().setBackground(background, /*updateChildNodes=*/false);
}

}  // namespace

MovedGrid movedGrid(const Imath::M44d& indexToWorld, double voxelSize, double halfWidth,
                    const Imath::M44d& matrix, const char* advice) {
  requireAffine(matrix);
  const Stretch stretch = stretchOf(matrix);
  requireStretch(stretch);
  const double determinant = Imath::M44d(matrix).determinant();
  if (stretch.greatest > stretch.least * (1 + 1e-7) || !(determinant > 0)) {
    throw InvalidInput(
        fmt::format("the matrix shears, mirrors or scales unevenly, which a grid transform cannot "
                    "represent; {}",
                    advice));
  }
  const Imath::M44d moved = indexToWorld * matrix;
  const double size = voxelSize * stretch.greatest;
  MovedGrid grid;
  grid.background = backgroundOf(halfWidth, size);
  requireBackground(grid.background, size);
  requirePrecision(moved, size);
  grid.transform = transformOf(moved);
  // The determinant of a rotation is one up to rounding.
  const double scale = std::cbrt(determinant);
  if (std::abs(scale - 1) > 1e-9) grid.scale = scale;
  return grid;
}

NarrowBand transform(NarrowBand solid, const Imath::M44d& matrix) {
  if (!solid.shared()) {
    requireAffine(matrix);
    throw InvalidInput("the solid is empty; give a solid with a surface");
  }
  const MovedGrid moved = movedGrid(solid.indexToWorld(), solid.voxelSize(), solid.halfWidth(),
                                    matrix, "resample the solid with --bake");
  openvdb::FloatGrid& grid = editVdb(solid);
  grid.setTransform(moved.transform);
  if (moved.scale != 1) scaleDistances(grid, moved.scale, moved.background);
  return solid;
}

NarrowBand bake(const NarrowBand& solid, const Imath::M44d& matrix, double voxelSize,
                const BakeOptions& options) {
  requireAffine(matrix);
  requireVoxelSize(voxelSize);
  return resampleField(solid, solid.indexToWorld() * matrix, axisAligned(voxelSize),
                       solid.shared() ? solid.halfWidth() : 3, options.maxMemory, options.progress);
}

TriMesh transform(TriMesh mesh, const Imath::M44d& matrix) {
  requireAffine(matrix);
  requireAttributes(mesh);
  const Stretch stretch = stretchOf(matrix);
  requireStretch(stretch);
  mesh.spacing = coordinateSpacing(mesh) * stretch.greatest;
  mesh.precision = CoordinatePrecision::Double;  // transformed coordinates may need more digits
  for (Imath::V3d& position : mesh.positions) {
    Imath::V3d moved;
    matrix.multVecMatrix(position, moved);
    for (int axis = 0; axis < 3; ++axis)
      if (!(std::abs(moved[axis]) < kFarthest))
        throw InvalidInput(
            fmt::format("a vertex moves to ({:.3g}, {:.3g}, {:.3g}), where volumes "
                        "would overflow; change the unit of length",
                        moved.x, moved.y, moved.z));
    position = moved;
  }
  const bool mirrors = Imath::M44d(matrix).determinant() < 0;
  const std::array<Imath::V3d, 3> slopes = {Imath::V3d(matrix[0][0], matrix[0][1], matrix[0][2]),
                                            Imath::V3d(matrix[1][0], matrix[1][1], matrix[1][2]),
                                            Imath::V3d(matrix[2][0], matrix[2][1], matrix[2][2])};
  const bool turns =
      slopes != std::array{Imath::V3d(1, 0, 0), Imath::V3d(0, 1, 0), Imath::V3d(0, 0, 1)};
  if (turns)  // a pure translation keeps the bits of the normals
    for (Imath::V3d& normal : mesh.attributes.normals)
      normal = transformedNormal(normal, slopes, mirrors ? -1 : 1);
  if (mirrors)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

}  // namespace levelset
