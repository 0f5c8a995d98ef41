#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "levelset/progress.h"
#include "render/bezier/bezier_volume.h"

/// Bézier volume files: JSON with the numbers of the patches.
///
/// {"format": "levelsmith bezier volume", "version": 1, "isovalue": 0,
///  "attributes": ["a"], "expression": "a",
///  "patches": [{"degree": [2, 2, 2], "count": [3, 3, 3], "points": [[x, y, z, a], …],
///               "weights": [1, …], "knots": [[0, 0, 0, 1, 1, 1], …]}, …]}
///
/// With two numbers in "degree" and "count", an entry is a surface in space: its points have three
/// coordinates and no attribute. "trims", a list of loops, cuts a surface to the part of (u, v)
/// that the loops enclose by the even-odd rule. A loop is {"polyline": [[u, v], …]} or
/// {"curves": [{"points": [[u, v], …], "weights": [1, …]}, …]}, rational Bézier curves end to end.
/// "domain", [u0, v0, u1, v1], is the box of (u, v) that the entry covers, [0, 0, 1, 1] if it is
/// left out.
///
/// A point has three coordinates and a number for each attribute. The last index of the points is
/// the fastest. "isovalue" is 0 if it is left out, and "attributes" is one. "expression" joins
/// several attributes as in CsgExpression. With "count", an entry is a B-spline volume, whose knots
/// are uniform unless "knots" gives them; without, it has one Bézier patch.
namespace render {

/// Returns true if a file is a JSON document whose member "format" names Bézier volumes.
[[nodiscard]] bool isBezierFile(const std::filesystem::path& file);

/// Reads a Bézier volume. Errors name the file and the member.
/// @throws levelset::IoError if the file cannot be read
/// @throws levelset::InvalidInput if the file is no Bézier volume, and as requireBezierVolume()
/// @throws levelset::UsageError for a wrong expression
/// @throws levelset::ResourceLimit if reading the file needs more than `maxMemory` bytes
[[nodiscard]] BezierVolume readBezierVolume(const std::filesystem::path& file,
                                            std::size_t maxMemory = levelset::kNoMemoryLimit);

/// Reads a Bézier volume from the text of a file. @param name  name of the file, for messages
[[nodiscard]] BezierVolume parseBezierVolume(const std::string& text, const std::string& name);

/// Writes a Bézier volume, exact to the last bit. Its attributes get the names a0, a1 and so on.
/// @throws levelset::IoError if the file cannot be written
void writeBezierVolume(const std::filesystem::path& file, const BezierVolume& volume);

}  // namespace render
