#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "levelset/points/creases/crease_network.h"

namespace levelset::points {

/// Position on two pieces, from an edge of the graph between them.
struct CreaseSample {
  Imath::V3d position;
  std::array<Imath::V3d, 2> normals;
  double spacing;
};

/// Samples of the curves between two pieces.
struct PairSamples {
  std::array<std::uint32_t, 2> pieces;  ///< ascending
  std::vector<CreaseSample> samples;
  std::size_t lost = 0;  ///< edges of the graph without a position on both pieces
};

/// Finds the samples of all pairs of pieces, in ascending order of the pairs.
[[nodiscard]] std::vector<PairSamples> sampleCreases(const PointSurface& whole,
                                                     const PointSurface& divided,
                                                     const Pieces& pieces);

/// Finds the corners. Where four or more pieces meet in one, it is the least-squares solution.
[[nodiscard]] std::vector<CreaseCorner> findCorners(const PointSurface& whole,
                                                    const PointSurface& divided,
                                                    const Pieces& pieces);

}  // namespace levelset::points
