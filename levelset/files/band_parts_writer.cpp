#include "levelset/files/band_parts_writer.h"

#include <fmt/core.h>
#include <openvdb/io/Compression.h>
#include <openvdb/io/DelayedLoadMetadata.h>
#include <openvdb/tools/Count.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/files/vdb_writer.h"
#include "levelset/grid_tools_vdb.h"

namespace levelset {

// A named namespace, because BandPartsWriter::Impl has members of these types.
namespace band_parts {

namespace fs = std::filesystem;
using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using LeafBlock = FloatTree::LeafNodeType;

using UpperNode = FloatTree::RootNodeType::ChildNodeType;
using LowerNode = UpperNode::ChildNodeType;
static_assert(LowerNode::DIM == kPartCell);

/// Level of the tiles that take the place of a leaf.
constexpr openvdb::Index kLeafTile = 1;

/// A temporary file of leaf values, addressed by the origin of the leaf.
class LeafStore {
 public:
  explicit LeafStore(const fs::path& besides) : target_(besides), name_(besides.string()) {
    open(std::ios::out);
  }

  void put(const LeafBlock& leaf) {
    errno = 0;
    file_.write(reinterpret_cast<const char*>(leaf.buffer().data()), kLeafBytes);
    if (!file_) fail();
    positions_[leaf.origin()] = count_++;
  }

  /// Ends writing and begins reading.
  void beginReading() {
    errno = 0;
    file_.close();
    if (!file_) fail();
    open(std::ios::in);
  }

  /// Fills a leaf with the values stored for its origin.
  void get(LeafBlock& leaf) {
    errno = 0;
    const std::uint64_t at = positions_.at(leaf.origin());
    if (at != next_) file_.seekg(static_cast<std::streamoff>(at) * kLeafBytes);
    leaf.buffer().allocate();
    file_.read(reinterpret_cast<char*>(leaf.buffer().data()), kLeafBytes);
    if (!file_) fail();
    next_ = at + 1;
  }

 private:
  static constexpr std::streamsize kLeafBytes = LeafBlock::SIZE * sizeof(float);

  void open(std::ios::openmode mode) {
    errno = 0;
    file_.open(target_.path(), mode | std::ios::binary);
    if (!file_) fail();
  }
  [[noreturn]] void fail() const {
    throw IoError(fmt::format(
        "the temporary file beside '{}' could not be used: {}; free disk space or write to another "
        "disk",
        name_, std::generic_category().message(errno != 0 ? errno : EIO)));
  }

  FileTarget target_;  // never committed, so the file is removed with this object
  std::string name_;
  std::fstream file_;
  std::map<Coord, std::uint64_t> positions_;
  std::uint64_t count_ = 0, next_ = 0;
};

/// A grid whose leaves have no values in memory. Values are read from a LeafStore while the grid is
/// written.
class StoredGrid : public FloatGrid {
 public:
  StoredGrid(const FloatTree::Ptr& tree, LeafStore& store, std::uint64_t& hash)
      : FloatGrid(tree), store_(store), hash_(hash) {}

  /// Memory of the grid with its values. It is written to the file.
  [[nodiscard]] openvdb::Index64 memUsage() const override {
    return openvdb::tools::memUsageIfLoaded(tree());
  }

  /// Adds the metadata that OpenVDB's writer adds: the statistics, and the sizes of the compressed
  /// leaves, which let a reader load leaves later.
  void addStatistics(const Progress& progress) {
    namespace io = openvdb::io;
    const std::uint32_t compression = vdbCompression();
    addStatsMetadata();
    insertMeta(META_FILE_COMPRESSION,
               openvdb::StringMetadata(io::compressionToString(compression)));
    const openvdb::Index32 count = tree().leafCount();
    auto sizes = std::make_shared<io::DelayedLoadMetadata>();
    sizes->resizeMask(count);
    const bool isCompressed = (compression & (io::COMPRESS_BLOSC | io::COMPRESS_ZIP)) != 0;
    if (isCompressed) sizes->resizeCompressedSize(count);
    std::size_t i = 0;
    for (auto leaf = tree().cbeginLeaf(); leaf; ++leaf, ++i) {
      constexpr std::size_t kReportInterval = 4096;  // leaves
      if (i % kReportInterval == 0) report(progress, static_cast<double>(i) / count);
      LeafBlock full(*leaf);
      store_.get(full);
      using Mask = LeafBlock::NodeMaskType;
      const io::MaskCompress<float, Mask> mask(full.valueMask(), Mask(), full.buffer().data(),
                                               tree().background());
      sizes->setMask(i, mask.metadata);
      if (!isCompressed) continue;
      const std::size_t bytes =
          io::writeCompressedValuesSize(full.buffer().data(), LeafBlock::SIZE, full.valueMask(),
                                        mask.metadata, false, compression);
      sizes->setCompressedSize(i, static_cast<std::int64_t>(sizeof(std::int64_t) + bytes));
    }
    insertMeta(META_FILE_DELAYED_LOAD, *sizes);
  }

  void writeBuffers(std::ostream& out) const override {
    hash_ = hashOfHeader(*this);
    for (auto leaf = tree().cbeginLeaf(); leaf; ++leaf) {
      LeafBlock full(*leaf);
      store_.get(full);
      full.writeBuffers(out, false);
      hash_ = mixLeaf(hash_, full);
    }
    hash_ = mixTiles(hash_, *this);
  }

 private:
  LeafStore& store_;
  std::uint64_t& hash_;
};

/// Members of BandPartsWriter.
struct WriterState {
  WriterState(fs::path target, WriteBandOptions settings)
      : path(std::move(target)), options(std::move(settings)), store(std::in_place, path) {}

  fs::path path;
  WriteBandOptions options;
  std::optional<LeafStore> store;  // empty after commit()
  FloatTree::Ptr topology;         // leaves without values
  openvdb::math::Transform::Ptr transform;
  // By the origin of a cell with leaves: true if its first and its last grid point are inside.
  std::map<Coord, std::pair<bool, bool>> signs;
  std::size_t activeVoxels = 0;

  void begin(const FloatGrid& part) {
    if (!topology) {
      topology = std::make_shared<FloatTree>(part.background());
      transform = part.transform().copy();
    }
    if (part.background() != topology->background() || part.transform() != *transform)
      throw InvalidInput(
          "the parts of a band differ in voxel size, position or half width; write bands of one "
          "grid");
  }

  void addLeaves(const FloatTree& part, const CoordBBox& box) {
    for (auto leaf = part.cbeginLeaf(); leaf; ++leaf) {
      if (!box.isInside(leaf->origin())) continue;
      store->put(*leaf);
      auto copy = std::make_unique<LeafBlock>(openvdb::PartialCreate(), leaf->origin(),
                                              topology->background());
      copy->setValueMask(leaf->valueMask());
      activeVoxels += leaf->onVoxelCount();
      topology->addLeaf(copy.release());
    }
  }

  /// Copies the negative tiles within the cells that have leaves, and the signs at two corners of
  /// these cells.
  void addTiles(const FloatTree& part, const CoordBBox& box) {
    std::vector<const LowerNode*> cells;
    topology->getNodes(cells);
    const openvdb::tree::ValueAccessor<const FloatTree> values(part);
    for (const LowerNode* cell : cells) {
      const Coord origin = cell->origin();
      if (!box.isInside(origin)) continue;
      signs[origin] = {values.getValue(origin) < 0,
                       values.getValue(origin.offsetBy(kPartCell - 1)) < 0};
      for (auto empty = cell->cbeginChildOff(); empty; ++empty)
        if (values.getValue(empty.getCoord()) < 0)
          topology->addTile(kLeafTile, empty.getCoord(), -topology->background(), false);
    }
  }

  /// Sets the signs of the cells without leaves. Along each axis a cell continues the sign of the
  /// cell before it, as in openvdb::tools::signedFloodFill().
  void fillInside() {
    std::vector<UpperNode*> nodes;
    topology->getNodes(nodes);
    for (UpperNode* node : nodes) fillInside(*node);
    std::map<Coord, const UpperNode*> inOrder;
    for (const UpperNode* node : nodes) inOrder.emplace(node->origin(), node);
    const UpperNode* before = nullptr;
    for (const auto& [origin, node] : inOrder) {
      if (before && origin.x() == before->origin().x() && origin.y() == before->origin().y() &&
          isInside(before->origin().offsetBy(UpperNode::DIM - kPartCell), true) &&
          isInside(origin, false)) {
        for (Coord at = before->origin().offsetBy(0, 0, UpperNode::DIM); at < origin;
             at.z() += UpperNode::DIM)
          topology->addTile(FloatTree::DEPTH - 1, at, -topology->background(), false);
      }
      before = node;
    }
  }

  void fillInside(UpperNode& node) {
    constexpr int kLog = UpperNode::LOG2DIM, kSide = 1 << kLog;
    const auto& children = node.getChildMask();
    const openvdb::Index first = children.findFirstOn();
    if (first >= UpperNode::NUM_VALUES) return;
    const auto follow = [&](int at, bool inside) {
      const auto n = static_cast<openvdb::Index>(at);
      return children.isOn(n) ? isInside(node.offsetToGlobalCoord(n), true) : inside;
    };
    bool alongX = isInside(node.offsetToGlobalCoord(first), false);
    for (int x = 0; x < kSide; ++x) {
      alongX = follow(x << 2 * kLog, alongX);
      bool alongY = alongX;
      for (int y = 0; y < kSide; ++y) {
        const int row = (x << 2 * kLog) + (y << kLog);
        alongY = follow(row, alongY);
        bool alongZ = alongY;
        for (int z = 0; z < kSide; ++z) {
          alongZ = follow(row + z, alongZ);
          const auto n = static_cast<openvdb::Index>(row + z);
          if (alongZ && !children.isOn(n)) node.addTile(n, -topology->background(), false);
        }
      }
    }
  }

  /// Returns the sign at the first or last grid point of a cell.
  [[nodiscard]] bool isInside(const Coord& cell, bool last) const {
    const auto found = signs.find(cell);
    if (found == signs.end()) return topology->getValue(cell) < 0;
    return last ? found->second.second : found->second.first;
  }
};

}  // namespace band_parts

struct BandPartsWriter::Impl : band_parts::WriterState {
  using WriterState::WriterState;
};

BandPartsWriter::BandPartsWriter(const std::filesystem::path& path,
                                 const WriteBandOptions& options) {
  if (!isVdbFormat(options.format.empty() ? path : std::filesystem::path(options.format)))
    throw UsageError(
        fmt::format("'{}' cannot be written in parts, since only .vdb files can; end the name in "
                    ".vdb",
                    path.string()));
  impl_ = std::make_unique<Impl>(path, options);
}

BandPartsWriter::~BandPartsWriter() = default;

void BandPartsWriter::add(const NarrowBand& part, const Imath::Box3i& cells) {
  if (!part.shared()) return;
  requireSolid(part);
  const openvdb::CoordBBox box(cells.min.x, cells.min.y, cells.min.z, cells.max.x, cells.max.y,
                               cells.max.z);
  impl_->begin(vdb(part));
  impl_->addLeaves(vdb(part).tree(), box);
  impl_->addTiles(vdb(part).tree(), box);
}

std::size_t BandPartsWriter::activeVoxelCount() const {
  return impl_->activeVoxels;
}

void BandPartsWriter::commit() {
  Impl& all = *impl_;
  if (!all.topology)
    throw InvalidInput(
        fmt::format("there is no band to write to '{}'; create one first", all.path.string()));
  all.fillInside();
  all.store->beginReading();
  std::uint64_t hash = 0;
  const auto grid = std::make_shared<band_parts::StoredGrid>(all.topology, *all.store, hash);
  nameGrid(*grid, *all.transform, all.options.name, openvdb::GRID_LEVEL_SET);
  grid->addStatistics(subProgress(all.options.progress, 0, 0.5));
  writeTarget(all.path, [&](const std::filesystem::path& target) {
    writeVdb(
        target, static_cast<double>(grid->memUsage()),
        [&](std::ostream& out) { writeGridWithItsMetadata(out, *grid); }, [&] { return hash; },
        subProgress(all.options.progress, 0.5, 1));
  });
  all.store.reset();
}

}  // namespace levelset
