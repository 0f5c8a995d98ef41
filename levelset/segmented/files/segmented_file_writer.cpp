#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/files/vdb_writer.h"
#include "levelset/segmented/files/segmented_file.h"
#include "levelset/segmented/files/segmented_grids_vdb.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {
namespace {

using openvdb::FloatTree;
using openvdb::GridBase;
using openvdb::Vec3STree;

/// Makes the grids of a segmented field.
class SegmentedGridMaker {
 public:
  explicit SegmentedGridMaker(const SegmentedData& data) : data_(data) {
    makers_.emplace_back([this] { return labels(); });
    for (std::size_t rank = 0; rank <= mostExtras(); ++rank) {
      makers_.emplace_back([this, rank] { return distances(rank); });
      makers_.emplace_back([this, rank] { return neighbours(rank); });
    }
    if (!data_.sheets) return;
    for (std::uint32_t slot = 0; slot < segmented_file::kEdgeSlots; ++slot)
      if (hasSlot(data_.sheets->edges, slot))
        makers_.emplace_back([this, slot] { return edges(slot); });
    for (std::uint32_t slot = 0; slot < kuhn::kSlots; ++slot)
      if (hasSlot(data_.sheets->pointKeys, slot))
        makers_.emplace_back([this, slot] { return points(slot); });
  }

  [[nodiscard]] std::int32_t count() const { return static_cast<std::int32_t>(makers_.size()); }
  [[nodiscard]] GridBase::Ptr make(std::int32_t n) const {
    return makers_[static_cast<std::size_t>(n)]();
  }
  /// Bytes of the values of all grids.
  [[nodiscard]] double bytes() const {
    return static_cast<double>(makers_.size() * data_.blockCount()) * SegmentedData::kVoxels * 4;
  }

 private:
  static bool hasSlot(const std::vector<std::uint16_t>& keys, std::uint32_t slot) {
    return std::any_of(keys.begin(), keys.end(),
                       [&](std::uint16_t key) { return key % SheetData::kSlots == slot; });
  }

  /// Calls visit(voxel, rank, extra) for the extras of a block. The rank counts those of a voxel
  /// from 1.
  template <typename Visit>
  void visitExtras(std::size_t block, const Visit& visit) const {
    std::size_t rank = 0;
    for (std::size_t n = data_.blocks[block].extras; n < data_.blocks[block + 1].extras; ++n) {
      const SegmentedExtra& extra = data_.extras[n];
      const bool isFirst =
          n == data_.blocks[block].extras || data_.extras[n - 1].voxel != extra.voxel;
      rank = isFirst ? 1 : rank + 1;
      visit(std::uint32_t{extra.voxel}, rank, extra);
    }
  }
  [[nodiscard]] std::size_t mostExtras() const {
    std::size_t most = 0;
    for (std::size_t b = 0; b < data_.blockCount(); ++b)
      visitExtras(b, [&](std::uint32_t, std::size_t rank, const SegmentedExtra&) {
        most = std::max(most, rank);
      });
    return most;
  }

  /// Makes a tree with a leaf for each block where fill(block, leaf) returns true.
  template <typename TreeT, typename Fill>
  void addLeaves(TreeT& tree, const Fill& fill) const {
    using Leaf = typename TreeT::LeafNodeType;
    std::vector<std::unique_ptr<Leaf>> leaves(data_.blockCount());
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t b) {
      auto leaf = std::make_unique<Leaf>(data_.blocks[b].origin, tree.background(), false);
      if (fill(b, *leaf)) leaves[b] = std::move(leaf);
    });
    for (auto& leaf : leaves)
      if (leaf) tree.addLeaf(leaf.release());
  }

  template <typename TreeT>
  GridBase::Ptr named(std::shared_ptr<TreeT> tree, const std::string& name) const {
    const auto grid = openvdb::Grid<TreeT>::create(std::move(tree));
    nameGrid(*grid, *data_.transform, name, openvdb::GRID_UNKNOWN);
    return grid;
  }

  [[nodiscard]] GridBase::Ptr labels() const {
    const RegionLabel outside = SegmentedData::labelOfTile(data_.blockTree->background());
    const auto tree = std::make_shared<FloatTree>(static_cast<float>(outside));
    for (auto tile = data_.blockTree->cbeginValueAll(); tile; ++tile) {
      if (*tile >= 0) continue;
      const RegionLabel label = SegmentedData::labelOfTile(*tile);
      if (label == outside) continue;
      const openvdb::CoordBBox box = tile.getBoundingBox();
      tree->fill({box.min() << 3, (box.max() << 3) + openvdb::Coord(SegmentedData::kBlock - 1)},
                 static_cast<float>(label), label != kVoid);
    }
    addLeaves(*tree, [&](std::size_t b, FloatTree::LeafNodeType& leaf) {
      for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
        const RegionLabel label = data_.labelAt(data_.blocks[b], n);
        leaf.setValueOnly(n, static_cast<float>(label));
        leaf.setActiveState(n, label != kVoid);
      }
      return true;
    });
    const GridBase::Ptr grid = named(tree, kLabelGrid);
    grid->insertMeta(segmented_file::kVersion,
                     openvdb::Int32Metadata(segmented_file::kCurrentVersion));
    grid->insertMeta(segmented_file::kHalfWidth, openvdb::DoubleMetadata(data_.halfWidth));
    if (data_.sheets)
      grid->insertMeta(
          segmented_file::kSheetLabels,
          openvdb::StringMetadata(fmt::format("{}", fmt::join(data_.sheets->owners, " "))));
    return grid;
  }

  /// Sets the value of each active voxel, or of those with so many extras.
  /// @param nearest  value of an active voxel by (block, voxel, index of its distance)
  /// @param further  value of an extra
  template <typename Nearest, typename Further>
  GridBase::Ptr ofRank(std::size_t rank, float background, const std::string& name,
                       const Nearest& nearest, const Further& further) const {
    const auto tree = std::make_shared<FloatTree>(background);
    addLeaves(*tree, [&](std::size_t b, FloatTree::LeafNodeType& leaf) {
      if (rank > 0) {
        visitExtras(b, [&](std::uint32_t voxel, std::size_t own, const SegmentedExtra& extra) {
          if (own == rank) leaf.setValueOn(voxel, further(extra));
        });
      } else {
        for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n)
          if (const std::int64_t at = data_.distanceIndex(data_.blocks[b], n); at >= 0)
            leaf.setValueOn(n, nearest(data_.blocks[b], n, at));
      }
      return !leaf.isEmpty();
    });
    return named(tree, name);
  }
  [[nodiscard]] GridBase::Ptr distances(std::size_t rank) const {
    return ofRank(
        rank, data_.background, segmented_file::distanceGrid(rank),
        [&](const SegmentedBlock&, std::uint32_t, std::int64_t at) {
          return data_.distances[static_cast<std::size_t>(at)];
        },
        [](const SegmentedExtra& extra) { return extra.distance; });
  }
  [[nodiscard]] GridBase::Ptr neighbours(std::size_t rank) const {
    return ofRank(
        rank, 0, segmented_file::neighbourGrid(rank),
        [&](const SegmentedBlock& block, std::uint32_t n, std::int64_t at) {
          return static_cast<float>(data_.neighbourAt(block, n, at));
        },
        [](const SegmentedExtra& extra) { return static_cast<float>(extra.label); });
  }

  [[nodiscard]] GridBase::Ptr edges(std::uint32_t slot) const {
    const SheetData& sheets = *data_.sheets;
    const auto tree = std::make_shared<FloatTree>(0.0f);
    addLeaves(*tree, [&](std::size_t b, FloatTree::LeafNodeType& leaf) {
      for (std::size_t n = sheets.firstEdge[b]; n < sheets.firstEdge[b + 1]; ++n)
        if (sheets.edges[n] % SheetData::kSlots == slot)
          leaf.setValueOn(sheets.edges[n] / SheetData::kSlots, sheets.positions[n]);
      return !leaf.isEmpty();
    });
    return named(tree, segmented_file::edgeGrid(slot));
  }
  [[nodiscard]] GridBase::Ptr points(std::uint32_t slot) const {
    const SheetData& sheets = *data_.sheets;
    const auto tree = std::make_shared<Vec3STree>(openvdb::Vec3s(0.0f));
    addLeaves(*tree, [&](std::size_t b, Vec3STree::LeafNodeType& leaf) {
      for (std::size_t n = sheets.firstPoint[b]; n < sheets.firstPoint[b + 1]; ++n)
        if (sheets.pointKeys[n] % SheetData::kSlots == slot)
          leaf.setValueOn(sheets.pointKeys[n] / SheetData::kSlots,
                          openvdb::Vec3s(sheets.points[n].getValue()));
      return !leaf.isEmpty();
    });
    return named(tree, segmented_file::pointGrid(slot));
  }

  const SegmentedData& data_;
  std::vector<std::function<GridBase::Ptr()>> makers_;
};

}  // namespace

void writeSegmented(const std::filesystem::path& path, const SegmentedField& field,
                    const WriteSegmentedOptions& options) {
  if (!field.shared())
    throw InvalidInput(
        fmt::format("there is no segmentation to write to '{}'; create one first", path.string()));
  const SegmentedGridMaker maker(*field.shared());
  writeTarget(path, [&](const std::filesystem::path& target) {
    writeVdb(
        target, maker.bytes(),
        [&](std::ostream& out) {
          writeGridsInTurn(out, maker.count(), [&](std::int32_t n) { return maker.make(n); });
        },
        [&] { return field.contentHash(); }, options.progress);
  });
}

}  // namespace levelset
