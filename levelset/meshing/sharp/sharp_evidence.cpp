#include "levelset/meshing/sharp/sharp_evidence.h"

#include <algorithm>
#include <array>
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
    std::array<float, std::size_t{kDim} * kDim * kDim> values;
    copyPaddedLeaf(field, origin, 1, 2, values.data());
    const auto limit = static_cast<float>(kSmoothBend * grid.voxelSize()[0]);
    for (int x = 0; x < kSide; ++x)
      for (int y = 0; y < kSide; ++y) {
        const float* v = values.data() + ((x + 1) * kDim + y + 1) * kDim + 1;
        std::array<bool, kSide> isInside, isBent;
        for (int z = 0; z < kSide; ++z) {
          const float twice = 2 * v[z];
          const float alongX = std::abs(v[z - kDim * kDim] + v[z + kDim * kDim] - twice),
                      alongY = std::abs(v[z - kDim] + v[z + kDim] - twice),
                      alongZ = std::abs(v[z - 1] + v[z + 1] - twice);
          isInside[static_cast<std::size_t>(z)] = v[z] < 0;
          isBent[static_cast<std::size_t>(z)] =
              !(alongX < limit) | !(alongY < limit) | !(alongZ < limit);
        }
        inside_[row(x, y)] = bits(isInside);
        bent_[row(x, y)] = bits(isBent);
      }
  }
  /// Returns the cells of a row with corners on both sides and a bent corner: bit z for each.
  [[nodiscard]] unsigned bentCrossings(int x, int y) const {
    unsigned any = 0, all = ~0u, bent = 0;
    for (const std::size_t i : {row(x, y), row(x, y + 1), row(x + 1, y), row(x + 1, y + 1)}) {
      any |= inside_[i] | inside_[i] >> 1;
      all &= inside_[i] & inside_[i] >> 1;
      bent |= bent_[i] | bent_[i] >> 1;
    }
    return any & ~all & bent & 0xff;
  }
  /// Pattern of the corners of a cell that are inside, as in cell_table.h.
  [[nodiscard]] unsigned pattern(int x, int y, int z) const {
    unsigned result = 0;
    for (int corner = 0; corner < 8; ++corner)
      result |= (inside_[row(x + (corner >> 2), y + (corner >> 1 & 1))] >> (z + (corner & 1)) & 1u)
                << corner;
    return result;
  }

 private:
  static constexpr int kSide = 9, kDim = kSide + 2;
  static std::size_t row(int x, int y) { return static_cast<std::size_t>(x * kSide + y); }
  static unsigned bits(const std::array<bool, kSide>& values) {
    unsigned result = 0;
    for (std::size_t i = 0; i < kSide; ++i) result |= unsigned{values[i]} << i;
    return result;
  }

  std::array<unsigned, std::size_t{kSide} * kSide> inside_, bent_;  // rows along z, bit z for each
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
                                           const Coord& origin,
                                           const openvdb::MaskTree::LeafNodeType* cells) {
  const BlockSigns signs(grid, field, origin);
  std::optional<VertexPlacer> placer;
  std::vector<SharpVertex> found;
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (unsigned row = signs.bentCrossings(x, y); row; row &= row - 1) {
        const int z = __builtin_ctz(row);
        if (cells && !cells->isValueOn(origin.offsetBy(x, y, z))) continue;
        const unsigned pattern = signs.pattern(x, y, z);
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
