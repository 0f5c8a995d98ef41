#pragma once

// Internal header of levelset: public headers must not include it.

#include <limits>
#include <vector>

#include "levelset/isosurface/isosurface.h"
#include "levelset/isosurface/surface_pieces.h"
#include "levelset/isosurface/trilinear_piece.h"

namespace levelset::trilinear {

/// Boundary of the solid of all points whose trilinear value lies in a range. Positions are in
/// voxels of the result, relative to the grid point base(), so that integers are grid points.
class TrilinearSurface {
 public:
  /// @param halfWidth  largest distance that will be asked for, voxels
  /// @throws ResourceLimit, Cancelled
  TrilinearSurface(const Volume& volume, const ValueRange& range, double voxelSize,
                   double halfWidth, std::size_t maxMemory, const Progress& progress);

  /// Item that was closest to the last position.
  struct Hint {
    std::size_t item = std::numeric_limits<std::size_t>::max();
  };
  /// Distance from the surface, voxels; `most` or more if it is at least `most`.
  [[nodiscard]] double distance(const Vec3d& position, double most, Hint& hint) const;
  [[nodiscard]] bool isInside(const Vec3d& position) const;

  /// Grid point of the result that is the origin of positions.
  [[nodiscard]] const openvdb::Coord& base() const { return base_; }
  /// Number of pieces and border faces.
  [[nodiscard]] std::size_t itemCount() const { return pieces_.size() + faces_.size(); }
  /// Bounds of the surface in an item.
  void bound(std::size_t item, Vec3d& low, Vec3d& high) const;
  [[nodiscard]] const IsosurfaceReport& report() const { return report_; }

 private:
  using SlabOfPieces = SlabOf<Piece>;
  using Corners = std::array<float, 8>;

  void placeFrame(double halfWidth);
  void collectSlab(int k, SlabOfPieces& out) const;
  void split(const Corners& corner, const std::array<float, 3>& first, int level,
             std::vector<Piece>& out) const;
  void setBounds(Piece& piece) const;
  void collectFaces(std::size_t maxMemory);
  void addFace(int axis, bool isHigh, int a, int b);
  /// Function number n at a grid point: positive inside, in units of the range of the values.
  [[nodiscard]] float functionAt(int n, double stored) const;
  [[nodiscard]] double squaredTo(std::size_t item, const Vec3d& position, const Vec3d& index,
                                 double best) const;
  [[nodiscard]] Vec3d place(const Vec3d& index) const { return origin_ + index * axes_; }

  const Volume& volume_;
  ValueLimits limits_;
  double unit_ = 1;  ///< range of the values of the volume
  double voxelSize_ = 1;
  openvdb::Coord base_;
  Vec3d origin_;          ///< position of index 0
  Mat3d axes_, toIndex_;  ///< rows: edges of a cell; inverse
  // For each level of splitting: inner products of the edges, and their inverse.
  static constexpr int kMostLevels = 4;
  std::array<Mat3d, kMostLevels> metric_, inverse_;
  std::vector<Piece> pieces_;
  std::vector<BorderFace> faces_;
  PieceTree tree_;
  IsosurfaceReport report_;
};

}  // namespace levelset::trilinear
