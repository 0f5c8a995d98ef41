#include "levelset/meshing/sharp/sharp_evidence.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <optional>

#include "levelset/grids/padded_leaf_vdb.h"
#include "levelset/meshing/sharp/sharp_vertices.h"
#include "levelset/meshing/sharp/tangent_planes.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::Vec3d;

/// Distance from an edge, voxels, up to which field values are compared with those of a sharp edge.
/// Inside a convex edge, or outside a concave one, the values of a sharp edge are distances to the
/// nearer sheet. Beyond the edge they are distances to the edge.
constexpr double kEdgeReach = 1.5;
/// kRounded: tolerance of that comparison, voxels; at a rounded right angle, values differ by up to
/// 2/5 of the radius of the rounding. kRoundedPart: share of the values that may exceed the
/// tolerance.
constexpr double kRounded = 0.06, kRoundedPart = 0.15;

/// Signs and smoothness of the grid points of a leaf block and of the first grid points beyond it.
class BlockSigns {
 public:
  BlockSigns(const openvdb::FloatGrid& grid, const openvdb::FloatGrid::ConstAccessor& field,
             const Coord& origin) {
    copyPaddedLeaf(field, origin, 1, 2, values_.data());
    const auto limit = static_cast<float>(kSmoothBend * grid.voxelSize()[0]);
    for (int x = 0; x <= 8; ++x)
      for (int y = 0; y <= 8; ++y)
        for (int z = 0; z <= 8; ++z) {
          const std::size_t n = slot(x, y, z);
          float bend = 0;
          for (const std::size_t step : {kDim * kDim, kDim, std::size_t{1}})
            bend = std::max(bend, std::abs(values_[n - step] + values_[n + step] - 2 * values_[n]));
          inside_[n] = values_[n] < 0;
          bent_[n] = !(bend < limit);
        }
  }
  /// Pattern of the corners of a cell that are inside, as in cell_table.h.
  [[nodiscard]] unsigned pattern(int x, int y, int z) const { return corners(inside_, x, y, z); }
  [[nodiscard]] bool isBent(int x, int y, int z) const { return corners(bent_, x, y, z) != 0; }

 private:
  static constexpr std::size_t kDim = 11;
  using Bits = std::bitset<kDim * kDim * kDim>;
  static std::size_t slot(int x, int y, int z) {
    return static_cast<std::size_t>(((x + 1) * 11 + y + 1) * 11 + z + 1);
  }
  static unsigned corners(const Bits& bits, int x, int y, int z) {
    unsigned result = 0;
    for (int corner = 0; corner < 8; ++corner)
      result |= unsigned{bits[slot(x + (corner >> 2), y + (corner >> 1 & 1), z + (corner & 1))]}
                << corner;
    return result;
  }

  std::array<float, kDim * kDim * kDim> values_;
  Bits inside_, bent_;
};

}  // namespace

void EdgeEvidence::add(const EdgeEvidence& other) {
  for (std::size_t i = 0; i < 2; ++i) {
    points[i] += other.points[i];
    odd[i] += other.odd[i];
  }
}

bool EdgeEvidence::isSharp() const {
  const auto speaksFor = [&](std::size_t i) {
    return points[i] &&
           static_cast<double>(odd[i]) <= kRoundedPart * static_cast<double>(points[i]);
  };
  return speaksFor(0) || speaksFor(1);
}

EdgeEvidence edgeEvidence(const Vec3d& vertex, const VertexSheets& sheets,
                          const openvdb::FloatGrid& grid,
                          const openvdb::FloatGrid::ConstAccessor& field) {
  const double voxelSize = grid.voxelSize()[0];
  const double halfWidth = static_cast<double>(grid.background()) / voxelSize;
  const Vec3d n0 = sheetNormal(sheets, 0), n1 = sheetNormal(sheets, 1);
  const double cosine = n0.dot(n1);
  Vec3d along = n0.cross(n1);
  along.normalize();
  EdgeEvidence found;
  const Coord centre = Coord::round(vertex);
  for (const Coord& c : openvdb::CoordBBox(centre.offsetBy(-2), centre.offsetBy(2))) {
    const Vec3d to = c.asVec3d() - vertex;
    const double alongEdge = to.dot(along), across = (to - along * alongEdge).length();
    const double value = static_cast<double>(field.getValue(c)) / voxelSize;
    // A value at the end of the band is clipped to the background and proves nothing.
    if (std::abs(alongEdge) > kEdgeReach || std::abs(value) > halfWidth * (1 - 1e-5)) continue;
    for (const int sign : {1, -1}) {
      const double d0 = sign * to.dot(n0), d1 = sign * to.dot(n1), d = sign * value;
      const bool isInside = d0 < 0 && d1 < 0 && std::min(d0, d1) > -kEdgeReach;
      const bool isBeyond = d0 > cosine * d1 && d1 > cosine * d0 && across < kEdgeReach;
      if (!isInside && !isBeyond) continue;
      ++found.points[sign < 0];
      found.odd[sign < 0] +=
          isInside ? std::abs(d - std::max(d0, d1)) > kRounded : d > across + kRounded;
    }
  }
  return found;
}

std::vector<SharpVertex> sharpEdgeVertices(const openvdb::FloatGrid& grid,
                                           const openvdb::FloatGrid::ConstAccessor& field,
                                           const Coord& origin) {
  const BlockSigns signs(grid, field, origin);
  std::optional<VertexPlacer> placer;
  std::vector<SharpVertex> found;
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) {
        const unsigned pattern = signs.pattern(x, y, z);
        if (pattern == 0 || pattern == 255 || !signs.isBent(x, y, z)) continue;
        if (!placer) placer.emplace(grid, origin);
        const CellCase& cell = cellTable()[pattern];
        const std::uint8_t* edges = cell.cycleEdges.data();
        for (std::size_t i = 0; i < cell.cycleCount; edges += cell.cycleLength[i++]) {
          const DualVertex vertex = placer->place(x, y, z, edges, cell.cycleLength[i]);
          if (vertex.sheets.count != 2 || vertex.misfit > kFeatureMisfit) continue;
          const Eigen::Vector3d& p = vertex.position;
          const Vec3d position = origin.asVec3d() + Vec3d(p.x(), p.y(), p.z());
          if (edgeEvidence(position, vertex.sheets, grid, field).isSharp())
            found.push_back({position, vertex.sheets});
        }
      }
  return found;
}

}  // namespace levelset
