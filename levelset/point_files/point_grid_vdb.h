#pragma once

// For the .cpp files of this library only.

#include <fmt/core.h>
#include <openvdb/points/StreamCompression.h>

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "levelset/files/values_vdb.h"

namespace levelset::point_files {

inline constexpr openvdb::Index kPointLeafVoxels = 512;

/// PointAttribute of the points of a leaf, as the descriptor names it.
struct PointAttribute {
  std::string name, type, codec;
};
struct PointDescriptor {
  std::vector<PointAttribute> attributes;
  bool hasGroups = false;
};

/// Values of one attribute in one leaf.
struct PointArray {
  std::uint64_t bytes = 0;  ///< in memory; in the file, if they are not in pages
  std::uint32_t size = 0, stride = 1;
  unsigned flags = 0;
  std::uint32_t page = 0, at = 0;  ///< number of the page, and byte offset there
  std::size_t position = 0;        ///< in the file, if the values are not in pages
  bool isCompressed = false;       ///< if they are not in pages
};

struct PointLeaf {
  openvdb::Coord origin;
  const PointDescriptor* descriptor = nullptr;
  std::vector<PointArray> arrays = {};
  std::size_t voxels = 0;  ///< position of the offsets of the voxels in the file
};

/// Block of the values of several leaves.
struct PointPage {
  std::size_t position = 0, stored = 0, size = 0;
  bool isCompressed = false;
};

/// Reads the layout of a grid of points, and its values on demand. The layout follows
/// PointDataLeafNode::readBuffers, AttributeSet.cc, AttributeArray.h and StreamCompression.cc in
/// OpenVDB's points/.
class PointGridReader {
 public:
  PointGridReader(VdbBytes& bytes, const VdbEntry& entry, std::function<void(double)> requireMemory)
      : bytes_(bytes), entry_(entry), requireMemory_(std::move(requireMemory)) {
    readTopology();
    if (!leaves_.empty()) readLayout();
  }

  [[nodiscard]] const std::vector<PointLeaf>& leaves() const { return leaves_; }
  [[nodiscard]] const std::vector<std::unique_ptr<PointDescriptor>>& descriptors() const {
    return descriptors_;
  }

  /// Number of the first point behind each voxel.
  [[nodiscard]] std::array<std::uint32_t, kPointLeafVoxels> offsets(const PointLeaf& leaf) {
    std::array<std::uint32_t, kPointLeafVoxels> offsets;
    VdbBytes at = bytes_;
    at.seek(leaf.voxels);
    const auto stored = at.value<std::uint16_t>();
    if (stored == 0xffff) {
      std::memcpy(offsets.data(), at.take(sizeof offsets), sizeof offsets);
    } else {
      const std::vector<char> plain = inflated(at, at.take(stored), stored, sizeof offsets);
      std::memcpy(offsets.data(), plain.data(), sizeof offsets);
    }
    std::uint32_t last = 0;
    for (const std::uint32_t end : offsets) {
      if (end < last) at.fail("the points of a leaf are not in order");
      last = end;
    }
    return offsets;
  }

  /// Returns the values of the n-th attribute in a leaf, and the number of bytes from one to the
  /// next: 0 if all are equal. They stay valid until the next call.
  [[nodiscard]] std::pair<const char*, std::size_t> values(std::size_t n, const PointArray& array,
                                                           std::size_t bytesPerValue) {
    if (array.stride != 1) bytes_.fail("an attribute has several values for each point");
    const bool isUniform = (array.flags & kUniform) != 0;
    const char* first = valuesOf(n, array, bytesPerValue * (isUniform ? 1 : array.size));
    return {first, isUniform ? 0 : bytesPerValue};
  }

 private:
  /// Serialization flags of an attribute.
  static constexpr unsigned kStrided = 1, kUniform = 2, kPaged = 8, kKnownFlags = 15;

  // === Topology

  void readTopology() {
    using Root = openvdb::UInt32Tree::RootNodeType;
    if (bytes_.value<std::int32_t>() != 1)
      bytes_.fail("a tree has an unsupported number of buffers");
    storage_ = {entry_.compression, false, bytes_.value<std::uint32_t>()};
    const auto tiles = bytes_.value<std::uint32_t>(), children = bytes_.value<std::uint32_t>();
    constexpr std::size_t kTileSize = 17;
    if (tiles > bytes_.remaining() / kTileSize)
      bytes_.fail(
          fmt::format("the root of a tree promises {} tiles, which the file cannot hold", tiles));
    static_cast<void>(bytes_.take(tiles * kTileSize));
    std::set<openvdb::Coord> seen;
    for (std::uint32_t i = 0; i < children; ++i) {
      openvdb::Coord origin;
      for (int axis = 0; axis < 3; ++axis) origin[axis] = bytes_.value<std::int32_t>();
      constexpr int kMask = static_cast<int>(Root::ChildNodeType::DIM) - 1;
      if ((origin & kMask) != openvdb::Coord(0))
        bytes_.fail("the origin of a node is not a multiple of its size");
      if (!seen.insert(origin).second) bytes_.fail("two nodes have the same origin");
      readNode<Root::ChildNodeType>(origin);
    }
  }

  template <typename Node>
  void readNode(const openvdb::Coord& origin) {
    using Mask = typename Node::NodeMaskType;
    if constexpr (Node::LEVEL == 0) {
      static_cast<void>(takeMask<Mask>(bytes_));
      leaves_.push_back({origin});
    } else {
      const auto children = takeMask<Mask>(bytes_), active = takeMask<Mask>(bytes_);
      static_cast<void>(takeValues<std::uint32_t, Mask>(bytes_, storage_, active));
      for (auto it = children.beginOn(); it; ++it) {
        openvdb::Coord local;
        Node::offsetToLocalCoord(it.pos(), local);
        readNode<typename Node::ChildNodeType>(
            origin + (local << static_cast<std::size_t>(Node::ChildNodeType::TOTAL)));
      }
    }
  }

  // === Layout: the file holds one quantity of all leaves after the other.

  void readLayout() {
    const auto passes = bytes_.value<std::uint16_t>();
    if (passes < 4 || passes % 2 != 0)
      bytes_.fail(fmt::format("a grid of points has {} parts", passes));
    const std::size_t attributes = (passes - 4) / 2u;
    requireMemory_(static_cast<double>(leaves_.size()) *
                   static_cast<double>(sizeof(PointLeaf) + attributes * sizeof(PointArray)));
    static_cast<void>(bytes_.take(leaves_.size() * sizeof(std::uint16_t)));
    const PointDescriptor* shared = nullptr;
    for (PointLeaf& leaf : leaves_) {
      if (shared) {
        leaf.descriptor = shared;
      } else {
        const auto header = bytes_.value<std::uint8_t>();
        if (header > 3) bytes_.fail("a leaf of points has an unknown header");
        descriptors_.push_back(std::make_unique<PointDescriptor>(readDescriptor()));
        leaf.descriptor = descriptors_.back().get();
        if (header & 1) shared = leaf.descriptor;
        if (header & 2) {
          const auto skipped = bytes_.value<std::uint64_t>();
          static_cast<void>(bytes_.take(skipped));
        }
      }
      if (leaf.descriptor->attributes.size() > attributes)
        bytes_.fail("a leaf has more attributes than its grid");
      for (std::size_t i = 0; i < leaf.descriptor->attributes.size(); ++i)
        leaf.arrays.push_back(readArray());
    }
    pages_.resize(attributes);
    for (std::size_t n = 0; n < attributes; ++n) readPageSizes(n);
    for (PointLeaf& leaf : leaves_) {
      static_cast<void>(bytes_.take(kPointLeafVoxels / 8));
      leaf.voxels = bytes_.position();
      const auto stored = bytes_.value<std::uint16_t>();
      static_cast<void>(
          bytes_.take(stored == 0xffff ? kPointLeafVoxels * sizeof(std::uint32_t) : stored));
    }
    for (std::size_t n = 0; n < attributes; ++n) locateValues(n);
  }

  PointDescriptor readDescriptor() {
    constexpr std::size_t kLeastBytes = 20;  // of an attribute: three lengths and a number
    const auto count = bytes_.value<std::uint64_t>();
    if (count > bytes_.remaining() / kLeastBytes)
      bytes_.fail(fmt::format("points promise {} attributes, which the file cannot hold", count));
    PointDescriptor descriptor;
    descriptor.attributes.resize(count);
    for (PointAttribute& attribute : descriptor.attributes) {
      attribute.type = bytes_.text();
      attribute.codec = bytes_.text();
    }
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::string_view name = bytes_.text();
      const auto place = bytes_.value<std::uint64_t>();
      if (place >= count) bytes_.fail("an attribute of points has no type");
      descriptor.attributes[place].name = name;
    }
    const auto groups = bytes_.value<std::uint64_t>();
    if (groups > bytes_.remaining() / 12)
      bytes_.fail(fmt::format("points promise {} groups, which the file cannot hold", groups));
    descriptor.hasGroups = groups > 0;
    for (std::uint64_t i = 0; i < groups; ++i) {
      static_cast<void>(bytes_.text());
      static_cast<void>(bytes_.value<std::uint64_t>());
    }
    static_cast<void>(readVdbMetadata(bytes_));
    return descriptor;
  }

  PointArray readArray() {
    PointArray array;
    constexpr std::uint64_t kCounted = 6;  // bytes of the flags and the size
    array.bytes = bytes_.value<std::uint64_t>();
    if (array.bytes < kCounted || array.bytes - kCounted > 0xffffffffu)
      bytes_.fail("an attribute of points has a wrong size");
    array.bytes -= kCounted;
    static_cast<void>(bytes_.value<std::uint8_t>());
    array.flags = bytes_.value<std::uint8_t>();
    if (array.flags > kKnownFlags) bytes_.fail("an attribute of points has an unknown layout");
    array.size = bytes_.value<std::uint32_t>();
    if (array.flags & kStrided) array.stride = bytes_.value<std::uint32_t>();
    return array;
  }

  /// Calls visit(array, isNewPage) for the values of an attribute that are in pages.
  /// @param size  returns the size of the page of an array; called when a new one begins
  template <class BeginPage>
  void walkPages(std::size_t n, const BeginPage& beginPage) {
    std::uint64_t at = 0, size = 0;
    for (PointLeaf& leaf : leaves_) {
      if (n >= leaf.arrays.size()) continue;
      PointArray& array = leaf.arrays[n];
      if (!(array.flags & kPaged)) {
        beginPage(array, false, at);
        continue;
      }
      if (at >= size) {
        size = beginPage(array, true, at);
        at = 0;
      }
      array.at = static_cast<std::uint32_t>(at);
      array.page = static_cast<std::uint32_t>(pages_[n].size() - 1);
      at += array.bytes;
      if (at > size) bytes_.fail("the values of points reach beyond their block");
    }
  }

  void readPageSizes(std::size_t n) {
    walkPages(n, [&](PointArray&, bool isNew, std::uint64_t) -> std::uint64_t {
      if (!isNew) return 0;
      PointPage page;
      const auto stored = bytes_.value<std::int32_t>();
      page.isCompressed = stored > 0;
      page.stored = static_cast<std::size_t>(std::abs(static_cast<std::int64_t>(stored)));
      const std::int64_t size =
          page.isCompressed ? bytes_.value<std::int32_t>() : static_cast<std::int64_t>(page.stored);
      if (size < 0) bytes_.fail("a block of points has a negative size");
      page.size = static_cast<std::size_t>(size);
      pages_[n].push_back(page);
      return page.size;
    });
  }

  void locateValues(std::size_t n) {
    std::size_t next = 0;
    for (PointLeaf& leaf : leaves_) {
      if (n >= leaf.arrays.size()) continue;
      PointArray& array = leaf.arrays[n];
      if (array.flags & kPaged) {
        if (next > array.page) continue;
        PointPage& page = pages_[n][array.page];
        page.position = bytes_.position();
        static_cast<void>(bytes_.take(page.stored));
        next = array.page + std::size_t{1};
      } else {
        if (!(array.flags & kUniform)) array.isCompressed = bytes_.value<std::uint8_t>() == 1;
        array.position = bytes_.position();
        static_cast<void>(bytes_.take(array.bytes));
      }
    }
  }

  // === Values

  /// Decompresses a block by Blosc. OpenVDB pads short blocks to kPadded bytes.
  static std::vector<char> inflated(const VdbBytes& at, const char* data, std::size_t stored,
                                    std::size_t size) {
    constexpr std::size_t kPadded = 128, kHeaderSize = 16;
    std::uint32_t plain = 0, packed = 0;
    if (stored >= kHeaderSize) {
      std::memcpy(&plain, data + 4, 4);
      std::memcpy(&packed, data + 12, 4);
    }
    if (packed != stored || (plain != size && !(size < kPadded && plain == kPadded)))
      at.fail("the header of a compressed block states a wrong size");
    try {
      const std::unique_ptr<char[]> result =
          openvdb::compression::bloscDecompress(data, size, false);
      if (result) return {result.get(), result.get() + size};
    } catch (const openvdb::Exception&) {
    }
    at.fail("a block of points cannot be decompressed");
  }

  const char* valuesOf(std::size_t n, const PointArray& array, std::size_t expected) {
    if (array.flags & kPaged) {
      if (array.bytes != expected) bytes_.fail("an attribute of points has a wrong size");
      const PointPage& page = pages_[n][array.page];
      if (&page != loaded_) {
        requireMemory_(static_cast<double>(page.size));
        VdbBytes at = bytes_;
        at.seek(page.position);
        const char* data = at.take(page.stored);
        values_ = page.isCompressed ? inflated(at, data, page.stored, page.size)
                                    : std::vector<char>(data, data + page.stored);
        loaded_ = &page;
      }
      return values_.data() + array.at;
    }
    VdbBytes at = bytes_;
    at.seek(array.position);
    if (!array.isCompressed) {
      if (array.bytes != expected) bytes_.fail("an attribute of points has a wrong size");
      return at.take(expected);
    }
    requireMemory_(static_cast<double>(expected));
    loaded_ = nullptr;
    values_ = inflated(at, at.take(array.bytes), array.bytes, expected);
    return values_.data();
  }

  VdbBytes& bytes_;
  const VdbEntry& entry_;
  std::function<void(double)> requireMemory_;
  Storage<std::uint32_t> storage_{};
  std::vector<PointLeaf> leaves_;
  std::vector<std::unique_ptr<PointDescriptor>> descriptors_;
  std::vector<std::vector<PointPage>> pages_;  ///< pages of each attribute
  const PointPage* loaded_ = nullptr;
  std::vector<char> values_;
};

}  // namespace levelset::point_files
