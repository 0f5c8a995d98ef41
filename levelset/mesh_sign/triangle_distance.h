#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// A triangle in its own orthonormal frame (u, v, n): corner A at the origin, the longest edge AB
/// along u, corner C at (cx, cy) with cy ≥ 0. The squared distance of a point is the squared
/// distance in the plane plus the squared height above it [Jones95]. A triangle without area counts
/// as its longest edge or as a point.
class TriangleFrame {
 public:
  TriangleFrame() = default;
  TriangleFrame(const Imath::V3d& a, const Imath::V3d& b, const Imath::V3d& c);

  [[nodiscard]] double squaredDistance(const Imath::V3d& point) const;

 private:
  friend class ApproximateTriangle;
  Imath::V3d a_, u_, v_, n_;
  double length_ = 0, cx_ = 0, cy_ = 0;
  double inverseAc_ = 0, inverseBc_ = 0;  // 1 / squared length of AC and BC; 0 if the length is 0
};

/// A TriangleFrame in single precision, to exclude triangles that are not the nearest one.
class ApproximateTriangle {
 public:
  static constexpr std::size_t kPoints = 8;
  using Coordinates = std::array<float, kPoints>;

  ApproximateTriangle() = default;
  /// @param range  largest coordinate of the points, voxels
  ApproximateTriangle(const TriangleFrame& frame, float range);

  /// Computes the squared distances of eight points.
  void squaredDistances(const Coordinates& x, const Coordinates& y, const Coordinates& z,
                        Coordinates& squared) const;
  /// Absolute part of the error of squaredDistances(). Infinite for a triangle that is much longer
  /// or much shorter than a block, which single precision cannot represent.
  [[nodiscard]] float error() const { return error_; }

 private:
  std::array<float, 3> a_{}, u_{}, v_{}, n_{};
  float length_ = 0, cx_ = 0, cy_ = 0, inverseAc_ = 0, inverseBc_ = 0, error_ = 0;
};

/// Edge length, in grid points, of a block: a leaf node of the OpenVDB tree.
inline constexpr int kBlockDim = 8;
inline constexpr int kBlockVoxels = kBlockDim * kBlockDim * kBlockDim;

/// Distances, in voxels, from the 8³ grid points of a block to the nearest of given triangles. They
/// are exact up to `reach`. The block is divided into cells of 4³, then of 2³ points. Bounding
/// spheres exclude the triangles that cannot be nearest to any point of a cell. In a cell of 2³
/// points, distances in single precision exclude all but the nearest triangles of each point.
/// Reuses its scratch memory between blocks.
class BlockDistance {
 public:
  explicit BlockDistance(double reach) : reach_(reach) {}

  /// @param candidates  triangles, including all within reach of the block
  /// @param origin  lowest grid point of the block
  /// @return true when a grid point lies within `reach` of a triangle; else all distances are
  ///         `reach`
  bool measure(const LocalMesh& mesh, std::span<const std::uint32_t> candidates,
               const Imath::V3d& origin);

  /// Distances in voxels, x slowest, z fastest; `reach` for points that are further away.
  [[nodiscard]] const std::array<double, kBlockVoxels>& distances() const { return distances_; }

 private:
  // Bounding spheres of triangles, as a structure of arrays, so that loops over it vectorise.
  // `slot` is the index of the triangle in corners_.
  struct Spheres {
    std::vector<float> x, y, z, radius;
    std::vector<std::uint32_t> slot;
    std::size_t size = 0;
    void resize(std::size_t count);
  };
  void load(const LocalMesh& mesh, std::span<const std::uint32_t> candidates);
  void pass(const Spheres& from, const Imath::V3f& centre, float cellRadius, Spheres& to);
  void splitCell(int level, const Imath::V3f& centre);
  void measureCell(const Spheres& spheres, const Imath::V3f& centre);
  void approximate(std::uint32_t slot, std::size_t at);
  float squaredToCentres(const Spheres& spheres, const Imath::V3f& point);

  double reach_;
  Imath::V3d centre_;
  std::array<double, kBlockVoxels> distances_{};
  bool anyWithin_ = false;
  std::array<Spheres, 3> lists_;  // bounding spheres of the triangles that can be nearest in
                                  // the block, in its current 4³ cell and in its 2³ cell
  std::vector<float> squared_;    // squared distances to the sphere centres
  // Corners of the candidates, relative to the centre of the block.
  std::vector<std::array<Imath::V3d, 3>> corners_;
  std::vector<TriangleFrame> frames_;
  std::vector<ApproximateTriangle> approximate_;
  std::vector<char> hasFrame_;
  // Eight grid points of a 2³ cell, relative to the centre of the block, and for each triangle of
  // the cell the approximate squared distances from them.
  ApproximateTriangle::Coordinates x_{}, y_{}, z_{};
  std::vector<ApproximateTriangle::Coordinates> near_;
  std::vector<std::uint32_t> kept_;  ///< triangles of the cell with an entry in `near_`
};

}  // namespace levelset::convert
