#pragma once

#include <vector>

#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "levelset/volume_files/volume_file.h"

namespace pipeline {

/// Options of `read` for volumes.
[[nodiscard]] std::vector<Param> volumeFileParams();
/// Options that the user gave for a volume.
[[nodiscard]] levelset::ReadVolumeOptions volumeOptions(const Invocation& in);
/// Refuses options for volumes on other files, and a raw file without its layout.
/// @throws UsageError
void checkVolumeOptions(const Invocation& in, bool isVolume);

/// Volume of an operand, by default of the first. A field from a .vdb becomes one.
[[nodiscard]] levelset::Volume volumeIn(const Invocation& in, std::size_t operand = 0);
/// Option --inside of operators that take an isovalue.
[[nodiscard]] Param insideParam(std::string doc = "side of the isovalue that is inside");

/// Adds size, spacing, origin, orientation and the index-to-world map to a JSON object.
void addVolumeGrid(Json& json, const levelset::VolumeGrid& grid);

}  // namespace pipeline
