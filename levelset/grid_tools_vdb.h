#pragma once

// Hashes of the contents of grids, and a check of their transforms. Includes OpenVDB, so include it
// from .cpp files only.

#include <cstdint>

#include "levelset/mix_hash.h"
#include "levelset/vdb.h"

namespace levelset {

/// Returns true if a transform is a rotation, uniform scale and translation, within a relative
/// tolerance of 1e-6.
[[nodiscard]] bool isSimilarity(const openvdb::math::Transform& transform);

/// Begins the hash of a grid with its transform and background.
template <typename GridT>
[[nodiscard]] std::uint64_t hashOfHeader(const GridT& grid) {
  std::uint64_t hash = 0x4c4556454c534d54ull;
  // Hashes the transform as the images of four points, because OpenVDB refuses to compute the
  // matrix for small voxels.
  for (int corner = 0; corner < 4; ++corner) {
    openvdb::Vec3d point(0);
    if (corner > 0) point[corner - 1] = 1;
    const openvdb::Vec3d world = grid.transform().indexToWorld(point);
    hash = mixBytes(hash, world.asPointer(), 3);
  }
  const typename GridT::ValueType background = grid.background();
  return mixBytes(hash, &background, 1);
}

/// Adds a leaf to the hash of its grid. Leaves are added in the order of the tree.
template <typename Leaf>
[[nodiscard]] std::uint64_t mixLeaf(std::uint64_t hash, const Leaf& leaf) {
  const openvdb::Coord origin = leaf.origin();
  hash = mixBytes(hash, origin.data(), 3);
  hash = mixBytes(hash, &leaf.valueMask(), 1);
  return mixBytes(hash, leaf.buffer().data(), Leaf::SIZE);
}

/// Completes the hash of a grid with its tiles, after all leaves.
template <typename GridT>
[[nodiscard]] std::uint64_t mixTiles(std::uint64_t hash, const GridT& grid) {
  // Tile values: outside the band they give the sign.
  auto it = grid.tree().cbeginValueAll();
  it.setMaxDepth(decltype(it)::LEAF_DEPTH - 1);
  for (; it; ++it) {
    const openvdb::CoordBBox box = it.getBoundingBox();
    const typename GridT::ValueType value = *it;
    hash = mixBytes(hash, box.min().data(), 3);
    hash = mixBytes(hash, &value, 1);
  }
  return hash;
}

/// Returns a hash of the transform, background, topology and values of a grid.
template <typename GridT>
[[nodiscard]] std::uint64_t gridHash(const GridT& grid) {
  std::uint64_t hash = hashOfHeader(grid);
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) hash = mixLeaf(hash, *leaf);
  return mixTiles(hash, grid);
}

}  // namespace levelset
