#pragma once

// The grid behind a FieldGrid. Includes OpenVDB, so include it from .cpp files only.

#include "levelset/fields/grid.h"
#include "levelset/vdb.h"

namespace levelset {

/// A scalar or a vector grid; the other pointer is null.
struct VdbField {
  openvdb::FloatGrid::ConstPtr scalar = {};
  openvdb::Vec3SGrid::ConstPtr vector = {};

  [[nodiscard]] const openvdb::GridBase& base() const {
    return scalar ? static_cast<const openvdb::GridBase&>(*scalar) : *vector;
  }
};

/// Makes a field of an external grid and checks that its values are finite.
/// @throws InvalidInput for NaN or infinite values, or a transform that is not linear
[[nodiscard]] FieldGrid importField(const openvdb::FloatGrid::Ptr& grid);
[[nodiscard]] FieldGrid importField(const openvdb::Vec3SGrid::Ptr& grid);

}  // namespace levelset
