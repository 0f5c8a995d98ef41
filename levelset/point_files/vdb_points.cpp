#include <fmt/core.h>
#include <openvdb/math/QuantizedUnitVec.h>
#include <openvdb/points/StreamCompression.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <span>
#include <utility>

#include "levelset/error.h"
#include "levelset/files/values_vdb.h"
#include "levelset/point_files/cloud_builder.h"

// The layout follows PointDataLeafNode::readBuffers, AttributeSet.cc, AttributeArray.h and
// StreamCompression.cc in OpenVDB's points/.

namespace levelset::point_files {
namespace {

using openvdb::Coord;
using openvdb::Index;

constexpr std::string_view kPointTree = "Tree_ptdataidx32_5_4_3";
constexpr Index kLeafVoxels = 512;
/// Serialization flags of an attribute.
constexpr unsigned kStrided = 1, kUniform = 2, kPaged = 8, kKnownFlags = 15;

bool isPoints(const VdbEntry& entry) {
  return entry.type == kPointTree;
}

std::string listOfPoints(const std::vector<VdbEntry>& entries) {
  std::string list;
  for (const VdbEntry& entry : entries)
    list += fmt::format("{}'{}' ({})", list.empty() ? "" : ", ", entry.name,
                        isPoints(entry) ? "points" : entry.type);
  return list.empty() ? "nothing" : list;
}

const VdbEntry& choosePoints(const std::vector<VdbEntry>& entries, const std::string& wanted,
                             const std::string& file) {
  const VdbEntry* chosen = nullptr;
  for (const VdbEntry& entry : entries) {
    if (!isPoints(entry) || (!wanted.empty() && entry.name != wanted)) continue;
    if (chosen)
      throw InvalidInput(
          fmt::format("{} holds more than one grid of points{}: {}; {}", file,
                      wanted.empty() ? "" : " of that name", listOfPoints(entries),
                      wanted.empty() ? "choose one with --grid" : "write them to separate files"));
    chosen = &entry;
  }
  if (!chosen)
    throw InvalidInput(
        fmt::format("{} holds {}, but no grid of points{}; {}", file, listOfPoints(entries),
                    wanted.empty() ? "" : fmt::format(" '{}'", wanted),
                    wanted.empty() ? "read another file, or this one without --points"
                                   : "choose another one with --grid"));
  return *chosen;
}

// Names of attributes, as Houdini and OpenVDB's tools use them.
constexpr std::string_view kPosition[] = {"P"}, kNormal[] = {"N"}, kColor[] = {"Cd"},
                           kAlpha[] = {"Alpha"}, kRadius[] = {"pscale", "radius"},
                           kWeight[] = {"weight", "confidence"};

/// Attribute of the points of a leaf, as the descriptor names it.
struct Attribute {
  std::string name, type, codec;
};
struct Descriptor {
  std::vector<Attribute> attributes;
  bool hasGroups = false;
};

/// Values of one attribute in one leaf.
struct Array {
  std::uint64_t bytes = 0;  ///< in memory; in the file, if they are not in pages
  std::uint32_t size = 0, stride = 1;
  unsigned flags = 0;
  std::uint32_t page = 0, at = 0;  ///< number of the page, and byte offset there
  std::size_t position = 0;        ///< in the file, if the values are not in pages
  bool isCompressed = false;       ///< if they are not in pages
};

struct Leaf {
  Coord origin;
  const Descriptor* descriptor = nullptr;
  std::vector<Array> arrays = {};
  std::size_t voxels = 0;  ///< position of the offsets of the voxels in the file
};

/// Block of the values of several leaves.
struct Page {
  std::size_t position = 0, stored = 0, size = 0;
  bool isCompressed = false;
};

/// Reads the layout of a grid of points, and its values on demand.
class PointGridReader {
 public:
  PointGridReader(VdbBytes& bytes, const VdbEntry& entry, std::function<void(double)> requireMemory)
      : bytes_(bytes), entry_(entry), requireMemory_(std::move(requireMemory)) {
    readTopology();
    if (!leaves_.empty()) readLayout();
  }

  [[nodiscard]] const std::vector<Leaf>& leaves() const { return leaves_; }
  [[nodiscard]] const std::vector<std::unique_ptr<Descriptor>>& descriptors() const {
    return descriptors_;
  }

  /// Number of the first point behind each voxel.
  [[nodiscard]] std::array<std::uint32_t, kLeafVoxels> offsets(const Leaf& leaf) {
    std::array<std::uint32_t, kLeafVoxels> offsets;
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
  [[nodiscard]] std::pair<const char*, std::size_t> values(std::size_t n, const Array& array,
                                                           std::size_t bytesPerValue) {
    if (array.stride != 1) bytes_.fail("an attribute has several values for each point");
    const bool isUniform = (array.flags & kUniform) != 0;
    const char* first = valuesOf(n, array, bytesPerValue * (isUniform ? 1 : array.size));
    return {first, isUniform ? 0 : bytesPerValue};
  }

 private:
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
    std::set<Coord> seen;
    for (std::uint32_t i = 0; i < children; ++i) {
      Coord origin;
      for (int axis = 0; axis < 3; ++axis) origin[axis] = bytes_.value<std::int32_t>();
      constexpr int kMask = static_cast<int>(Root::ChildNodeType::DIM) - 1;
      if ((origin & kMask) != Coord(0))
        bytes_.fail("the origin of a node is not a multiple of its size");
      if (!seen.insert(origin).second) bytes_.fail("two nodes have the same origin");
      readNode<Root::ChildNodeType>(origin);
    }
  }

  template <typename Node>
  void readNode(const Coord& origin) {
    using Mask = typename Node::NodeMaskType;
    if constexpr (Node::LEVEL == 0) {
      static_cast<void>(takeMask<Mask>(bytes_));
      leaves_.push_back({origin});
    } else {
      const auto children = takeMask<Mask>(bytes_), active = takeMask<Mask>(bytes_);
      static_cast<void>(takeValues<std::uint32_t, Mask>(bytes_, storage_, active));
      for (auto it = children.beginOn(); it; ++it) {
        Coord local;
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
                   static_cast<double>(sizeof(Leaf) + attributes * sizeof(Array)));
    static_cast<void>(bytes_.take(leaves_.size() * sizeof(std::uint16_t)));
    const Descriptor* shared = nullptr;
    for (Leaf& leaf : leaves_) {
      if (shared) {
        leaf.descriptor = shared;
      } else {
        const auto header = bytes_.value<std::uint8_t>();
        if (header > 3) bytes_.fail("a leaf of points has an unknown header");
        descriptors_.push_back(std::make_unique<Descriptor>(readDescriptor()));
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
    for (Leaf& leaf : leaves_) {
      static_cast<void>(bytes_.take(kLeafVoxels / 8));
      leaf.voxels = bytes_.position();
      const auto stored = bytes_.value<std::uint16_t>();
      static_cast<void>(
          bytes_.take(stored == 0xffff ? kLeafVoxels * sizeof(std::uint32_t) : stored));
    }
    for (std::size_t n = 0; n < attributes; ++n) locateValues(n);
  }

  Descriptor readDescriptor() {
    constexpr std::size_t kLeastBytes = 20;  // of an attribute: three lengths and a number
    const auto count = bytes_.value<std::uint64_t>();
    if (count > bytes_.remaining() / kLeastBytes)
      bytes_.fail(fmt::format("points promise {} attributes, which the file cannot hold", count));
    Descriptor descriptor;
    descriptor.attributes.resize(count);
    for (Attribute& attribute : descriptor.attributes) {
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

  Array readArray() {
    Array array;
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
    for (Leaf& leaf : leaves_) {
      if (n >= leaf.arrays.size()) continue;
      Array& array = leaf.arrays[n];
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
    walkPages(n, [&](Array&, bool isNew, std::uint64_t) -> std::uint64_t {
      if (!isNew) return 0;
      Page page;
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
    for (Leaf& leaf : leaves_) {
      if (n >= leaf.arrays.size()) continue;
      Array& array = leaf.arrays[n];
      if (array.flags & kPaged) {
        if (next > array.page) continue;
        Page& page = pages_[n][array.page];
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

  const char* valuesOf(std::size_t n, const Array& array, std::size_t expected) {
    if (array.flags & kPaged) {
      if (array.bytes != expected) bytes_.fail("an attribute of points has a wrong size");
      const Page& page = pages_[n][array.page];
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
  std::vector<Leaf> leaves_;
  std::vector<std::unique_ptr<Descriptor>> descriptors_;
  std::vector<std::vector<Page>> pages_;  ///< pages of each attribute
  const Page* loaded_ = nullptr;
  std::vector<char> values_;
};

// === Codecs

/// Format of the numbers of an attribute in a file.
struct NumberFormat {
  std::size_t bytes = 0;  ///< size of a number; 0: unsupported
  double (*decode)(const char*) = nullptr;
  bool isUnitVector = false;
  double error = 0;  ///< largest error of a position, voxels
};

template <typename T>
double plainNumber(const char* data) {
  T value;
  std::memcpy(&value, data, sizeof value);
  return static_cast<double>(value);
}
double halfNumber(const char* data) {
  openvdb::math::half value;
  std::memcpy(&value, data, sizeof value);
  return static_cast<double>(static_cast<float>(value));
}
template <typename T, int kShifted>
double fixedNumber(const char* data) {
  return plainNumber<T>(data) / std::numeric_limits<T>::max() - 0.5 * kShifted;
}

// OpenVDB rounds down to fixed-point numbers, so their error is a whole step.
NumberFormat formatOf(const Attribute& attribute, bool isVector) {
  const bool isFloat = attribute.type == (isVector ? "vec3s" : "float");
  if (attribute.codec == "null") {
    if (isFloat) return {4, plainNumber<float>, false, 0x1p-26};
    if (attribute.type == (isVector ? "vec3d" : "double")) return {8, plainNumber<double>};
    return {};
  }
  if (!isFloat) return {};
  if (attribute.codec == "trnc") return {2, halfNumber, false, 0x1p-13};
  if (attribute.codec == "fxpt8") return {1, fixedNumber<std::uint8_t, 1>, false, 1.0 / 0xff};
  if (attribute.codec == "fxpt16") return {2, fixedNumber<std::uint16_t, 1>, false, 1.0 / 0xffff};
  if (attribute.codec == "ufxpt8") return {1, fixedNumber<std::uint8_t, 0>};
  if (attribute.codec == "ufxpt16") return {2, fixedNumber<std::uint16_t, 0>};
  if (attribute.codec == "uvec" && isVector) return {2, nullptr, true};
  return {};
}

Imath::V3d vectorAt(const char* data, const NumberFormat& format) {
  if (format.isUnitVector) {
    std::uint16_t packed = 0;
    std::memcpy(&packed, data, sizeof packed);
    const openvdb::Vec3s v = openvdb::math::QuantizedUnitVec::unpack(packed);
    return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
  }
  return {format.decode(data), format.decode(data + format.bytes),
          format.decode(data + 2 * format.bytes)};
}

std::size_t findAttribute(const Descriptor& descriptor, std::span<const std::string_view> names) {
  for (const std::string_view name : names)
    for (std::size_t i = 0; i < descriptor.attributes.size(); ++i)
      if (descriptor.attributes[i].name == name) return i;
  return std::string::npos;
}

/// Reads the points of a grid into a cloud.
class CloudReader {
 public:
  CloudReader(VdbBytes& bytes, const VdbEntry& entry, CloudBuilder& builder)
      : bytes_(bytes),
        entry_(entry),
        builder_(builder),
        grid_(bytes, entry, [&builder](double more) { builder.requireMore(more); }) {}

  void read() {
    readPositions();
    if (builder_.wantsAttributes()) {
      readAttribute(kNormal, true,
                    [&](const Imath::V3d& v, FilePosition p) { builder_.addNormal(v, p); });
      std::vector<float> alphas;
      if (!presentAttributes().colors.empty())
        readAttribute(kAlpha, false, [&](const Imath::V3d& v, FilePosition) {
          alphas.push_back(static_cast<float>(v.x));
        });
      std::size_t next = 0;
      readAttribute(kColor, true, [&](const Imath::V3d& v, FilePosition p) {
        const float alpha = alphas.empty() ? 1 : alphas[next++];
        builder_.addColor(Imath::V4f(static_cast<float>(v.x), static_cast<float>(v.y),
                                     static_cast<float>(v.z), alpha),
                          p);
      });
      readAttribute(kRadius, false,
                    [&](const Imath::V3d& v, FilePosition p) { builder_.addRadius(v.x, p); });
      readAttribute(kWeight, false,
                    [&](const Imath::V3d& v, FilePosition p) { builder_.addWeight(v.x, p); });
      noteOthers();
    }
  }

 private:
  void readPositions() {
    std::uint64_t count = 0;
    double error = 0;
    for (const Leaf& leaf : grid_.leaves()) {
      const std::size_t n = findAttribute(*leaf.descriptor, kPosition);
      if (n == std::string::npos)
        failFile(builder_.name(),
                 fmt::format("has points without positions (P) in grid '{}'; export it again",
                             entry_.name));
      const Attribute& attribute = leaf.descriptor->attributes[n];
      const NumberFormat format = formatOf(attribute, true);
      if (format.bytes == 0 || format.isUnitVector)
        failFile(builder_.name(),
                 fmt::format("has positions (P) of type {} with codec {} in grid '{}'; supported "
                             "are vec3s and vec3d; export it again",
                             attribute.type, attribute.codec, entry_.name));
      error = std::max(error, format.error);
      if (grid_.offsets(leaf).back() != leaf.arrays[n].size)
        bytes_.fail("a leaf has another number of points than its voxels");
      count += leaf.arrays[n].size;
    }
    builder_.reserve(count, presentAttributes());
    for (const Leaf& leaf : grid_.leaves())
      readLeaf(leaf, findAttribute(*leaf.descriptor, kPosition));
    constexpr double kWorthANote = 1e-6;
    if (error > kWorthANote)
      builder_.note(fmt::format(
          "{} stores positions as short numbers; they are rounded by up to {:.2g} along each axis",
          builder_.name(),
          error * std::max({entry_.transform->voxelSize()[0], entry_.transform->voxelSize()[1],
                            entry_.transform->voxelSize()[2]})));
  }

  /// Returns a cloud with an entry in each list that the points may fill.
  [[nodiscard]] PointCloud presentAttributes() const {
    PointCloud present;
    if (!builder_.wantsAttributes()) return present;
    for (const auto& descriptor : grid_.descriptors()) {
      const auto has = [&](std::span<const std::string_view> names) {
        return findAttribute(*descriptor, names) != std::string::npos;
      };
      if (has(kNormal)) present.normals.resize(1);
      if (has(kColor)) present.colors.resize(1);
      if (has(kRadius)) present.radii.resize(1);
      if (has(kWeight)) present.weights.resize(1);
    }
    return present;
  }

  void readLeaf(const Leaf& leaf, std::size_t n) {
    const NumberFormat format = formatOf(leaf.descriptor->attributes[n], true);
    const auto ends = grid_.offsets(leaf);
    const Array& array = leaf.arrays[n];
    const auto [values, step] = grid_.values(n, array, 3 * format.bytes);
    std::uint32_t point = 0;
    for (Index voxel = 0; voxel < kLeafVoxels; ++voxel) {
      const openvdb::Vec3d centre =
          (leaf.origin + openvdb::FloatTree::LeafNodeType::offsetToLocalCoord(voxel)).asVec3d();
      for (; point < ends[voxel]; ++point) {
        const openvdb::Vec3d local = toVdb(vectorAt(values + point * step, format));
        builder_.addPosition(toImath(entry_.transform->indexToWorld(centre + local)), nextPoint(),
                             bytes_.rest().data());
      }
    }
  }

  /// Calls add(value, place) for each point, if all leaves have the attribute in a format that is
  /// supported.
  template <class Add>
  void readAttribute(std::span<const std::string_view> names, bool isVector, const Add& add) {
    for (const Leaf& leaf : grid_.leaves()) {
      const std::size_t n = findAttribute(*leaf.descriptor, names);
      if (n == std::string::npos) return;
      if (formatOf(leaf.descriptor->attributes[n], isVector).bytes == 0) return;
      if (leaf.arrays[n].stride != 1) return;
    }
    std::size_t point = 0;
    for (const Leaf& leaf : grid_.leaves()) {
      const std::size_t n = findAttribute(*leaf.descriptor, names);
      const NumberFormat format = formatOf(leaf.descriptor->attributes[n], isVector);
      const Array& array = leaf.arrays[n];
      if (array.size != leaf.arrays[findAttribute(*leaf.descriptor, kPosition)].size)
        bytes_.fail("the attributes of a leaf have different numbers of points");
      const auto [values, step] = grid_.values(
          n, array, format.isUnitVector || !isVector ? format.bytes : 3 * format.bytes);
      for (std::uint32_t i = 0; i < array.size; ++i) {
        const char* at = values + i * step;
        add(isVector ? vectorAt(at, format) : Imath::V3d(format.decode(at)),
            FilePosition{"point", ++point});
      }
    }
    for (const auto& descriptor : grid_.descriptors())
      used_.insert(descriptor->attributes[findAttribute(*descriptor, names)].name);
  }

  void noteOthers() {
    std::set<std::string> others;
    bool hasGroups = false;
    for (const auto& descriptor : grid_.descriptors()) {
      hasGroups = hasGroups || descriptor->hasGroups;
      for (const Attribute& a : descriptor->attributes)
        if (a.name != "P" && a.codec != "grp" && !used_.contains(a.name))
          others.insert(fmt::format("'{}' ({}, {})", a.name, a.type, a.codec));
    }
    std::string list;
    for (const std::string& other : others) list += (list.empty() ? "" : ", ") + other;
    if (!list.empty())
      builder_.note(fmt::format("{} has attributes that were left out: {}", builder_.name(), list));
    if (hasGroups)
      builder_.note(fmt::format("{} has groups of points, which were left out", builder_.name()));
  }

  [[nodiscard]] FilePosition nextPoint() const { return {"point", builder_.cloud().size() + 1}; }

  VdbBytes& bytes_;
  const VdbEntry& entry_;
  CloudBuilder& builder_;
  PointGridReader grid_;
  std::set<std::string> used_;
};

/// Returns the entry that owns the tree of `entry`: another entry when grids share a tree.
const VdbEntry& ownerOf(const std::vector<VdbEntry>& entries, const VdbEntry& entry,
                        const std::string& file) {
  if (entry.instanceOf.empty()) return entry;
  for (const VdbEntry& other : entries)
    if (other.uniqueName == entry.instanceOf && other.instanceOf.empty() && isPoints(other))
      return other;
  failFile(file, fmt::format("is damaged: the tree of grid '{}' is missing; download or create the "
                             "file again",
                             entry.name));
}

}  // namespace

void readVdbPoints(std::string_view input, CloudBuilder& builder) {
  const std::vector<VdbEntry> entries = readVdbEntries(input, builder.name());
  const VdbEntry& entry = choosePoints(entries, builder.grid(), builder.name());
  if (!entry.transform)
    throw InvalidInput(
        fmt::format("grid '{}' of {} has a frustum transform; resample it to uniform voxels first",
                    entry.name, builder.name()));
  VdbBytes bytes(input, builder.name());
  bytes.seek(ownerOf(entries, entry, builder.name()).treePosition);
  CloudReader(bytes, entry, builder).read();
}

bool vdbHoldsPoints(std::string_view input, const std::string& grid, const std::string& name) {
  bool hasPoints = false;
  for (const VdbEntry& entry : readVdbEntries(input, name)) {
    if (!grid.empty() && entry.name != grid) continue;
    if (isPoints(entry))
      hasPoints = true;
    else if (!grid.empty() ||
             entry.gridClass() == openvdb::GridBase::gridClassToString(openvdb::GRID_LEVEL_SET))
      return false;
  }
  return hasPoints;
}

}  // namespace levelset::point_files
