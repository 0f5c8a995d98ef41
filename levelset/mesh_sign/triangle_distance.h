#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// A triangle in a frame of its own: A at the origin, its longest edge AB along u, C above it at
/// (cx, cy). The distance of a point is then a problem of the plane plus a height [Jones95].
/// Triangles without area keep their longest edge, or their point, and measure to that.
class TriangleFrame {
 public:
  TriangleFrame() = default;
  TriangleFrame(const Imath::V3d& a, const Imath::V3d& b, const Imath::V3d& c);

  [[nodiscard]] double squaredDistance(const Imath::V3d& point) const;

 private:
  Imath::V3d a_, u_, v_, n_;
  double length_ = 0, cx_ = 0, cy_ = 0;
  double inverseAc_ = 0, inverseBc_ = 0;  // 1 / squared length; 0 for a point
};

/// Edge of a block: the leaf nodes of the tree.
inline constexpr int kBlockDim = 8;
inline constexpr int kBlockVoxels = kBlockDim * kBlockDim * kBlockDim;

/// Distances of the 8³ grid points of a block to the nearest of some triangles: exact, but only as
/// far as `reach`. Cells of 4³ and 2³ points pass on only the triangles that can be nearest to one
/// of their points, judged by bounding spheres. Keeps its scratch memory from block to block.
class BlockDistance {
 public:
  explicit BlockDistance(double reach) : reach_(reach) {}

  /// @param candidates  triangles; all that come within reach of the block must be among them
  /// @param origin      the block's lowest grid point
  /// @return true when a point lies within reach; distances() holds them all
  bool measure(const LocalMesh& mesh, std::span<const std::uint32_t> candidates,
               const Imath::V3d& origin);

  /// In voxels, `reach` for points that lie no nearer; x slowest, z fastest.
  [[nodiscard]] const std::array<double, kBlockVoxels>& distances() const { return distances_; }

 private:
  struct Spheres {  // structure of arrays: the loops over it vectorise
    std::vector<float> x, y, z, radius;
    std::vector<std::uint32_t> slot;
    std::size_t size = 0;
    void resize(std::size_t count);
  };
  void load(const LocalMesh& mesh, std::span<const std::uint32_t> candidates);
  void pass(const Spheres& from, const Imath::V3f& centre, float cellRadius, Spheres& to);
  void splitCell(int level, const Imath::V3f& centre);
  double nearest(const Spheres& spheres, const Imath::V3f& point);
  double squaredDistance(std::uint32_t slot, const Imath::V3f& point);
  float squaredToCentres(const Spheres& spheres, const Imath::V3f& point);

  double reach_;
  Imath::V3d centre_;
  std::array<double, kBlockVoxels> distances_{};
  bool anyWithin_ = false;
  std::array<Spheres, 3> lists_;  // of the block, of a 4³ cell, of a 2³ cell
  std::vector<float> squared_;
  std::vector<std::array<Imath::V3d, 3>> corners_;  // about the block's centre
  std::vector<TriangleFrame> frames_;
  std::vector<char> hasFrame_;
};

}  // namespace levelset::convert
