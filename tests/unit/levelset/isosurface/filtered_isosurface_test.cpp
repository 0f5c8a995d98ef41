#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>

#include "levelset/error.h"
#include "levelset/isosurface/isosurface.h"
#include "levelset/vdb.h"
#include "levelset/volumes/filters/filtered_volume.h"
#include "levelset/volumes/synthetic.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"
#include "tests/support/volumes.h"

namespace filtered_isosurface_test {

using Imath::V3d;
using Imath::V3i;
using levelset::factsOf;
using levelset::FilteredVolume;
using levelset::isosurface;
using levelset::IsosurfaceResult;
using levelset::UsageError;
using levelset::ValueRange;
using levelset::Volume;
using levelset::VolumeFilter;
using levelset::VolumeGrid;
using support::BandError;
using support::cubeGrid;
using support::errorOf;
using support::measured;
using support::measuredOrder;
using support::refusal;
using support::sampled;

constexpr std::array kSmooth = {VolumeFilter::Tricubic,       VolumeFilter::BSpline,
                                VolumeFilter::BSplineQi,      VolumeFilter::WindowedSinc,
                                VolumeFilter::SuperQuadratic, VolumeFilter::CubicC1,
                                VolumeFilter::BccQuadratic};

double sphere(const V3d& p) {
  return p.length() - 0.8;
}

struct Expected {
  VolumeFilter filter;
  double order, error;  ///< order from 12 to 24 cells, and largest error with 24 cells
};

TEST(FilteredIsosurface, ConvergesToASphere) {
  for (const Expected& expected : {Expected{VolumeFilter::Trilinear, 1.9, 3.64e-3},
                                   {VolumeFilter::Tricubic, 3.12, 1.24e-4},
                                   {VolumeFilter::BSpline, 2.03, 4.92e-3},
                                   {VolumeFilter::BSplineQi, 3.86, 4.41e-5},
                                   {VolumeFilter::WindowedSinc, 1.97, 1.05e-3},
                                   {VolumeFilter::SuperQuadratic, 2.05, 3.72e-3},
                                   {VolumeFilter::CubicC1, 2.05, 3.73e-3},
                                   {VolumeFilter::BccQuadratic, 2.05, 3.79e-3}}) {
    SCOPED_TRACE(factsOf(expected.filter).name);
    std::array<double, 2> errors{};
    for (std::size_t n = 0; n < 2; ++n) {
      // Values that are not distances, with an equal gradient at the surface.
      const Volume volume =
          sampled(cubeGrid(12 << n), [](const V3d& p) { return std::tanh(-sphere(p)); });
      const IsosurfaceResult made = isosurface(volume, {.low = 0.0}, {.filter = expected.filter});
      EXPECT_EQ(made.report.closedArea, 0);
      const BandError error = errorOf(made.band, sphere);
      EXPECT_EQ(error.wrongSigns, 0u);
      errors[n] = error.largest();
    }
    EXPECT_GT(std::log2(errors[0] / errors[1]), measuredOrder(expected.order));
    EXPECT_LT(errors[1], measured(expected.error));
  }
}

/// Kernel of the tricubic filter along an axis, of a sample at 0.
double catmullRom(double x) {
  const double a = std::abs(x);
  if (a >= 2) return 0;
  return a < 1 ? 1 + a * a * (1.5 * a - 2.5) : 2 + a * (-4 + a * (2.5 - 0.5 * a));
}

/// Value 1 at some grid points, and 0 at the others.
Volume bright(int size, const std::function<bool(const V3i&)>& is) {
  return sampled({V3i(size), {}}, [&](const V3d& p) { return is(V3i(p)) ? 1.0 : 0.0; });
}

/// Position between low and high at which a function changes its sign.
double rootOf(const std::function<double(double)>& f, double low, double high) {
  const bool isPositive = f(low) > 0;
  for (int n = 0; n < 60; ++n) {
    const double middle = (low + high) / 2;
    ((f(middle) > 0) == isPositive ? low : high) = middle;
  }
  return low;
}

TEST(FilteredIsosurface, LiesBeyondTheSamplesWhereTheFilterDoes) {
  // Between two bright samples the tricubic filter has values up to 9/8.
  const Volume pair = bright(13, [](const V3i& p) { return p == V3i(6) || p == V3i(7, 6, 6); });
  const auto above =
      isosurface(pair, {.low = 1.05}, {.filter = VolumeFilter::Tricubic, .voxelSize = 0.1});
  const Imath::Box3d box = above.band.zeroSetBounds();
  const double x =
      rootOf([](double t) { return catmullRom(t) + catmullRom(t - 1) - 1.05; }, 0.5, 1);
  const double y = rootOf([](double t) { return 9.0 / 8 * catmullRom(t) - 1.05; }, 0, 0.5);
  // The surface bends along x, so linear interpolation of the distances is less exact there.
  EXPECT_NEAR(box.max.x, 6 + x, measured(1.4e-4));
  EXPECT_NEAR(box.min.x, 7 - x, measured(1.4e-4));
  EXPECT_NEAR(box.max.y, 6 + y, measured(1.4e-9));
  EXPECT_EQ(above.report.closedArea, 0);
  // Around a single bright sample there are six regions below 0, down to −2/27.
  const Volume single = bright(13, [](const V3i& p) { return p == V3i(6); });
  const auto below =
      isosurface(single, {.high = -0.05}, {.filter = VolumeFilter::Tricubic, .voxelSize = 0.1});
  const double far = rootOf([](double t) { return catmullRom(t) + 0.05; }, 4.0 / 3, 2);
  EXPECT_NEAR(below.band.zeroSetBounds().max.z, 6 + far, measured(1.4e-9));
  EXPECT_NEAR(below.band.zeroSetBounds().min.y, 6 - far, measured(1.4e-9));
  EXPECT_EQ(below.report.closedArea, 0);
}

TEST(FilteredIsosurface, FindsValuesBeyondTheSamplesAtTheBorder) {
  // The quadratic extension by −3 makes the B-spline −1/3 on the face x = 0.
  const Volume layer = bright(7, [](const V3i& p) { return p.x == 1; });
  const FilteredVolume f(layer, VolumeFilter::BSpline);
  EXPECT_NEAR(f.value(V3d(0, 3, 3)), -1.0 / 3, 1e-12);
  const auto made =
      isosurface(layer, {.low = -0.2}, {.filter = VolumeFilter::BSpline, .voxelSize = 0.05});
  const double x = rootOf([&](double t) { return f.value(V3d(t, 3, 3)) + 0.2; }, 0, 0.5);
  EXPECT_GT(x, 0.05);
  EXPECT_NEAR(made.band.zeroSetBounds().min.x, x, measured(1e-6));
}

TEST(FilteredIsosurface, HasTheSidesOfTheFilterBeyondTheSamples) {
  const Volume single = bright(7, [](const V3i& p) { return p == V3i(3); });
  for (const VolumeFilter filter : {VolumeFilter::BSplineQi, VolumeFilter::Tricubic}) {
    const auto made =
        isosurface(single, {.high = -0.005}, {.filter = filter, .voxelSize = 0.6, .halfWidth = 2});
    const FilteredVolume f(single, filter);
    std::size_t inside = 0;
    for (auto it = levelset::vdb(made.band).cbeginValueOn(); it; ++it) {
      const V3d p = V3d(it.getCoord().x(), it.getCoord().y(), it.getCoord().z()) * 0.6;
      if (std::max({p.x, p.y, p.z}) > 6 || std::min({p.x, p.y, p.z}) < 0) continue;
      inside += *it < 0;
      ASSERT_EQ(*it < 0, f.value(p) < -0.005) << factsOf(filter).name << p;
    }
    EXPECT_GT(inside, 20u) << factsOf(filter).name;
  }
}

TEST(FilteredIsosurface, RefusesIsovaluesThatTheFilterDoesNotReach) {
  // The largest value of the B-spline is 8/27 of a single bright sample.
  const Volume single = bright(9, [](const V3i& p) { return p == V3i(4); });
  const Volume dark = bright(9, [](const V3i& p) { return p != V3i(4); });
  const auto refused = [](const Volume& volume, VolumeFilter filter, double isovalue) {
    return refusal<levelset::NoSurface>(
        [&] { (void)isosurface(volume, {.low = isovalue}, {.filter = filter}); });
  };
  EXPECT_SAYS(refused(single, VolumeFilter::BSpline, 0.3),
              "the filter bspline has no surface here: no value");
  EXPECT_SAYS(refused(dark, VolumeFilter::BSpline, 0.7),
              "the filter bspline has no surface here: every value");
  EXPECT_NO_THROW((void)isosurface(single, {.low = 0.29},
                                   {.filter = VolumeFilter::BSpline, .voxelSize = 0.05}));
  EXPECT_SAYS(refused(single, VolumeFilter::Tricubic, 1.001), "no value");
  EXPECT_SAYS(refused(single, VolumeFilter::Tricubic, -0.075), "every value");
  EXPECT_SAYS(refused(single, VolumeFilter::Tricubic, 9), "no value");
  EXPECT_SAYS(refused(single, VolumeFilter::Trilinear, -0.01), "every value of the volume belongs");
}

/// Distances of the band against those to dense points of the surface, which are never nearer.
struct Excess {
  double further = 0, nearer = 0;  ///< voxels
  std::size_t wrongSides = 0, count = 0;
};

Excess againstDensePoints(const Volume& volume, VolumeFilter filter, double isovalue, int fine) {
  const FilteredVolume f(volume, filter);
  const IsosurfaceResult made =
      isosurface(volume, {.low = isovalue}, {.filter = filter, .halfWidth = 2});
  const V3i size = volume.size();
  std::vector<V3d> points;
  for (int axis = 0; axis < 3; ++axis) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    for (int u = 0; u <= (size[b] - 1) * fine; ++u)
      for (int v = 0; v <= (size[c] - 1) * fine; ++v) {
        V3d last;
        double lastValue = 0;
        const int steps = 8 * (size[axis] - 1);
        for (int n = 0; n <= steps; ++n) {
          V3d at;
          at[axis] = n / 8.0;
          at[b] = static_cast<double>(u) / fine;
          at[c] = static_cast<double>(v) / fine;
          const double value = f.value(at) - isovalue;
          if ((n == 0 || n == steps) && value > 0)
            points.push_back(at * volume.grid().indexToWorld);
          if (n > 0 && (value > 0) != (lastValue > 0)) {
            V3d low = last, high = at;
            for (int bisection = 0; bisection < 30; ++bisection) {
              const V3d middle = (low + high) / 2;
              ((f.value(middle) > isovalue) == (lastValue > 0) ? low : high) = middle;
            }
            points.push_back(low * volume.grid().indexToWorld);
          }
          last = at;
          lastValue = value;
        }
      }
  }
  Excess found;
  const auto& tree = levelset::vdb(made.band);
  const Imath::M44d toIndex = volume.grid().indexToWorld.inverse();
  for (auto it = tree.cbeginValueOn(); it; ++it) {
    const V3d at = levelset::toImath(tree.transform().indexToWorld(it.getCoord()));
    double least = HUGE_VAL;
    for (const V3d& point : points) least = std::min(least, (point - at).length2());
    least = std::sqrt(least) / made.band.voxelSize();
    const double distance = std::abs(static_cast<double>(*it)) / made.band.voxelSize();
    found.further = std::max(found.further, distance - least);
    found.nearer = std::max(found.nearer, least - distance);
    const V3d index = at * toIndex;
    bool isInside = f.value(index) > isovalue;
    for (int axis = 0; axis < 3; ++axis)
      isInside = isInside && index[axis] >= 0 && index[axis] <= size[axis] - 1;
    found.wrongSides += distance > 1e-6 && isInside != (*it < 0);
    ++found.count;
  }
  return found;
}

TEST(FilteredIsosurface, FindsTheClosestPointsOfNoisyData) {
  VolumeGrid grid = cubeGrid(5);
  grid.indexToWorld[0][0] *= 0.6;
  grid.indexToWorld[1][0] += 0.2;
  grid.indexToWorld[2][1] += 0.1;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Volume volume = sampled(grid, [&](const V3d&) { return uniform(random); });
  for (const VolumeFilter filter : kSmooth) {
    SCOPED_TRACE(factsOf(filter).name);
    const Excess found = againstDensePoints(volume, filter, 0.0, 8);
    // One grid point misses the closest part of the surface, with the quadratic spline Q₂.
    EXPECT_LT(found.further,
              filter == VolumeFilter::BccQuadratic ? measured(3.53e-3) : measured(1.1e-7));
    EXPECT_LT(found.nearer, measured(0.124));  // the points of the surface are that far apart
    EXPECT_EQ(found.wrongSides, 0u);
    EXPECT_GT(found.count, 500u);
  }
}

TEST(FilteredIsosurface, ClosesTheBorder) {
  // A plane, which all these filters reproduce, cuts the cube of edge 2.6 at x = 0.
  const Volume volume = sampled(cubeGrid(8), [](const V3d& p) { return p.x - 0.013; });
  for (const VolumeFilter filter : kSmooth) {
    SCOPED_TRACE(factsOf(filter).name);
    const IsosurfaceResult made = isosurface(volume, {.low = 0.0}, {.filter = filter});
    EXPECT_NEAR(made.report.closedArea, 2.6 * 2.6 + 4 * 2.6 * 1.287, support::measured(1e-3));
    const BandError error = errorOf(made.band, [](const V3d& p) {
      const V3d low(0.013, -1.3, -1.3), high(1.3);
      double outside = 0, depth = HUGE_VAL;
      for (int axis = 0; axis < 3; ++axis) {
        const double beyond = std::max(low[axis] - p[axis], p[axis] - high[axis]);
        outside += beyond > 0 ? beyond * beyond : 0;
        depth = std::min(depth, -beyond);
      }
      return outside > 0 ? std::sqrt(outside) : -depth;
    });
    EXPECT_LT(error.largest(), measured(1e-6));
    EXPECT_EQ(error.wrongSigns, 0u);
  }
}

TEST(FilteredIsosurface, HasEqualBitsOnAnyNumberOfThreads) {
  const Volume volume = levelset::sphereVolume(13, 0.6);
  const auto run = [&] {
    return isosurface(volume, {.low = 0.0}, {.filter = VolumeFilter::CubicC1}).band.contentHash();
  };
  EXPECT_EQ(support::onThreads(1, run), support::onThreads(4, run));
}

TEST(FilteredIsosurface, RefusesTheBox) {
  const Volume volume = levelset::sphereVolume(9, 0.6);
  EXPECT_NE(refusal<UsageError>([&] {
              (void)isosurface(volume, {.low = 0.0}, {.filter = VolumeFilter::Box});
            }).find("not continuous"),
            std::string::npos);
}

}  // namespace filtered_isosurface_test
