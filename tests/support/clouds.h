#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cmath>
#include <ostream>
#include <random>
#include <vector>

#include "levelset/rbf/sums/rbf_kernel.h"

namespace levelset::rbf {
/// Prints the kernel in test names.
inline void PrintTo(RbfKernel kernel, std::ostream* out) {
  constexpr std::array<const char*, 7> kNames = {"Biharmonic", "Triharmonic", "ThinPlate", "Sum",
                                                 "Laplacian",  "Gaussian",    "Wendland"};
  *out << kNames[static_cast<std::size_t>(kernel)];
}
}  // namespace levelset::rbf

/// Particles for RBF maps.
namespace support {

inline constexpr std::array kKernels = {
    levelset::rbf::RbfKernel::Biharmonic, levelset::rbf::RbfKernel::Triharmonic,
    levelset::rbf::RbfKernel::ThinPlate,  levelset::rbf::RbfKernel::Sum,
    levelset::rbf::RbfKernel::Laplacian,  levelset::rbf::RbfKernel::Gaussian,
    levelset::rbf::RbfKernel::Wendland};

struct Cloud {
  std::vector<Imath::V3d> points, targets;
  std::vector<char> near;

  void add(const Imath::V3d& point, const Imath::V3d& target, bool isNear = false) {
    points.push_back(point);
    targets.push_back(target);
    near.push_back(isNear);
  }
};

inline Imath::V3d bend(const Imath::V3d& p) {
  return {p.x + 0.05 * p.y * p.y, p.y + 0.1 * std::sin(p.z), p.z - 0.04 * p.x * p.y};
}
inline Imath::V3d affine(const Imath::V3d& p) {
  return {0.3 * p.x - 0.1 * p.y + 7, 0.2 * p.y + 0.4 * p.z - 3, 0.5 * p.z + 0.1 * p.x};
}

/// Slightly jittered lattice of spacing 1, moved far from the origin by `shift`.
template <typename Map>
Cloud lattice(int edge, const Map& map, const Imath::V3d& shift = Imath::V3d(0)) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> jitter(-0.2, 0.2);
  Cloud cloud;
  for (int i = 0; i < edge; ++i)
    for (int j = 0; j < edge; ++j)
      for (int k = 0; k < edge; ++k) {
        const Imath::V3d p(i + jitter(random), j + jitter(random), k + jitter(random));
        cloud.add(p + shift, map(p), k == 0);
      }
  return cloud;
}

}  // namespace support
