#include "levelset/segmented/files/segmented_file.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/files/byte_io.h"
#include "levelset/files/vdb_layout.h"
#include "levelset/grid_tools_vdb.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/segmented/files/segmented_grids_vdb.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using openvdb::Vec3STree;
using FloatLeaf = FloatTree::LeafNodeType;

const VdbEntry* findSegmentedGrid(const std::vector<VdbEntry>& entries, const std::string& name) {
  const auto found = std::find_if(entries.begin(), entries.end(),
                                  [&](const VdbEntry& entry) { return entry.name == name; });
  return found == entries.end() ? nullptr : &*found;
}

template <typename T>
std::optional<T> metadataOf(const VdbEntry& entry, const char* key) {
  const VdbMetadata* found = entry.find(key);
  if (!found || found->value.size() != sizeof(T)) return std::nullopt;
  T value;
  std::memcpy(&value, found->value.data(), sizeof(T));
  return value;
}

const VdbEntry* findLabelGrid(const std::vector<VdbEntry>& entries) {
  const VdbEntry* entry = findSegmentedGrid(entries, kLabelGrid);
  return entry && entry->find(segmented_file::kVersion) ? entry : nullptr;
}

/// Makes a field of the grids of a file. Checks all values, since the file may be damaged.
class SegmentedFileReader {
 public:
  SegmentedFileReader(std::string_view file, const std::string& name,
                      const ReadSegmentedOptions& options)
      : file_(file), name_(name), options_(options), limit_(memoryLimit(options.maxMemory)) {
    labelEntry_ = findLabelGrid(entries_);
    if (!labelEntry_)
      throw InvalidInput(fmt::format(
          "{} holds no segmentation; read it as a level set, or write it again with 'segment'",
          name_));
    checkHeader(*labelEntry_);
  }

  /// Half width in voxels, from the header. @throws InvalidInput if the header is damaged
  [[nodiscard]] double halfWidth() const { return halfWidth_; }

  SegmentedField read() {
    labels_ = load<FloatTree>(*labelEntry_, 0.1, 0.3);
    listBlocks();
    readInterfaces();
    std::shared_ptr<const SheetData> sheets = readSheets(*labelEntry_);
    std::vector<PackedBlock> blocks(leaves_.size());
    tbb::parallel_for(std::size_t{0}, leaves_.size(),
                      [&](std::size_t b) { blocks[b] = packed(b); });
    if (const std::size_t b = damaged_; b < leaves_.size())
      fail(fmt::format("the values near index [{}, {}, {}] contradict each other",
                       leaves_[b]->origin()[0], leaves_[b]->origin()[1], leaves_[b]->origin()[2]));
    const auto tiles = tilesOfLabels();
    labels_.reset();
    layers_.clear();
    report(options_.progress, 0.95);
    const SegmentedField field =
        assembleSegmented(transform_, halfWidth_, tiles, std::move(blocks), std::move(sheets));
    const std::vector<RegionLabel> labels = field.labels();
    for (const RegionLabel owner : field.sheetLabels())
      if (owner != kVoid && !std::binary_search(labels.begin(), labels.end(), owner))
        fail(fmt::format("region {} has sheets and no grid point", owner));
    return field;
  }

 private:
  /// Distances and labels of the neighbours of one rank.
  struct Layer {
    FloatTree::Ptr distances, neighbours;
  };

  [[noreturn]] void fail(const std::string& what) const {
    throw InvalidInput(fmt::format(
        "{} holds a damaged segmentation: {}; download or create the file again", name_, what));
  }
  /// Marks a block as damaged. The first one is reported, for any number of threads.
  void markDamaged(std::size_t block) {
    std::size_t known = damaged_;
    while (block < known && !damaged_.compare_exchange_weak(known, block)) {
    }
  }

  void checkHeader(const VdbEntry& entry) {
    const auto version = metadataOf<std::int32_t>(entry, segmented_file::kVersion);
    if (version != segmented_file::kCurrentVersion)
      throw InvalidInput(fmt::format(
          "{} holds a segmentation in version {} of its format, and this program reads version {}; "
          "write it again with this program",
          name_, version.value_or(0), segmented_file::kCurrentVersion));
    if (!entry.transform || !isSimilarity(*entry.transform))
      fail("its transform is not a rotation, uniform scale and translation");
    transform_ = entry.transform;
    halfWidth_ = metadataOf<double>(entry, segmented_file::kHalfWidth).value_or(0);
    constexpr double kMostHalfWidth = 1000;  // voxels
    if (!(halfWidth_ > 0 && halfWidth_ <= kMostHalfWidth)) fail("its half width is missing");
    background_ = backgroundOf(halfWidth_, transform_->voxelSize()[0]);
    if (!(background_ > 0) || !std::isfinite(background_)) fail("its half width is out of range");
  }

  template <typename TreeT>
  typename TreeT::Ptr load(const VdbEntry& entry, double begin, double end) {
    if (!entry.instanceOf.empty()) fail(fmt::format("grid '{}' has no tree", entry.name));
    VdbTreeLimits limits{.maxMemory = limit_ - std::min(limit_, used_),
                         .keepsTiles = true,
                         .progress = subProgress(options_.progress, begin, end)};
    typename TreeT::Ptr tree;
    if constexpr (std::is_same_v<TreeT, Vec3STree>) {
      if (!hasVectorTree(entry)) fail(fmt::format("grid '{}' holds no vectors", entry.name));
      tree = readVdbVectorTree(file_, name_, entry, limits);
    } else {
      if (!hasFloatTree(entry)) fail(fmt::format("grid '{}' holds no floats", entry.name));
      tree = readVdbTree(file_, name_, entry, limits);
    }
    used_ += tree->memUsage();
    return tree;
  }
  /// Loads a grid whose leaves are at blocks.
  template <typename TreeT>
  typename TreeT::Ptr loadAtBlocks(const VdbEntry& entry, double begin, double end) {
    typename TreeT::Ptr tree = load<TreeT>(entry, begin, end);
    if (tree->activeTileCount() > 0) fail(fmt::format("grid '{}' has active tiles", entry.name));
    for (auto leaf = tree->cbeginLeaf(); leaf; ++leaf)
      if (!labels_->probeConstLeaf(leaf->origin()))
        fail(fmt::format("grid '{}' has values outside the blocks of grid '{}'", entry.name,
                         kLabelGrid));
    return tree;
  }

  void listBlocks() {
    for (auto leaf = labels_->cbeginLeaf(); leaf; ++leaf) leaves_.push_back(&*leaf);
    std::sort(leaves_.begin(), leaves_.end(),
              [](const FloatLeaf* a, const FloatLeaf* b) { return a->origin() < b->origin(); });
    constexpr std::size_t kMostBlocks = std::numeric_limits<std::int32_t>::max();
    if (leaves_.size() >= kMostBlocks)
      throw ResourceLimit(fmt::format("{} has more than 2^31 blocks; use larger voxels", name_));
    damaged_ = leaves_.size();
    // Labels, distances and neighbours of the packed blocks.
    requireMemory(static_cast<double>(used_ + leaves_.size() * SegmentedData::kVoxels * 8), limit_);
  }

  void readInterfaces() {
    constexpr std::size_t kMostRanks = 1000;
    for (std::size_t rank = 0; rank < kMostRanks; ++rank) {
      const VdbEntry* distances = findSegmentedGrid(entries_, segmented_file::distanceGrid(rank));
      const VdbEntry* neighbours = findSegmentedGrid(entries_, segmented_file::neighbourGrid(rank));
      if (!distances || !neighbours) {
        if (rank == 0 || distances || neighbours)
          fail(fmt::format("grid '{}' is missing", distances ? segmented_file::neighbourGrid(rank)
                                                             : segmented_file::distanceGrid(rank)));
        return;
      }
      layers_.push_back({loadAtBlocks<FloatTree>(*distances, 0.3, 0.5),
                         loadAtBlocks<FloatTree>(*neighbours, 0.5, 0.7)});
    }
  }

  /// @return false for a number that is no label
  static bool toLabel(float value, RegionLabel& label) {
    if (!(value >= 0 && value <= std::numeric_limits<RegionLabel>::max())) return false;
    label = static_cast<RegionLabel>(value);
    return static_cast<float>(label) == value;
  }

  PackedBlock packed(std::size_t b) {
    SegmentedBlockValues values{};
    values.origin = leaves_[b]->origin();
    for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n)
      if (!toLabel(leaves_[b]->getValue(n), values.labels[n])) markDamaged(b);
    values.distances.fill(background_);
    values.neighbours.fill(kVoid);
    if (!takeNearest(values) || !takeExtras(values)) {
      markDamaged(b);
      return {};
    }
    return packBlock(values, background_);
  }
  [[nodiscard]] bool takeNearest(SegmentedBlockValues& values) const {
    const FloatLeaf* distances = layers_[0].distances->probeConstLeaf(values.origin);
    const FloatLeaf* neighbours = layers_[0].neighbours->probeConstLeaf(values.origin);
    if (!distances && !neighbours) return true;
    if (!distances || !neighbours || distances->valueMask() != neighbours->valueMask())
      return false;
    for (auto on = distances->cbeginValueOn(); on; ++on) {
      const std::uint32_t n = on.pos();
      values.distances[n] = *on;
      if (!(*on >= 0 && *on < background_) ||
          !toLabel(neighbours->getValue(n), values.neighbours[n]) ||
          values.neighbours[n] == values.labels[n])
        return false;
    }
    return true;
  }
  [[nodiscard]] bool takeExtras(SegmentedBlockValues& values) const {
    for (std::size_t rank = 1; rank < layers_.size(); ++rank) {
      const FloatLeaf* distances = layers_[rank].distances->probeConstLeaf(values.origin);
      const FloatLeaf* neighbours = layers_[rank].neighbours->probeConstLeaf(values.origin);
      if (!distances && !neighbours) continue;
      if (!distances || !neighbours || distances->valueMask() != neighbours->valueMask())
        return false;
      for (auto on = distances->cbeginValueOn(); on; ++on) {
        SegmentedExtra extra{.voxel = static_cast<std::uint16_t>(on.pos()), .distance = *on};
        if (!(*on >= 0) || !std::isfinite(*on) ||
            !toLabel(neighbours->getValue(on.pos()), extra.label) ||
            extra.label == values.labels[on.pos()])
          return false;
        values.extras.push_back(extra);
      }
    }
    const auto keyOf = [](const SegmentedExtra& e) {
      return std::uint32_t{e.voxel} << 16 | e.label;
    };
    std::sort(values.extras.begin(), values.extras.end(),
              [&](const auto& a, const auto& b) { return keyOf(a) < keyOf(b); });
    return std::adjacent_find(values.extras.begin(), values.extras.end(),
                              [&](const auto& a, const auto& b) { return keyOf(a) == keyOf(b); }) ==
           values.extras.end();
  }

  /// Makes the tree of block coordinates of the tiles of the labels.
  [[nodiscard]] openvdb::Int32Tree::Ptr tilesOfLabels() const {
    RegionLabel outside = kVoid;
    if (!toLabel(labels_->background(), outside)) fail("its background is no label");
    auto tree = std::make_shared<openvdb::Int32Tree>(SegmentedData::tile(outside));
    auto tile = labels_->cbeginValueAll();
    tile.setMaxDepth(FloatTree::DEPTH - 2);
    for (; tile; ++tile) {
      RegionLabel label = kVoid;
      if (!toLabel(*tile, label)) fail("a tile of grid 'label' holds no label");
      if (label == outside) continue;
      const openvdb::CoordBBox box = tile.getBoundingBox();
      tree->fill({box.min() >> 3, box.max() >> 3}, SegmentedData::tile(label), false);
    }
    return tree;
  }

  std::shared_ptr<const SheetData> readSheets(const VdbEntry& labelEntry) {
    const VdbMetadata* owners = labelEntry.find(segmented_file::kSheetLabels);
    if (!owners) return nullptr;
    const auto sheets = std::make_shared<SheetData>();
    sheets->owners = ownersOf(owners->value);
    std::vector<FloatTree::Ptr> edges(segmented_file::kEdgeSlots);
    for (std::uint32_t slot = 0; slot < edges.size(); ++slot)
      if (const auto* entry = findSegmentedGrid(entries_, segmented_file::edgeGrid(slot)))
        edges[slot] = loadAtBlocks<FloatTree>(*entry, 0.7, 0.8);
    std::vector<Vec3STree::Ptr> points(kuhn::kSlots);
    for (std::uint32_t slot = 0; slot < points.size(); ++slot)
      if (const auto* entry = findSegmentedGrid(entries_, segmented_file::pointGrid(slot)))
        points[slot] = loadAtBlocks<Vec3STree>(*entry, 0.8, 0.9);
    for (const FloatLeaf* leaf : leaves_) {
      sheets->firstEdge.push_back(static_cast<std::uint32_t>(sheets->edges.size()));
      sheets->firstPoint.push_back(static_cast<std::uint32_t>(sheets->pointKeys.size()));
      appendByKey(edges, leaf->origin(), sheets->edges, sheets->positions);
      appendByKey(points, leaf->origin(), sheets->pointKeys, sheets->points);
    }
    sheets->firstEdge.push_back(static_cast<std::uint32_t>(sheets->edges.size()));
    sheets->firstPoint.push_back(static_cast<std::uint32_t>(sheets->pointKeys.size()));
    for (const float position : sheets->positions)
      if (!(position >= 0 && position <= 1)) fail("a sheet crosses an edge beyond its ends");
    constexpr float kFarthestPoint = 2;  // voxels; those of a cell are at most one voxel away
    for (const Imath::V3f& point : sheets->points)
      for (int axis = 0; axis < 3; ++axis)
        if (!(std::abs(point[axis]) <= kFarthestPoint)) fail("a point of a rim is out of range");
    return sheets;
  }

  [[nodiscard]] std::vector<std::uint16_t> ownersOf(std::string_view text) const {
    std::vector<std::uint16_t> owners;
    const char *at = text.data(), *end = at + text.size();
    while (at < end) {
      std::uint16_t label = 0;
      const auto [next, error] = std::from_chars(at, end, label);
      if (error != std::errc() || (next < end && *next != ' ') ||
          (!owners.empty() && label <= owners.back()))
        fail("the list of regions with sheets is damaged");
      owners.push_back(label);
      at = next < end ? next + 1 : next;
    }
    return owners;
  }

  static float valueOfSlot(float value) { return value; }
  static Imath::V3f valueOfSlot(const openvdb::Vec3s& value) {
    return {value[0], value[1], value[2]};
  }
  /// Appends the active values of a block, by voxel and slot.
  template <typename TreePtr, typename Value>
  static void appendByKey(const std::vector<TreePtr>& trees, const Coord& origin,
                          std::vector<std::uint16_t>& keys, std::vector<Value>& values) {
    using Leaf = typename TreePtr::element_type::LeafNodeType;
    std::vector<const Leaf*> leaves(trees.size());
    bool isEmpty = true;
    for (std::size_t slot = 0; slot < trees.size(); ++slot) {
      leaves[slot] = trees[slot] ? trees[slot]->probeConstLeaf(origin) : nullptr;
      isEmpty = isEmpty && !leaves[slot];
    }
    if (isEmpty) return;
    for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n)
      for (std::uint32_t slot = 0; slot < leaves.size(); ++slot) {
        if (!leaves[slot] || !leaves[slot]->isValueOn(n)) continue;
        keys.push_back(SheetData::key(n, slot));
        values.push_back(valueOfSlot(leaves[slot]->getValue(n)));
      }
  }

  std::string_view file_;
  const std::string& name_;
  const ReadSegmentedOptions& options_;
  std::size_t limit_, used_ = 0;
  std::vector<VdbEntry> entries_ = readVdbEntries(file_, name_);
  const VdbEntry* labelEntry_ = nullptr;  ///< the grid of labels
  openvdb::math::Transform::Ptr transform_;
  double halfWidth_ = 0;
  float background_ = 0;
  FloatTree::Ptr labels_;
  std::vector<const FloatLeaf*> leaves_;  ///< leaves of labels_, by x, y, z
  std::vector<Layer> layers_;
  std::atomic<std::size_t> damaged_ = 0;
};

}  // namespace

SegmentedField readSegmented(const std::filesystem::path& path,
                             const ReadSegmentedOptions& options) {
  const std::string name = inputName(path);
  try {
    report(options.progress, 0);
    const MappedFile bytes(path, options.maxMemory);
    report(options.progress, 0.1);
    SegmentedField field = SegmentedFileReader(bytes.view(), name, options).read();
    report(options.progress, 1);
    return field;
  } catch (const std::bad_alloc&) {
    throw ResourceLimit(
        fmt::format("{} does not fit into memory; free memory or use larger voxels", name));
  } catch (const openvdb::Exception& error) {
    throw InvalidInput(
        fmt::format("{} is damaged: {}; download or create the file again", name, error.what()));
  }
}

SegmentedFileInfo segmentedFileInfo(const std::filesystem::path& path) {
  const std::string name = inputName(path);
  SegmentedFileInfo info;
  {
    const MappedFile bytes(path);
    const ReadSegmentedOptions options;
    info.halfWidth = SegmentedFileReader(bytes.view(), name, options).halfWidth();
  }
  for (const GridInfo& grid : bandFileInfo(path)) {
    if (grid.name != segmented_file::distanceGrid(0)) continue;
    info.voxelSize = grid.voxelSize;
    info.activeVoxels = grid.activeVoxels;
    info.worldBounds = grid.worldBounds;
  }
  if (!(info.voxelSize > 0))
    throw InvalidInput(fmt::format(
        "{} holds a damaged segmentation: grid 'distance' is missing or has no cubic voxels; "
        "download or create the file again",
        name));
  return info;
}

bool holdsSegmented(const std::filesystem::path& path) {
  std::error_code error;
  if (path == "-" || !std::filesystem::is_regular_file(path, error)) return false;
  try {
    const MappedFile bytes(path);
    return findLabelGrid(readVdbEntries(bytes.view(), inputName(path))) != nullptr;
  } catch (const Error&) {  // reading the file reports the error
    return false;
  }
}

}  // namespace levelset
