#include "levelset/csg/seam_curve.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <optional>

namespace levelset::solids {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;
using Accessor = openvdb::tree::ValueAccessor<const FloatTree>;

// Sine of the smallest angle between the surfaces that counts as a crease.
constexpr double kLeastSine = 0.1;
// Largest distance of a curve point from the centre of its cell along each axis, voxels.
constexpr double kCellReach = 0.75;

/// Linear model of a field in a cell of eight grid points.
struct CellModel {
  double value = 0;  ///< value at the centre of the cell
  Vec3d gradient;
  bool crossed = false;  ///< the zero set of the field crosses the cell

  CellModel(const Accessor& accessor, const Coord& cell) {
    int inside = 0;
    gradient.setZero();
    for (int corner = 0; corner < 8; ++corner) {
      const Coord d(corner >> 2, corner >> 1 & 1, corner & 1);
      const double v = accessor.getValue(cell + d);
      inside += v < 0;
      value += v / 8;
      for (int i = 0; i < 3; ++i) gradient[i] += d[i] ? v / 4 : -v / 4;
    }
    crossed = inside > 0 && inside < 8;
  }
};

/// Returns the point nearest to the centre of the cell at which both models are zero, in index
/// space. Empty if the surfaces are nearly parallel, or the point is not in or near the cell.
std::optional<Vec3d> meetingPoint(const CellModel& a, const CellModel& b, const Coord& cell) {
  const double aa = a.gradient.lengthSqr(), bb = b.gradient.lengthSqr(),
               ab = a.gradient.dot(b.gradient);
  const double determinant = aa * bb - ab * ab;
  if (!(determinant > kLeastSine * kLeastSine * aa * bb)) return {};
  const double u = (-a.value * bb + b.value * ab) / determinant,
               v = (-b.value * aa + a.value * ab) / determinant;
  const Vec3d offset = a.gradient * u + b.gradient * v;
  for (int i = 0; i < 3; ++i)
    if (std::abs(offset[i]) > kCellReach) return {};
  return cell.asVec3d() + Vec3d(0.5) + offset;
}

}  // namespace

std::vector<Vec3d> seamCurve(const FloatTree& a, const FloatTree& b) {
  std::vector<const LeafNode*> leaves;
  for (auto leaf = a.cbeginLeaf(); leaf; ++leaf) leaves.push_back(leaf.getLeaf());
  std::vector<std::vector<Vec3d>> found(leaves.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16), [&](const auto& range) {
    const Accessor readA(a), readB(b);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      if (!readB.probeConstLeaf(leaves[i]->origin())) continue;
      for (auto it = leaves[i]->cbeginValueOn(); it; ++it) {
        const Coord cell = it.getCoord();
        if (!readB.isValueOn(cell)) continue;
        const CellModel modelB(readB, cell);
        if (!modelB.crossed) continue;
        const CellModel modelA(readA, cell);
        if (!modelA.crossed) continue;
        if (const auto point = meetingPoint(modelA, modelB, cell)) found[i].push_back(*point);
      }
    }
  });
  std::vector<Vec3d> points;
  for (const auto& part : found) points.insert(points.end(), part.begin(), part.end());
  return points;
}

}  // namespace levelset::solids
