#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/isosurface/isosurface.h"
#include "levelset/isosurface/surface_pieces.h"
#include "levelset/isosurface/volume_frame.h"
#include "levelset/volumes/filters/filtered_volume.h"

namespace levelset {

/// Bounds that hold for a filter with any samples.
struct FilterBounds {
  /// Values lie within this factor times half the range of the samples, from its middle.
  double value = 1;
  /// Each second derivative along an axis is at most this factor times the largest second
  /// difference of the samples.
  double curvature = 1;
  bool usesMixed = false;  ///< the second differences include those along two axes
};

[[nodiscard]] FilterBounds boundsOf(VolumeFilter filter);

/// Boundary of the solid of all points whose filtered value lies in a range, inside the box of the
/// volume. Positions are those of a VolumeFrame.
///
/// Each cell of the volume is split into boxes. A box whose corners have values on both sides of a
/// limit holds a piece of the surface. A bound of the second derivatives tells where the surface
/// may pass between the corners of a box; such boxes are split, and boxes in which the surface may
/// bend strongly too. The smallest boxes have 1/16 of a cell's edge, so that only parts of the
/// surface that pass between points of that distance are missed. Distances are local minima that
/// Newton's method finds from a point of each piece that may be nearest.
class FilteredSurface {
 public:
  /// @param halfWidth  largest distance that will be asked for, voxels
  /// @pre `filter` is continuous
  /// @throws ResourceLimit, Cancelled
  FilteredSurface(const Volume& volume, VolumeFilter filter, const ValueRange& range,
                  double voxelSize, double halfWidth, std::size_t maxMemory,
                  const Progress& progress);

  /// Closest point of the last position.
  struct Hint {
    int function = -1;  ///< −1: none
    openvdb::Vec3d index;
  };
  /// Distance from the surface, voxels; `most` or more if it is at least `most`.
  [[nodiscard]] double distance(const openvdb::Vec3d& position, double most, Hint& hint) const;
  [[nodiscard]] bool isInside(const openvdb::Vec3d& position) const;

  [[nodiscard]] const openvdb::Coord& base() const { return frame_.base; }
  /// Number of pieces and parts of border faces.
  [[nodiscard]] std::size_t itemCount() const { return pieces_.size() + faces_.size(); }
  void bound(std::size_t item, openvdb::Vec3d& low, openvdb::Vec3d& high) const;
  [[nodiscard]] const IsosurfaceReport& report() const { return report_; }

 private:
  using Vec3d = openvdb::Vec3d;

  /// Box of index space, with the values at its corners.
  struct Box {
    Vec3d first;      ///< lowest corner
    double edge = 1;  ///< cells
    std::array<double, 8> value{};

    static Vec3d offset(std::size_t c) {
      return {static_cast<double>(c >> 2), static_cast<double>(c >> 1 & 1),
              static_cast<double>(c & 1)};
    }
    [[nodiscard]] Vec3d corner(std::size_t c) const { return first + edge * offset(c); }
  };

  /// Surface in a box.
  struct Piece {
    std::array<float, 3> first;   ///< lowest corner of the box, index coordinates
    std::array<float, 3> start;   ///< point of the surface, index coordinates
    std::array<float, 3> normal;  ///< unit normal there
    float radius = 0;             ///< distance of the furthest corner of the box from it
    /// Estimate, with a reserve, of the distance of the piece from its tangent plane.
    float bend = 0;
    float edge = 1;  ///< edge of the box, cells
    int function = 0;
  };
  struct Face {
    std::array<float, 3> low, high;  ///< bounds, in the frame of the search
  };
  struct Foot {
    Vec3d index;
    double squared = 0;      ///< squared distance, voxels²
    bool isMinimum = false;  ///< the search converged here, and not on the border
  };
  using SlabOfPieces = SlabOf<Piece>;
  class Descent;

  void collectSlab(int k, SlabOfPieces& out) const;
  void collectCell(const Imath::V3i& cell, double curvature, SlabOfPieces& out) const;
  /// @param curvature  bound of the second derivatives of the functions along each axis, per cell²
  void collectBox(const Box& box, int function, double curvature, SlabOfPieces& out) const;
  void collectFaces();
  [[nodiscard]] bool mayHoldSurface(const Imath::V3i& cell, double& curvature) const;
  /// @param slope  becomes the length of the function's gradient at the start of the piece, per
  /// cell
  [[nodiscard]] Piece pieceIn(const Box& box, int function, const Vec3d& inside,
                              const Vec3d& outside, double& slope) const;
  [[nodiscard]] double functionAt(int n, double value) const {
    const auto at = static_cast<std::size_t>(n);
    return limits_.sign[at] * (value - limits_.limit[at]) / unit_;
  }
  /// Smallest of the functions: positive inside the solid.
  [[nodiscard]] double depthAt(const Vec3d& index) const;
  [[nodiscard]] double valueAt(const Vec3d& index) const {
    return volume_.value({index[0], index[1], index[2]});
  }
  /// Lower bound, squared, of the distance of a position from a piece.
  [[nodiscard]] double squaredBound(const Piece& piece, const Vec3d& position) const;
  [[nodiscard]] double squaredToFaces(const Vec3d& position, double best) const;

  FilteredVolume volume_;
  VolumeFrame frame_;
  openvdb::Mat3d metric_;  ///< inner products of the edges of a cell
  double voxelSize_ = 1;
  ValueLimits limits_;
  double unit_ = 1;  ///< range of the values of the volume
  FilterBounds bounds_;
  Vec3d last_;  ///< index of the last grid point
  std::vector<Piece> pieces_;
  std::vector<Face> faces_;
  PieceTree tree_;
  IsosurfaceReport report_;
};

}  // namespace levelset
