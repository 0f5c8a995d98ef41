#include "levelset/inspect/check.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "levelset/progress_gate.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using LeafNode = FloatTree::LeafNodeType;

constexpr double kMeanResidualLimit = 0.1;
/// Bounds of |∇φ|² at a zero crossing, from openvdb::tools::checkLevelSet.
constexpr double kMinSquaredSlope = 0.5, kMaxSquaredSlope = 1.5;
/// Smallest half width, voxels, at which the eikonal residual is measured. In a narrower band, only
/// voxels at edges of the solid have all their neighbours in the band.
constexpr double kMinHalfWidthForResidual = 2 - 1e-5;

/// Number of values that fail a check, and the first one in tree order.
struct Finding {
  std::size_t count = 0;
  Coord where;
  float value = 0;
  bool isBackground = false;

  void add(const Coord& at, float bad) {
    if (!count++) where = at, value = bad;
  }
  void append(const Finding& later) {
    if (!later.count) return;
    if (!count) where = later.where, value = later.value;
    count += later.count;
  }
};

CheckItem item(const char* name, const Finding& finding, const char* fault) {
  if (!finding.count) return {name, true, ""};
  const std::string place =
      finding.isBackground
          ? "the background"
          : fmt::format("[{}, {}, {}]", finding.where.x(), finding.where.y(), finding.where.z());
  return {
      name, false,
      fmt::format("{} {}: first at {} with value {}", finding.count, fault, place, finding.value)};
}

struct EikonalSum {
  double sum = 0, max = 0;
  std::size_t count = 0;
};

struct LeafFindings {
  Finding notFinite, outOfRange, badInactive, badSlope;
  EikonalSum eikonal;
};

/// One voxel with its six neighbours.
class SlopeStencil {
 public:
  explicit SlopeStencil(const FloatGrid& grid)
      : accessor_(grid.getConstAccessor()), inverse_(1 / grid.voxelSize()[0]) {}

  /// Moves to a voxel. Returns false when a neighbour is outside the band, so that no slope is
  /// defined.
  bool moveTo(const Coord& c, float value) {
    at_ = c;
    centre_ = static_cast<double>(value);
    bool inBand = true;
    hasCrossing_ = false;
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = 0; side < 2; ++side) {
        Coord next = c;
        next[axis] += side ? 1 : -1;
        float neighbour;
        inBand &= accessor_.probeValue(next, neighbour);
        around_[axis][side] = static_cast<double>(neighbour);
        hasCrossing_ |= (neighbour < 0) != (value < 0);
      }
    }
    return inBand;
  }

  [[nodiscard]] double inverseVoxel() const { return inverse_; }
  [[nodiscard]] bool hasCrossing() const { return hasCrossing_; }

  /// Squared slope by Godunov's choice of the one-sided differences that point towards the zero
  /// set.
  [[nodiscard]] double upwindSquaredSlope() const {
    double sum = 0;
    const double sign = centre_ < 0 ? -1 : 1;
    for (const auto& pair : around_) {
      const double back = sign * (centre_ - pair[0]) * inverse_;
      const double ahead = sign * (pair[1] - centre_) * inverse_;
      const double steepest = std::max({back, -ahead, 0.0});
      sum += steepest * steepest;
    }
    return sum;
  }

  /// Returns true when the squared length of some gradient lies in [low, high], with each component
  /// between the two one-sided differences of its axis. Beside an edge of the solid these two
  /// differ widely, and any slope between them may be correct.
  [[nodiscard]] bool canHaveSquaredSlope(double low, double high) const {
    double least = 0, most = 0;
    for (const auto& pair : around_) {
      const double back = (centre_ - pair[0]) * inverse_, ahead = (pair[1] - centre_) * inverse_;
      most += std::max(back * back, ahead * ahead);
      if (back * ahead > 0) least += std::min(back * back, ahead * ahead);
    }
    return least <= high && most >= low;
  }

  /// Returns the deviation of |∇φ| from 1 beside a sheet of solid or void thinner than two voxels;
  /// nullopt where there is no such sheet. Uses the differences away from the sheet, because a
  /// difference towards it spans both of its sides.
  [[nodiscard]] std::optional<double> residualBesideSheet() const {
    const bool isInside = centre_ < 0;
    double sum = 0;
    bool hasSheet = false;
    for (int axis = 0; axis < 3; ++axis) {
      const double slopes[2] = {centre_ - around_[axis][0], around_[axis][1] - centre_};
      bool isAcross[2];
      for (int side = 0; side < 2; ++side) {
        Coord beyond = at_;
        beyond[axis] += side ? 2 : -2;
        isAcross[side] =
            (around_[axis][side] < 0) != isInside && (accessor_.getValue(beyond) < 0) == isInside;
      }
      hasSheet |= isAcross[0] || isAcross[1];
      const double slope = isAcross[0] == isAcross[1] ? (slopes[0] + slopes[1]) / 2
                           : isAcross[0]              ? slopes[1]
                                                      : slopes[0];
      sum += slope * slope;
    }
    if (!hasSheet) return std::nullopt;
    return std::abs(std::sqrt(sum) * inverse_ - 1);
  }

  [[nodiscard]] double centralSquaredSlope() const {
    double sum = 0;
    for (const auto& pair : around_) {
      const double slope = (pair[1] - pair[0]) * inverse_ / 2;
      sum += slope * slope;
    }
    return sum;
  }

 private:
  FloatGrid::ConstAccessor accessor_;
  double inverse_;
  Coord at_;
  double centre_ = 0;
  double around_[3][2] = {};
  bool hasCrossing_ = false;
};

void checkLeaf(const LeafNode& leaf, float background, SlopeStencil& stencil, LeafFindings& out) {
  const float* values = leaf.buffer().data();
  const float tolerance = openvdb::math::Tolerance<float>::value() * std::max(1.0f, background);
  const bool measureResidual =
      static_cast<double>(background) * stencil.inverseVoxel() >= kMinHalfWidthForResidual;
  for (openvdb::Index i = 0; i < LeafNode::SIZE; ++i) {
    const float value = values[i];
    const Coord c = leaf.offsetToGlobalCoord(i);
    if (!std::isfinite(value)) {
      out.notFinite.add(c, value);
      continue;
    }
    if (!leaf.isValueOn(i)) {
      if (!(std::abs(std::abs(value) - background) <= tolerance)) out.badInactive.add(c, value);
      continue;
    }
    if (!(std::abs(value) <= background)) out.outOfRange.add(c, value);
    if (!stencil.moveTo(c, value)) continue;
    const double upwind = stencil.upwindSquaredSlope();
    if (stencil.hasCrossing() && !stencil.canHaveSquaredSlope(kMinSquaredSlope, kMaxSquaredSlope)) {
      out.badSlope.add(c, static_cast<float>(std::sqrt(upwind)));
    }
    if (!measureResidual) continue;
    // Where distances to two parts of the surface meet, only one-sided differences are correct.
    // Elsewhere central differences are more accurate. A field of wrong slope fails both.
    double residual = std::min(std::abs(std::sqrt(upwind) - 1),
                               std::abs(std::sqrt(stencil.centralSquaredSlope()) - 1));
    if (stencil.hasCrossing())
      residual = std::min(residual, stencil.residualBesideSheet().value_or(residual));
    if (!std::isfinite(residual)) continue;
    out.eikonal.sum += residual;
    out.eikonal.max = std::max(out.eikonal.max, residual);
    ++out.eikonal.count;
  }
}

LeafFindings checkLeaves(const FloatGrid& grid, const Progress& progress) {
  std::vector<const LeafNode*> leaves;
  leaves.reserve(grid.tree().leafCount());
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) leaves.push_back(leaf.getLeaf());
  std::vector<LeafFindings> found(leaves.size());
  ProgressGate gate(progress, leaves.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      SlopeStencil stencil(grid);
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        checkLeaf(*leaves[i], grid.background(), stencil, found[i]);
                      }
                      gate.advance(range.size());
                    });
  LeafFindings total;
  for (const LeafFindings& leaf : found) {
    total.notFinite.append(leaf.notFinite);
    total.outOfRange.append(leaf.outOfRange);
    total.badInactive.append(leaf.badInactive);
    total.badSlope.append(leaf.badSlope);
    total.eikonal.sum += leaf.eikonal.sum;
    total.eikonal.max = std::max(total.eikonal.max, leaf.eikonal.max);
    total.eikonal.count += leaf.eikonal.count;
  }
  return total;
}

/// Checks the values of tiles. Counts active tiles in `active`, other faults in `out`.
void checkTiles(const FloatGrid& grid, Finding& active, LeafFindings& out) {
  const float background = grid.background();
  for (auto tile = grid.tree().cbeginValueAll(); tile; ++tile) {
    if (tile.getDepth() == FloatTree::DEPTH - 1) continue;
    const Coord c = tile.getBoundingBox().min();
    if (tile.isValueOn()) active.add(c, *tile);
    if (!std::isfinite(*tile)) {
      out.notFinite.add(c, *tile);
    } else if (!tile.isValueOn() && !(std::abs(*tile) == background)) {
      out.badInactive.add(c, *tile);
    }
  }
}

CheckItem checkBackground(const FloatGrid& grid) {
  const double voxels = static_cast<double>(grid.background()) / grid.voxelSize()[0];
  // Rounded to float, a half width of one voxel may be slightly too small.
  if (std::isfinite(voxels) && voxels >= 1 - 1e-5) return {"positive background", true, ""};
  return {"positive background", false,
          fmt::format("the background is {}, which is {} voxels; it must be at least one voxel",
                      grid.background(), voxels)};
}

CheckItem checkClass(const FloatGrid& grid) {
  const bool passed = grid.getGridClass() == openvdb::GRID_LEVEL_SET;
  return {"level-set class", passed,
          passed ? ""
                 : fmt::format("the class of the grid is '{}', not 'level set'",
                               FloatGrid::gridClassToString(grid.getGridClass()))};
}

CheckItem checkVoxels(const FloatGrid& grid) {
  const openvdb::Vec3d size = grid.voxelSize();
  const bool passed = grid.hasUniformVoxels();
  return {"uniform voxels", passed,
          passed ? "" : fmt::format("voxels measure {} × {} × {}", size.x(), size.y(), size.z())};
}

}  // namespace

bool CheckReport::passed() const {
  return std::all_of(items.begin(), items.end(), [](const CheckItem& i) { return i.passed; });
}

CheckReport check(const NarrowBand& solid, const Progress& progress) {
  levelset::report(progress, 0);
  CheckReport report;
  if (!solid.shared()) {
    report.items.push_back({"floating-point values", false, "there is no grid"});
    return report;
  }
  const FloatGrid& grid = vdb(solid);
  LeafFindings found;
  Finding activeTiles, notFinite;
  checkTiles(grid, activeTiles, found);
  const LeafFindings leaves = checkLeaves(grid, progress);
  if (!std::isfinite(grid.background())) {
    notFinite.add(Coord(0), grid.background());
    notFinite.isBackground = true;
  }
  notFinite.append(found.notFinite);
  notFinite.append(leaves.notFinite);
  found.badInactive.append(leaves.badInactive);

  report.items.push_back({"floating-point values", true, ""});
  report.items.push_back(checkClass(grid));
  report.items.push_back(checkVoxels(grid));
  report.items.push_back(checkBackground(grid));
  report.items.push_back(item("no active tiles", activeTiles, "active tiles"));
  report.items.push_back(item("finite values", notFinite, "values are not finite"));
  report.items.push_back(item("values within the background", leaves.outOfRange,
                              "active values exceed the background in magnitude"));
  report.items.push_back(item("symmetric background", found.badInactive,
                              "inactive values differ from plus or minus the background"));
  report.items.push_back(item("unit slope at the zero set", leaves.badSlope,
                              "slopes at zero crossings lie outside [0.71, 1.22]"));
  if (leaves.eikonal.count) {
    report.eikonalMean = leaves.eikonal.sum / static_cast<double>(leaves.eikonal.count);
    report.eikonalMax = leaves.eikonal.max;
  }
  report.items.push_back({"eikonal residual", report.eikonalMean <= kMeanResidualLimit,
                          fmt::format("the mean of ||∇φ| - 1| is {:.2g}, the maximum {:.2g}",
                                      report.eikonalMean, report.eikonalMax)});
  return report;
}

}  // namespace levelset
