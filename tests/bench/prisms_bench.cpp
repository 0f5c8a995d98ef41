// Compares the scan conversion of prisms with its peers; see prisms.sh. Converts a model by one
// method and prints CPU seconds, peak memory in MB, the largest error of a distance in voxels and
// the number of voxels with a wrong sign. Or counts saddle vertices and gaps of prisms as
// published.
//
//   prisms_bench METHOD MODEL GRID WIDTH
//   prisms_bench gaps
//
// METHOD: blocks, prisms, csc, openvdb. MODEL: sphere:LEVELS, knot, torus, seashell or a file.
// WIDTH: width of the band, both sides together, in the longest side of the object. GRID: number of
// voxels along the object with its band.

#include <fmt/core.h>
#include <openvdb/tools/MeshToVolume.h>
#include <tbb/parallel_for.h>

#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/convert/mesh_to_band_input.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/mesh_sign/triangle_distance.h"
#include "levelset/vdb.h"
#include "tests/bench/characteristics.h"
#include "tests/support/bisector_prisms.h"
#include "tests/support/sigg_meshes.h"

namespace {

using Imath::V3d;
using Imath::V3i;
using namespace levelset;
using support::BisectorPrisms;

TriMesh model(const std::string& name) {
  if (name.starts_with("sphere:")) return support::subdividedSphere(std::atoi(name.c_str() + 7));
  if (name == "knot") return support::trefoilTube(0.4, 120, 12);
  if (name == "torus") return support::torusMesh(1, 0.4, 75, 40);
  if (name == "seashell") return support::seaShell(61, 15);
  return readMesh(name);
}

/// CPU seconds of all threads.
double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Largest resident set so far, MB.
double peakMemory() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == "VmHWM:") {
      double kilobytes = 0;
      status >> kilobytes;
      return kilobytes / 1024;
    }
  return 0;
}

struct Errors {
  double worst = 0;  // voxels
  std::size_t wrongSigns = 0;
};

/// Compares a field with the exact band. That of prisms has the bits of that of blocks.
template <typename At>
Errors errorsOf(const NarrowBand& exact, const At& at) {
  Errors errors;
  const double voxel = exact.voxelSize();
  for (auto it = vdb(exact).cbeginValueOn(); it; ++it) {
    const auto truth = static_cast<double>(*it) / voxel;
    const double value = at(it.getCoord());
    errors.worst = std::max(errors.worst, std::abs(std::abs(value) - std::abs(truth)));
    errors.wrongSigns += truth != 0 && (value < 0) != (truth < 0);
  }
  return errors;
}

void convertBy(const std::string& method, const TriMesh& mesh, double voxel, double halfWidth) {
  const auto exact = [&](DistanceMethod by) {
    return meshToBand(mesh, voxel, {.halfWidth = halfWidth, .sign = SignMode::Closed, .method = by})
        .band;
  };
  const double start = cpuSeconds();
  double seconds = 0, memory = 0;
  const auto stop = [&] { seconds = cpuSeconds() - start, memory = peakMemory(); };
  Errors errors;
  if (method == "blocks" || method == "prisms") {
    const NarrowBand band =
        exact(method == "prisms" ? DistanceMethod::Prisms : DistanceMethod::Blocks);
    stop();
    if (method == "prisms") {
      auto accessor = vdb(band).getConstAccessor();
      errors = errorsOf(exact(DistanceMethod::Blocks), [&](const openvdb::Coord& c) {
        return static_cast<double>(accessor.getValue(c)) / voxel;
      });
    }
  } else if (method == "csc") {
    const V3i origin = levelset::convert::localOrigin(mesh, voxel);
    const auto local =
        levelset::convert::toLocal(mesh, levelset::convert::findTopology(mesh), voxel, origin);
    const characteristics::DenseBand band(local, halfWidth);
    stop();
    errors = errorsOf(exact(DistanceMethod::Prisms), [&](const openvdb::Coord& c) {
      return static_cast<double>(band.at(V3i(c.x(), c.y(), c.z()) - origin));
    });
  } else {
    std::vector<openvdb::Vec3s> points;
    for (const V3d& p : mesh.positions) points.emplace_back(p.x, p.y, p.z);
    std::vector<openvdb::Vec3I> triangles;
    for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    const auto grid = openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(
        *openvdb::math::Transform::createLinearTransform(voxel), points, triangles,
        static_cast<float>(halfWidth));
    stop();
    auto accessor = grid->getConstAccessor();
    errors = errorsOf(exact(DistanceMethod::Prisms), [&](const openvdb::Coord& c) {
      return static_cast<double>(accessor.getValue(c)) / voxel;
    });
  }
  fmt::print("{:.2f} {:.0f} {:.2g} {}\n", seconds, memory, errors.worst, errors.wrongSigns);
}

/// Prints saddles, gaps, and errors of the published prisms at random points of the band.
void countGaps(const char* name, const TriMesh& mesh, double width) {
  const V3d size = bounds(mesh).size();
  const double reach = width / 2 * std::max({size.x, size.y, size.z});
  const levelset::convert::LocalMesh local{mesh.positions, mesh.triangles};
  const BisectorPrisms kept(local, reach, BisectorPrisms::Gaps::Keep),
      repaired(local, reach, BisectorPrisms::Gaps::Repair);
  std::vector<levelset::convert::TriangleFrame> frames;
  for (std::size_t t = 0; t < local.triangles.size(); ++t)
    frames.emplace_back(local.corner(t, 0), local.corner(t, 1), local.corner(t, 2));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> between(-1, 1);
  std::uniform_int_distribution<std::size_t> any(0, local.triangles.size() - 1);
  std::size_t uncovered = 0, wrong = 0;
  double worst = 0;
  const std::size_t points = std::max<std::size_t>(2000, 150'000'000 / frames.size());
  for (std::size_t n = 0; n < points; ++n) {
    const std::size_t at = any(random);
    V3d step(2);
    while (step.length2() > 1) step = V3d(between(random), between(random), between(random));
    const V3d p =
        (local.corner(at, 0) + local.corner(at, 1) + local.corner(at, 2)) / 3 + step * reach;
    double nearest = 4 * reach * reach, inPrisms = nearest;
    bool isCovered = false;
    for (std::uint32_t t = 0; t < frames.size(); ++t) {
      const double squared = frames[t].squaredDistance(p);
      nearest = std::min(nearest, squared);
      isCovered = isCovered || kept.contains(t, p);
      if (repaired.contains(t, p)) inPrisms = std::min(inPrisms, squared);
    }
    const double error = std::sqrt(inPrisms) - std::sqrt(nearest);
    uncovered += !isCovered;
    wrong += error > 1e-6 * reach;
    worst = std::max(worst, error / reach);
  }
  const auto percent = [&](std::size_t part) {
    return 100 * static_cast<double>(part) / static_cast<double>(points);
  };
  fmt::print("{:9} {:8} {:8} {:6} {:10.3f} {:8.3f} {:8.2g}\n", name, kept.vertices(),
             kept.saddles(), kept.gaps(), percent(uncovered), percent(wrong), worst);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc == 2 && std::string(argv[1]) == "gaps") {
    fmt::print("{:9} {:>8} {:>8} {:>6} {:>10} {:>8} {:>8}\n", "mesh", "vertices", "saddles", "gaps",
               "in gaps %", "wrong %", "worst");
    for (const char* name : {"sphere:6", "torus", "knot", "seashell"})
      countGaps(name, model(name), 0.1);
    const std::string bunny = "data/models/bunny.obj";
    if (std::filesystem::exists(bunny)) countGaps("bunny", model(bunny), 0.1);
    return 0;
  }
  if (argc != 5) {
    fmt::print(stderr, "prisms_bench blocks|prisms|csc|openvdb MODEL GRID WIDTH\n");
    return 2;
  }
  const TriMesh mesh = model(argv[2]);
  const V3d size = bounds(mesh).size();
  const double grid = std::atof(argv[3]), width = std::atof(argv[4]);
  const double voxel = std::max({size.x, size.y, size.z}) * (1 + width) / grid;
  convertBy(argv[1], mesh, voxel, width / (1 + width) * grid / 2);
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
