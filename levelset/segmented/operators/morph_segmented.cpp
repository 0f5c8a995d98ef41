#include "levelset/segmented/operators/morph_segmented.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>
#include <vector>

#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/grids/grid_queries_vdb.h"
#include "levelset/grids/padded_leaf_vdb.h"
#include "levelset/segmented/operators/field_edit_vdb.h"
#include "levelset/segmented/operators/region_bands_vdb.h"
#include "levelset/transform/resample_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using Leaf = FloatTree::LeafNodeType;

constexpr double kMorphReach = 8;      // voxels: first guess of the distances that are needed
constexpr double kMorphMargin = 4;     // voxels: beyond the points that change their region
constexpr double kMorphHalfWidth = 3;  // voxels: of the means

/// Computes the distances to the regions of a field on the grid of another one.
RegionBands bandsOnGrid(const SegmentedField& field, const Imath::M44d& matrix, double voxelSize,
                        double halfWidth, const MorphSegmentedOptions& options) {
  constexpr double kSameGrid = 1e-9;
  const double ratio = voxelSize / field.voxelSize();
  RegionBands bands = regionBands(field, halfWidth * std::max(1.0, ratio), options.maxMemory, {});
  if (matrix.equalWithAbsError(field.indexToWorld(), kSameGrid * voxelSize)) return bands;
  for (NarrowBand& band : bands.bands)
    band = resampleField(band, band.indexToWorld(), matrix, halfWidth, options.maxMemory, {});
  return bands;
}

/// Two partitions on one grid, with the same labels.
class MorphPair {
 public:
  MorphPair(RegionBands from, RegionBands to, double fraction, double voxelSize)
      : from_(std::move(from)),
        to_(std::move(to)),
        fraction_(static_cast<float>(fraction)),
        voxelSize_(voxelSize),
        far_(vdb(from_.bands.front()).background()) {
    std::set_union(from_.labels.begin(), from_.labels.end(), to_.labels.begin(), to_.labels.end(),
                   std::back_inserter(labels_));
    std::set<Coord> blocks;
    for (const RegionBands* bands : {&from_, &to_})
      for (const LabelledLeaf& leaf : labelledLeaves(*bands)) blocks.insert(leaf.block);
    blocks_.assign(blocks.begin(), blocks.end());
  }

  /// Returns true when a point that changes its region is farther from an interface than distances
  /// reach.
  [[nodiscard]] bool fallsShort() const {
    const float limit = far_ - static_cast<float>(kMorphMargin * voxelSize_);
    std::atomic<bool> found = false;
    tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t b) {
      if (found) return;
      const Columns columns = columnsOf(blocks_[b]);
      for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
        const std::size_t u = leastOf(columns.from, n), v = leastOf(columns.to, n);
        if (u != v && (columns.from[u].at(n) < -limit || columns.to[v].at(n) < -limit))
          found = true;
      }
    });
    return found;
  }

  /// Computes the distances to the regions at the fraction.
  [[nodiscard]] RegionBands mean(const std::size_t maxMemory, double halfWidth) const {
    RegionBands result;
    std::vector<openvdb::FloatGrid::Ptr> grids;
    for (const RegionLabel label : labels_) grids.push_back(start(label));
    const float background = grids.front()->background();
    std::vector<std::vector<Leaf*>> leaves(blocks_.size());
    for (std::size_t b = 0; b < blocks_.size(); ++b)
      for (const openvdb::FloatGrid::Ptr& grid : grids)
        leaves[b].push_back(grid->tree().touchLeaf(originOf(blocks_[b])));
    tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t b) {
      const Columns columns = columnsOf(blocks_[b]);
      std::vector<float> values(labels_.size());
      for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
        for (std::size_t r = 0; r < labels_.size(); ++r)
          values[r] = (1 - fraction_) * columns.from[r].at(n) + fraction_ * columns.to[r].at(n);
        write(values, n, background, leaves[b]);
      }
    });
    for (std::size_t r = 0; r < labels_.size(); ++r) {
      pruneOneSided(grids[r]->tree());
      if (!hasInside(*grids[r])) continue;
      result.labels.push_back(labels_[r]);
      result.bands.push_back(
          redistance(makeBand(grids[r]), {.halfWidth = halfWidth, .maxMemory = maxMemory}));
    }
    return result;
  }

 private:
  /// Values of a region in a block: negative inside, for the void too.
  struct Column {
    BlockValues values;
    float sign;
    [[nodiscard]] float at(std::uint32_t n) const {
      return sign * (values.values ? values.values[n] : values.constant);
    }
  };
  struct Columns {
    std::vector<Column> from, to;  ///< by label
  };

  static Coord originOf(const Coord& block) {
    return {block[0] << 3, block[1] << 3, block[2] << 3};
  }

  [[nodiscard]] std::vector<Column> columnsIn(const RegionBands& bands, const Coord& block) const {
    std::vector<Column> columns;
    for (const RegionLabel label : labels_) {
      const auto at = std::lower_bound(bands.labels.begin(), bands.labels.end(), label);
      if (at == bands.labels.end() || *at != label) {
        columns.push_back({{nullptr, far_}, 1});
        continue;
      }
      const auto r = static_cast<std::size_t>(at - bands.labels.begin());
      const openvdb::tree::ValueAccessor<const FloatTree> accessor(vdb(bands.bands[r]).tree());
      columns.push_back({blockValues(accessor, originOf(block)), bands.sign(r)});
    }
    return columns;
  }
  [[nodiscard]] Columns columnsOf(const Coord& block) const {
    return {columnsIn(from_, block), columnsIn(to_, block)};
  }
  static std::size_t leastOf(const std::vector<Column>& columns, std::uint32_t n) {
    std::size_t best = 0;
    for (std::size_t r = 1; r < columns.size(); ++r)
      if (columns[r].at(n) < columns[best].at(n)) best = r;
    return best;
  }

  /// Makes a band that is inside where both partitions have no interface and the same region.
  [[nodiscard]] openvdb::FloatGrid::Ptr start(RegionLabel label) const {
    const openvdb::FloatGrid& any = vdb(from_.bands.front());
    openvdb::FloatGrid::Ptr grid = emptyLevelSet(any.transform().copy(), kMorphHalfWidth);
    const NarrowBand* bands[2] = {nullptr, nullptr};
    for (std::size_t k = 0; k < 2; ++k) {
      const RegionBands& side = k == 0 ? from_ : to_;
      const auto at = std::lower_bound(side.labels.begin(), side.labels.end(), label);
      if (at == side.labels.end() || *at != label) return grid;
      bands[k] = &side.bands[static_cast<std::size_t>(at - side.labels.begin())];
    }
    FloatTree& tree = grid->tree();
    auto tile = vdb(*bands[0]).tree().cbeginValueAll();
    tile.setMaxDepth(FloatTree::DEPTH - 2);
    for (; tile; ++tile)
      if (*tile < 0) tree.sparseFill(tile.getBoundingBox(), -grid->background(), false);
    // Where only one of them is inside, an interface is near, and the block gets its values later.
    return grid;
  }

  void write(const std::vector<float>& values, std::uint32_t n, float background,
             const std::vector<Leaf*>& leaves) const {
    std::size_t best = 0;
    float second = std::numeric_limits<float>::infinity();
    for (std::size_t r = 1; r < values.size(); ++r) {
      if (values[r] < values[best]) {
        second = values[best];
        best = r;
      } else {
        second = std::min(second, values[r]);
      }
    }
    for (std::size_t r = 0; r < values.size(); ++r) {
      const float rival = r == best ? second : values[best];
      const float sign = labels_[r] == kVoid ? -1.0f : 1.0f;
      const float value = sign * (values[r] - rival) / 2;
      if (std::abs(value) < background)
        leaves[r]->setValueOn(n, value);
      else
        leaves[r]->setValueOff(n, std::copysign(background, value));
    }
  }

  RegionBands from_, to_;
  float fraction_;
  double voxelSize_;
  float far_;
  std::vector<RegionLabel> labels_;  ///< all labels, ascending
  std::vector<Coord> blocks_;        ///< in which a band has a leaf, ascending
};

}  // namespace

SegmentedField morphSegmented(const SegmentedField& from, const SegmentedField& to, double fraction,
                              const MorphSegmentedOptions& options) {
  if (!(fraction >= 0 && fraction <= 1))
    throw UsageError(fmt::format("the fraction is {}; give a number from 0 to 1", fraction));
  if (from.isEmpty() || to.isEmpty())
    throw InvalidInput(fmt::format("the {} segmentation has no interface; give two with regions",
                                   from.isEmpty() ? "first" : "second"));
  for (const SegmentedField* field : {&from, &to}) requireNoSheets(*field);
  if (fraction == 0) return from;
  const Imath::M44d matrix = from.indexToWorld();
  const double voxelSize = from.voxelSize();
  for (double reach = kMorphReach;; reach *= 2) {
    report(options.progress, 0);
    const MorphPair pair(bandsOnGrid(from, matrix, voxelSize, reach, options),
                         bandsOnGrid(to, matrix, voxelSize, reach, options), fraction, voxelSize);
    if (pair.fallsShort()) continue;
    report(options.progress, 0.7);
    const RegionBands mean = pair.mean(options.maxMemory, from.halfWidth() + 1);
    if (mean.bands.size() < 2)
      throw NoSurface(
          fmt::format("no region is left at the fraction {:.3g}, because the partitions do not "
                      "overlap; move one "
                      "of them until they overlap",
                      fraction));
    SegmentedField result =
        fieldOfBands(mean, from.halfWidth(), subProgress(options.progress, 0.8, 1));
    requireRegion(result);
    return result;
  }
}

}  // namespace levelset
