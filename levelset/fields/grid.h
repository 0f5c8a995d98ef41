#pragma once

#include <Imath/ImathBox.h>

#include <cstdint>
#include <memory>
#include <string>

#include "levelset/fields/field.h"
#include "levelset/narrow_band.h"

namespace levelset {

struct VdbField;  // levelset/fields/grid_vdb.h, for .cpp files only

/// Numbers or vectors on a sparse grid of any class: a fog volume, an attribute, a velocity. Unlike
/// in a narrow band, the values are only required to be finite.
///
/// The class has value semantics. Copies share one grid, which never changes. Grids come from files
/// (readField in levelset/files/band_file.h) and from operators.
class FieldGrid {
 public:
  explicit FieldGrid(std::shared_ptr<const VdbField> field) : field_(std::move(field)) {}

  [[nodiscard]] bool isVector() const;
  /// Returns true when component i of a vector belongs to the centre of the voxel's lower face i
  /// (marker-and-cell), not to the voxel's centre.
  [[nodiscard]] bool isStaggered() const;
  /// OpenVDB's name of the class: "staggered", "fog volume", "unknown", …
  [[nodiscard]] std::string gridClass() const;
  [[nodiscard]] std::string name() const;
  /// Edge length of a voxel, world units; 0 when the voxels are not cubes.
  [[nodiscard]] double voxelSize() const;
  [[nodiscard]] std::uint64_t activeVoxelCount() const;
  /// Memory of the tree in bytes.
  [[nodiscard]] std::size_t memoryUse() const;
  /// World-space box around the centres of the active voxels; empty when there are none.
  [[nodiscard]] Imath::Box3d bounds() const;
  /// Hash of transform, topology, class and values. Equal grids have equal hashes, whatever their
  /// source.
  [[nodiscard]] std::uint64_t contentHash() const;

  /// Grid behind the field, for the .cpp files of this library; see levelset/fields/grid_vdb.h.
  [[nodiscard]] const std::shared_ptr<const VdbField>& shared() const { return field_; }

 private:
  std::shared_ptr<const VdbField> field_;
};

/// Interpolates the grid trilinearly, inactive values included. Where the grid stores no value, the
/// background takes its place.
/// @throws InvalidInput for a vector grid
[[nodiscard]] ScalarField asScalarField(const FieldGrid& grid);

/// Interpolates the signed distance of a band trilinearly, world units; ± background outside the
/// band.
[[nodiscard]] ScalarField asScalarField(const NarrowBand& band);

/// Interpolates a vector grid trilinearly; the result is constant in time. On a staggered grid,
/// each component is interpolated between the points where it is stored.
/// @throws InvalidInput for a scalar grid
[[nodiscard]] VectorField asVectorField(const FieldGrid& grid);

}  // namespace levelset
