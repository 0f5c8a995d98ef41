#pragma once

#include <Imath/ImathBox.h>

#include <cstdint>
#include <memory>
#include <string>

#include "levelset/fields/field.h"
#include "levelset/narrow_band.h"

namespace levelset {

struct VdbField;  // levelset/fields/grid_vdb.h, for .cpp files only

/// Numbers or vectors on a sparse grid of any class: a fog volume, an attribute, a velocity. Not a
/// narrow band: nothing is promised about its values but that they are finite.
///
/// A value: copies share one grid, which nobody changes. Grids come from files (readField in
/// levelset/files/band_file.h) and from operators.
class FieldGrid {
 public:
  explicit FieldGrid(std::shared_ptr<const VdbField> field) : field_(std::move(field)) {}

  [[nodiscard]] bool isVector() const;
  /// Component i of a vector at the centre of the voxel's lower face i (marker-and-cell), not at
  /// the voxel's centre.
  [[nodiscard]] bool isStaggered() const;
  /// OpenVDB's word: "staggered", "fog volume", "unknown", …
  [[nodiscard]] std::string gridClass() const;
  [[nodiscard]] std::string name() const;
  /// Edge of a voxel, world units; 0 when the voxels are no cubes.
  [[nodiscard]] double voxelSize() const;
  [[nodiscard]] std::uint64_t activeVoxelCount() const;
  /// Bytes that the tree takes.
  [[nodiscard]] std::size_t memoryUse() const;
  /// World-space box about the centres of the active voxels; empty when there are none.
  [[nodiscard]] Imath::Box3d bounds() const;
  /// Hash of transform, topology, class and values: equal for equal grids, whatever made them.
  [[nodiscard]] std::uint64_t contentHash() const;

  /// For our own .cpp files; see levelset/fields/grid_vdb.h.
  [[nodiscard]] const std::shared_ptr<const VdbField>& shared() const { return field_; }

 private:
  std::shared_ptr<const VdbField> field_;
};

/// Trilinear between grid points, through the grid's transform; the background outside.
/// @throws InvalidInput for a vector grid. @param action  for the message
[[nodiscard]] ScalarField asScalarField(const FieldGrid& grid, const char* action);

/// The signed distance of a band, world units: ± background outside it.
[[nodiscard]] ScalarField asScalarField(const NarrowBand& band);

/// Trilinear as above, each component about its own place when staggered. The same at any time.
/// @throws InvalidInput for a scalar grid. @param action  for the message
[[nodiscard]] VectorField asVectorField(const FieldGrid& grid, const char* action);

}  // namespace levelset
