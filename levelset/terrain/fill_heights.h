#pragma once

#include "levelset/terrain/height_field.h"

/// Heights for samples without data.
namespace levelset {

struct FillOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Gives missing samples the heights of a harmonic function: each one is the mean of its four
/// neighbours, weighted by the inverse squares of their distances. At the border of the field the
/// neighbours beyond it do not count, so the ground runs out level there. Known samples keep
/// their bits, and filled heights lie between the least and the greatest height beside the hole.
/// Conjugate gradients solve the equations of each hole to 1e-10 of the range of its heights.
/// @throws InvalidInput when no sample has data, and for a field that requireHeights() refuses
/// @throws NumericalError when the equations do not converge
/// @throws ResourceLimit, Cancelled
[[nodiscard]] HeightField filledHeights(HeightField field, const FillOptions& options = {});

}  // namespace levelset
