#pragma once

#include <memory>
#include <string>

#include "apps/viewer/model/model.h"
#include "levelset/narrow_band.h"

/// Models with one solid, which editors change.
namespace viewer {

/// Returns true for a model with one solid and nothing else. The solid is closed and not empty.
[[nodiscard]] bool hasOneSolid(const Model& model);

/// Voxel size of the preview while the user drags, world units: the longest side of the base has
/// about 96 voxels, or fewer on a coarser base. @pre hasOneSolid()
[[nodiscard]] double previewVoxel(const Model& base);

/// Copy of a model with another solid, and without patches.
[[nodiscard]] std::shared_ptr<const Model> modelWith(const Model& base, levelset::NarrowBand solid);

/// Actions that make the solid of a model from its file; empty if no file has this solid alone.
/// @param voxelSize  voxel size of the solid; a mesh is converted with it
[[nodiscard]] std::string baseActions(const Model& base, double voxelSize);

/// Quotes a text for the shell.
[[nodiscard]] std::string quoted(const std::string& text);

}  // namespace viewer
