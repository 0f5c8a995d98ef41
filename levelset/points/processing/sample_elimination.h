#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/progress.h"

// Internal header of levelset/points/processing.

namespace levelset::points {

/// Returns a well-mixed number for each pair of seed and index.
[[nodiscard]] inline std::uint64_t mixed(std::uint64_t seed, std::uint64_t index) {
  std::uint64_t x = seed * 0x9e3779b97f4a7c15ull + index + 0x632be59bd9b4e019ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  x ^= x >> 31;
  x = (x + 0x9e3779b97f4a7c15ull) * 0xd6e8feb86659fd93ull;
  return x ^ (x >> 32);
}

/// Chooses points no two of which are nearer than `radius`, such that each other point is nearer
/// than `radius` to a chosen one. The choice among near points is pseudo-random.
/// @return the numbers of the chosen points, ascending
[[nodiscard]] std::vector<std::uint32_t> poissonDisk(const std::vector<Imath::V3d>& positions,
                                                     double radius, const Progress& progress);

/// Removes points until `count` remain, each time the one with the most crowded neighbourhood
/// [Yuksel15].
/// @param greatest  distance between neighbours if `count` points were a hexagonal lattice on the
///        surface, world units. No set of that many points has a greater least distance.
/// @return the numbers of the points that remain, ascending
[[nodiscard]] std::vector<std::uint32_t> eliminateSamples(const std::vector<Imath::V3d>& positions,
                                                          std::size_t count, double greatest,
                                                          const Progress& progress);

}  // namespace levelset::points
