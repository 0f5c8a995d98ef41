#pragma once

// Private to the ray casting of height fields: the pyramid and the place of the grid.

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "levelset/terrain/height_field.h"
#include "render/camera.h"
#include "render/terrain/rays/height_kernel.h"

namespace render {

/// A height field with its pyramid. Level l of the pyramid has a node for each square of 2^l cells
/// at an edge, from level 1 to the level of a single node.
struct TerrainTables {
  std::shared_ptr<const levelset::HeightField> field;
  std::vector<float> ranges = {};            ///< lowest and highest known height of each node
  std::vector<std::size_t> firstNode = {0};  ///< first node of each level
  int cellsU = 0, cellsV = 0, topLevel = 0;
  Imath::Box3d box = {};  ///< of the known samples, in the positions of the field
  /// First and last column, first and last row of the cells that are left out.
  std::array<int, 4> leftOut = {0, -1, 0, -1};
  float lowest = 0, highest = 0;  ///< heights of all known samples
  /// World position of the first sample at the height 0.
  Imath::V3d origin{0};
  /// Linear parts of the maps of (column, row, height) to the world, and back. Vectors are rows.
  Imath::M33d toWorld = {}, toGrid = {};

  [[nodiscard]] std::size_t bytes() const {
    return field->memoryUse() + ranges.size() * sizeof(float);
  }
  [[nodiscard]] HeightKernel kernel() const;
  /// The ray relative to the first sample, in cells and heights.
  [[nodiscard]] HeightKernel::HeightRay gridRay(const Camera::Ray& ray) const;
  /// State of a walk before its first step.
  [[nodiscard]] HeightKernel::HeightWalk start() const;
};

/// Builds the pyramid. @pre the field has at least 2x2 samples
/// @param box  the ground in this box is left out, as TerrainOptions::outside; null: none
/// @throws levelset::InvalidInput  for a transform that is not affine or not invertible, and if the
///         ground that is left out leaves the box
/// @throws levelset::ResourceLimit if the pyramid needs more than `maxBytes`
[[nodiscard]] TerrainTables makeTerrainTables(std::shared_ptr<const levelset::HeightField> field,
                                              const Imath::M44d& transform, const Imath::Box3d* box,
                                              std::size_t maxBytes);

}  // namespace render
