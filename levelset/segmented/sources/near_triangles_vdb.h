#pragma once

// Internal header of levelset. Includes OpenVDB: for .cpp files only.

#include <Imath/ImathVec.h>
#include <openvdb/Types.h>

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace levelset {

/// Triangles near grid points: those that may meet the cube of a voxel around a point. Index
/// coordinates.
class NearTriangles {
 public:
  using Entry = std::pair<openvdb::Coord, std::uint32_t>;  ///< grid point and triangle

  NearTriangles() = default;
  /// Refers to both lists.
  NearTriangles(const std::vector<std::array<std::uint32_t, 3>>& triangles,
                const std::vector<Imath::V3d>& points);

  [[nodiscard]] std::span<const Entry> at(const openvdb::Coord& point) const;
  /// Returns true if the line between neighbouring grid points meets a triangle.
  [[nodiscard]] bool separate(const openvdb::Coord& a, const openvdb::Coord& b) const;
  /// Returns true if the line between grid points meets no triangle.
  [[nodiscard]] bool sees(const openvdb::Coord& from, const openvdb::Coord& to) const;

 private:
  [[nodiscard]] bool meets(const openvdb::Coord& from, const openvdb::Coord& to,
                           const openvdb::Coord& at) const;
  [[nodiscard]] std::array<Imath::V3d, 3> corners(std::uint32_t triangle) const {
    const auto& t = (*triangles_)[triangle];
    return {(*points_)[t[0]], (*points_)[t[1]], (*points_)[t[2]]};
  }

  const std::vector<std::array<std::uint32_t, 3>>* triangles_ = nullptr;
  const std::vector<Imath::V3d>* points_ = nullptr;
  std::vector<Entry> entries_;  ///< ascending
};

}  // namespace levelset
