#pragma once

// What is behind a FieldGrid. Includes OpenVDB: for .cpp files only.

#include "levelset/fields/grid.h"
#include "levelset/vdb.h"

namespace levelset {

/// One of the two is set.
struct VdbField {
  openvdb::FloatGrid::ConstPtr scalar = {};
  openvdb::Vec3SGrid::ConstPtr vector = {};

  [[nodiscard]] const openvdb::GridBase& base() const {
    return scalar ? static_cast<const openvdb::GridBase&>(*scalar) : *vector;
  }
};

/// Take a grid that came from outside, and find it finite.
/// @throws InvalidInput for NaN or infinite values, or a transform that is not linear
[[nodiscard]] FieldGrid importField(const openvdb::FloatGrid::Ptr& grid, const char* action);
[[nodiscard]] FieldGrid importField(const openvdb::Vec3SGrid::Ptr& grid, const char* action);

}  // namespace levelset
