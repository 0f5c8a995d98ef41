#include "apps/pipeline/run/surface_spread.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "apps/pipeline/values/value.h"
#include "levelset/files/band_file.h"

namespace pipeline {
namespace {

using Imath::Box3d;
using Imath::V3d;
using Imath::V3i;

constexpr double kCellVoxels = 32;  ///< edge length of the cells, a quarter of the least part

/// Share of the planned surface in a box, at most. In a convex solid no box holds more of the
/// surface than three of its own faces. A folded surface is spread over the volume.
double shareByPlan(const Plan& plan, const Box3d& box) {
  const V3d size = plan.bounds.size();
  V3d inner;
  double volume = 1;
  for (int axis = 0; axis < 3; ++axis) {
    inner[axis] = std::max(0.0, std::min(plan.bounds.max[axis], box.max[axis]) -
                                    std::max(plan.bounds.min[axis], box.min[axis]));
    if (size[axis] > 0) volume *= inner[axis] / size[axis];
  }
  const double faces = inner.x * inner.y + inner.y * inner.z + inner.z * inner.x;
  return std::min(1.0, std::max(volume, plan.area > 0 ? faces / plan.area : 0.0));
}

/// Share of a cell in a box, in [0, 1].
double shareOfCell(const V3i& cell, double size, const Box3d& box) {
  double share = 1;
  for (int axis = 0; axis < 3 && share > 0; ++axis) {
    const double low = std::max(box.min[axis] / size, static_cast<double>(cell[axis])),
                 high = std::min(box.max[axis] / size, static_cast<double>(cell[axis]) + 1);
    share *= std::max(0.0, high - low);
  }
  return share;
}

}  // namespace

std::size_t SurfaceSpread::CellHash::operator()(const V3i& cell) const {
  std::size_t hash = 0;
  for (int axis = 0; axis < 3; ++axis) {
    hash = (hash ^ static_cast<std::uint32_t>(cell[axis])) * 0x9e3779b97f4a7c15ull;
    hash ^= hash >> 29;
  }
  return hash;
}

void SurfaceSpread::add(const V3d& at, double amount) {
  V3i cell;
  for (int axis = 0; axis < 3; ++axis)
    cell[axis] = static_cast<int>(std::floor(at[axis] / cellSize_));
  amounts_[cell] += amount;
  total_ += amount;
}

void SurfaceSpread::add(const levelset::TriMesh& mesh) {
  std::vector<std::array<V3d, 3>> pieces;
  for (const auto& [a, b, c] : mesh.triangles) {
    pieces.push_back({mesh.positions[a], mesh.positions[b], mesh.positions[c]});
    while (!pieces.empty()) {
      const auto [p, q, r] = pieces.back();
      pieces.pop_back();
      const std::array<double, 3> sides = {(q - p).length2(), (r - q).length2(), (p - r).length2()};
      const auto longest = std::max_element(sides.begin(), sides.end());
      if (*longest <= cellSize_ * cellSize_) {
        add((p + q + r) / 3, 0.5 * (q - p).cross(r - p).length());
        continue;
      }
      // Turn the triangle so that pq is the longest side, and halve it.
      std::array<V3d, 3> t = {p, q, r};
      std::rotate(t.begin(), t.begin() + (longest - sides.begin()), t.end());
      const V3d middle = (t[0] + t[1]) / 2;
      pieces.push_back({t[0], middle, t[2]});
      pieces.push_back({middle, t[1], t[2]});
    }
  }
}

double SurfaceSpread::within(const Box3d& box) const {
  if (total_ <= 0) return 0;
  double sum = 0;
  for (const auto& [cell, amount] : amounts_) sum += amount * shareOfCell(cell, cellSize_, box);
  return std::min(1.0, sum / total_);
}

double SurfaceSpread::inDensestSlab(const Box3d& box, double width) const {
  std::map<int, double> amounts;  // by the position of the cells along x
  for (const auto& [cell, amount] : amounts_)
    if (const double part = amount * shareOfCell(cell, cellSize_, box); part > 0)
      amounts[cell.x] += part;
  if (amounts.empty()) return 0;
  // Amount below each face between cells, from the first face to the last one.
  const int first = amounts.begin()->first;
  std::vector<double> below = {0};
  for (const auto& [x, amount] : amounts) {
    below.resize(static_cast<std::size_t>(x - first) + 1, below.back());
    below.push_back(below.back() + amount);
  }
  const auto amountBelow = [&](double x) {
    const double at = std::clamp(x, 0.0, static_cast<double>(below.size() - 1));
    const auto i = std::min(static_cast<std::size_t>(at), below.size() - 2);
    return below[i] + (at - static_cast<double>(i)) * (below[i + 1] - below[i]);
  };
  // The amount below a position is piecewise linear, so the densest slab begins or ends at a face.
  double most = 0;
  for (std::size_t i = 0; i < below.size(); ++i) {
    const double after = amountBelow(static_cast<double>(i) + width / cellSize_) - below[i];
    const double before = below[i] - amountBelow(static_cast<double>(i) - width / cellSize_);
    most = std::max({most, after, before});
  }
  return std::min(1.0, most / total_);
}

SurfaceShares surfaceShares(const Graph& graph, std::size_t node, const Plan& plan) {
  const Node& maker = graph.nodes[node];
  const auto spread = std::make_shared<SurfaceSpread>(kCellVoxels * plan.voxelSize);
  const auto operand = maker.inputs.empty() ? graph.given.end() : graph.given.find(maker.inputs[0]);
  if (operand != graph.given.end() && operand->second.kind() == Kind::Mesh) {
    spread->add(operand->second.mesh());
  } else if (maker.op->name == "read") {
    const Invocation reading(*maker.op, maker.options);
    levelset::visitBlocks(reading.text("file"), {.grid = reading.text("grid")},
                          [&](const V3d& centre) { spread->add(centre, 1); });
  } else {
    return {[plan](const Box3d& box) { return shareByPlan(plan, box); },
            [plan](const Box3d& box, double width) {
              Box3d slab = box;
              slab.min.x = std::max(box.min.x, plan.bounds.min.x);
              slab.max.x = std::min(box.max.x, slab.min.x + width);
              return shareByPlan(plan, slab);
            }};
  }
  return {[spread](const Box3d& box) { return spread->within(box); },
          [spread](const Box3d& box, double width) { return spread->inDensestSlab(box, width); }};
}

}  // namespace pipeline
