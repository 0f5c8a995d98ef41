#pragma once

// Bézier volumes with known surfaces, for tests and benchmarks.

#include <Imath/ImathVec.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "render/bezier/bezier_volume.h"
#include "render/camera.h"

namespace bezier_scenes {

using Imath::V3d;
using render::BezierPatch;
using render::BezierVolume;

/// Coefficients of a polynomial by ascending powers.
using Powers = std::vector<double>;

/// Bernstein coefficients on [low, high] of a polynomial in powers of x.
inline std::vector<double> bernstein(const Powers& powers, double low, double high, int degree) {
  Powers shifted;  // powers of t, with x = low + (high − low) t; by Horner's rule
  for (std::size_t n = powers.size(); n-- > 0;) {
    Powers next(shifted.size() + 1, 0.0);
    for (std::size_t i = 0; i < shifted.size(); ++i) {
      next[i] += low * shifted[i];
      next[i + 1] += (high - low) * shifted[i];
    }
    next[0] += powers[n];
    shifted = std::move(next);
  }
  const auto binomial = [](int n, int k) {
    double result = 1;
    for (int i = 1; i <= k; ++i) result = result * (n - k + i) / i;
    return result;
  };
  std::vector<double> result;
  for (int i = 0; i <= degree; ++i) {
    double sum = 0;
    for (int k = 0; k <= i && k < static_cast<int>(shifted.size()); ++k)
      sum += binomial(i, k) / binomial(degree, k) * shifted[static_cast<std::size_t>(k)];
    result.push_back(sum);
  }
  return result;
}

/// Product of polynomials in x, y and z.
struct Term {
  Powers x, y, z;
};

/// Patch of a box whose map is the identity.
inline BezierPatch boxPatch(const std::array<int, 3>& degree, const V3d& low, const V3d& high) {
  BezierPatch patch;
  patch.degree = degree;
  for (int i = 0; i <= degree[0]; ++i)
    for (int j = 0; j <= degree[1]; ++j)
      for (int k = 0; k <= degree[2]; ++k) {
        const V3d t(static_cast<double>(i) / degree[0], static_cast<double>(j) / degree[1],
                    static_cast<double>(k) / degree[2]);
        patch.points.push_back(low + (high - low) * t);
      }
  return patch;
}

/// Adds a sum of terms, in coordinates of the box that the patch had before it was deformed.
inline void addAttribute(BezierPatch& patch, const std::vector<Term>& terms, const V3d& low,
                         const V3d& high) {
  std::vector<double> sum(patch.controlPointCount(), 0.0);
  for (const Term& term : terms) {
    const std::vector<double> x = bernstein(term.x, low.x, high.x, patch.degree[0]),
                              y = bernstein(term.y, low.y, high.y, patch.degree[1]),
                              z = bernstein(term.z, low.z, high.z, patch.degree[2]);
    std::size_t n = 0;
    for (const double a : x)
      for (const double b : y)
        for (const double c : z) sum[n++] += a * b * c;
  }
  patch.attributes.push_back(std::move(sum));
}

/// Terms of |p − centre|² − radius².
inline std::vector<Term> ballTerms(const V3d& centre, double radius) {
  const auto square = [](double c) { return Powers{c * c, -2 * c, 1}; };
  return {{square(centre.x), {1}, {1}},
          {{1}, square(centre.y), {1}},
          {{1}, {1}, square(centre.z)},
          {{-radius * radius}, {1}, {1}}};
}

inline void deform(BezierPatch& patch, const std::function<V3d(const V3d&)>& move) {
  for (V3d& point : patch.points) point = move(point);
}

/// The unit sphere in [−1.25, 1.25]³, exact at any degree from 2.
inline BezierVolume sphere(int degree) {
  const V3d low(-1.25), high(1.25);
  BezierPatch patch = boxPatch({2, 2, 2}, low, high);
  addAttribute(patch, ballTerms(V3d(0), 1), low, high);
  for (int d = 2; d < degree; ++d)
    for (int axis = 0; axis < 3; ++axis) patch = elevated(patch, axis);
  return {{patch}};
}

/// y² + z² = (x⁵ + x⁴) / 2, turned over: the teardrop, with a singular tip at the origin.
inline BezierVolume teardrop() {
  const V3d low(-1.1, -0.6, -0.6), high(0.4, 0.6, 0.6);
  BezierPatch patch = boxPatch({5, 5, 5}, low, high);
  addAttribute(patch,
               {{{0, 0, 0, 0, -0.5, -0.5}, {1}, {1}}, {{1}, {0, 0, 1}, {1}}, {{1}, {1}, {0, 0, 1}}},
               low, high);
  return {{patch}};
}

/// A cylinder of radius 0.8, bent along its axis: a cubic B-spline volume of 5 x 5 x 2 spans.
inline BezierVolume bentCylinder() {
  render::SplineVolume volume;
  volume.axes = {levelset::uniformAxis(3, 8), levelset::uniformAxis(3, 8),
                 levelset::uniformAxis(3, 5)};
  volume.attributes.resize(1);
  // The square has the coefficient (ab + bc + ca) / 3 for the knots a, b and c; x runs over [−1,
  // 1].
  const auto knot = [](const levelset::LatticeAxis& axis, std::size_t n) {
    return 2 * axis.knots[n] - 1;
  };
  const auto line = [&](const levelset::LatticeAxis& axis, std::size_t i) {
    return (knot(axis, i + 1) + knot(axis, i + 2) + knot(axis, i + 3)) / 3;
  };
  const auto square = [&](const levelset::LatticeAxis& axis, std::size_t i) {
    const double a = knot(axis, i + 1), b = knot(axis, i + 2), c = knot(axis, i + 3);
    return (a * b + b * c + c * a) / 3;
  };
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t j = 0; j < 8; ++j)
      for (std::size_t k = 0; k < 5; ++k) {
        const double x = line(volume.axes[0], i), y = line(volume.axes[1], j),
                     along = line(volume.axes[2], k);
        const double angle = 1.2 * along;
        volume.points.emplace_back((2 + x) * std::cos(angle) - 2, y + 0.2 * along * along,
                                   (2 + x) * std::sin(angle));
        volume.attributes[0].push_back(square(volume.axes[0], i) + square(volume.axes[1], j) -
                                       0.64);
      }
  return {bezierPatches(volume)};
}

/// A ball in a map that goes forth, back and forth again along x: up to six layers.
inline BezierVolume folded() {
  const V3d low(-0.5), high(0.5);
  BezierPatch patch = boxPatch({3, 2, 2}, low, high);
  addAttribute(patch, ballTerms(V3d(0), 0.45), low, high);
  constexpr std::array<double, 4> kAlong = {-0.6, 1.4, -1.4, 0.6};
  for (std::size_t n = 0; n < patch.points.size(); ++n) {
    const double t = static_cast<double>(n / 9);
    patch.points[n].x = kAlong[n / 9];
    patch.points[n].y += 0.15 * t;
    patch.points[n].z += 0.05 * t;
  }
  return {{patch}};
}

/// A quarter of a cylinder as an exact rational patch, whose inner face collapses to the axis, with
/// a ball about the axis.
inline BezierVolume collapsedEdge() {
  BezierPatch patch;
  patch.degree = {2, 2, 2};
  const double diagonal = std::sqrt(0.5);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) {
        const double r = 0.5 * i;
        patch.points.emplace_back(j < 2 ? r : 0, j > 0 ? r : 0, 0.5 * k);
        patch.weights.push_back(j == 1 ? diagonal : 1);
      }
  addAttribute(patch, {{{0, 0, 1}, {1}, {1}}, {{1}, {1}, {0.25 - 0.16, -1, 1}}}, V3d(0), V3d(1));
  return {{patch}};
}

/// The saddle z = (x² − y²) / 10, which rays along the plane touch.
inline BezierVolume saddle() {
  const V3d low(-1, -1, -0.3), high(1, 1, 0.3);
  BezierPatch patch = boxPatch({2, 2, 2}, low, high);
  addAttribute(patch, {{{0, 0, -0.1}, {1}, {1}}, {{1}, {0, 0, 0.1}, {1}}, {{1}, {1}, {0, 1}}}, low,
               high);
  return {{patch}};
}

/// Two unit balls that touch at the origin, as one quartic. Rays across the point of contact have a
/// root of order four there.
inline BezierVolume touchingBalls() {
  // (s − 2x)(s + 2x) = s² − 4x² with s = |p|².
  const V3d low(-2.2, -1.2, -1.2), high(2.2, 1.2, 1.2);
  BezierPatch patch = boxPatch({4, 4, 4}, low, high);
  const Powers one{1}, two{0, 0, 1}, four{0, 0, 0, 0, 1};
  addAttribute(patch,
               {{four, one, one},
                {one, four, one},
                {one, one, four},
                {{0, 0, 2}, two, one},
                {one, {0, 0, 2}, two},
                {{0, 0, 2}, one, two},
                {{0, 0, -4}, one, one}},
               low, high);
  return {{patch}};
}

/// The cone x² + y² = z² / 2, with its apex in the origin.
inline BezierVolume cone() {
  const V3d low(-1), high(1, 1, 0.5);
  BezierPatch patch = boxPatch({2, 2, 2}, low, high);
  addAttribute(patch, {{{0, 0, 1}, {1}, {1}}, {{1}, {0, 0, 1}, {1}}, {{1}, {1}, {0, 0, -0.5}}}, low,
               high);
  return {{patch}};
}

/// A twisted die: three slabs, and a ball for each of its 21 pips. One cubic map holds them all.
inline BezierVolume dice(const std::function<V3d(const V3d&)>& move = {}) {
  const V3d low(-1.2), high(1.2);
  BezierPatch patch = boxPatch({3, 3, 3}, low, high);
  BezierVolume volume;
  const Powers square{0, 0, 1};
  for (int axis = 0; axis < 3; ++axis) {
    std::array<Powers, 3> of = {Powers{1}, Powers{1}, Powers{1}};
    of[static_cast<std::size_t>(axis)] = {-1, 0, 1};
    addAttribute(patch, {{of[0], of[1], of[2]}}, low, high);
  }
  volume.expression = {0, 1, -2, 2, -2};
  const std::array<std::vector<std::pair<int, int>>, 6> pips = {
      {{{0, 0}},
       {{-1, -1}, {1, 1}},
       {{-1, -1}, {0, 0}, {1, 1}},
       {{-1, -1}, {-1, 1}, {1, -1}, {1, 1}},
       {{-1, -1}, {-1, 1}, {0, 0}, {1, -1}, {1, 1}},
       {{-1, -1}, {-1, 0}, {-1, 1}, {1, -1}, {1, 0}, {1, 1}}}};
  // Opposite faces add up to seven.
  const std::array<std::pair<int, int>, 6> faces = {
      {{0, 1}, {1, 1}, {2, 1}, {2, -1}, {1, -1}, {0, -1}}};
  for (std::size_t f = 0; f < 6; ++f)
    for (const auto& [a, b] : pips[f]) {
      const int axis = faces[f].first;
      V3d centre(0);
      centre[axis] = faces[f].second;
      centre[(axis + 1) % 3] = 0.5 * a;
      centre[(axis + 2) % 3] = 0.5 * b;
      addAttribute(patch, ballTerms(centre, 0.2), low, high);
      volume.expression.push_back(static_cast<int>(patch.attributes.size()) - 1);
      volume.expression.push_back(-3);
    }
  deform(
      patch, move ? move : [](const V3d& p) {
        const double angle = 0.35 * p.z;
        return V3d(p.x * std::cos(angle) - p.y * std::sin(angle),
                   p.x * std::sin(angle) + p.y * std::cos(angle), p.z + 0.1 * p.x * p.x);
      });
  volume.patches = {patch};
  return volume;
}

/// A bent block with 20 round holes, as one cubic map: 23 attributes.
inline BezierVolume cheese() {
  const V3d low(-1.2, -1.2, -0.8), high(1.2, 1.2, 0.8);
  BezierPatch patch = boxPatch({3, 3, 3}, low, high);
  BezierVolume volume;
  addAttribute(patch, {{{-1, 0, 1}, {1}, {1}}}, low, high);
  addAttribute(patch, {{{1}, {-1, 0, 1}, {1}}}, low, high);
  addAttribute(patch, {{{1}, {1}, {-0.36, 0, 1}}}, low, high);
  volume.expression = {0, 1, -2, 2, -2};
  std::uint64_t state = 7;
  const auto next = [&] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 11) * 0x1p-52 - 1;
  };
  for (int n = 0; n < 20; ++n) {
    const V3d centre(next(), next(), 0.6 * next());
    addAttribute(patch, ballTerms(centre, 0.2 + 0.08 * next()), low, high);
    volume.expression.push_back(static_cast<int>(patch.attributes.size()) - 1);
    volume.expression.push_back(-3);
  }
  deform(patch, [](const V3d& p) { return V3d(p.x, p.y, p.z + 0.3 * p.x * p.x - 0.2 * p.y); });
  volume.patches = {patch};
  return volume;
}

/// Numbers of a linear congruential generator, in [−1, 1).
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : state_(seed) {}
  double operator()() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state_ >> 11) * 0x1p-52 - 1;
  }

 private:
  std::uint64_t state_;
};

/// The unit sphere as eight rational surfaces of degree 2. Each collapses to a pole along an edge.
inline BezierVolume sphereSurfaces() {
  const double diagonal = std::sqrt(0.5);
  BezierVolume volume;
  for (int quarter = 0; quarter < 4; ++quarter)
    for (const double side : {1.0, -1.0}) {
      std::vector<V3d> points;
      std::vector<double> weights;
      for (int i = 0; i < 3; ++i)      // from the equator to a pole
        for (int j = 0; j < 3; ++j) {  // along the equator
          const double radius = i < 2 ? 1 : 0;
          const int along = side > 0 ? j : 2 - j;  // normals point outwards
          const double x = along < 2 ? 1 : 0, y = along > 0 ? 1 : 0;
          V3d p(radius * x, radius * y, i > 0 ? side : 0);
          for (int turn = 0; turn < quarter; ++turn) p = V3d(-p.y, p.x, p.z);
          points.push_back(p);
          weights.push_back((i == 1 ? diagonal : 1) * (j == 1 ? diagonal : 1));
        }
      volume.patches.push_back(render::surfacePatch(2, 2, points, weights));
    }
  return volume;
}

/// Circle of four rational arcs. @param turns  true: clockwise
inline render::TrimLoop trimCircle(const Imath::V2d& centre, double radius, bool turns = false) {
  using Imath::V2d;
  render::TrimLoop loop;
  const V2d axes[] = {V2d(1, 0), V2d(0, 1), V2d(-1, 0), V2d(0, -1)};
  for (int n = 0; n < 4; ++n) {
    const int k = turns ? 3 - n : n;
    const V2d a = axes[k] * radius, b = axes[(k + 1) % 4] * radius;
    render::TrimCurve arc{{centre + a, centre + a + b, centre + b},
                          {1, std::numbers::sqrt2 / 2, 1}};
    if (turns) std::swap(arc.points.front(), arc.points.back());
    loop.push_back(std::move(arc));
  }
  return loop;
}

/// A wavy B-spline surface of nine cubic patches, cut to a disc without a star and a leaf, and with
/// a smaller disc in the star.
inline BezierVolume trimmedSurface() {
  using Imath::V2d;
  render::SplineVolume spline;
  spline.axes = {levelset::uniformAxis(3, 6), levelset::uniformAxis(3, 6),
                 levelset::uniformAxis(1, 2)};
  spline.attributes.resize(1);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      for (const double w : {0.0, 1.0}) {
        spline.points.emplace_back(-1 + 0.4 * i, -1 + 0.4 * j,
                                   0.5 * std::sin(1.3 * i) * std::cos(1.7 * j));
        spline.attributes[0].push_back(w - 1.0 / 3);
      }
  std::vector<V2d> star;
  for (int n = 0; n < 10; ++n) {
    const double radius = n % 2 == 0 ? 0.22 : 0.1, angle = 0.2 * std::numbers::pi * n + 0.05;
    star.push_back(V2d(0.42, 0.45) + V2d(std::cos(angle), std::sin(angle)) * radius);
  }
  const render::TrimLoop leaf{
      {{V2d(0.6, 0.7), V2d(0.75, 0.55), V2d(0.95, 0.85), V2d(0.75, 0.8)}, {}},
      {{V2d(0.75, 0.8), V2d(0.5, 0.95), V2d(0.6, 0.7)}, {1, 0.4, 1}}};
  const auto region = std::make_shared<const render::TrimRegion>(
      std::vector<render::TrimLoop>{trimCircle(V2d(0.5), 0.47), render::polylineLoop(star), leaf,
                                    trimCircle(V2d(0.42, 0.45), 0.06, true)});
  BezierVolume volume;
  volume.patches = bezierPatches(spline);
  trimPatches(spline, region, volume.patches);
  return volume;
}

/// A scene with its cameras.
struct BezierScene {
  std::string name;
  BezierVolume volume;
  std::vector<render::Camera> cameras;
};

/// Camera on a random side of a volume.
inline render::Camera randomCamera(const BezierVolume& volume, Numbers& numbers, int size) {
  V3d direction;
  do direction = V3d(numbers(), numbers(), numbers());
  while (direction.length() > 1 || direction.length() < 0.1);
  const Imath::Box3d box = volume.bounds();
  const double diagonal = box.size().length();
  render::Camera camera;
  camera.to = box.center() + V3d(numbers(), numbers(), numbers()) * 0.05 * diagonal;
  camera.from = camera.to + direction.normalized() * diagonal * 1.2;
  camera.up = V3d(0.1, 0.2, 1);
  camera.width = camera.height = size;
  return camera;
}

/// Fourteen scenes, each with `count` cameras.
inline std::vector<BezierScene> scenes(std::size_t count, int size) {
  std::vector<BezierScene> result;
  const auto add = [&](const char* name, BezierVolume volume) -> BezierScene& {
    Numbers numbers(result.size() + 1);
    BezierScene scene{name, std::move(volume), {}};
    while (scene.cameras.size() < count)
      scene.cameras.push_back(randomCamera(scene.volume, numbers, size));
    if (count > 1) scene.cameras[1].orthoHeight = 0.6 * scene.volume.bounds().size().length();
    result.push_back(std::move(scene));
    return result.back();
  };
  for (int degree = 2; degree <= 5; ++degree)
    add(("sphere of degree " + std::to_string(degree)).c_str(), sphere(degree));
  add("teardrop", teardrop());
  add("bent cylinder", bentCylinder());
  add("folded map", folded());
  add("collapsed edge", collapsedEdge());
  for (render::Camera& camera : add("grazing rays", saddle()).cameras) {
    Numbers numbers(static_cast<std::uint64_t>(camera.from.x * 1e6));
    camera.from = V3d(3 * std::cos(3 * numbers()), 3 * std::sin(3 * numbers()), 0.1 * numbers());
    camera.to = V3d(0.2 * numbers(), 0.2 * numbers(), 0);
  }
  BezierScene& touching = add("double root", cone());
  touching.cameras[0].from = V3d(-4, 0, 0);  // its middle pixel sees the apex from the side
  touching.cameras[0].to = V3d(0);
  touching.cameras[0].width = touching.cameras[0].height = size | 1;
  for (render::Camera& camera : add("eye inside", sphere(3)).cameras) {
    const V3d direction = camera.to - camera.from;
    camera.from = direction * 0.05;  // in the ball, or between it and the faces of the patch
    camera.to = camera.from + direction;
    camera.verticalFov = 1.9;
    camera.orthoHeight = {};
  }
  add("dice", dice());
  add("rational surfaces", sphereSurfaces());
  add("trimmed surface", trimmedSurface());
  return result;
}

}  // namespace bezier_scenes
