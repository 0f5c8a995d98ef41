#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Text to numbers, the same in every locale: points are decimal points. Every function throws
/// levelset::UsageError whose sentence begins with `where` ("offset: --distance").
namespace pipeline {

enum class Unit { World, Voxels, Percent };

/// A length as it was written: `0.5`, `2vx`, `1%`. A world unit may be written as `0.5mm`.
struct Length {
  double number = 0;
  Unit unit = Unit::World;
};

[[nodiscard]] double parseNumber(std::string_view text, std::string_view where);
[[nodiscard]] long parseInteger(std::string_view text, std::string_view where);
[[nodiscard]] Length parseLength(std::string_view text, std::string_view where);
/// "x,y,z"
[[nodiscard]] Imath::V3d parsePoint(std::string_view text, std::string_view where);
/// Points separated by blanks.
[[nodiscard]] std::vector<Imath::V3d> parsePoints(std::string_view text, std::string_view where);
/// "lo hi": two points, lo below hi on every axis.
[[nodiscard]] Imath::Box3d parseBox(std::string_view text, std::string_view where);
/// "WxH", each at least 1.
[[nodiscard]] std::pair<int, int> parseImageSize(std::string_view text, std::string_view where);
/// "a,b" or "a,b,c": `count` lengths.
[[nodiscard]] std::vector<Length> parseLengths(std::string_view text, std::size_t count,
                                               std::string_view where);
/// "4G", "512M", "1.5T", "100000": bytes, with powers of 1024.
[[nodiscard]] std::size_t parseBytes(std::string_view text, std::string_view where);
/// 16 numbers, or 12 (the last column 0 0 0 1 left out), separated by commas or blanks; acts on row
/// vectors, translation in the last row.
[[nodiscard]] Imath::M44d parseMatrix(std::string_view text, std::string_view where);
/// One number, or three separated by commas.
[[nodiscard]] std::vector<double> parseNumbers(std::string_view text, std::string_view where);

/// The candidate nearest to `word`, if near enough to be meant; else empty.
[[nodiscard]] std::string didYouMean(std::string_view word,
                                     const std::vector<std::string>& candidates);

}  // namespace pipeline
