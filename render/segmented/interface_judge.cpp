#include "render/segmented/interface_judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "levelset/segmented/segmented_data_vdb.h"
#include "levelset/vdb.h"
#include "render/segmented/interface_tables.h"
#include "render/segmented/sheet_judge.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::RegionLabel;
using levelset::SegmentedCell;
using levelset::SegmentedData;
using levelset::SegmentedReader;
using openvdb::Coord;

// Length of the interval in which a change of the label is accepted, relative to the distance.
constexpr double kFinest = 1e-14;
// Intervals that are examined in a cell. Only a ray within an interface needs more.
constexpr int kMostIntervals = 100000;
// Distance behind a crossing within which no sheet is seen, voxels.
constexpr double kNoSheet = 1e-7;

using Corners = std::array<double, 8>;

/// A ray in index space. Its parameter is the world distance.
struct Line {
  V3d from, step;
  [[nodiscard]] V3d at(double t) const { return from + step * t; }
};

/// Sorted parameters between `low` and `high` where a line crosses planes of the grid, with both
/// ends. @param spacing  of the planes, grid points
std::vector<double> planesBetween(const Line& line, double low, double high, double spacing) {
  std::vector<double> cuts{low, high};
  for (int axis = 0; axis < 3; ++axis) {
    if (line.step[axis] == 0) continue;
    double a = line.at(low)[axis] / spacing, b = line.at(high)[axis] / spacing;
    if (a > b) std::swap(a, b);
    for (double k = std::ceil(a); k <= b; ++k) {
      const double t = (k * spacing - line.from[axis]) / line.step[axis];
      if (t > low && t < high) cuts.push_back(t);
    }
  }
  std::sort(cuts.begin(), cuts.end());
  return cuts;
}

Coord floorOf(const V3d& p) {
  return {static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y)),
          static_cast<int>(std::floor(p.z))};
}

Corners weightsAt(const V3d& p, const Coord& low) {
  V3d s;
  for (int axis = 0; axis < 3; ++axis) s[axis] = std::clamp(p[axis] - low[axis], 0.0, 1.0);
  Corners weights;
  for (int c = 0; c < 8; ++c)
    weights[static_cast<std::size_t>(c)] =
        (c & 4 ? s.x : 1 - s.x) * (c & 2 ? s.y : 1 - s.y) * (c & 1 ? s.z : 1 - s.z);
  return weights;
}

/// Regions at the corners of a cell, and their excesses at the corners.
class MixedCell {
 public:
  MixedCell(SegmentedReader& reader, const Coord& low) : low_(low), cell_(reader, low) {
    for (const RegionLabel label : cell_.labels()) excess_.push_back(excessOf(reader, label));
  }
  [[nodiscard]] bool isUniform() const { return cell_.isUniform(); }
  [[nodiscard]] RegionLabel onlyLabel() const { return cell_.labels().front(); }
  [[nodiscard]] Corners excessOf(SegmentedReader& reader, RegionLabel label) const {
    Corners values;
    for (int c = 0; c < 8; ++c) {
      const SegmentedReader::Nearest& near = cell_.corner(c);
      values[static_cast<std::size_t>(c)] =
          near.label == label ? 0.0
                              : static_cast<double>(reader.distanceTo(
                                    low_ + SegmentedCell::cornerOffset(c), near, label));
    }
    return values;
  }

  /// Label of a position in the cell. Of equal excesses that of `kept` counts.
  [[nodiscard]] RegionLabel labelAt(const V3d& p, std::optional<RegionLabel> kept) const {
    const Corners weights = weightsAt(p, low_);
    std::optional<double> least;
    RegionLabel best = levelset::kVoid;
    for (std::size_t n = 0; n < excess_.size(); ++n) {
      const RegionLabel label = cell_.labels()[n];
      const double value = sum(weights, excess_[n]);
      if (least && (value > *least || (value == *least && best == kept))) continue;
      least = value;
      best = label;
    }
    return best;
  }

  /// First parameter in [low, high] at which the label is no longer `present`.
  [[nodiscard]] std::optional<double> firstChange(const Line& line, double low, double high,
                                                  RegionLabel present) const {
    int left = kMostIntervals;
    return search(line, low, high, present, left);
  }

 private:
  static double sum(const Corners& weights, const Corners& values) {
    double total = 0;
    for (std::size_t c = 0; c < 8; ++c) total += weights[c] * values[c];
    return total;
  }
  /// Bound on the derivative of the difference of two excesses along the line.
  static double steepest(const Line& line, const Corners& a, const Corners& b) {
    double bound = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t bit = std::size_t{4} >> axis;
      double most = 0;
      for (std::size_t c = 0; c < 8; ++c)
        if (!(c & bit)) most = std::max(most, std::abs(a[c | bit] - b[c | bit] - a[c] + b[c]));
      bound += most * std::abs(line.step[axis]);
    }
    return bound;
  }
  std::optional<double> search(const Line& line, double low, double high, RegionLabel present,
                               int& left) const {
    if (--left < 0) return std::nullopt;
    const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
    const Corners weights = weightsAt(line.at(middle), low_);
    const auto& labels = cell_.labels();
    const auto number =
        static_cast<std::size_t>(std::find(labels.begin(), labels.end(), present) - labels.begin());
    const double own = sum(weights, excess_[number]);
    bool isSafe = true;
    for (std::size_t n = 0; n < labels.size() && isSafe; ++n)
      isSafe = n == number ||
               sum(weights, excess_[n]) - own >= steepest(line, excess_[n], excess_[number]) * half;
    if (isSafe) return std::nullopt;
    if (half <= kFinest * std::max(1.0, std::abs(middle))) {
      if (labelAt(line.at(high), present) != present) return high;
      return std::nullopt;
    }
    if (const auto found = search(line, low, middle, present, left)) return found;
    return search(line, middle, high, present, left);
  }

  Coord low_;
  SegmentedCell cell_;
  std::vector<Corners> excess_;
};

/// State of a ray along its way.
struct March {
  SegmentedReader reader;
  const InterfaceCaster& caster;
  Line line;
  std::optional<RegionLabel> label = {};
  std::optional<double> crossing = {};
  RegionLabel front = levelset::kVoid;
  Coord cell = {};
  std::vector<JudgedSheet> sheets = {};  ///< that the ray meets, by distance
  std::size_t nextSheet = 0;
  std::optional<JudgedSheet> sheet = {};  ///< at the crossing

  /// Goes on in the present region. @return true if a sheet of it is met
  bool stay(double t) {
    for (; nextSheet < sheets.size() && sheets[nextSheet].t <= t; ++nextSheet) {
      if (label != sheets[nextSheet].label) continue;
      sheet = sheets[nextSheet];
      crossing = sheet->t;
      front = sheet->label;
      return true;
    }
    return false;
  }
  /// Enters a region. @return true if a surface is crossed
  bool enter(RegionLabel next, double t, const Coord& low) {
    if (stay(t)) return true;
    const std::optional<RegionLabel> before = label;
    label = next;
    if (!before || *before == next || (!caster.isShown(*before) && !caster.isShown(next)))
      return false;
    front = *before;
    crossing = t;
    cell = low;
    return true;
  }
  /// Follows a part of the ray in a cell. @return true if a surface is crossed
  bool pass(double low, double high) {
    const Coord corner = floorOf(line.at(0.5 * (low + high)));
    const MixedCell mixed(reader, corner);
    if (mixed.isUniform()) return enter(mixed.onlyLabel(), low, corner);
    if (enter(mixed.labelAt(line.at(low), label), low, corner)) return true;
    double from = low;
    while (from < high) {
      const auto change = mixed.firstChange(line, from, high, *label);
      if (!change) return false;
      if (enter(mixed.labelAt(line.at(*change), {}), *change, corner)) return true;
      from = std::max(*change, std::nextafter(from, HUGE_VAL));
    }
    return false;
  }
  /// Returns true if an interface may be in a block of cells.
  bool mayChange(const Coord& block) {
    for (int n = 0; n < 8; ++n) {
      const Coord near = block + Coord(n >> 2, n >> 1 & 1, n & 1);
      if (reader.blockOf(Coord(near[0] * 8, near[1] * 8, near[2] * 8)) >= 0) return true;
    }
    return false;
  }
};

/// Gradients at a crossing, by index.
struct Gradients {
  V3d facet{0}, smooth{0};
};

Gradients gradientsAt(SegmentedReader& reader, const Coord& low, const V3d& p, RegionLabel front,
                      RegionLabel behind) {
  const auto differenceAt = [&](const Coord& at) {
    const SegmentedReader::Nearest near = reader.nearest(at);
    const auto excess = [&](RegionLabel label) {
      return near.label == label ? 0.0 : static_cast<double>(reader.distanceTo(at, near, label));
    };
    return excess(behind) - excess(front);
  };
  const auto isOfTwo = [&](const Coord& at) {
    const RegionLabel label = reader.label(at);
    return label == front || label == behind;
  };
  Gradients found;
  V3d s;
  for (int axis = 0; axis < 3; ++axis) s[axis] = std::clamp(p[axis] - low[axis], 0.0, 1.0);
  const Corners weights = weightsAt(p, low);
  for (int c = 0; c < 8; ++c) {
    const Coord at = low + SegmentedCell::cornerOffset(c);
    const double value = differenceAt(at);
    for (int axis = 0; axis < 3; ++axis) {
      // Derivative of the weight of the corner.
      double slope = c & (4 >> axis) ? 1 : -1;
      for (int other = 0; other < 3; ++other)
        if (other != axis) slope *= c & (4 >> other) ? s[other] : 1 - s[other];
      found.facet[axis] += slope * value;
    }
    if (!isOfTwo(at)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      Coord before = at, after = at;
      if (--before[axis], !isOfTwo(before)) before = at;
      if (++after[axis], !isOfTwo(after)) after = at;
      const int points = after[axis] - before[axis];
      if (points > 0)
        found.smooth[axis] += weights[static_cast<std::size_t>(c)] *
                              (differenceAt(after) - differenceAt(before)) / points;
    }
  }
  return found;
}

/// Part of the line within a box around all blocks.
std::optional<std::pair<double, double>> rangeInBlocks(const Line& line, const SegmentedData& data,
                                                       double near, double far) {
  openvdb::CoordBBox box;
  for (std::size_t b = 0; b < data.blockCount(); ++b) box.expand(data.blocks[b].origin);
  V3d low, high;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = box.min()[axis] - 3;
    high[axis] = box.max()[axis] + 11;
    if (line.step[axis] == 0) {
      if (line.from[axis] < low[axis] || line.from[axis] > high[axis]) return std::nullopt;
      continue;
    }
    double a = (low[axis] - line.from[axis]) / line.step[axis],
           b = (high[axis] - line.from[axis]) / line.step[axis];
    if (a > b) std::swap(a, b);
    near = std::max(near, a);
    far = std::min(far, b);
  }
  if (near >= far) return std::nullopt;
  return std::pair(near, far);
}

}  // namespace

InterfaceJudge::InterfaceJudge(const InterfaceCaster& caster) : caster_(caster) {
  if (caster.tables()->sheets)
    sheets_ =
        std::make_shared<const SheetJudge>(caster.tables()->sheets, caster.field().voxelSize());
}

InterfaceHit InterfaceJudge::firstHit(const InterfaceRay& ray) const {
  const SegmentedData& data = *caster_.field().shared();
  const openvdb::math::Transform& map = *data.transform;
  const V3d from = levelset::toImath(map.worldToIndex(levelset::toVdb(ray.origin)));
  const V3d to =
      levelset::toImath(map.baseMap()->applyInverseJacobian(levelset::toVdb(ray.direction)));
  March march{SegmentedReader(data), caster_, {from, to}};
  const auto range = rangeInBlocks(march.line, data, ray.near, ray.far);
  if (!range) return {};
  if (ray.label && range->first == ray.near) march.label = ray.label;
  if (sheets_)
    march.sheets = sheets_->along(
        ray.origin, ray.direction,
        ray.near + (ray.label ? kNoSheet * caster_.field().voxelSize() : 0), range->second);
  const std::vector<double> blocks = planesBetween(march.line, range->first, range->second, 8);
  for (std::size_t b = 1; b < blocks.size() && !march.crossing; ++b) {
    const double low = blocks[b - 1], high = blocks[b];
    if (!(low < high)) continue;
    const Coord middle = floorOf(march.line.at(0.5 * (low + high)));
    if (!march.mayChange(SegmentedData::blockCoord(middle))) {
      march.enter(march.reader.label(middle), low, middle);
      continue;  // without sheets
    }
    const std::vector<double> cells = planesBetween(march.line, low, high, 1);
    for (std::size_t n = 1; n < cells.size() && !march.crossing; ++n)
      if (cells[n - 1] < cells[n]) march.pass(cells[n - 1], cells[n]);
  }
  if (!march.crossing) march.stay(range->second);
  if (!march.crossing) return {};
  if (march.sheet) {
    const SheetJudge::Normals normals = sheets_->normalsAt(
        march.sheet->triangle, ray.origin + ray.direction * march.sheet->t, ray.direction);
    return {true, march.sheet->t, march.front, march.front, normals.facet, normals.smooth};
  }
  const Gradients gradients = gradientsAt(march.reader, march.cell, march.line.at(*march.crossing),
                                          march.front, *march.label);
  InterfaceHit hit;
  hit.found = true;
  hit.distance = *march.crossing;
  hit.front = march.front;
  hit.behind = *march.label;
  const auto toWorld = [&](const V3d& gradient, const V3d& otherwise) {
    const V3d world = levelset::toImath(map.baseMap()->applyIJT(levelset::toVdb(gradient)));
    return world.length() > 0 ? world.normalized() : otherwise;
  };
  hit.facetNormal = toWorld(gradients.facet, -ray.direction);
  hit.normal = toWorld(gradients.smooth, hit.facetNormal);
  return hit;
}

}  // namespace render
