// Compares the depths of two EXR pictures of one view.
// depth_agreement A.exr B.exr VOXEL [USUAL LARGEST]
// Pixels at silhouettes are left out, see tests/support/picture_agreement.h; the step is three
// voxels. Exit code 5 if a difference exceeds LARGEST voxels, or if more than 0.1 % exceed USUAL.

#include "tests/support/picture_agreement.h"

#include <fmt/core.h>

#include <cstdlib>
#include <exception>

int main(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr, "depth_agreement A.exr B.exr VOXEL [USUAL LARGEST]\n");
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
    if (argc < 6) return 0;
    const auto isWithin = [&](double difference, const char* voxels) {
      return difference <= std::strtod(voxels, nullptr) * voxel;
    };
    return isWithin(found.p999, argv[4]) && isWithin(found.largest, argv[5]) ? 0 : 5;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 3;
  }
}
