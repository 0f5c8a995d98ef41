#include "levelset/curvature_flow/smooth.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <optional>

#include "levelset/distance/distance_transform.h"
#include "levelset/distance/redistance.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/error.h"
#include "levelset/grids/band_blocks_vdb.h"

namespace levelset {
namespace {

using flow::BandBlocks;
using flow::Field;
using flow::Values;
using openvdb::Coord;
using openvdb::CoordBBox;

// Distance at which the Gaussian filter is cut off, in σ.
constexpr double kGaussianReach = 4;
// Largest distance from the zero set at which the interpolant of the distance transform reads
// values, voxels.
constexpr double kStencil = 3;
// Half width that the filter needs, in σ. Values farther from the surface change the result little,
// since their contributions from the two sides of the surface cancel.
constexpr double kKnownReach = 3;
// A band is widened when the filter needs more than this multiple of its half width.
constexpr double kWideEnough = 1.0001;
// Smallest σ of a Gaussian filter, voxels, that rounds all edges. Slightly below 1: σ in voxels is
// a quotient of two lengths.
constexpr double kLeastRounding = 1 - 1e-6;
// Memory of the filter and of the distance transform, as a number of fields with one float for each
// grid point of the leaf blocks.
constexpr double kFieldsAlive = 5;
// Largest number of values that a median may read, for all grid points together. Reading as many
// takes some thousand CPU seconds.
constexpr double kMostReadings = 1e12;
// Progress, 0 to 1, when the band is wide enough and when it is filtered.
constexpr double kWidened = 0.3, kFiltered = 0.7;

/// Returns the weights of a Gaussian filter along a line, from the middle to one end; `sigma` is in
/// voxels. The filter is symmetric.
std::vector<float> gaussianWeights(double sigma) {
  const int reach = std::max(1, static_cast<int>(std::ceil(kGaussianReach * sigma)));
  // The weights integrate the Gaussian over each voxel, so that a σ below a voxel keeps its
  // variance. The integration adds 1/12 voxel², the variance of a box one voxel wide, so this is
  // subtracted from σ² first.
  std::vector<double> weights;
  const double narrowed = std::sqrt(std::max(sigma * sigma - 1.0 / 12, 1e-4));
  double sum = 0;
  for (int i = 0; i <= reach; ++i) {
    weights.push_back(std::erf((i + 0.5) / (narrowed * M_SQRT2)) -
                      std::erf((i - 0.5) / (narrowed * M_SQRT2)));
    sum += i == 0 ? weights.back() : 2 * weights.back();
  }
  std::vector<float> result;
  for (const double w : weights) result.push_back(static_cast<float>(w / sum));
  return result;
}

std::vector<float> boxWeights(double sigma) {
  // A box of variance σ²: equal weights on the inner voxels, and the fraction `part` of that weight
  // on the voxel at each end.
  int whole = 0;
  const auto squares = [](int n) { return n * (n + 1.0) * (2.0 * n + 1) / 3; };
  while (squares(whole + 1) / (2.0 * (whole + 1) + 1) <= sigma * sigma) ++whole;
  const double end = whole + 1, variance = sigma * sigma;
  // Solves (squares(whole) + 2 part end²) / (2 whole + 1 + 2 part) = σ² for `part`.
  const double part =
      (variance * (2.0 * whole + 1) - squares(whole)) / (2 * (end * end - variance));
  const double sum = 2.0 * whole + 1 + 2 * part;
  std::vector<float> result(static_cast<std::size_t>(whole) + 1, static_cast<float>(1 / sum));
  result.push_back(static_cast<float>(part / sum));
  return result;
}

/// Returns the array offsets, in a dense cube with `side` grid points along an edge, from a grid
/// point to all grid points within `radius` voxels of it; a radius below 1 counts as 1.
std::vector<std::ptrdiff_t> stepsWithin(double radius, int pad, std::ptrdiff_t side) {
  const double squared = std::max(1.0, radius * radius);
  std::vector<std::ptrdiff_t> steps;
  for (int x = -pad; x <= pad; ++x)
    for (int y = -pad; y <= pad; ++y)
      for (int z = -pad; z <= pad; ++z)
        if (static_cast<double>(x) * x + static_cast<double>(y) * y + static_cast<double>(z) * z <=
            squared)
          steps.push_back((x * side + y) * side + z);
  return steps;
}

int medianPad(double radius) {
  return std::max(1, static_cast<int>(std::floor(radius)));
}

/// Refuses a median that would read more than kMostReadings values.
void requireMedian(const openvdb::FloatGrid& grid, double radius) {
  const double around = 4.0 / 3 * M_PI * std::pow(std::max(1.0, radius), 3);
  const double readings = static_cast<double>(grid.activeVoxelCount()) * around;
  if (readings <= kMostReadings) return;
  throw ResourceLimit(fmt::format(
      "a median within {:.4g} voxels reads {:.3g} values, more than the limit of {:.3g}; use "
      "a smaller sigma, larger voxels or --kind gaussian",
      radius, readings, kMostReadings));
}

/// Linear and median filters for a field on the leaf blocks of a band.
class BlockFilter {
 public:
  /// @param passes  number of passes over all blocks that the caller makes, for the fraction in
  ///                progress reports
  BlockFilter(const openvdb::FloatGrid& grid, double passes, Progress progress)
      : tree_(grid.tree()),
        blocks_(grid.tree()),
        far_(static_cast<float>(static_cast<double>(grid.background()) / grid.voxelSize()[0])),
        work_(passes * static_cast<double>(blocks_.size())),
        progress_(std::move(progress)) {}

  [[nodiscard]] const BandBlocks& blocks() const { return blocks_; }

  /// Reuses the memory of `field`.
  [[nodiscard]] Field convolve(Field field, const std::vector<float>& weights) const {
    Field result(blocks_.size());
    alongAxis<0>(field, weights, result);
    alongAxis<1>(result, weights, field);
    alongAxis<2>(field, weights, result);
    return result;
  }

  [[nodiscard]] Field median(const Field& field, double radius) const {
    struct Scratch {
      std::vector<float> dense, values;
    };
    const int pad = medianPad(radius);
    const std::ptrdiff_t side = 8 + 2 * pad;
    const std::vector<std::ptrdiff_t> steps = stepsWithin(radius, pad, side);
    Field result(blocks_.size());
    forEachBlock<Scratch>([&](std::size_t i, Scratch& scratch) {
      gatherWide(field, i, pad, scratch.dense);
      scratch.values.resize(steps.size());
      result[i] = field[i];
      for (auto it = blocks_.active(i).beginOn(); it; ++it) {
        const Coord c = BandBlocks::LeafNode::offsetToLocalCoord(it.pos()).offsetBy(pad);
        const float* centre = scratch.dense.data() + (c.x() * side + c.y()) * side + c.z();
        std::transform(steps.begin(), steps.end(), scratch.values.begin(),
                       [centre](std::ptrdiff_t step) { return centre[step]; });
        const auto middle =
            scratch.values.begin() + static_cast<std::ptrdiff_t>(scratch.values.size() / 2);
        std::nth_element(scratch.values.begin(), middle, scratch.values.end());
        result[i][it.pos()] = *middle;
      }
    });
    return result;
  }

 private:
  [[nodiscard]] float farValue(const Coord& c) const {
    return tree_.getValue(c) < 0 ? -far_ : far_;
  }

  /// Calls work(i, scratch) for each block in parallel, and reports progress.
  template <typename Scratch, typename Work>
  void forEachBlock(const Work& work) const {
    blocks_.forEach<Scratch>([&](std::size_t i, Scratch& scratch) {
      work(i, scratch);
      const std::lock_guard lock(mutex_);
      report(progress_, std::min(1.0, ++done_ / work_));
    });
  }

  /// Copies the values of a block and of `pad` grid points on each side of it, rows along z.
  /// Positions outside all leaf blocks get the background with their sign.
  void gatherWide(const Field& field, std::size_t i, int pad, std::vector<float>& dense) const {
    const int side = 8 + 2 * pad;
    dense.resize(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) *
                 static_cast<std::size_t>(side));
    copyPadded(pad, pad, side, dense.data(), [&](const Coord& step) -> BlockValues {
      const Coord origin = blocks_.origin(i).offsetBy(8 * step.x(), 8 * step.y(), 8 * step.z());
      const std::uint32_t n = blocks_.find(origin);
      if (n != BandBlocks::kNone) return {field[n / 512].data(), 0};
      return {nullptr, farValue(origin)};
    });
  }

  /// A block and its neighbour blocks along an axis.
  struct Chain {
    std::vector<const float*> blocks;  ///< from the farthest before to the farthest after
    std::vector<Values> constants;     ///< values of blocks that do not exist
    std::vector<float> row;            ///< one row along the axis through all blocks
  };

  template <int axis>
  void findChain(const Field& in, std::size_t i, int length, Chain& chain) const {
    const auto count = static_cast<std::size_t>(2 * length + 1);
    chain.blocks.resize(count);
    chain.constants.resize(count);
    chain.row.resize(8 * count);
    for (std::size_t k = 0; k < count; ++k) {
      Coord origin = blocks_.origin(i);
      origin[axis] += 8 * (static_cast<int>(k) - length);
      const std::uint32_t n = blocks_.find(origin);
      if (n == BandBlocks::kNone) chain.constants[k].fill(farValue(origin));
      chain.blocks[k] = n == BandBlocks::kNone ? chain.constants[k].data() : in[n / 512].data();
    }
  }

  /// Convolves N contiguous values. `at(k)` returns the address of the values k grid points away
  /// along the axis.
  template <std::size_t N, typename At>
  static void convolveLines(const std::vector<float>& weights, const At& at, float* out) {
    std::array<float, N> sums;
    const float* centre = at(0);
    for (std::size_t n = 0; n < N; ++n) sums[n] = weights[0] * centre[n];
    for (int k = 1; k < static_cast<int>(weights.size()); ++k) {
      const float w = weights[static_cast<std::size_t>(k)];
      const float *before = at(-k), *after = at(k);
      for (std::size_t n = 0; n < N; ++n) sums[n] += w * (before[n] + after[n]);
    }
    std::copy(sums.begin(), sums.end(), out);
  }

  /// Convolves along an axis. Reads each block and its neighbour blocks along that axis in place:
  /// planes of 64 contiguous values along x, rows of 8 along y. Rows along z are copied first.
  template <int axis>
  void alongAxis(const Field& in, const std::vector<float>& weights, Field& out) const {
    const int reach = static_cast<int>(weights.size()) - 1, length = (reach + 7) / 8;
    forEachBlock<Chain>([&](std::size_t i, Chain& chain) {
      findChain<axis>(in, i, length, chain);
      // Block of the chain, and place in it, of position p along the axis of block i.
      const auto blockAt = [&](int p) {
        return chain.blocks[static_cast<std::size_t>((p >> 3) + length)];
      };
      float* target = out[i].data();
      if constexpr (axis == 0) {
        for (int x = 0; x < 8; ++x)
          convolveLines<64>(
              weights, [&](int k) { return blockAt(x + k) + ((x + k) & 7) * 64; }, target + x * 64);
      } else if constexpr (axis == 1) {
        for (int x = 0; x < 8; ++x)
          for (int y = 0; y < 8; ++y)
            convolveLines<8>(
                weights, [&](int k) { return blockAt(y + k) + x * 64 + ((y + k) & 7) * 8; },
                target + x * 64 + y * 8);
      } else {
        for (int line = 0; line < 64; ++line) {
          for (std::size_t b = 0; b < chain.blocks.size(); ++b)
            std::memcpy(chain.row.data() + 8 * b, chain.blocks[b] + line * 8, 8 * sizeof(float));
          const float* centre = chain.row.data() + static_cast<std::ptrdiff_t>(8) * length;
          convolveLines<8>(
              weights, [&](int k) { return centre + k; }, target + line * 8);
        }
      }
    });
  }

  const openvdb::FloatTree& tree_;
  BandBlocks blocks_;
  float far_;
  double work_;  ///< total work: number of blocks times number of passes
  mutable double done_ = 0;
  mutable std::mutex mutex_;
  Progress progress_;
};

Field filtered(const BlockFilter& filter, Field field, SmoothKind kind, double sigma) {
  switch (kind) {
    case SmoothKind::Mean:
      return filter.convolve(std::move(field), boxWeights(sigma));
    case SmoothKind::Median:
      return filter.median(field, sigma);
    case SmoothKind::Taubin: {
      const std::vector<float> weights = gaussianWeights(sigma);
      Field once = filter.convolve(std::move(field), weights);
      const Field twice = filter.convolve(once, weights);
      for (std::size_t i = 0; i < once.size(); ++i)
        for (std::size_t n = 0; n < 512; ++n) once[i][n] += once[i][n] - twice[i][n];
      return once;
    }
    default:
      return filter.convolve(std::move(field), gaussianWeights(sigma));
  }
}

void applyMask(const Mask& mask, const openvdb::FloatGrid& grid, const BandBlocks& blocks,
               const Field& before, Field& after) {
  struct Nothing {};
  blocks.forEach<Nothing>([&](std::size_t i, Nothing&) {
    for (auto it = blocks.active(i).beginOn(); it; ++it) {
      const openvdb::Index n = it.pos();
      const Coord c = blocks.origin(i) + BandBlocks::LeafNode::offsetToLocalCoord(n);
      const double weight = mask.weight(toImath(grid.transform().indexToWorld(c)));
      after[i][n] = before[i][n] + static_cast<float>(weight) * (after[i][n] - before[i][n]);
    }
  });
}

/// Returns the index bounds of the band's grid points with a positive mask weight; empty when there
/// are none.
CoordBBox changingBox(const openvdb::FloatGrid& grid, const Mask& mask) {
  CoordBBox box;
  for (auto it = grid.cbeginValueOn(); it; ++it)
    if (mask.weight(toImath(grid.transform().indexToWorld(it.getCoord()))) > 0)
      box.expand(it.getCoord());
  return box;
}

/// Returns the index bounds of the grid points at which two fields differ; empty when there are
/// none.
CoordBBox differing(const BandBlocks& blocks, const Field& a, const Field& b) {
  CoordBBox box;
  for (std::size_t i = 0; i < blocks.size(); ++i)
    for (openvdb::Index n = 0; n < BandBlocks::LeafNode::SIZE; ++n)
      if (a[i][n] != b[i][n])
        box.expand(blocks.origin(i) + BandBlocks::LeafNode::offsetToLocalCoord(n));
  return box;
}

/// Replaces the values and active states of `target` in a box by those of `source`.
void paste(const openvdb::FloatTree& source, const CoordBBox& box, openvdb::FloatTree& target) {
  target.fill(box, target.background(), false);
  for (auto it = source.cbeginValueAll(); it; ++it) {
    if (it.isVoxelValue() || *it >= 0) continue;
    CoordBBox tile;
    it.getBoundingBox(tile);
    tile.intersect(box);
    if (!tile.empty()) target.fill(tile, *it, false);
  }
  for (auto leaf = source.cbeginLeaf(); leaf; ++leaf) {
    if (!leaf->getNodeBoundingBox().hasOverlap(box)) continue;
    auto* out = target.touchLeaf(leaf->origin());
    for (auto it = leaf->cbeginValueAll(); it; ++it)
      if (box.isInside(it.getCoord())) {
        if (it.isValueOn())
          out->setValueOn(it.pos(), *it);
        else
          out->setValueOff(it.pos(), *it);
      }
  }
  openvdb::tools::pruneTiles(target);
}

/// A filter and its size.
struct Filtering {
  SmoothKind kind;
  double width;  ///< σ, or the radius of the median, voxels

  [[nodiscard]] double passes() const { return kind == SmoothKind::Taubin ? 2 : 1; }
  /// Returns the half width of the band that the filter needs, voxels.
  [[nodiscard]] double known() const {
    return kind == SmoothKind::Median ? width + 1 : passes() * kKnownReach * width;
  }
  /// Returns true if the filtered field may have edges as sharp as the grid can hold. A Gaussian of
  /// σ ≥ 1 voxel leaves at most exp(−π²/2), 0.7 %, of the shortest waves of the grid.
  [[nodiscard]] bool mayLeaveEdges() const {
    return kind != SmoothKind::Gaussian || width < kLeastRounding;
  }
  /// Returns the largest distance from a grid point at which the filter reads values, voxels.
  [[nodiscard]] double reach() const {
    return kind == SmoothKind::Median ? width + 1 : passes() * kGaussianReach * width;
  }
};

/// Filters the values of a field.
/// @return the index bounds of the grid points that change, if `isBoxed`; else an empty box
CoordBBox filterValues(openvdb::FloatGrid& field, const Filtering& filtering, bool isBoxed,
                       const SmoothOptions& options) {
  requireMemory(static_cast<double>(field.tree().leafCount()) * sizeof(Values) * kFieldsAlive,
                options.maxMemory);
  if (filtering.kind == SmoothKind::Median) requireMedian(field, filtering.width);
  const BlockFilter filter(field, filtering.kind == SmoothKind::Median ? 1 : 3 * filtering.passes(),
                           subProgress(options.progress, kWidened, kFiltered));
  const double voxel = field.voxelSize()[0];
  Field before = filter.blocks().read(field.tree(), voxel);
  const bool isKept = isBoxed || options.mask;
  Field after = isKept ? filtered(filter, before, filtering.kind, filtering.width)
                       : filtered(filter, std::move(before), filtering.kind, filtering.width);
  if (options.mask) applyMask(*options.mask, field, filter.blocks(), before, after);
  filter.blocks().write(after, voxel, field.tree());
  return isBoxed ? differing(filter.blocks(), before, after) : CoordBBox();
}

/// Smooths the solid in an index box of grid points, or everywhere if `box` is empty. Returns
/// nullopt if the filtered field has no zero crossing. With a box, also returns nullopt if too
/// little of the surface lies near it to compute the distances in it.
std::optional<NarrowBand> smoothedIn(const std::optional<CoordBBox>& box, NarrowBand solid,
                                     const Filtering& filtering, const SmoothOptions& options) {
  const double halfWidth = solid.halfWidth();
  eikonal::DistanceRequest request;
  request.maxMemory = options.maxMemory;
  const auto around = [&](double voxels) {
    CoordBBox wider = *box;
    wider.expand(static_cast<int>(std::ceil(std::min(1e8, voxels))));
    return wider;
  };

  // === Distances for the filter
  // The final redistancing reads the surface up to twice the half width of the solid away.
  const double trusted = filtering.known(), own = 2 * halfWidth + 2;
  const double needed = trusted + std::max(filtering.reach(), own) + 2 * kStencil;
  openvdb::FloatGrid::Ptr field;
  if (filtering.known() > halfWidth * kWideEnough) {
    request.halfWidth = filtering.known() + kStencil;
    if (box) request.region = around(needed);
    request.progress = subProgress(options.progress, 0, kWidened);
    openvdb::FloatGrid::Ptr unshared = box ? nullptr : takeUnshared(solid);
    field = unshared ? eikonal::distanceTransform(std::move(unshared), request)
                     : eikonal::distanceTransform(vdb(solid), request);
  } else if (box) {
    field = vdb(solid).deepCopy();
    field->tree().clip(around(needed));
  } else {
    (void)editVdb(solid);  // copies the grid if another band shares it
    field = takeUnshared(solid);
  }

  // === Filter
  const CoordBBox moved = filterValues(*field, filtering, box.has_value(), options);
  if (box && moved.empty()) return solid;
  // Values that change farther than `trusted` voxels from the box would need a larger `field`.
  if (box && !around(trusted).isInside(moved)) return std::nullopt;
  if (!eikonal::hasZeroCrossing(field->tree())) return std::nullopt;

  // === Redistancing
  request.halfWidth = halfWidth;
  request.mayHaveEdges = options.mask || filtering.mayLeaveEdges();
  request.progress = subProgress(options.progress, kFiltered, 1);
  request.region.reset();
  if (!box) return makeBand(eikonal::distanceTransform(std::move(field), request));
  request.region = moved;
  request.region->expand(static_cast<int>(std::ceil(halfWidth + 1)));
  openvdb::FloatGrid::Ptr changed;
  try {
    changed = eikonal::distanceTransform(*field, request);
  } catch (const InvalidInput&) {
    return std::nullopt;  // all zero crossings are at the border of the region
  }
  const openvdb::FloatGrid::Ptr result = vdb(solid).deepCopy();
  paste(changed->tree(), *request.region, result->tree());
  return makeBand(result);
}

}  // namespace

double smoothingWidth(SmoothKind kind, double sigma) {
  return Filtering{kind, sigma}.known();
}

double smoothingReach(SmoothKind kind, double sigma, double halfWidth) {
  const Filtering filtering{kind, sigma};
  const double known = filtering.known(),
               widened = known > halfWidth * kWideEnough ? distanceReach(known + kStencil) : 0;
  return widened + filtering.reach() + distanceReach(halfWidth);
}

NarrowBand smooth(NarrowBand solid, SmoothKind kind, double sigma, const SmoothOptions& options) {
  if (!(sigma > 0) || !std::isfinite(sigma))
    throw UsageError(fmt::format("sigma is {}; give a positive, finite length", sigma));
  if (options.mask) checkMask(*options.mask);
  requireSolid(solid);
  if (solid.isEmpty())
    throw NoSurface(
        "the solid is empty, so there is no surface to smooth; give a solid with a surface");
  const Filtering filtering{kind, sigma / solid.voxelSize()};
  if (options.mask) {
    const CoordBBox box = changingBox(vdb(solid), *options.mask);
    if (box.empty()) return solid;
    // When the box contains too little of the surface, distances in it depend on the surface
    // elsewhere: smooth the complete band.
    if (!box.isInside(vdb(solid).evalActiveVoxelBoundingBox()))
      if (auto part = smoothedIn(box, solid, filtering, options)) return std::move(*part);
  }
  if (auto whole = smoothedIn(std::nullopt, std::move(solid), filtering, options))
    return std::move(*whole);
  throw InvalidInput(
      fmt::format("a sigma of {} world units removes the entire solid; give a smaller "
                  "sigma",
                  sigma));
}

}  // namespace levelset
