// Converts a mesh several times and prints the median CPU seconds of a conversion, without reading.
//
//   mesh_to_band_bench FILE VOXEL RUNS closed
//
// winding
// search

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <string>
#include <vector>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/mesh_files/mesh_file.h"

namespace {

/// CPU seconds of all threads.
double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double convertOnce(const levelset::TriMesh& mesh, double voxel, const std::string& what) {
  using namespace levelset;
  const double start = cpuSeconds();
  if (what == "search")
    (void)countSelfIntersections(mesh);
  else
    (void)meshToBand(mesh, voxel,
                     {.sign = what == "closed" ? SignMode::Closed : SignMode::Winding});
  return cpuSeconds() - start;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 5) {
    fmt::print(stderr, "mesh_to_band_bench FILE VOXEL RUNS closed|winding|search\n");
    return 2;
  }
  const levelset::TriMesh mesh = levelset::readMesh(argv[1]);
  std::vector<double> seconds(static_cast<std::size_t>(std::max(1, std::atoi(argv[3]))));
  for (double& s : seconds) s = convertOnce(mesh, std::atof(argv[2]), argv[4]);
  std::sort(seconds.begin(), seconds.end());
  fmt::print("{:.3f}\n", seconds[seconds.size() / 2]);
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
