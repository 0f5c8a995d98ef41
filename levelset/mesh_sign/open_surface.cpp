#include "levelset/mesh_sign/open_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <unordered_map>

#include "levelset/progress_gate.h"

namespace levelset::convert {
namespace {

using Imath::V3d;
using Imath::V3i;

struct CoordLess {
  bool operator()(const V3i& a, const V3i& b) const {
    if (a.x != b.x) return a.x < b.x;
    if (a.y != b.y) return a.y < b.y;
    return a.z < b.z;
  }
};

/// A grid edge from `point` to the next grid point along `axis`. The open surface crosses it at the
/// fraction `t` of its length.
struct CrossedEdge {
  V3i point;
  int axis;
  double t;
};

V3i blockOf(const V3i& p) {
  return {p.x & ~7, p.y & ~7, p.z & ~7};
}

V3i step(int axis) {
  return {axis == 0, axis == 1, axis == 2};
}

class OpenSurfaceWalk {
 public:
  OpenSurfaceWalk(const SignField& field, std::size_t maxMemory, const Progress& progress)
      : field_(field), maxMemory_(maxMemory), progress_(progress) {}

  void follow(std::vector<V3i> wave) {
    while (!wave.empty()) {
      std::sort(wave.begin(), wave.end(), CoordLess{});
      wave.erase(std::unique(wave.begin(), wave.end()), wave.end());
      requireMemory(
          static_cast<double>(known_.size() + wave.size()) * sizeof(SignField::BlockWinding),
          maxMemory_);
      evaluate(wave);
      wave = unknownNeighbours(wave);
    }
  }

  std::vector<std::array<V3d, 3>> triangles() const {
    std::vector<CrossedEdge> edges;
    for (const auto& [origin, values] : known_) crossedEdgesIn(origin, false, edges);
    struct Mean {
      V3d sum = V3d(0);
      double count = 0;
    };
    std::map<V3i, Mean, CoordLess> cells;
    for (const CrossedEdge& edge : edges)
      for (int corner = 0; corner < 4; ++corner) {
        Mean& mean = cells[cellAt(edge, corner)];
        mean.sum += crossingPoint(edge);
        mean.count += 1;
      }
    std::vector<std::array<V3d, 3>> result;
    result.reserve(edges.size() * 3);
    for (const CrossedEdge& edge : edges) {
      std::array<V3d, 4> quad;
      for (int corner = 0; corner < 4; ++corner) {
        const Mean& mean = cells.at(cellAt(edge, corner));
        quad[static_cast<std::size_t>(corner)] = mean.sum / mean.count;
      }
      result.push_back({quad[0], quad[1], quad[2]});
      result.push_back({quad[0], quad[2], quad[3]});
      result.push_back({crossingPoint(edge), crossingPoint(edge), crossingPoint(edge)});
    }
    return result;
  }

 private:
  static V3d crossingPoint(const CrossedEdge& edge) {
    return V3d(edge.point) + V3d(step(edge.axis)) * edge.t;
  }

  /// Lowest grid point of one of the four cells around an edge. `corner` counts them in cyclic
  /// order from 0 to 3.
  static V3i cellAt(const CrossedEdge& edge, int corner) {
    const V3i first = step((edge.axis + 1) % 3), second = step((edge.axis + 2) % 3);
    return edge.point - (corner == 1 || corner == 2 ? first : V3i(0)) -
           (corner >= 2 ? second : V3i(0));
  }

  void evaluate(const std::vector<V3i>& wave) {
    std::vector<std::unique_ptr<SignField::BlockWinding>> values(wave.size());
    ProgressGate gate(progress_, wave.size());
    tbb::parallel_for(std::size_t{0}, wave.size(), [&](std::size_t i) {
      values[i] = std::make_unique<SignField::BlockWinding>();
      field_.winding(wave[i], *values[i]);
      gate.advance(1);
    });
    for (std::size_t i = 0; i < wave.size(); ++i) known_[wave[i]] = std::move(values[i]);
  }

  double at(const V3i& p) const {
    const V3i origin = blockOf(p), d = p - origin;
    const auto found = known_.find(origin);
    if (found == known_.end()) return field_.winding(p);
    return (*found->second)[static_cast<std::size_t>(64 * d.x + 8 * d.y + d.z)];
  }

  /// Returns true when the open surface crosses a grid edge whose ends have the winding numbers w
  /// and `next`. A triangle on the edge would change the winding number by one, so a change below
  /// 1/2 excludes a triangle. The change exceeds 1/2 also across a very small hole. The rim of the
  /// hole then lies within a voxel, so the edge needs no open surface.
  static bool isCrossed(double w, double next) {
    return (w > 0.5) != (next > 0.5) && std::abs(w - next) < 0.5;
  }

  /// Adds the crossed edges from the block's grid points in the positive directions. With `both`,
  /// also adds the crossed edges that end at its grid points and start in the neighbouring blocks
  /// on the negative side.
  void crossedEdgesIn(const V3i& origin, bool both, std::vector<CrossedEdge>& out) const {
    for (int x = 0; x < kBlockDim; ++x)
      for (int y = 0; y < kBlockDim; ++y)
        for (int z = 0; z < kBlockDim; ++z) {
          const V3i p = origin + V3i(x, y, z);
          const double w = at(p);
          for (int axis = 0; axis < 3; ++axis) {
            const double next = at(p + step(axis));
            if (isCrossed(w, next)) out.push_back({p, axis, (0.5 - w) / (next - w)});
            if (!both || p[axis] != origin[axis]) continue;
            const double last = at(p - step(axis));
            if (isCrossed(last, w))
              out.push_back({p - step(axis), axis, (0.5 - last) / (w - last)});
          }
        }
  }

  /// Blocks without computed winding numbers that contain corners of the cells around the crossed
  /// edges.
  std::vector<V3i> unknownNeighbours(const std::vector<V3i>& wave) const {
    std::vector<std::vector<V3i>> found(wave.size());
    ProgressGate gate(progress_, wave.size());
    tbb::parallel_for(std::size_t{0}, wave.size(), [&](std::size_t i) {
      std::vector<CrossedEdge> edges;
      crossedEdgesIn(wave[i], true, edges);
      for (const CrossedEdge& edge : edges)
        for (int corner = 0; corner < 4; ++corner)
          for (int k = 0; k < 8; ++k) {
            const V3i origin = blockOf(cellAt(edge, corner) + V3i(k >> 2, (k >> 1) & 1, k & 1));
            if (!known_.count(origin)) found[i].push_back(origin);
          }
      gate.advance(0);
    });
    std::vector<V3i> next;
    for (const auto& part : found) next.insert(next.end(), part.begin(), part.end());
    return next;
  }

  const SignField& field_;
  std::size_t maxMemory_;
  const Progress& progress_;
  std::map<V3i, std::unique_ptr<SignField::BlockWinding>, CoordLess> known_;
};

}  // namespace

std::vector<std::array<V3d, 3>> findOpenSurface(const SignField& field, std::vector<V3i> seeds,
                                                std::size_t maxMemory, const Progress& progress) {
  OpenSurfaceWalk walk(field, maxMemory, progress);
  walk.follow(std::move(seeds));
  return walk.triangles();
}

}  // namespace levelset::convert
