#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace levelset {

/// Rims and junctions of a mesh: edges with one triangle, edges with three or more, and the lines
/// along which triangles cross each other.
class SheetFeatures {
 public:
  enum class Kind : std::uint8_t { Rim, Junction };

  /// @param points  vertices, voxels
  /// @param crossing  pairs of triangles that meet without sharing edges
  SheetFeatures(const std::vector<Imath::V3d>& points,
                const std::vector<std::array<std::uint32_t, 3>>& triangles,
                const std::vector<std::pair<std::uint32_t, std::uint32_t>>& crossing);

  /// Finds the point where a rim or junction passes through a face of the grid; if none does, its
  /// closest point up to a voxel away.
  /// @param near  of several points the one closest to this one is returned
  [[nodiscard]] std::optional<Imath::V3d> onFace(Kind kind, const std::array<Imath::V3d, 3>& face,
                                                 const Imath::V3d& near) const;
  /// Finds the closest point of a rim or junction, up to a voxel away.
  [[nodiscard]] std::optional<Imath::V3d> closest(Kind kind, const Imath::V3d& to) const;

  /// Points where junctions end, branch or meet a rim.
  [[nodiscard]] const std::vector<Imath::V3d>& ends() const { return ends_; }
  /// Points where a rim bends.
  [[nodiscard]] const std::vector<Imath::V3d>& corners() const { return corners_; }
  [[nodiscard]] std::size_t rimCount() const { return rims_; }  ///< edges of the mesh

 private:
  /// Part of a rim or junction, at most a voxel long.
  struct Piece {
    Imath::V3d from, to;
    Kind kind;
  };

  void addLine(const Imath::V3d& from, const Imath::V3d& to, Kind kind);
  void sortPieces();
  template <class Visit>
  void forEachPiece(const Imath::V3d& low, const Imath::V3d& high, Kind kind,
                    const Visit& visit) const;

  std::vector<Piece> pieces_;
  std::vector<std::pair<Imath::V3i, std::uint32_t>> cells_;  ///< pieces by the cells of their boxes
  std::vector<Imath::V3d> ends_, corners_;
  std::size_t rims_ = 0;
};

}  // namespace levelset
