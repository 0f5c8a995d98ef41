#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace render {

/// Segmented distances packed into bytes, as published for graphics hardware [Yamazaki03]: region
/// index times kBand, plus the distance to the nearest interface in levels, at most kFarthest. A
/// baseline for InterfaceCaster.
struct PackedDistances {
  static constexpr int kBand = 64;      ///< values of a region, D in the paper
  static constexpr int kFarthest = 63;  ///< clamped distance, δ in the paper
  static constexpr int kMostRegions = 256 / kBand;

  Imath::V3i size{0};                     ///< grid points along each axis
  Imath::V3d origin{0};                   ///< position of the grid point (0, 0, 0), world units
  double spacing = 1;                     ///< distance of grid points, world units
  double levelsPerLength = 1;             ///< levels for each world unit of distance
  std::vector<std::uint8_t> values = {};  ///< x fastest

  /// Value at a grid point; points beyond the border have the value of the border.
  [[nodiscard]] int at(int x, int y, int z) const;
  [[nodiscard]] static int regionOf(int value) { return value / kBand; }
  [[nodiscard]] static int levelsOf(int value) { return value % kBand; }
};

/// Region and distance to the nearest interface of a position.
struct RegionSample {
  int region = 0;       ///< index, from 0 to kMostRegions − 1
  double distance = 0;  ///< world units, ≥ 0
};

/// Samples a partition on a regular grid.
/// @param farthestVoxels  distance that has the value kFarthest, in grid spacings
/// @param sample  is called concurrently
/// @throws levelset::InvalidInput for a region index out of range
/// @throws levelset::UsageError for a size or spacing that is not positive
[[nodiscard]] PackedDistances packDistances(
    const Imath::V3i& size, const Imath::V3d& origin, double spacing, double farthestVoxels,
    const std::function<RegionSample(const Imath::V3d&)>& sample);

/// Vertex generation diagram [Yamazaki03]: for each pair of packed values, in front and behind,
/// whether an interface lies between the two samples, and where. Two samples have an interface
/// between them if their regions differ and their distances add up to less than the distance of the
/// samples.
///
/// The published test has two defects, which this table corrects. It also accepts two samples of
/// one region near a sheet. And it demands a sum that is strictly less, so that quantised distances
/// lose most crossings of a plane across the line of the samples; a tolerance keeps them.
class VertexDiagram {
 public:
  static constexpr int kSize = 256;

  struct Entry {
    bool isSurface = false;
    /// Share of the way from the front sample to the one behind, [0, 1].
    float share = 0;
  };

  /// @param regions  number of regions in use, up to PackedDistances::kMostRegions
  /// @param width  distance of the two samples, levels
  /// @param tolerance  levels; the published test has 0
  VertexDiagram(int regions, double width, double tolerance = 1);

  [[nodiscard]] const Entry& at(int front, int behind) const {
    return entries_[static_cast<std::size_t>(front) * kSize + static_cast<std::size_t>(behind)];
  }
  /// Rule without quantisation, for values that are not bytes.
  /// @param front, behind  distances to the nearest interface, levels; of different regions
  [[nodiscard]] static Entry entryOf(double front, double behind, double width, double tolerance);

 private:
  std::vector<Entry> entries_;
};

}  // namespace render
