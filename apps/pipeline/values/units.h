#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Converts text to numbers. The decimal separator is a point in every locale. Every function
/// throws levelset::UsageError with a message that begins with `where`, for example "offset:
/// --distance".
namespace pipeline {

enum class Unit { World, Voxels, Percent };

/// A length as the user wrote it: `0.5` (world units), `2vx` (voxels), `1%` (of the diagonal of the
/// first operand). `0.5mm` means the same as `0.5`.
struct Length {
  double number = 0;
  Unit unit = Unit::World;
};

[[nodiscard]] double parseNumber(std::string_view text, std::string_view where);
[[nodiscard]] long parseInteger(std::string_view text, std::string_view where);
[[nodiscard]] Length parseLength(std::string_view text, std::string_view where);
/// Parses "x,y,z".
[[nodiscard]] Imath::V3d parsePoint(std::string_view text, std::string_view where);
/// Parses points "x,y,z", separated by blanks.
[[nodiscard]] std::vector<Imath::V3d> parsePoints(std::string_view text, std::string_view where);
/// Parses "LOW HIGH": two points, LOW less than HIGH on every axis.
[[nodiscard]] Imath::Box3d parseBox(std::string_view text, std::string_view where);
/// Parses "WxH", width and height from 1 to 2²⁰ pixels.
/// @throws levelset::ResourceLimit if a side is longer
[[nodiscard]] std::pair<int, int> parseImageSize(std::string_view text, std::string_view where);
/// Parses `count` lengths: "a,b" or "a,b,c".
[[nodiscard]] std::vector<Length> parseLengths(std::string_view text, std::size_t count,
                                               std::string_view where);
/// Parses a number of bytes: "4G", "512M", "1.5T", "100000". Suffixes are powers of 1024.
[[nodiscard]] std::size_t parseBytes(std::string_view text, std::string_view where);
/// Parses a matrix of 16 numbers separated by commas or blanks, row by row. With 12 numbers the
/// last column is 0 0 0 1. The matrix acts on row vectors; the translation is the last row.
[[nodiscard]] Imath::M44d parseMatrix(std::string_view text, std::string_view where);
/// Parses one number, or three separated by commas.
[[nodiscard]] std::vector<double> parseNumbers(std::string_view text, std::string_view where);

/// Finds the candidate that is most similar to `word`; empty if none is similar enough.
[[nodiscard]] std::string didYouMean(std::string_view word,
                                     const std::vector<std::string>& candidates);

}  // namespace pipeline
