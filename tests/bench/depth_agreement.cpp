// Compares the depths of two EXR pictures of one view.
// depth_agreement A.exr B.exr VOXEL [LARGEST]
// Pixels at silhouettes are left out, see tests/support/picture_agreement.h; the step is three
// voxels. Exit code 5 if the largest difference exceeds LARGEST voxels.

#include "tests/support/picture_agreement.h"

#include <fmt/core.h>

#include <cstdlib>
#include <exception>

int main(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr, "depth_agreement A.exr B.exr VOXEL [LARGEST]\n");
    return 2;
  }
  try {
    const double voxel = std::strtod(argv[3], nullptr);
    const support::DepthAgreement found =
        support::compareDepths(render::readExr(argv[1]), render::readExr(argv[2]), 3 * voxel);
    fmt::print(
        "{} pixels in both pictures, {} in one only; {} compared: depths differ by {:.4f} voxel "
        "(median), {:.3f} (99.9 %), {:.3f} (largest, at {},{}); 99 % of all: {:.3f}\n",
        found.hits, found.unlike, found.compared, found.median / voxel, found.p999 / voxel,
        found.largest / voxel, found.worstX, found.worstY, found.p99OfAll / voxel);
    return argc > 4 && !(found.largest <= std::strtod(argv[4], nullptr) * voxel) ? 5 : 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 3;
  }
}
