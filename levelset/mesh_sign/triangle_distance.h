#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// A triangle in a frame of its own: A at the origin, its longest edge AB along u, C above it at
/// (cx, cy). The distance of a point then reduces to a problem in the plane plus a height
/// [Jones95]. A triangle without area reduces to its longest edge or to a point.
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

/// Edge length of a block in grid points: a leaf node of the tree.
inline constexpr int kBlockDim = 8;
inline constexpr int kBlockVoxels = kBlockDim * kBlockDim * kBlockDim;

/// Distances of the 8³ grid points of a block to the nearest of given triangles. Distances are
/// exact up to `reach`. Cells of 4³ and 2³ points pass on only the triangles that can be nearest to
/// one of their points, by bounding spheres. Reuses its scratch memory between blocks.
class BlockDistance {
 public:
  explicit BlockDistance(double reach) : reach_(reach) {}

  /// @param candidates  triangles, including all within reach of the block
  /// @param origin  lowest grid point of the block
  /// @return true when a point lies within reach; distances() then holds all distances
  bool measure(const LocalMesh& mesh, std::span<const std::uint32_t> candidates,
               const Imath::V3d& origin);

  /// Distances in voxels, x slowest, z fastest; `reach` for points that are further away.
  [[nodiscard]] const std::array<double, kBlockVoxels>& distances() const { return distances_; }

 private:
  struct Spheres {  // structure of arrays, so that loops over it vectorise
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
  std::array<Spheres, 3> lists_;  // lists of the block, of a 4³ cell, of a 2³ cell
  std::vector<float> squared_;
  std::vector<std::array<Imath::V3d, 3>> corners_;  // relative to the centre of the block
  std::vector<TriangleFrame> frames_;
  std::vector<char> hasFrame_;
};

}  // namespace levelset::convert
