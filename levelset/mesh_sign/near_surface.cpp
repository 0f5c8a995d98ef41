#include "levelset/mesh_sign/near_surface.h"

#include <Imath/ImathBox.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include "levelset/mesh_sign/triangle_distance.h"

namespace levelset::convert {
namespace {

using Imath::V3d;
using SampleCell = std::array<std::int64_t, 3>;

constexpr double kCellSize = 4;  // voxels

SampleCell cellOf(const V3d& p) {
  SampleCell cell;
  for (std::size_t i = 0; i < 3; ++i)
    cell[i] = static_cast<std::int64_t>(std::floor(p[static_cast<int>(i)] / kCellSize));
  return cell;
}

/// Cubes of edge kCellSize that contain sample points. Each has a list of the triangles whose
/// bounding boxes, enlarged by the search distance, overlap it.
class SampleCells {
 public:
  explicit SampleCells(std::span<const V3d> points) {
    for (const V3d& p : points) lists_[cellOf(p)];
  }

  void add(std::uint32_t triangle, const Imath::Box3d& reach) {
    const SampleCell low = cellOf(reach.min), high = cellOf(reach.max);
    double covered = 1;
    for (std::size_t i = 0; i < 3; ++i) covered *= static_cast<double>(high[i] - low[i] + 1);
    if (covered > static_cast<double>(lists_.size())) {
      for (auto& [cell, list] : lists_) {
        bool within = true;
        for (std::size_t i = 0; i < 3; ++i)
          within = within && cell[i] >= low[i] && cell[i] <= high[i];
        if (within) list.push_back(triangle);
      }
      return;
    }
    SampleCell c;
    for (c[0] = low[0]; c[0] <= high[0]; ++c[0])
      for (c[1] = low[1]; c[1] <= high[1]; ++c[1])
        for (c[2] = low[2]; c[2] <= high[2]; ++c[2])
          if (const auto found = lists_.find(c); found != lists_.end())
            found->second.push_back(triangle);
  }

  [[nodiscard]] const std::vector<std::uint32_t>& at(const V3d& p) const {
    return lists_.find(cellOf(p))->second;
  }

 private:
  std::map<SampleCell, std::vector<std::uint32_t>> lists_;
};

}  // namespace

std::vector<char> areNear(const LocalMesh& mesh, std::span<const V3d> points, double reach) {
  std::vector<char> result(points.size(), 0);
  if (points.empty()) return result;
  Imath::Box3d region;
  for (const V3d& p : points) region.extendBy(p);
  SampleCells cells(points);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    Imath::Box3d box;
    for (std::size_t k = 0; k < 3; ++k) box.extendBy(mesh.corner(t, k));
    box.min -= V3d(reach);
    box.max += V3d(reach);
    if (box.intersects(region)) cells.add(t, box);
  }
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    for (const std::uint32_t t : cells.at(points[i])) {
      const TriangleFrame frame(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2));
      if (frame.squaredDistance(points[i]) > reach * reach) continue;
      result[i] = 1;
      return;
    }
  });
  return result;
}

}  // namespace levelset::convert
