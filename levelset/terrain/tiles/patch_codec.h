#pragma once

// Internal header of levelset: public headers must not include it.

#include <span>
#include <string>
#include <string_view>

/// Compression of the heights of one patch.
namespace levelset::terrain {

/// Step between the heights that a tolerance allows: the largest number of five significant bits
/// that is at most twice the tolerance. Multiples of it are floats while they have at most 19 bits.
/// @return 0 for a tolerance of 0
[[nodiscard]] double heightStep(double tolerance);

/// Height that is stored in place of a height. With a tolerance it is the nearest multiple of the
/// step, if that multiple as a float is within the tolerance. Otherwise it is the height itself.
/// Missing heights get the same bits.
[[nodiscard]] float storedHeight(float height, double step, double tolerance);

/// Compresses heights without loss. Of missing heights only the place is stored.
/// @param heights  width × height floats, row by row; finite or NaN
/// @param step     0, or a step of which most heights are multiples
[[nodiscard]] std::string encodeHeights(std::span<const float> heights, int width, double step);

/// Restores the bits of heights. Missing ones are kMissingHeight.
/// @param heights  as for encodeHeights(); receives the result
/// @return false if the bytes are none of encodeHeights()
[[nodiscard]] bool decodeHeights(std::string_view bytes, int width, double step,
                                 std::span<float> heights);

}  // namespace levelset::terrain
