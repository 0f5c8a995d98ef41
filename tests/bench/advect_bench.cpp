// Times Enright's deformation, forward and back, beside OpenVDB's own advection (HJ-WENO5, TVD-RK3)
// on the same grid in one run. The velocity is first a function, then a staggered grid of the same
// voxels. Both programs read it with the same sampler. Exits 1 when the ratio of the front's CPU
// seconds to OpenVDB's exceeds a bound or cannot be computed.
// Usage: advect_bench [function=BOUND] [staggered=BOUND] [csv=FILE] [RESOLUTION …]
// csv=FILE writes the rows as docs/figures/advect.csv has them, for tests/figures.py.

#include <fmt/core.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "apps/regress/peers/peer.h"
#include "levelset/advection/advect.h"
#include "levelset/advection/velocity.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"

namespace {

using Imath::V3d;
using levelset::NarrowBand;

constexpr double kRadius = 0.15, kPeriod = 3;
const V3d kCenter(0.35);

double cpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// Mean distance from the ball, in voxels, of the zeros that linear interpolation finds on grid
/// edges.
double surfaceError(const NarrowBand& band) {
  const openvdb::FloatGrid& grid = levelset::vdb(band);
  const auto accessor = grid.getConstAccessor();
  double sum = 0, count = 0;
  for (auto it = grid.cbeginValueOn(); it; ++it)
    for (int axis = 0; axis < 3; ++axis) {
      openvdb::Coord next = it.getCoord();
      ++next[axis];
      const auto a = static_cast<double>(*it), b = static_cast<double>(accessor.getValue(next));
      if ((a < 0) == (b < 0)) continue;
      openvdb::Vec3d place = it.getCoord().asVec3d();
      place[axis] += a / (a - b);
      const V3d world = levelset::toImath(grid.indexToWorld(place));
      sum += std::abs((world - kCenter).length() - kRadius);
      ++count;
    }
  return sum / count / band.voxelSize();
}

/// Rows of the result file; empty without one.
std::string rows;

/// @return CPU seconds
template <typename Run>
double show(const char* name, int resolution, const NarrowBand& ball, const Run& run) {
  const double start = cpuSeconds();
  const NarrowBand result = run();
  const double seconds = cpuSeconds() - start;
  const double volume = levelset::measure(result).volume / levelset::measure(ball).volume - 1;
  const double surface = surfaceError(result);
  fmt::print("{:>4}  {:<18} volume {:+8.3f} %  surface L1 {:7.4f} voxels  {:7.1f} s CPU\n",
             resolution, name, 100 * volume, surface, seconds);
  const bool isPeer = std::string(name).starts_with("OpenVDB");
  rows += fmt::format("advect_bench,\"{}\",{},{},{:.9g},{:.9g},{:.9g}\n", name,
                      isPeer ? "OpenVDB" : "levelsmith", resolution, surface, volume, seconds);
  return seconds;
}

/// Largest accepted ratio of the front's time to OpenVDB's, by the name of the velocity.
using Bounds = std::map<std::string, double>;

/// @return true if a bound is exceeded
bool judge(const Bounds& bounds, const char* velocity, double ours, double theirs) {
  const double ratio = ours / theirs;
  fmt::print("      front / OpenVDB, {:<9} {:6.2f}", velocity, ratio);
  const auto bound = bounds.find(velocity);
  const bool isMissed = bound != bounds.end() && !(ratio <= bound->second);
  if (bound != bounds.end())
    fmt::print("  bound {:.2f}{}", bound->second, isMissed ? "  missed" : "");
  fmt::print("\n");
  return isMissed;
}

bool hasRatio(const std::string& velocity) {
  return velocity == "function" || velocity == "staggered";
}

NarrowBand theirs(const NarrowBand& ball, const levelset::VectorField& velocity) {
  return regress::peer::advect(ball, velocity, kPeriod, true);
}

}  // namespace

int main(int count, char** arguments) {
  using Scheme = levelset::AdvectScheme;
  Bounds bounds;
  std::vector<int> resolutions;
  std::string file;
  for (int i = 1; i < count; ++i) {
    const std::string argument = arguments[i];
    const std::size_t equals = argument.find('=');
    if (equals == std::string::npos)
      resolutions.push_back(std::atoi(argument.c_str()));
    else if (argument.starts_with("csv="))
      file = argument.substr(4);
    else
      bounds[argument.substr(0, equals)] = std::atof(argument.c_str() + equals + 1);
  }
  if (resolutions.empty()) resolutions.push_back(64);
  bool isMissed = false;
  for (const auto& [velocity, bound] : bounds)
    if (!hasRatio(velocity)) {
      fmt::print("{} has a bound of {} and no ratio\n", velocity, bound);
      isMissed = true;
    }
  const levelset::VectorField function = levelset::enrightVelocity(kPeriod);
  for (const int resolution : resolutions) {
    const double voxel = 1.0 / resolution;
    const NarrowBand ball = levelset::makeSphere(kRadius, kCenter, voxel);
    const auto ours = [&](Scheme scheme, const levelset::VectorField& velocity) {
      return levelset::advect(ball, velocity, kPeriod, {.scheme = scheme}).band;
    };
    const double front =
        show("front", resolution, ball, [&] { return ours(Scheme::Front, function); });
    const double peer = show("OpenVDB", resolution, ball, [&] { return theirs(ball, function); });
    isMissed |= judge(bounds, "function", front, peer);
    const levelset::VectorField still = regress::peer::staggered(function, voxel);  // at time 0
    const levelset::VectorField staggered = [&still](const V3d& p, double time) {
      return still(p, 0) * std::cos(M_PI * time / kPeriod);
    };
    const double frontOnGrid =
        show("front, staggered", resolution, ball, [&] { return ours(Scheme::Front, staggered); });
    const double peerOnGrid =
        show("OpenVDB, staggered", resolution, ball, [&] { return theirs(ball, staggered); });
    isMissed |= judge(bounds, "staggered", frontOnGrid, peerOnGrid);
    show("semi-lagrangian", resolution, ball,
         [&] { return ours(Scheme::SemiLagrangian, function); });
    show("upwind", resolution, ball, [&] { return ours(Scheme::Upwind, function); });
  }
  if (!file.empty()) {
    std::ofstream out(file);
    out << "case,variant,tool,resolution,surface_l1_vx,volume_error,cpu_s\n" << rows;
    if (!out.flush()) {
      fmt::print(stderr, "advect_bench: '{}' cannot be written\n", file);
      return 1;
    }
  }
  return isMissed ? 1 : 0;
}
