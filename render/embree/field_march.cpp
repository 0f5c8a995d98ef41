#include "render/embree/field_march.h"

#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/vdb.h"
#include "render/embree/surface_spline_vdb.h"
#include "render/shading/field_shape.h"

namespace render {
namespace {

using Imath::V3d;
using openvdb::Coord;
using openvdb::FloatTree;
using CornerAccessor = openvdb::tree::ValueAccessor<const FloatTree, false>;
using Join = FieldExpression::Join;

constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr double kLeastStep = 1e-7;  // smallest step along a ray, in finest voxel sizes
constexpr double kMostStepUp = 1e5;  // largest factor by which repeated smallest steps grow
constexpr double kSlopeRounding = 1 + 1e-6;

/// Bound on the length of the trilinear interpolant's gradient, φ per voxel, in the 9³ cells from
/// one point before the leaf's origin on. In a cell, each component is at most the largest slope of
/// the four edges along its axis.
double steepestNear(const FloatTree& tree, const Coord& origin) {
  CornerAccessor accessor(tree);
  constexpr int kPoints = 10;
  double f[kPoints][kPoints][kPoints];
  for (int x = 0; x < kPoints; ++x)
    for (int y = 0; y < kPoints; ++y)
      for (int z = 0; z < kPoints; ++z)
        f[x][y][z] = static_cast<double>(accessor.getValue(origin.offsetBy(x - 1, y - 1, z - 1)));
  double steepest = 0;
  for (int x = 0; x + 1 < kPoints; ++x)
    for (int y = 0; y + 1 < kPoints; ++y)
      for (int z = 0; z + 1 < kPoints; ++z) {
        V3d edge(0);
        for (int i = 0; i < 2; ++i)
          for (int j = 0; j < 2; ++j) {
            edge.x = std::max(edge.x, std::abs(f[x + 1][y + i][z + j] - f[x][y + i][z + j]));
            edge.y = std::max(edge.y, std::abs(f[x + i][y + 1][z + j] - f[x + i][y][z + j]));
            edge.z = std::max(edge.z, std::abs(f[x + i][y + j][z + 1] - f[x + i][y + j][z]));
          }
        steepest = std::max(steepest, edge.length());
      }
  return steepest;
}

/// Bound on the length of the trilinear interpolant's gradient in the entire grid, φ per voxel.
double steepestOf(const FloatTree& tree) {
  std::vector<Coord> origins;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, origins.size(), 64), 0.0,
      [&](const auto& range, double most) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          most = std::max(most, steepestNear(tree, origins[i]));
        return most;
      },
      [](double a, double b) { return std::max(a, b); });
}

double interpolantAt(const CornerAccessor& accessor, const V3d& place) {
  const V3d base(std::floor(place.x), std::floor(place.y), std::floor(place.z));
  const V3d a = place - base;
  const Coord cell(static_cast<int>(base.x), static_cast<int>(base.y), static_cast<int>(base.z));
  double sum = 0;
  for (int n = 0; n < 8; ++n) {
    const int i = n >> 2, j = n >> 1 & 1, k = n & 1;
    sum += (i ? a.x : 1 - a.x) * (j ? a.y : 1 - a.y) * (k ? a.z : 1 - a.z) *
           static_cast<double>(accessor.getValue(cell.offsetBy(i, j, k)));
  }
  return sum;
}

/// The smooth minimum of FieldExpression, written as a convex combination of a and b less a
/// quadratic term.
double mixedMin(double a, double b, double softness) {
  const double h = std::clamp(0.5 + 0.5 * (b - a) / softness, 0.0, 1.0);
  return a * h + b * (1 - h) - softness * h * (1 - h);
}

double marchedJoin(const FieldExpression& e, Join how, double a, double b) {
  switch (how) {
    case Join::Union:
      return mixedMin(a, b, e.softness);
    case Join::Intersection:
      return -mixedMin(-a, -b, e.softness);
    case Join::Difference:
      return -mixedMin(-a, b, e.softness);
    default:
      return a + (b - a) * e.share;
  }
}

}  // namespace

/// The expression along one ray, as a function of the distance t from the point where the ray first
/// enters the box of a field.
class FieldMarch::RaySegment {
 public:
  // Range of the ray in which some field is not constant: distances from the ray's origin, world
  // units. begin ≥ end: there is no such range.
  double begin = kEndless, end = 0;

  RaySegment(const FieldMarch& march, const V3d& origin, const V3d& direction, double near,
             double far)
      : march_(march), values_(march.expression_.valueCount()) {
    for (const MarchedField& field : march.fields_) {
      const auto [enter, leave] = partIn(field, origin, direction, near, far);
      if (enter >= leave) continue;
      begin = std::min(begin, enter);
      end = std::max(end, leave);
    }
    if (begin >= end) return;
    for (const MarchedField& field : march.fields_) {
      Part part{CornerAccessor(levelset::vdb(field.band).tree()), {}, {}, 0, 0};
      const auto [enter, leave] = partIn(field, origin, direction, near, far);
      part.enter = enter - begin;
      part.leave = leave - begin;
      field.worldToIndex.multVecMatrix(origin + direction * begin, part.start);
      field.worldToIndex.multDirMatrix(direction, part.step);
      parts_.push_back(part);
    }
  }

  [[nodiscard]] bool isEmpty() const { return begin >= end; }
  [[nodiscard]] bool isInside(double t) { return valueAt(t) < 0; }

  /// Finds the next crossing after t with the zero set of the expression. Returns nothing when
  /// there is none up to the end of the segment.
  /// @param inside  true when the ray is inside the solid at t
  std::optional<double> nextCrossing(double t, bool inside) {
    double least = march_.leastStep_;
    while (t < end - begin) {
      const double value = valueAt(t);
      if ((value < 0) != inside) return t;
      const double safe = std::abs(value) / march_.steepest_, step = std::max(safe, least);
      // The growth of the smallest step limits the number of steps of a ray that runs within the
      // surface.
      least =
          safe < least ? std::min(2 * least, kMostStepUp * march_.leastStep_) : march_.leastStep_;
      const double next = std::min(std::max(t + step, nextEntry(t)), end - begin);
      if (isInside(next) != inside) return between(t, next, inside);
      t = next;
    }
    return std::nullopt;
  }

 private:
  struct Part {  // the ray in the index space of one field: start + t · step
    CornerAccessor accessor;
    V3d start, step;
    double enter, leave;  // range of t in which the field is not constant; empty: enter >= leave
  };

  static std::pair<double, double> partIn(const MarchedField& field, const V3d& origin,
                                          const V3d& direction, double near, double far) {
    V3d o, d;
    field.worldToIndex.multVecMatrix(origin, o);
    field.worldToIndex.multDirMatrix(direction, d);
    for (int a = 0; a < 3; ++a) {
      if (d[a] == 0) {
        if (o[a] < field.box.min[a] || o[a] > field.box.max[a]) return {kEndless, -kEndless};
        continue;
      }
      const double t0 = (field.box.min[a] - o[a]) / d[a], t1 = (field.box.max[a] - o[a]) / d[a];
      near = std::max(near, std::min(t0, t1));
      far = std::min(far, std::max(t0, t1));
    }
    return {near, far};
  }

  double valueAt(double t) {
    std::size_t n = 0;
    for (const Part& part : parts_)
      values_[n++] = interpolantAt(part.accessor, part.start + part.step * t);
    for (const FieldExpression::Step& step : march_.expression_.steps)
      values_[n++] = marchedJoin(march_.expression_, step.join, values_[step.a], values_[step.b]);
    return values_[march_.expression_.drawn];
  }

  /// If all fields are constant at t: the parameter at which the next field begins to vary.
  /// Otherwise 0.
  [[nodiscard]] double nextEntry(double t) const {
    double entry = kEndless;
    for (const Part& part : parts_) {
      if (part.enter >= part.leave || t > part.leave) continue;
      if (t >= part.enter) return 0;
      entry = std::min(entry, part.enter);
    }
    return entry;
  }

  double between(double a, double b, bool inside) {
    for (double middle = 0.5 * (a + b); middle > a && middle < b; middle = 0.5 * (a + b))
      (isInside(middle) == inside ? a : b) = middle;
    return b;
  }

  const FieldMarch& march_;
  std::vector<Part> parts_;
  std::vector<double> values_;
};

FieldMarch::FieldMarch(const Scene& scene) : expression_(fieldExpression(scene)) {
  double steepest = 0, finest = kEndless;
  for (const FieldExpression::Operand& operand : expression_.operands) {
    MarchedField field;
    field.band = scene.solids[operand.solid].band;
    field.indexToWorld = field.band.indexToWorld();
    field.worldToIndex = field.indexToWorld.inverse();
    const FloatTree& tree = levelset::vdb(field.band).tree();
    openvdb::CoordBBox leaves;
    tree.evalLeafBoundingBox(leaves);
    leaves.expand(1);
    field.box = {levelset::toImath(leaves.min().asVec3d()),
                 levelset::toImath(leaves.max().asVec3d())};
    steepest = std::max(steepest, steepestOf(tree) / field.band.voxelSize());
    finest = std::min(finest, field.band.voxelSize());
    fields_.push_back(std::move(field));
  }
  if (steepest > 0) steepest_ = steepest * kSlopeRounding;
  leastStep_ = kLeastStep * finest;
}

Hit FieldMarch::intersect(const V3d& origin, const V3d& direction, double near, double far) const {
  Hit hit;
  RaySegment segment(*this, origin, direction, near, far);
  if (segment.isEmpty()) return hit;
  const std::optional<double> t = segment.nextCrossing(0, segment.isInside(0));
  if (!t) return hit;
  hit.distance = segment.begin + *t;
  hit.position = origin + direction * hit.distance;
  std::vector<FieldShape> shapes;
  for (const MarchedField& field : fields_) {
    const FloatTree& tree = levelset::vdb(field.band).tree();
    const V3d place = hit.position * field.worldToIndex;
    shapes.push_back(fieldShape(interpolantAt(CornerAccessor(tree), place),
                                surfaceShape(tree, place, Filter::Trilinear), field.indexToWorld));
  }
  addFieldShape(hit, expression_, shapes, direction);
  return hit;
}

bool FieldMarch::isOccluded(const V3d& origin, const V3d& direction, double near,
                            double far) const {
  RaySegment segment(*this, origin, direction, near, far);
  return !segment.isEmpty() && segment.nextCrossing(0, segment.isInside(0));
}

double FieldMarch::thickness(const V3d& origin, const V3d& direction, double near,
                             double far) const {
  RaySegment segment(*this, origin, direction, near, far);
  if (segment.isEmpty()) return 0;
  double length = 0, from = 0;
  for (bool inside = segment.isInside(0);; inside = !inside) {
    const std::optional<double> t = segment.nextCrossing(from, inside);
    if (inside) length += t.value_or(segment.end - segment.begin) - from;
    if (!t) return length;
    from = *t;
  }
}

}  // namespace render
