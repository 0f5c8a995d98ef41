#include <fmt/core.h>
#include <openvdb/io/Compression.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <istream>
#include <limits>
#include <memory>
#include <set>
#include <vector>

#include "levelset/error.h"
#include "levelset/files/values_vdb.h"
#include "levelset/progress.h"
#include "levelset/progress_gate.h"

// The layout follows readTopology and readBuffers in OpenVDB's tree/*.h and
// io::readCompressedValues, format 222 and later.

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::Index;

void unpack(const VdbBytes& bytes, const char* data, std::size_t size, std::uint32_t compression,
            char* out, std::size_t outSize) {
  namespace io = openvdb::io;
  if (outSize == 0) return;
  MemoryBuffer buffer({data, size});
  std::istream stream(&buffer);
  try {
    if (compression & io::COMPRESS_BLOSC)
      io::bloscFromStream(stream, out, outSize);
    else if (compression & io::COMPRESS_ZIP)
      io::unzipFromStream(stream, out, outSize);
    else
      std::memcpy(out, data, outSize);
  } catch (const openvdb::Exception&) {
    bytes.fail("a block of values cannot be decompressed");
  }
}

/// Fills in all values of a node: those stored in the file, and ValueBlock::inactive for inactive
/// values that are not stored.
template <typename T, typename Mask>
void expand(const VdbBytes& bytes, const ValueBlock<T, Mask>& block, const Storage<T>& storage,
            const Mask& active, T* values) {
  std::vector<T> stored(block.count);
  if (storage.half) {
    std::vector<openvdb::math::half> halves(kComponents<T> * block.count);
    unpack(bytes, block.data, block.size, storage.compression,
           reinterpret_cast<char*>(halves.data()), 2 * halves.size());
    for (std::size_t i = 0; i < stored.size(); ++i)
      stored[i] = fromHalves<T>(halves.data() + kComponents<T> * i);
  } else {
    unpack(bytes, block.data, block.size, storage.compression,
           reinterpret_cast<char*>(stored.data()), sizeof(T) * stored.size());
  }
  if (!block.activeOnly) {
    std::copy(stored.begin(), stored.end(), values);
    return;
  }
  std::size_t next = 0;
  for (Index i = 0; i < Mask::SIZE; ++i)
    values[i] = active.isOn(i) ? stored[next++] : block.inactive[block.selection.isOn(i) ? 1 : 0];
}

/// Reads a tree from the root down, then the values of its leaves.
template <typename TreeT>
class TreeReader {
  using T = typename TreeT::ValueType;
  using Root = typename TreeT::RootNodeType;
  using Leaf = typename TreeT::LeafNodeType;

 public:
  TreeReader(VdbBytes& bytes, const VdbEntry& entry, const VdbTreeLimits& limits)
      : bytes_(bytes),
        storage_{entry.compression, entry.half, openvdb::zeroVal<T>()},
        limits_(limits) {}

  typename TreeT::Ptr read() {
    auto tree = std::make_shared<TreeT>();
    readRoot(tree->root());
    if (limits_.visit) return tree;
    const std::vector<std::size_t> offsets = skipLeafValues();
    std::erase(leaves_, nullptr);
    ProgressGate gate(limits_.progress, leaves_.size());
    tbb::parallel_for(std::size_t{0}, leaves_.size(), [&](std::size_t i) {
      VdbBytes at = bytes_;
      at.seek(offsets[i]);
      readLeafValues(at, *leaves_[i]);
      constexpr std::size_t kReportInterval = 64;  // leaves between two reports
      if (i % kReportInterval == 0) gate.advance(std::min(kReportInterval, leaves_.size() - i));
    });
    return tree;
  }

  /// Skips the tree: only advances `bytes`.
  void skip() {
    countOnly_ = true;
    TreeT tree;
    readRoot(tree.root());
    static_cast<void>(skipLeafValues());
  }

 private:
  /// Adds the bytes of a node to the memory of the tree and checks the limit. A damaged file cannot
  /// claim nodes without end, because each node also takes bytes of the file.
  void countMemory(std::size_t size) {
    memory_ += static_cast<double>(size);
    if (memory_ > static_cast<double>(limits_.maxMemory)) requireMemory(memory_, limits_.maxMemory);
  }

  void readRoot(Root& root) {
    if (bytes_.value<std::int32_t>() != 1)
      bytes_.fail("a tree has an unsupported number of buffers");
    storage_.background = bytes_.value<T>();
    root.setBackground(storage_.background, false);
    const auto tiles = bytes_.value<std::uint32_t>(), children = bytes_.value<std::uint32_t>();
    constexpr std::size_t kTileSize = 3 * sizeof(std::int32_t) + sizeof(T) + 1;
    if (tiles > bytes_.remaining() / kTileSize)
      bytes_.fail(
          fmt::format("the root of a tree promises {} tiles, which the file cannot hold", tiles));
    std::set<Coord> seen;
    for (std::uint32_t i = 0; i < tiles; ++i) {
      const Coord origin = takeOrigin<typename Root::ChildNodeType>(seen);
      const T value = bytes_.value<T>();
      const bool active = bytes_.value<std::uint8_t>() != 0;
      const bool isRead = active && isNeeded<typename Root::ChildNodeType>(origin);
      if (isRead) countTile(Root::ChildNodeType::TOTAL * 3);
      root.addTile(origin, value, isRead);
    }
    for (std::uint32_t i = 0; i < children; ++i) {
      const Coord origin = takeOrigin<typename Root::ChildNodeType>(seen);
      root.addChild(readNode<typename Root::ChildNodeType>(origin).release());
    }
  }

  template <typename Node>
  Coord takeOrigin(std::set<Coord>& seen) {
    Coord origin;
    for (int axis = 0; axis < 3; ++axis) origin[axis] = bytes_.value<std::int32_t>();
    const int mask = static_cast<int>(Node::DIM) - 1;
    if ((origin & mask) != Coord(0))
      bytes_.fail("the origin of a node is not a multiple of its size");
    if (!seen.insert(origin).second) bytes_.fail("two nodes have the same origin");
    return origin;
  }

  /// Returns true if a node at `origin` intersects the requested region.
  template <typename Node>
  [[nodiscard]] bool isNeeded(const Coord& origin) const {
    return !limits_.region ||
           limits_.region->hasOverlap(openvdb::CoordBBox::createCube(origin, Node::DIM));
  }

  /// Adds the memory that an active tile takes after importBand() has split it into voxels. Fields
  /// keep their tiles, so nothing is added for them.
  void countTile(Index log2VoxelCount) {
    if (limits_.keepsTiles) return;
    const double leaves = std::ldexp(1.0, static_cast<int>(log2VoxelCount)) / Leaf::SIZE;
    memory_ += leaves * static_cast<double>(sizeof(Leaf) + Leaf::SIZE * sizeof(T));
    countMemory(0);
  }

  template <typename Node>
  std::unique_ptr<Node> readNode(const Coord& origin) {
    if constexpr (Node::LEVEL == 0) {
      if (limits_.visit) limits_.visit(origin);
      if (limits_.visit || !isNeeded<Node>(origin)) {
        static_cast<void>(takeMask<typename Node::NodeMaskType>(bytes_));
        leaves_.push_back(nullptr);
        return nullptr;
      }
      auto leaf = std::make_unique<Node>(openvdb::PartialCreate(), origin, storage_.background);
      leaf->setValueMask(takeMask<typename Node::NodeMaskType>(bytes_));
      if (!countOnly_) countMemory(sizeof(Node) + Node::SIZE * sizeof(T));
      leaves_.push_back(leaf.get());
      return leaf;
    } else {
      return readInternal<Node>(origin);
    }
  }

  template <typename Node>
  std::unique_ptr<Node> readInternal(const Coord& origin) {
    using Mask = typename Node::NodeMaskType;
    const auto children = takeMask<Mask>(bytes_), active = takeMask<Mask>(bytes_);
    countMemory(sizeof(Node));
    const auto block = takeValues<T, Mask>(bytes_, storage_, active);
    std::vector<T> values(Node::NUM_VALUES);
    expand(bytes_, block, storage_, active, values.data());
    auto node = std::make_unique<Node>(origin, storage_.background, false);
    for (Index i = 0; i < Node::NUM_VALUES; ++i) {
      if (children.isOn(i)) continue;
      using Child = typename Node::ChildNodeType;
      const bool isRead = active.isOn(i) && isNeeded<Child>(node->offsetToGlobalCoord(i));
      node->addTile(i, values[i], isRead);
      if (isRead) countTile(3 * Child::TOTAL);
    }
    for (auto it = children.beginOn(); it; ++it) {
      const Coord childOrigin = node->offsetToGlobalCoord(it.pos());
      if (auto child = readNode<typename Node::ChildNodeType>(childOrigin))
        node->addChild(child.release());
    }
    return node;
  }

  /// Skips the values of all leaves. Returns the byte offset of the values of each leaf that is
  /// read.
  std::vector<std::size_t> skipLeafValues() {
    std::vector<std::size_t> offsets;
    offsets.reserve(leaves_.size());
    for (std::size_t i = 0; i < leaves_.size(); ++i) {
      if (leaves_[i]) offsets.push_back(bytes_.position());
      if (limits_.passed) limits_.passed(bytes_.position());
      const auto active = takeMask<typename Leaf::NodeMaskType>(bytes_);
      static_cast<void>(takeValues<T, typename Leaf::NodeMaskType>(bytes_, storage_, active));
    }
    return offsets;
  }

  void readLeafValues(VdbBytes& at, Leaf& leaf) const {
    using Mask = typename Leaf::NodeMaskType;
    const auto active = takeMask<Mask>(at);
    const auto block = takeValues<T, Mask>(at, storage_, active);
    leaf.setValueMask(active);
    leaf.buffer().allocate();
    expand(at, block, storage_, active, leaf.buffer().data());
  }

  VdbBytes& bytes_;
  Storage<T> storage_;
  VdbTreeLimits limits_;
  double memory_ = 0;
  bool countOnly_ = false;
  std::vector<Leaf*> leaves_;
};

/// Converts a tree of double vectors to float vectors; OpenVDB has no such conversion.
openvdb::Vec3STree::Ptr narrowed(const openvdb::Vec3DTree& wide) {
  using Leaf = openvdb::Vec3STree::LeafNodeType;
  auto tree = std::make_shared<openvdb::Vec3STree>(openvdb::Vec3s(wide.background()));
  auto tile = wide.cbeginValueAll();
  tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
  for (; tile; ++tile)
    tree->addTile(tile.getLevel(), tile.getCoord(), openvdb::Vec3s(*tile), tile.isValueOn());
  for (auto leaf = wide.cbeginLeaf(); leaf; ++leaf) {
    auto copy = std::make_unique<Leaf>(leaf->origin());
    for (Index i = 0; i < Leaf::SIZE; ++i) copy->setValueOnly(i, openvdb::Vec3s(leaf->getValue(i)));
    copy->setValueMask(leaf->valueMask());
    tree->addLeaf(copy.release());
  }
  return tree;
}

}  // namespace

openvdb::FloatTree::Ptr readVdbTree(std::string_view file, const std::string& name,
                                    const VdbEntry& entry, const VdbTreeLimits& limits) {
  VdbBytes bytes(file, name);
  bytes.seek(entry.treePosition);
  if (hasFloatTree(entry)) return TreeReader<openvdb::FloatTree>(bytes, entry, limits).read();
  const auto wide = TreeReader<openvdb::DoubleTree>(bytes, entry, limits).read();
  return std::make_shared<openvdb::FloatTree>(*wide);
}

openvdb::Vec3STree::Ptr readVdbVectorTree(std::string_view file, const std::string& name,
                                          const VdbEntry& entry, const VdbTreeLimits& limits) {
  VdbBytes bytes(file, name);
  bytes.seek(entry.treePosition);
  if (entry.type == openvdb::Vec3STree::treeType())
    return TreeReader<openvdb::Vec3STree>(bytes, entry, limits).read();
  return narrowed(*TreeReader<openvdb::Vec3DTree>(bytes, entry, limits).read());
}

double readVdbBackground(std::string_view file, const std::string& name, const VdbEntry& entry) {
  VdbBytes bytes(file, name);
  bytes.seek(entry.treePosition + sizeof(std::int32_t));  // after the number of buffers
  return hasFloatTree(entry) ? static_cast<double>(bytes.value<float>()) : bytes.value<double>();
}

void skipVdbTree(VdbBytes& bytes, const VdbEntry& entry) {
  if (hasFloatTree(entry))
    TreeReader<openvdb::FloatTree>(bytes, entry, {}).skip();
  else if (hasDoubleTree(entry))
    TreeReader<openvdb::DoubleTree>(bytes, entry, {}).skip();
  else if (entry.type == openvdb::Vec3STree::treeType())
    TreeReader<openvdb::Vec3STree>(bytes, entry, {}).skip();
  else
    TreeReader<openvdb::Vec3DTree>(bytes, entry, {}).skip();
}

}  // namespace levelset
