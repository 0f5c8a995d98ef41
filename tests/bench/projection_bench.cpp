// Compares the ray caster with the cell projection of [Kalbe11, §6.1] on isosurfaces of the splines
// on tetrahedra. Cell projection draws each tetrahedron that the surface may cross: for every pixel
// of its bounding rectangle it finds the crossing of the ray in the tetrahedron, and a depth buffer
// keeps the nearest one. Coefficients are computed for each pixel ("on the fly"), or once for all
// pictures. One thread, 1024x768 pixels, default view.
//
//   projection_bench sphere|marschner-lobb SIZE     a table on standard output: NAME VALUE

#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/splines/cubic_c1_spline.h"
#include "levelset/splines/quadratic_super_spline.h"
#include "levelset/volumes/synthetic.h"
#include "render/cpu/cpu_tracer.h"
#include "render/kernel/kernel_scene.h"
#include "render/volumes/volume_surface.h"

namespace {

using namespace render;
using Imath::V3d;
using Imath::V3i;
using levelset::BernsteinLine;
using levelset::BernsteinTetrahedron;
using levelset::PartitionTetrahedron;

constexpr int kWidth = 1024, kHeight = 768;

double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void tell(const std::string& name, double value) {
  fmt::print("{} {:.4g}\n", name, value);
}

/// Least CPU seconds of two runs.
template <typename Job>
double timeOf(const Job& job) {
  double least = HUGE_VAL;
  for (int run = 0; run < 2; ++run) {
    const double start = cpuSeconds();
    job();
    least = std::min(least, cpuSeconds() - start);
  }
  return least;
}

template <std::size_t N>
bool mayCross(const std::array<float, N>& coefficients) {
  const auto [low, high] = std::minmax_element(coefficients.begin(), coefficients.end());
  return *low < 0 && *high >= 0;
}

/// First parameter in [0, 1] at which the polynomial changes its sign; negative: none.
template <int Degree>
float firstRoot(const BernsteinLine<Degree, float>& line, int depth = 0) {
  if (!mayCross(line.coefficients)) return -1;
  constexpr int kDeepest = 20;
  int changes = 0;
  for (std::size_t n = 0; n < Degree; ++n)
    changes += (line.coefficients[n] < 0) != (line.coefficients[n + 1] < 0);
  if (changes == 1 || depth == kDeepest) {
    // One sign change of the coefficients: one root. False position, with halved end values.
    float a = 0, b = 1, fa = line.coefficients.front(), fb = line.coefficients.back(), root = 0.5f;
    for (int step = 0; step < 12 && fa != fb; ++step) {
      root = a - fa * (b - a) / (fb - fa);
      const float f = levelset::lineValue(line, root);
      if (std::abs(f) < 1e-7f) break;
      if ((f < 0) == (fa < 0)) {
        a = root;
        fa = f;
        fb *= 0.5f;
      } else {
        b = root;
        fb = f;
        fa *= 0.5f;
      }
    }
    return root;
  }
  // Halve the interval by the scheme of de Casteljau.
  BernsteinLine<Degree, float> left = line, right = line;
  std::array<float, Degree + 1> row = line.coefficients;
  for (std::size_t level = 0; level <= Degree; ++level) {
    left.coefficients[level] = row[0];
    right.coefficients[Degree - level] = row[Degree - level];
    for (std::size_t n = 0; n + level < Degree; ++n) row[n] = 0.5f * (row[n] + row[n + 1]);
  }
  const float first = firstRoot<Degree>(left, depth + 1);
  if (first >= 0) return 0.5f * first;
  const float second = firstRoot<Degree>(right, depth + 1);
  return second >= 0 ? 0.5f + 0.5f * second : -1;
}

template <class Spline>
class CellProjection {
 public:
  using Form = BernsteinTetrahedron<Spline::kDegree, float>;

  CellProjection(const VolumeSurface& surface, Filter filter, const Camera& camera)
      : surface_(surface), camera_(camera) {
    const Imath::M44d toIndex = surface.indexToWorld().inverse();
    origin_ = camera.from * toIndex;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        V3d direction;
        toIndex.multDirMatrix(camera.ray(x + 0.5, y + 0.5).direction, direction);
        directions_.push_back(direction);
      }
    classify(filter);
  }

  [[nodiscard]] std::size_t cubes() const { return cubes_; }
  [[nodiscard]] std::size_t tetrahedra() const { return tetrahedra_.size(); }

  void storeCoefficients() {
    stored_.clear();
    for (const PartitionTetrahedron& t : tetrahedra_) stored_.push_back(formOf(t));
  }

  /// Draws the picture. @return distances from the eye in index space by the length of the
  /// direction; infinite where no surface is seen
  [[nodiscard]] std::vector<float> draw(bool isStored) const {
    std::vector<float> nearest(directions_.size(), HUGE_VALF);
    const Imath::M44d toNdc = surface_.indexToWorld() * camera_.worldToNdc();
    for (std::size_t n = 0; n < tetrahedra_.size(); ++n) {
      double left = kWidth, right = 0, top = kHeight, bottom = 0;
      for (const auto& v : Spline::template vertices<double>(tetrahedra_[n])) {
        const V3d at = V3d(v[0], v[1], v[2]) * toNdc;
        left = std::min(left, at.x * kWidth);
        right = std::max(right, at.x * kWidth);
        top = std::min(top, at.y * kHeight);
        bottom = std::max(bottom, at.y * kHeight);
      }
      const int x0 = std::max(static_cast<int>(std::ceil(left - 0.5)), 0),
                x1 = std::min(static_cast<int>(std::floor(right - 0.5)), kWidth - 1),
                y0 = std::max(static_cast<int>(std::ceil(top - 0.5)), 0),
                y1 = std::min(static_cast<int>(std::floor(bottom - 0.5)), kHeight - 1);
      const auto map = Spline::template barycentric<double>(tetrahedra_[n]);
      for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) {
          const std::size_t pixel =
              static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x);
          drawPixel(n, map, directions_[pixel], isStored, nearest[pixel]);
        }
    }
    return nearest;
  }

 private:
  [[nodiscard]] Form formOf(const PartitionTetrahedron& t) const {
    const levelset::Volume& volume = surface_.volume();
    return Spline::coefficients(
        [&](int i, int j, int k) { return surface_.field(volume.at(i, j, k)); }, t);
  }

  void classify(Filter filter) {
    const auto [first, last] = surface_.cells(filter);
    for (const V3i& block : surface_.blocks(filter))
      for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j)
          for (int k = 0; k < 8; ++k) {
            const V3i cell = block + V3i(i, j, k);
            bool isWithin = true;
            for (int axis = 0; axis < 3; ++axis)
              isWithin = isWithin && cell[axis] >= first[axis] && cell[axis] <= last[axis];
            if (!isWithin) continue;
            const std::size_t before = tetrahedra_.size();
            for (int index = 0; index < Spline::kTetrahedra; ++index) {
              const PartitionTetrahedron t{{cell.x, cell.y, cell.z}, index};
              if (mayCross(formOf(t).coefficients)) tetrahedra_.push_back(t);
            }
            cubes_ += tetrahedra_.size() > before;
          }
  }

  template <class Map>
  void drawPixel(std::size_t n, const Map& map, const V3d& direction, bool isStored,
                 float& nearest) const {
    // Barycentric coordinates are linear along the ray; inside, none is negative.
    std::array<double, 4> at{}, step{};
    double enter = 0, leave = HUGE_VAL;
    for (std::size_t v = 0; v < 4; ++v) {
      const auto& row = map.rows[v];
      at[v] = row[0] * origin_.x + row[1] * origin_.y + row[2] * origin_.z + row[3];
      step[v] = row[0] * direction.x + row[1] * direction.y + row[2] * direction.z;
      if (step[v] > 0)
        enter = std::max(enter, -at[v] / step[v]);
      else if (step[v] < 0)
        leave = std::min(leave, -at[v] / step[v]);
      else if (at[v] < 0)
        return;
    }
    if (!(enter < leave) || enter >= static_cast<double>(nearest)) return;
    std::array<float, 4> a{}, b{};
    for (std::size_t v = 0; v < 4; ++v) {
      a[v] = static_cast<float>(at[v] + step[v] * enter);
      b[v] = static_cast<float>(at[v] + step[v] * leave);
    }
    const float root = firstRoot<Spline::kDegree>(
        isStored ? stored_[n].restriction(a, b) : formOf(tetrahedra_[n]).restriction(a, b));
    if (root >= 0)
      nearest = std::min(nearest,
                         static_cast<float>(enter + static_cast<double>(root) * (leave - enter)));
  }

  const VolumeSurface& surface_;
  const Camera& camera_;
  V3d origin_;
  std::vector<V3d> directions_;
  std::vector<PartitionTetrahedron> tetrahedra_;
  std::vector<Form> stored_;
  std::size_t cubes_ = 0;
};

/// Depths of the ray caster, by pixel; infinite where it finds no surface.
std::vector<double> cast(const KernelScene& surfaces) {
  const CpuTracer tracer;
  std::vector<double> depths(std::size_t{kWidth} * kHeight, HUGE_VAL);
  constexpr int kSquare = 32;
  for (int top = 0; top < kHeight; top += kSquare)
    for (int left = 0; left < kWidth; left += kSquare) {
      PixelBlock block(std::size_t{kSquare} * kSquare);
      for (std::size_t n = 0; n < block.x.size(); ++n) {
        block.x[n] = static_cast<float>(left + static_cast<int>(n) % kSquare + 0.5 - 0.5 * kWidth);
        block.y[n] = static_cast<float>(top + static_cast<int>(n) / kSquare + 0.5 - 0.5 * kHeight);
      }
      const PixelHits hits = surfaces.castPixels(tracer, block);
      for (std::size_t n = 0; n < block.x.size(); ++n)
        if (hits.solid[n] >= 0)
          depths[static_cast<std::size_t>(top + static_cast<int>(n) / kSquare) * kWidth +
                 static_cast<std::size_t>(left + static_cast<int>(n) % kSquare)] = hits.depth[n];
    }
  return depths;
}

template <class Spline>
void benchmark(const VolumeSurface& surface, Filter filter, std::size_t determiningSet) {
  const std::string name = filterName(filter);
  Scene scene;
  scene.solids.push_back({.band = {}, .volume = std::make_shared<const VolumeSurface>(surface)});
  scene.camera = framingCamera(scene, kWidth, kHeight, scene.camera.verticalFov, scene.camera.up);

  double start = cpuSeconds();
  CellProjection<Spline> projection(surface, filter, scene.camera);
  tell(name + "_classification_s", cpuSeconds() - start);
  const auto cubes = static_cast<double>(projection.cubes()),
             tetrahedra = static_cast<double>(projection.tetrahedra());
  tell(name + "_cubes", cubes);
  tell(name + "_tetrahedra_per_cube", tetrahedra / cubes);
  std::vector<float> drawn;
  const double onTheFly = timeOf([&] { drawn = projection.draw(false); });
  start = cpuSeconds();
  projection.storeCoefficients();
  tell(name + "_coefficients_s", cpuSeconds() - start);
  const double stored = timeOf([&] { drawn = projection.draw(true); });
  tell(name + "_projection_on_the_fly_s", onTheFly);
  tell(name + "_projection_stored_s", stored);

  const KernelScene surfaces(scene, levelset::kNoMemoryLimit, filter);
  std::vector<double> depths;
  const double casting = timeOf([&] { depths = cast(surfaces); });
  tell(name + "_casting_s", casting);
  tell(name + "_on_the_fly_to_stored", onTheFly / stored);
  tell(name + "_projection_to_casting", std::min(onTheFly, stored) / casting);

  // Bytes: a number for each tetrahedron beside the coefficients or the determining sets, and the
  // tables of the ray caster.
  constexpr std::size_t kForm = sizeof(typename CellProjection<Spline>::Form);
  const double coefficients = tetrahedra * (4 + kForm);
  const double sets = tetrahedra * 4 + cubes * 4 * static_cast<double>(determiningSet);
  tell(name + "_coefficients_mb", 1e-6 * coefficients);
  tell(name + "_determining_sets_mb", 1e-6 * sets);
  tell(name + "_casting_tables_mb", 1e-6 * static_cast<double>(surfaces.bytes()));
  tell(name + "_coefficients_to_sets", coefficients / sets);

  // Both must show the same picture.
  std::size_t differing = 0, seen = 0;
  double largest = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x);
      const bool isHit = std::isfinite(drawn[pixel]), isCast = std::isfinite(depths[pixel]);
      differing += isHit != isCast;
      seen += isCast;
      if (!isHit || !isCast) continue;
      const Camera::Ray ray = scene.camera.ray(x + 0.5, y + 0.5);
      const double depth =
          static_cast<double>(drawn[pixel]) * ray.direction.dot(scene.camera.axis());
      largest = std::max(largest, std::abs(depth - depths[pixel]) / surface.voxelSize());
    }
  tell(name + "_pixels_of_one_only", static_cast<double>(differing) / static_cast<double>(seen));
  tell(name + "_largest_depth_difference_voxels", largest);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) {
    fmt::print(stderr, "usage: projection_bench sphere|marschner-lobb SIZE\n");
    return 2;
  }
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  const bool isSphere = std::string(argv[1]) == "sphere";
  const int size = std::stoi(argv[2]);
  const VolumeSurface surface(
      isSphere ? levelset::sphereVolume(size, 0.8) : levelset::marschnerLobb(size),
      isSphere ? 0 : 0.5);
  // Numbers of a cube that determine its coefficients [Kalbe11].
  benchmark<levelset::QuadraticSuperSpline>(surface, Filter::SuperQuadratic, 20);
  benchmark<levelset::CubicC1Spline>(surface, Filter::CubicC1, 56);
  return 0;
} catch (const levelset::Error& error) {
  fmt::print(stderr, "projection_bench: {}\n", error.what());
  return 1;
}
