#pragma once

// Distances to regions near junctions. Includes OpenVDB: for .cpp files only.

#include <openvdb/tree/ValueAccessor.h>

#include <Imath/ImathVec.h>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "levelset/vdb.h"

namespace levelset {

/// Smooth functions that compete for space: each point belongs to the region with the least value,
/// or to a fixed region where its function is negative.
struct CompetingFields {
  std::vector<openvdb::FloatTree::Ptr> trees;  ///< world units
  std::vector<char> isFixed;
  double voxelSize = 1;
};

/// Finds the closest points of the interfaces near junctions. An interface is the zero set of a
/// difference of two functions, which is smooth beyond the junction where the interface ends. So
/// Newton's method finds closest points on it, and where it has ended, on the junction. Use one per
/// thread.
class JunctionDistances {
 public:
  explicit JunctionDistances(const CompetingFields& fields);

  /// Computes the distances of a grid point from the boundaries of regions, voxels.
  /// @param regions    at least three
  /// @param distances  result by region; negative where no closest point was found
  void find(const openvdb::Coord& at, std::span<const std::size_t> regions,
            std::vector<double>& distances);

 private:
  using Accessor = openvdb::tree::ValueAccessor<const openvdb::FloatTree>;
  struct Sample {
    double value;  ///< voxels
    Imath::V3d gradient;
  };
  [[nodiscard]] Sample sample(std::size_t region, const Imath::V3d& p) const;
  [[nodiscard]] double value(std::size_t region, const Imath::V3d& p) const;
  [[nodiscard]] Sample interface(std::size_t a, std::size_t b, const Imath::V3d& p) const;
  [[nodiscard]] std::optional<Imath::V3d> closest(const Imath::V3d& from, const Imath::V3d& start,
                                                  std::span<const std::size_t> meeting) const;
  [[nodiscard]] std::optional<std::size_t> intruder(const Imath::V3d& p,
                                                    std::span<const std::size_t> meeting,
                                                    std::span<const std::size_t> regions) const;

  const CompetingFields& fields_;
  std::vector<Accessor> accessors_;
};

}  // namespace levelset
