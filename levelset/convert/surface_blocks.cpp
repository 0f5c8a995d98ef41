#include "levelset/convert/surface_blocks.h"

#include <tbb/task_group.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/mesh_sign/triangle_distance.h"
#include "levelset/progress_gate.h"

namespace levelset::convert {
namespace {

using Imath::V3d;
using Imath::V3i;
using List = std::vector<std::uint32_t>;

constexpr std::size_t kTaskSize = 2048;  // minimum number of triangles of a cell that is a task
constexpr std::size_t kShare = std::size_t{1} << 50;  // progress units of the complete traversal

struct Cell {
  std::int64_t x, y, z, size;  // lowest grid point; grid points along an edge
};

class BlockTraversal {
 public:
  BlockTraversal(const LocalMesh& mesh, double reach, const BlockVisitor& visit,
                 const Progress& progress, const std::optional<Imath::Box3i>& region,
                 const CellTest& isNeeded)
      : mesh_(mesh),
        reach_(reach),
        visit_(visit),
        isNeeded_(isNeeded),
        gate_(progress, kShare),
        region_(region) {
    double half = kBlockDim;
    for (const Imath::V3d& point : mesh.points)
      for (int axis = 0; axis < 3; ++axis) half = std::max(half, std::abs(point[axis]) + reach);
    root_ = kBlockDim;
    // The largest unit is left free, so that rounding outwards stays inside.
    while (static_cast<double>(root_) * (1 - 4.0 / kUnits) <= half) root_ *= 2;
    unit_ = static_cast<double>(2 * root_) / kUnits;
    boxes_.reserve(mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) boxes_.push_back(boxOf(t));
  }

  void run() {
    List all(mesh_.triangles.size());
    for (std::size_t t = 0; t < all.size(); ++t) all[t] = static_cast<std::uint32_t>(t);
    const Cell root = {-root_, -root_, -root_, 2 * root_};
    group_.run_and_wait([&] { traverse(root, all, kShare); });
  }

 private:
  // Boxes are stored in units of the root cell's edge divided by kUnits. Meshes have many
  // triangles, so two bytes for each number save memory.
  static constexpr int kUnits = 1 << 16;
  /// Bounding box of a triangle, enlarged by reach_ and rounded outwards, in units from the lowest
  /// corner of the root cell.
  struct Box {
    std::array<std::uint16_t, 3> low, high;
    std::uint16_t extent;  // longest side of the triangle's bounding box, rounded up
  };

  Box boxOf(std::size_t t) const {
    const V3d &a = mesh_.corner(t, 0), &b = mesh_.corner(t, 1), &c = mesh_.corner(t, 2);
    Box box{};
    double extent = 0;
    const auto units = [this](double length) {
      return static_cast<std::uint16_t>(std::clamp(length / unit_, 0.0, kUnits - 1.0));
    };
    for (int axis = 0; axis < 3; ++axis) {
      const double low = std::min({a[axis], b[axis], c[axis]}),
                   high = std::max({a[axis], b[axis], c[axis]}), root = static_cast<double>(root_);
      const auto i = static_cast<std::size_t>(axis);
      box.low[i] = units(low - reach_ + root - unit_ / 2);
      box.high[i] = units(high + reach_ + root + unit_);
      extent = std::max(extent, high - low);
    }
    box.extent = units(extent + unit_);
    return box;
  }

  bool touches(std::uint32_t t, const Cell& cell) const {
    const Box& box = boxes_[t];
    const double last = static_cast<double>(cell.size - 1);
    const V3d low(static_cast<double>(cell.x), static_cast<double>(cell.y),
                  static_cast<double>(cell.z));
    for (int axis = 0; axis < 3; ++axis) {
      const double from = low[axis] + static_cast<double>(root_);
      const auto i = static_cast<std::size_t>(axis);
      if (box.low[i] * unit_ > from + last || box.high[i] * unit_ < from) return false;
    }
    const double extent = box.extent * unit_;
    if (isNeeded_) {
      // In a cell larger than the box, the test would hardly exclude the triangle.
      const bool isLarge = static_cast<double>(cell.size) > extent + 2 * reach_;
      return isLarge || isNeeded_(t, low + V3d(last / 2), last / 2);
    }
    if (extent <= static_cast<double>(cell.size)) return true;
    const TriangleFrame frame(mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2));
    const double range = reach_ + last * 0.8660255 + 1e-6;
    return frame.squaredDistance(low + V3d(last / 2)) <= range * range;
  }

  [[nodiscard]] bool isInRegion(const Cell& cell) const {
    if (!region_) return true;
    const std::int64_t low[] = {cell.x, cell.y, cell.z};
    for (int axis = 0; axis < 3; ++axis)
      if (low[axis] > region_->max[axis] || low[axis] + cell.size <= region_->min[axis])
        return false;
    return true;
  }

  void traverse(const Cell& cell, const List& triangles, std::size_t share) {
    if (!isInRegion(cell)) return gate_.advance(share);
    if (cell.size == kBlockDim) {
      visit_(V3i(static_cast<int>(cell.x), static_cast<int>(cell.y), static_cast<int>(cell.z)),
             triangles);
      gate_.advance(share);
      return;
    }
    std::vector<std::pair<Cell, List>> parts;
    std::size_t total = 0;
    for (int child = 0; child < 8; ++child) {
      const std::int64_t half = cell.size / 2;
      const Cell part = {cell.x + (child & 4 ? half : 0), cell.y + (child & 2 ? half : 0),
                         cell.z + (child & 1 ? half : 0), half};
      List list;
      for (const std::uint32_t t : triangles)
        if (touches(t, part)) list.push_back(t);
      total += list.size();
      if (!list.empty()) parts.emplace_back(part, std::move(list));
    }
    for (auto& [part, list] : parts) {
      const auto partShare =
          static_cast<std::size_t>(static_cast<double>(share) * static_cast<double>(list.size()) /
                                   static_cast<double>(total));
      if (list.size() >= kTaskSize) {
        gate_.advance(0);
        group_.run([this, task = part, own = std::move(list), partShare] {
          traverse(task, own, partShare);
        });
      } else {
        traverse(part, list, partShare);
      }
    }
  }

  const LocalMesh& mesh_;
  double reach_;
  const BlockVisitor& visit_;
  const CellTest& isNeeded_;
  ProgressGate gate_;
  std::optional<Imath::Box3i> region_;
  std::int64_t root_ = 0;  // half the edge of the root cell, grid points
  double unit_ = 1;        // unit of the boxes, voxels
  std::vector<Box> boxes_;
  tbb::task_group group_;
};

}  // namespace

CellTest prismTest(const LocalMesh& mesh, const PrismCovering& prisms) {
  return [&](std::uint32_t t, const V3d& centre, double halfEdge) {
    return PrismPlanes(
               {mesh.corner(t, 0) - centre, mesh.corner(t, 1) - centre, mesh.corner(t, 2) - centre},
               prisms.prism(t), prisms.reach())
        .mayTouch(V3d(0), halfEdge);
  };
}

void forEachBlock(const LocalMesh& mesh, double reach, const BlockVisitor& visit,
                  const Progress& progress, const std::optional<Imath::Box3i>& region,
                  const CellTest& isNeeded) {
  if (mesh.triangles.empty()) return;
  BlockTraversal(mesh, reach, visit, progress, region, isNeeded).run();
}

}  // namespace levelset::convert
