#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "levelset/progress.h"
#include "render/quadrics/quadric.h"

/// Files of quadrics: JSON with one object for each.
///
/// {"format": "levelsmith quadrics", "version": 1,
///  "quadrics": [{"kind": "sphere", "centre": [x, y, z], "radius": 1, "colour": [r, g, b]},
///               {"kind": "cylinder", "ends": [[x, y, z], [x, y, z]], "radius": 0.2},
///               {"kind": "cone", "position": [x, y, z], "axes": [[x, y, z], …],
///                "range": [0, 1], "capped": true}, …]}
///
/// Kinds are "sphere", "ellipsoid", "cylinder", "cone", "paraboloid", "one-sheet hyperboloid" and
/// "two-sheet hyperboloid". All but the sphere have a position, three axes, and the range of z in
/// their own coordinates (Quadric). Two ends and a radius stand for a circular cylinder. Colours
/// are linear, from 0 to 1.
namespace render {

/// Returns true if a file is a JSON document whose member "format" names quadrics.
[[nodiscard]] bool isQuadricFile(const std::filesystem::path& file);

/// Reads quadrics. Errors name the file and the entry.
/// @throws levelset::IoError if the file cannot be read
/// @throws levelset::InvalidInput if the file has no quadrics, and as requireQuadrics()
/// @throws levelset::ResourceLimit if reading the file needs more than `maxMemory` bytes
[[nodiscard]] QuadricModel readQuadrics(const std::filesystem::path& file,
                                        std::size_t maxMemory = levelset::kNoMemoryLimit);

/// Reads quadrics from the text of a file. @param name  name of the file, for messages
[[nodiscard]] QuadricModel parseQuadrics(const std::string& text, const std::string& name);

/// Writes quadrics.
/// @throws levelset::IoError if the file cannot be written
void writeQuadrics(const std::filesystem::path& file, const QuadricModel& model);

}  // namespace render
