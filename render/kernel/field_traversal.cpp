#include "render/kernel/field_traversal.h"

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "levelset/progress.h"

namespace render {
namespace {

using Imath::V3d;
using Join = FieldExpression::Join;
using Range = FieldGrid::Range;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr int kMostHalvings =
    44;  // halvings of a ray segment, down to the spacing of representable positions
// Bound on the rounding noise of the expression's value, relative to the largest |φ| that a grid
// has outside its band.
constexpr double kNoise = 1e-13;

/// Bernstein coefficients of a field's cubic on a ray segment.
using FieldCubic = std::array<double, 4>;

/// Bounds on a field's values along a ray segment (`value`), and on a third of its derivative by
/// the segment's parameter in [0, 1] (`slope`).
struct FieldBounds {
  Range value, slope;
};

Range joinRanges(const FieldExpression& e, Join join, const Range& a, const Range& b) {
  const bool isTurned = join == Join::Difference;
  return {e.join(join, a.low, isTurned ? b.high : b.low),
          e.join(join, a.high, isTurned ? b.low : b.high)};
}

Range negated(const Range& r) {
  return {-r.high, -r.low};
}

/// Bounds on share · a + (1 − share) · b, given ranges of the share and of the slopes a and b.
Range mixedSlope(const Range& share, const Range& a, const Range& b) {
  const auto at = [](double s, double u, double v) { return s * u + (1 - s) * v; };
  return {std::min(at(share.low, a.low, b.low), at(share.high, a.low, b.low)),
          std::max(at(share.low, a.high, b.high), at(share.high, a.high, b.high))};
}

FieldBounds joinBounds(const FieldExpression& e, Join join, const FieldBounds& a,
                       const FieldBounds& b) {
  const Range value = joinRanges(e, join, a.value, b.value);
  if (join == Join::Morph) return {value, mixedSlope({1 - e.share, 1 - e.share}, a.slope, b.slope)};
  const bool isTurned = join == Join::Difference;
  const Range other = isTurned ? negated(b.value) : b.value;
  Range ahead{other.low - a.value.high, other.high - a.value.low};
  if (join != Join::Union) ahead = negated(ahead);
  const auto shareAt = [&](double d) { return std::clamp(0.5 + 0.5 * d / e.softness, 0.0, 1.0); };
  return {value, mixedSlope({shareAt(ahead.low), shareAt(ahead.high)}, a.slope,
                            isTurned ? negated(b.slope) : b.slope)};
}

FieldBounds boundsOf(const FieldCubic& c) {
  const double d[3] = {c[1] - c[0], c[2] - c[1], c[3] - c[2]};
  return {{std::min(std::min(c[0], c[1]), std::min(c[2], c[3])),
           std::max(std::max(c[0], c[1]), std::max(c[2], c[3]))},
          {std::min(std::min(d[0], d[1]), d[2]), std::max(std::max(d[0], d[1]), d[2])}};
}

/// Splits a cubic at one half by De Casteljau's algorithm.
void halve(const FieldCubic& c, FieldCubic& left, FieldCubic& right) {
  const double b01 = 0.5 * (c[0] + c[1]), b12 = 0.5 * (c[1] + c[2]), b23 = 0.5 * (c[2] + c[3]);
  const double b012 = 0.5 * (b01 + b12), b123 = 0.5 * (b12 + b23), middle = 0.5 * (b012 + b123);
  left = {c[0], b01, b012, middle};
  right = {middle, b123, b23, c[3]};
}

double valueAt(const FieldCubic& c, double s) {
  const double r = 1 - s;
  return r * r * (r * c[0] + 3 * s * c[1]) + s * s * (3 * r * c[2] + s * c[3]);
}

/// Traversal of one grid by a ray: the present block, and the present cell in that block.
struct GridTraversal {
  const FieldGrid* grid;
  // Ray in the grid's index space. Its parameter is the world distance from the ray's start.
  V3d origin, direction;
  double inverse[3];
  int block[3] = {}, cell[3] = {};
  int number = -1;  // number of the present block; negative: the field is constant in the block
  double blockExit = 0, cellExit = kNever;
  // Axis of the face through which the ray leaves the block or cell; −1: outside the grid's blocks.
  int blockAxis = -1, cellAxis = -1;
  Range range{0, 0};  // range of the values in the present block or cell
  double corner[2][2][2];

  GridTraversal(const FieldGrid& of, const V3d& start, const V3d& along) : grid(&of) {
    of.worldToIndex().multVecMatrix(start, origin);
    of.worldToIndex().multDirMatrix(along, direction);
    for (int a = 0; a < 3; ++a) {
      inverse[a] = 1 / direction[a];
      if (!std::isfinite(inverse[a]))
        direction[a] = inverse[a] = 0;  // the ray meets no plane across this axis
    }
    beAway(entry());
  }

  /// Parameter at which the ray meets the plane k across axis a. All cells and blocks use this
  /// function. It is monotone in k, so neighbours agree on their common face.
  [[nodiscard]] double plane(int a, int k) const {
    return (static_cast<double>(k) - origin[a]) * inverse[a];
  }
  [[nodiscard]] double entry() const {
    double enter = 0, leave = kNever;
    for (int a = 0; a < 3; ++a) {
      const int high = grid->size(a) * FieldGrid::kEdge;
      if (direction[a] == 0) {
        if (origin[a] < 0 || origin[a] > high) return kNever;
        continue;
      }
      enter = std::max(enter, plane(a, direction[a] > 0 ? 0 : high));
      leave = std::min(leave, plane(a, direction[a] > 0 ? high : 0));
    }
    return enter < leave ? enter : kNever;
  }
  /// Marks the ray as outside the grid's blocks up to the parameter `until`.
  void beAway(double until) {
    number = -1;
    blockAxis = -1;
    blockExit = until;
  }

  [[nodiscard]] double exitOf(const int (&at)[3], int edge, int& axis) const {
    double exit = kNever;
    for (int a = 0; a < 3; ++a) {
      if (direction[a] == 0) continue;
      const double p = plane(a, (at[a] + (direction[a] > 0 ? 1 : 0)) * edge);
      if (p < exit) {
        exit = p;
        axis = a;
      }
    }
    return exit;
  }
  [[nodiscard]] int placeIn(int a, double t, int low, int high) const {
    return static_cast<int>(std::clamp(std::floor(origin[a] + t * direction[a]),
                                       static_cast<double>(low), static_cast<double>(high)));
  }

  void nextBlock(double t) {
    if (blockAxis < 0) {
      if (blockExit == kNever) return;
      for (int a = 0; a < 3; ++a)
        block[a] = placeIn(a, t, 0, grid->size(a) * FieldGrid::kEdge - 1) / FieldGrid::kEdge;
    } else {
      block[blockAxis] += direction[blockAxis] > 0 ? 1 : -1;
      if (block[blockAxis] < 0 || block[blockAxis] >= grid->size(blockAxis)) return beAway(kNever);
    }
    number = grid->block(block[0], block[1], block[2]);
    blockExit = exitOf(block, FieldGrid::kEdge, blockAxis);
  }

  void firstCell(double t) {
    cellExit = kNever;
    if (number < 0) return;
    for (int a = 0; a < 3; ++a) {
      const int low = block[a] * FieldGrid::kEdge;
      cell[a] = placeIn(a, t, low, low + FieldGrid::kEdge - 1);
    }
    readCell();
  }
  void nextCell() {
    cell[cellAxis] += direction[cellAxis] > 0 ? 1 : -1;
    if (cell[cellAxis] / FieldGrid::kEdge == block[cellAxis] && cell[cellAxis] >= 0)
      readCell();
    else
      cellExit = kNever;  // the ray leaves the block, too
  }
  void readCell() {
    constexpr int kPoints = FieldGrid::kPoints;
    const float* from =
        grid->values(number) + ((cell[0] & 7) * kPoints + (cell[1] & 7)) * kPoints + (cell[2] & 7);
    range = {kNever, -kNever};
    for (int n = 0; n < 8; ++n) {
      const int i = n >> 2, j = n >> 1 & 1, k = n & 1;
      const auto v = static_cast<double>(from[(i * kPoints + j) * kPoints + k]);
      corner[i][j][k] = v;
      range = {std::min(range.low, v), std::max(range.high, v)};
    }
    cellExit = exitOf(cell, 1, cellAxis);
  }

  /// Bernstein coefficients of the field along the ray between t0 and t1 within the present cell.
  /// They are values of the blossom of the field's cubic there.
  [[nodiscard]] FieldCubic cubic(double t0, double t1) const {
    if (number < 0) return {range.low, range.low, range.low, range.low};
    double p[2][3];
    for (int a = 0; a < 3; ++a) {
      p[0][a] = std::clamp(origin[a] + t0 * direction[a] - cell[a], 0.0, 1.0);
      p[1][a] = std::clamp(origin[a] + t1 * direction[a] - cell[a], 0.0, 1.0);
    }
    // blossom[i][j][k]: interpolant with x taken at t0 (i = 0) or t1 (i = 1), and likewise y by j
    // and z by k.
    double blossom[2][2][2];
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) {
        double line[2];
        for (int k = 0; k < 2; ++k) {
          const double low = corner[0][0][k] + (corner[1][0][k] - corner[0][0][k]) * p[i][0];
          const double high = corner[0][1][k] + (corner[1][1][k] - corner[0][1][k]) * p[i][0];
          line[k] = low + (high - low) * p[j][1];
        }
        for (int k = 0; k < 2; ++k) blossom[i][j][k] = line[0] + (line[1] - line[0]) * p[k][2];
      }
    return {blossom[0][0][0], (blossom[0][0][1] + blossom[0][1][0] + blossom[1][0][0]) / 3,
            (blossom[0][1][1] + blossom[1][0][1] + blossom[1][1][0]) / 3, blossom[1][1][1]};
  }
};

/// Finds the points where one ray crosses the zero set of the expression. render/shaders/field.glsl
/// has the same steps, and must give the same bits.
class FieldSearch {
 public:
  std::vector<double> crossings;  // distances from `start` along the ray, world units
  bool startsInside = false;

  /// @param wantsAll  true: finds all crossings; false: only the first one
  FieldSearch(const FieldTraversal& fields, const FieldSegment& segment, bool wantsAll)
      : e_(fields.expression()),
        end_(segment.end),
        wantsAll_(wantsAll),
        noise_(fields.noise()),
        values_(e_.valueCount()),
        bounds_(e_.valueCount()),
        ranges_(e_.valueCount()),
        cubics_(fields.grids().size() * (kMostHalvings + 1)) {
    for (const FieldGrid& grid : fields.grids())
      traversals_.emplace_back(grid, segment.start, segment.direction);
    walkBlocks();
  }

 private:
  template <typename Value, typename JoinValues>
  Value joined(std::vector<Value>& values, const JoinValues& join) const {
    std::size_t n = traversals_.size();
    for (const FieldExpression::Step& step : e_.steps)
      values[n++] = join(e_, step.join, values[step.a], values[step.b]);
    return values[e_.drawn];
  }

  /// Records if the ray is inside the solid from t on, and a crossing at t if it was on the other
  /// side before. Returns true when the search continues.
  bool settle(bool isInside, double t) {
    if (!inside_) startsInside = isInside;
    const bool hasChanged = inside_ && *inside_ != isInside;
    inside_ = isInside;
    if (hasChanged) crossings.push_back(t);
    return wantsAll_ || !hasChanged;
  }

  /// Decides from the value ranges in the present blocks or cells if the ray is inside the solid.
  /// Returns nothing when the ranges allow both signs.
  std::optional<bool> sideByRanges() {
    for (std::size_t i = 0; i < traversals_.size(); ++i) ranges_[i] = traversals_[i].range;
    const Range all = joined(ranges_, joinRanges);
    if (all.low >= 0) return false;
    if (all.high < 0) return true;
    return std::nullopt;
  }

  void walkBlocks() {
    for (double t = 0; t < end_;) {
      for (GridTraversal& traversal : traversals_) {
        while (traversal.blockExit <= t) traversal.nextBlock(t);
        traversal.range = traversal.grid->range(traversal.number);
      }
      double next = end_;
      for (const GridTraversal& traversal : traversals_) next = std::min(next, traversal.blockExit);
      const std::optional<bool> side = sideByRanges();
      if (side ? !settle(*side, t) : !walkCells(t, next)) return;
      t = next;
    }
  }

  bool walkCells(double t, double end) {
    for (GridTraversal& traversal : traversals_) traversal.firstCell(t);
    for (;;) {
      for (GridTraversal& traversal : traversals_)
        while (traversal.cellExit <= t) traversal.nextCell();
      double next = end;
      for (const GridTraversal& traversal : traversals_) next = std::min(next, traversal.cellExit);
      const std::optional<bool> side = sideByRanges();
      if (side ? !settle(*side, t) : !solve(t, next)) return false;
      if (next == end) return true;
      t = next;
    }
  }

  bool solve(double t0, double t1) {
    for (std::size_t i = 0; i < traversals_.size(); ++i) cubics_[i] = traversals_[i].cubic(t0, t1);
    return search(0, t0, t1);
  }

  bool search(int level, double t0, double t1) {
    const std::size_t count = traversals_.size();
    FieldCubic* cubics = cubics_.data() + static_cast<std::size_t>(level) * count;
    for (std::size_t i = 0; i < count; ++i) bounds_[i] = boundsOf(cubics[i]);
    const FieldBounds all = joined(bounds_, joinBounds);
    if (all.value.low >= 0) return settle(false, t0);
    if (all.value.high < 0) return settle(true, t0);
    const bool isMonotone = all.slope.low >= 0 || all.slope.high <= 0;
    const bool isFlat = std::max(-all.value.low, all.value.high) < noise_;
    if (isMonotone || isFlat || level == kMostHalvings) {
      const bool before = valueOf(cubics, 0) < 0, after = valueOf(cubics, 1) < 0;
      if (!settle(before, t0)) return false;
      return before == after || settle(after, t0 + (t1 - t0) * rootOf(cubics));
    }
    const double middle = 0.5 * (t0 + t1);
    for (const bool isRight : {false, true}) {
      FieldCubic other;
      for (std::size_t i = 0; i < count; ++i)
        halve(cubics[i], isRight ? other : cubics[count + i], isRight ? cubics[count + i] : other);
      if (!search(level + 1, isRight ? middle : t0, isRight ? t1 : middle)) return false;
    }
    return true;
  }

  [[nodiscard]] double valueOf(const FieldCubic* cubics, double s) {
    for (std::size_t i = 0; i < traversals_.size(); ++i) values_[i] = valueAt(cubics[i], s);
    return joined(values_, [](const FieldExpression& e, Join join, double a, double b) {
      return e.join(join, a, b);
    });
  }

  /// Finds the parameter in [0, 1] at which the expression changes sign. Uses the Illinois variant
  /// of regula falsi, with a bisection at every fourth step.
  [[nodiscard]] double rootOf(const FieldCubic* cubics) {
    constexpr int kMostSteps = 100;
    constexpr double kExact = 0x1p-50;
    double a = 0, b = 1, fa = valueOf(cubics, 0), fb = valueOf(cubics, 1);
    std::optional<bool> hasMovedA;
    for (int n = 0; n < kMostSteps && b - a > kExact; ++n) {
      const double share = fa / (fa - fb);
      const double s =
          n % 4 == 3 || !(share > 0 && share < 1) ? 0.5 * (a + b) : a + (b - a) * share;
      const double f = valueOf(cubics, s);
      const bool movesA = (f < 0) == (fa < 0);
      if (hasMovedA == movesA) (movesA ? fb : fa) *= 0.5;
      hasMovedA = movesA;
      (movesA ? a : b) = s;
      (movesA ? fa : fb) = f;
    }
    return 0.5 * (a + b);
  }

  const FieldExpression& e_;
  double end_;
  bool wantsAll_;
  double noise_;
  std::vector<GridTraversal> traversals_;
  std::optional<bool> inside_;
  std::vector<double> values_;
  std::vector<FieldBounds> bounds_;
  std::vector<Range> ranges_;
  // Cubics of all grids, one set for each number of halvings of the segment.
  std::vector<FieldCubic> cubics_;
};

/// Clips the range [near, far] of a ray to a box. Returns nothing when the ray misses the box.
std::optional<Range> partWithin(const Imath::Box3d& box, const V3d& origin, const V3d& direction,
                                double near, double far) {
  if (box.isEmpty()) return std::nullopt;
  Range part{near, far};
  for (int a = 0; a < 3; ++a) {
    if (direction[a] == 0) {
      if (origin[a] < box.min[a] || origin[a] > box.max[a]) return std::nullopt;
      continue;
    }
    const double t0 = (box.min[a] - origin[a]) / direction[a],
                 t1 = (box.max[a] - origin[a]) / direction[a];
    part = {std::max(part.low, std::min(t0, t1)), std::min(part.high, std::max(t0, t1))};
  }
  return part.low < part.high ? std::optional(part) : std::nullopt;
}

}  // namespace

FieldTraversal::FieldTraversal(const Scene& scene, std::size_t maxBytes)
    : expression_(fieldExpression(scene)) {
  double bytes = 0;
  for (const FieldExpression::Operand& operand : expression_.operands)
    bytes += FieldGrid::bytesOf(scene.solids[operand.solid].band);
  levelset::requireMemory(bytes, maxBytes);
  for (const FieldExpression::Operand& operand : expression_.operands)
    grids_.emplace_back(scene.solids[operand.solid].band);
  updateTransforms(scene);
}

bool FieldTraversal::updateTransforms(const Scene& scene) {
  bool hasMoved = false;
  box_.makeEmpty();
  for (std::size_t i = 0; i < grids_.size(); ++i) {
    hasMoved =
        grids_[i].updateTransform(scene.solids[expression_.operands[i].solid].band) || hasMoved;
    box_.extendBy(grids_[i].worldBox());
  }
  return hasMoved;
}

std::size_t FieldTraversal::bytes() const {
  std::size_t sum = 0;
  for (const FieldGrid& grid : grids_) sum += grid.bytes();
  return sum;
}

std::size_t FieldTraversal::blockCount() const {
  std::size_t sum = 0;
  for (const FieldGrid& grid : grids_) sum += grid.blockCount();
  return sum;
}

double FieldTraversal::noise() const {
  double largest = 0;
  for (const FieldGrid& grid : grids_) largest = std::max(largest, grid.background());
  return kNoise * largest;
}

FieldTraversal::Clipped FieldTraversal::clipped(const std::vector<FieldRay>& rays) const {
  Clipped result;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const FieldRay& ray = rays[i];
    const std::optional<Range> part =
        partWithin(box_, ray.origin, ray.direction, ray.near, ray.far);
    if (!part) continue;
    result.segments.push_back(
        {ray.origin + ray.direction * part->low, ray.direction, part->high - part->low});
    result.number.push_back(i);
    result.low.push_back(part->low);
  }
  return result;
}

double FieldTraversal::search(const FieldSegment& segment, FieldQuestion question) const {
  const bool isLength = question == FieldQuestion::InsideLength;
  const FieldSearch found(*this, segment, isLength);
  if (!isLength) return found.crossings.empty() ? kNever : found.crossings[0];
  double length = 0, from = 0;
  bool isInside = found.startsInside;
  for (const double t : found.crossings) {
    if (isInside) length += t - from;
    from = t;
    isInside = !isInside;
  }
  return isInside ? length + segment.end - from : length;
}

std::vector<double> FieldTracer::search(const FieldTraversal& fields,
                                        const std::vector<FieldSegment>& segments,
                                        FieldQuestion question) const {
  std::vector<double> answers;
  answers.reserve(segments.size());
  for (const FieldSegment& segment : segments) answers.push_back(fields.search(segment, question));
  return answers;
}

std::vector<Hit> FieldTraversal::intersect(const FieldTracer& tracer,
                                           const std::vector<FieldRay>& rays) const {
  std::vector<Hit> hits(rays.size());
  const Clipped part = clipped(rays);
  const std::vector<double> crossings =
      tracer.search(*this, part.segments, FieldQuestion::FirstCrossing);
  for (std::size_t n = 0; n < crossings.size(); ++n) {
    if (crossings[n] == kNever) continue;
    const FieldRay& ray = rays[part.number[n]];
    Hit& hit = hits[part.number[n]];
    hit.distance = part.low[n] + crossings[n];
    hit.position = ray.origin + ray.direction * hit.distance;
    std::vector<FieldShape> shapes;
    for (const FieldGrid& grid : grids_) shapes.push_back(grid.shapeAt(hit.position));
    addFieldShape(hit, expression_, shapes, ray.direction);
  }
  return hits;
}

std::vector<char> FieldTraversal::areOccluded(const FieldTracer& tracer,
                                              const std::vector<FieldRay>& rays) const {
  std::vector<char> occluded(rays.size(), 0);
  const Clipped part = clipped(rays);
  const std::vector<double> crossings =
      tracer.search(*this, part.segments, FieldQuestion::FirstCrossing);
  for (std::size_t n = 0; n < crossings.size(); ++n)
    occluded[part.number[n]] = crossings[n] == kNever ? 0 : 1;
  return occluded;
}

std::vector<double> FieldTraversal::thickness(const FieldTracer& tracer,
                                              const std::vector<FieldRay>& rays) const {
  std::vector<double> lengths(rays.size(), 0);
  const Clipped part = clipped(rays);
  const std::vector<double> found =
      tracer.search(*this, part.segments, FieldQuestion::InsideLength);
  for (std::size_t n = 0; n < found.size(); ++n) lengths[part.number[n]] = found[n];
  return lengths;
}

}  // namespace render
