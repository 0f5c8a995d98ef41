#pragma once

// Interfaces near junctions, for segmentedToMesh(). Includes OpenVDB: for .cpp files only.

#include <Imath/ImathVec.h>

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {

/// Signed distance to an interface near a point, as a quadratic polynomial. Index coordinates.
struct InterfaceFit {
  static constexpr std::size_t kTerms = 10;

  Imath::V3d about = Imath::V3d(0);
  std::array<double, kTerms> c{};

  [[nodiscard]] double value(const Imath::V3d& p) const;
  [[nodiscard]] Imath::V3d gradient(const Imath::V3d& p) const;
};

/// Fits the interfaces near a block. They are extended smoothly up to a junction, also those that
/// end there. Only the grid points to which an interface is the nearest one determine its fit. Some
/// of them may be closest to the end of the interface, or beyond a crease; their distances count as
/// far as they agree with the others.
class JunctionFit {
 public:
  /// @param origin  of the block, index coordinates
  JunctionFit(const SegmentedData& data, const openvdb::Coord& origin);

  /// Fits the interface between two regions.
  /// @param about  position in the block
  /// @return empty when too few grid points know the interface
  [[nodiscard]] std::optional<InterfaceFit> fit(RegionLabel a, RegionLabel b,
                                                const Imath::V3d& about);

 private:
  static constexpr int kReach = 3;  // of the samples of a fit, voxels
  static constexpr int kPad = kReach;
  static constexpr int kSide = 8 + 1 + 2 * kPad;
  [[nodiscard]] static std::size_t index(int x, int y, int z) {
    return static_cast<std::size_t>(((x + kPad) * kSide + y + kPad) * kSide + z + kPad);
  }
  struct Sample {
    float distance;  ///< voxels
    RegionLabel label, neighbour;
  };

  openvdb::Coord origin_;
  std::vector<Sample> samples_;
};

/// Finds the point on all of the interfaces that is closest to `start`.
/// @return empty when two or more interfaces are nearly parallel, or the point is too far from
/// where
///         they were fitted
[[nodiscard]] std::optional<Imath::V3d> meet(std::span<const InterfaceFit> interfaces,
                                             const Imath::V3d& start);

}  // namespace levelset
