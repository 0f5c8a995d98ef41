#pragma once

// Bézier clipping of polynomial surfaces, a baseline of shared subdivision trees. A tree of clipped
// patches for each ray [Nishita90].

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "render/bezier/bezier_view.h"
#include "tests/bench/bezier_workloads.h"

namespace bezier_clipping {

using render::BezierPatch;
using render::BezierVolume;
using render::Camera;

/// Surface patch in homogeneous coordinates of a perspective view: X, Y and depth W.
struct ViewedSurface {
  int u = 0, v = 0;  ///< degrees
  std::vector<std::array<double, 3>> points;
  double left = 0, right = 0, top = 0, bottom = 0, nearest = 0;  ///< box on the screen, least depth

  void bound() {
    left = top = nearest = std::numeric_limits<double>::infinity();
    right = bottom = -left;
    for (const auto& [x, y, w] : points) {
      left = std::min(left, x / w);
      right = std::max(right, x / w);
      top = std::min(top, y / w);
      bottom = std::max(bottom, y / w);
      nearest = std::min(nearest, w);
    }
  }
};

/// Replaces a line of `count` points, `stride` apart, by its part [low, high].
template <typename Point>
void cutLine(Point* line, int count, int stride, double low, double high) {
  const auto mix = [](Point& a, const Point& b, double t) {
    for (std::size_t c = 0; c < a.size(); ++c) a[c] += t * (b[c] - a[c]);
  };
  for (int r = 1; r < count; ++r)  // keeps the part above `low`
    for (int i = 0; i < count - r; ++i) mix(line[i * stride], line[(i + 1) * stride], low);
  const double rest = low < 1 ? (high - low) / (1 - low) : 1;
  for (int r = 1; r < count; ++r)  // and the part below `high` of it
    for (int i = count - 1; i >= r; --i) {
      Point previous = line[(i - 1) * stride];
      mix(previous, line[i * stride], rest);
      line[i * stride] = previous;
    }
}

/// Cuts a patch along one axis. @param axis  0: u, 1: v
template <typename Point>
void cut(std::vector<Point>& points, int u, int v, int axis, double low, double high) {
  if (axis == 0)
    for (int j = 0; j <= v; ++j)
      cutLine(&points[static_cast<std::size_t>(j)], u + 1, v + 1, low, high);
  else
    for (int i = 0; i <= u; ++i)
      cutLine(&points[static_cast<std::size_t>(i * (v + 1))], v + 1, 1, low, high);
}

/// The rays of a camera against the patches of a volume of surfaces.
class Clipping {
 public:
  /// @param levels  uniform splits in four before the rays begin
  Clipping(const BezierVolume& volume, const Camera& camera, int levels) : view_(camera) {
    for (const BezierPatch& patch : volume.patches) {
      ViewedSurface surface{patch.degree[0], patch.degree[1], {}};
      for (std::size_t n = 0; n < patch.points.size(); n += 2) {  // two equal layers
        const bezier_scenes::V3d from = patch.points[n] - view_.eye;
        const double w = patch.weights.empty() ? 1 : patch.weights[n];
        surface.points.push_back(
            {w * from.dot(view_.right), w * from.dot(view_.down), w * from.dot(view_.axis)});
      }
      add(std::move(surface), levels);
    }
    std::sort(surfaces_.begin(), surfaces_.end(),
              [](const auto& a, const auto& b) { return a.nearest < b.nearest; });
  }

  [[nodiscard]] std::size_t size() const { return surfaces_.size(); }
  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = 0;
    for (const ViewedSurface& s : surfaces_)
      sum += sizeof(s) + sizeof(s.points[0]) * s.points.size();
    return sum;
  }

  /// Least depth of each pixel; infinite without a hit.
  [[nodiscard]] std::vector<double> depths(const Camera& camera) {
    constexpr int kTile = 32;
    std::vector<double> result(static_cast<std::size_t>(camera.width * camera.height),
                               std::numeric_limits<double>::infinity());
    for (int top = 0; top < camera.height; top += kTile)
      for (int left = 0; left < camera.width; left += kTile) {
        const int right = std::min(left + kTile, camera.width),
                  bottom = std::min(top + kTile, camera.height);
        const Imath::V2d low = view_.at(left, top), high = view_.at(right, bottom);
        std::vector<const ViewedSurface*> met;
        for (const ViewedSurface& s : surfaces_)
          if (s.left <= high.x && s.right >= low.x && s.top <= high.y && s.bottom >= low.y)
            met.push_back(&s);
        for (int y = top; y < bottom; ++y)
          for (int x = left; x < right; ++x) {
            const Imath::V2d at = view_.at(x + 0.5, y + 0.5);
            double& nearest = result[static_cast<std::size_t>(y * camera.width + x)];
            for (const ViewedSurface* s : met) {
              if (s->nearest > nearest) break;
              if (at.x < s->left || at.x > s->right || at.y < s->top || at.y > s->bottom) continue;
              clip(*s, at, nearest);
            }
          }
      }
    return result;
  }

 private:
  using Plane = std::array<double, 2>;  ///< distances from the two planes of a ray

  static constexpr double kLastEdge = 1e-8;  ///< edge of a root, in the parameters
  static constexpr double kLeastCut = 0.2;   ///< share that a clip must remove
  static constexpr int kMostDepth = 60;

  struct Part {
    std::vector<Plane> points;
    std::array<double, 2> low{0, 0}, high{1, 1};
    int depth = 0;
  };

  void add(ViewedSurface surface, int levels) {
    if (levels > 0) {
      for (const double a : {0.0, 0.5})
        for (const double b : {0.0, 0.5}) {
          ViewedSurface quarter = surface;
          cut(quarter.points, quarter.u, quarter.v, 0, a, a + 0.5);
          cut(quarter.points, quarter.u, quarter.v, 1, b, b + 0.5);
          add(std::move(quarter), levels - 1);
        }
      return;
    }
    surface.bound();
    surfaces_.push_back(std::move(surface));
  }

  /// Range of a parameter in which the distance from a line through the origin, along the other
  /// parameter, may be zero. @return false if there is none
  static bool range(const Part& part, int u, int v, int axis, double& low, double& high) {
    const auto at = [&](int i, int j) -> const Plane& {
      return part.points[static_cast<std::size_t>(i * (v + 1) + j)];
    };
    Plane along{};  // mean direction of the other parameter
    for (std::size_t c = 0; c < 2; ++c)
      along[c] = axis == 0 ? at(0, v)[c] - at(0, 0)[c] + at(u, v)[c] - at(u, 0)[c]
                           : at(u, 0)[c] - at(0, 0)[c] + at(u, v)[c] - at(0, v)[c];
    const int count = axis == 0 ? u : v, other = axis == 0 ? v : u;
    std::array<double, 21> least{}, most{};
    for (int i = 0; i <= count; ++i) {
      auto& a = least[static_cast<std::size_t>(i)];
      auto& b = most[static_cast<std::size_t>(i)];
      a = std::numeric_limits<double>::infinity();
      b = -a;
      for (int j = 0; j <= other; ++j) {
        const Plane& p = axis == 0 ? at(i, j) : at(j, i);
        const double distance = along[0] * p[1] - along[1] * p[0];
        a = std::min(a, distance);
        b = std::max(b, distance);
      }
    }
    // Where the convex hull of the points (i / count, distance) meets zero.
    low = 2;
    high = -1;
    const auto offer = [&](double t) {
      low = std::min(low, t);
      high = std::max(high, t);
    };
    for (int i = 0; i <= count; ++i) {
      const auto n = static_cast<std::size_t>(i);
      const double t = static_cast<double>(i) / count;
      if (least[n] <= 0 && most[n] >= 0) offer(t);
      for (int k = i + 1; k <= count; ++k) {
        const auto m = static_cast<std::size_t>(k);
        const double s = static_cast<double>(k) / count;
        const auto cross = [&](double a, double b) {
          if (a * b < 0) offer(t + (s - t) * a / (a - b));
        };
        cross(least[n], least[m]);
        cross(most[n], most[m]);
        cross(least[n], most[m]);
        cross(most[n], least[m]);
      }
    }
    return low <= high;
  }

  void clip(const ViewedSurface& surface, const Imath::V2d& at, double& nearest) {
    const int u = surface.u, v = surface.v;
    stack_.clear();
    stack_.emplace_back();
    for (const auto& [x, y, w] : surface.points)
      stack_.back().points.push_back({x - at.x * w, y - at.y * w});
    while (!stack_.empty()) {
      Part part = std::move(stack_.back());
      stack_.pop_back();
      Plane least{1e300, 1e300}, most{-1e300, -1e300};
      for (const Plane& p : part.points)
        for (std::size_t c = 0; c < 2; ++c) {
          least[c] = std::min(least[c], p[c]);
          most[c] = std::max(most[c], p[c]);
        }
      if (least[0] > 0 || most[0] < 0 || least[1] > 0 || most[1] < 0) continue;
      const std::array<double, 2> edge{part.high[0] - part.low[0], part.high[1] - part.low[1]};
      if ((edge[0] < kLastEdge && edge[1] < kLastEdge) || part.depth > kMostDepth) {
        nearest = std::min(nearest, depthAt(surface, 0.5 * (part.low[0] + part.high[0]),
                                            0.5 * (part.low[1] + part.high[1])));
        continue;
      }
      const int axis = edge[0] >= edge[1] ? 0 : 1;
      const auto a = static_cast<std::size_t>(axis);
      double low = 0, high = 1;
      if (!range(part, u, v, axis, low, high)) continue;
      const double margin = 1e-12;
      low = std::max(0.0, low - margin);
      high = std::min(1.0, high + margin);
      ++part.depth;
      if (high - low > 1 - kLeastCut) {
        Part second = part;
        const double middle = 0.5 * (part.low[a] + part.high[a]);
        cut(part.points, u, v, axis, 0.0, 0.5);
        cut(second.points, u, v, axis, 0.5, 1.0);
        part.high[a] = second.low[a] = middle;
        stack_.push_back(std::move(second));
      } else {
        cut(part.points, u, v, axis, low, high);
        const double begin = part.low[a];
        part.low[a] = begin + edge[a] * low;
        part.high[a] = begin + edge[a] * high;
      }
      stack_.push_back(std::move(part));
    }
  }

  [[nodiscard]] double depthAt(const ViewedSurface& surface, double u, double v) {
    scratch_.assign(surface.points.begin(), surface.points.end());
    cut(scratch_, surface.u, surface.v, 0, u, 1);
    cut(scratch_, surface.u, surface.v, 1, v, 1);
    return scratch_[0][2];
  }

  render::BezierView view_;
  std::vector<ViewedSurface> surfaces_;  ///< from front to back
  std::vector<Part> stack_;
  std::vector<std::array<double, 3>> scratch_;
};

}  // namespace bezier_clipping
