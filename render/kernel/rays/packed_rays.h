#pragma once

// Private to the kernel: rays of any origin as its input.

#include <Imath/ImathVec.h>

#include <cstddef>
#include <vector>

#include "render/kernel/kernel_scene.h"

namespace render {

/// The rays of a list that meet the box of a solid's blocks, as input of the kernel. They start at
/// the box, and their parameter counts in voxels from there.
class PackedRays {
 public:
  /// @param asked  indices in `rays` of the rays to pack; rays that miss the box are left out
  /// @param hasEnd  true: rays end at their maxDistance; false: they continue to the last surface
  PackedRays(const KernelSolid& solid, const std::vector<LightRay>& rays,
             const std::vector<std::size_t>& asked, bool hasEnd);

  /// Distance from the origin of packed ray n to its start at the box, voxels.
  [[nodiscard]] double enter(std::size_t n) const { return exact_[n].enter; }
  /// Start and direction of packed ray n in double precision, table space.
  [[nodiscard]] const Imath::V3d& start(std::size_t n) const { return exact_[n].start; }
  [[nodiscard]] const Imath::V3d& direction(std::size_t n) const { return exact_[n].direction; }

  std::vector<std::size_t> number;  ///< index of each packed ray in the list
  RayBlock block{0};

 private:
  struct Exact {
    Imath::V3d start, direction;
    double enter, length;
  };
  std::vector<Exact> exact_;
};

}  // namespace render
