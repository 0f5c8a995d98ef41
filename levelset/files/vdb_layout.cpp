#include "levelset/files/vdb_layout.h"

#include <fmt/core.h>

#include <cstring>
#include <istream>
#include <mutex>

#include "levelset/error.h"

// The layout follows OpenVDB's io/Archive.cc, io/GridDescriptor.cc and metadata/MetaMap.cc.

namespace levelset {
namespace {

constexpr std::int64_t kMagic = 0x56444220;
constexpr std::uint32_t kOldestVersion = openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION;
constexpr std::uint32_t kNewestVersion = openvdb::OPENVDB_FILE_VERSION;
constexpr std::size_t kIdentifierSize = 36;
constexpr std::string_view kHalfSuffix = "_HalfFloat";
constexpr char kNameSeparator = '\x1e';  // precedes the number that makes equal names unique

void initializeOnce() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

/// Reads the header of the file.
/// @return true when the file stores where each grid begins and ends
bool readFileHeader(VdbBytes& bytes) {
  if (bytes.remaining() < sizeof kMagic || bytes.value<std::int64_t>() != kMagic) {
    throw InvalidInput(
        fmt::format("{} is not an OpenVDB file; give its actual format", bytes.name()));
  }
  const auto version = bytes.value<std::uint32_t>();
  if (version < kOldestVersion || version > kNewestVersion) {
    throw InvalidInput(
        fmt::format("{} has version {} of OpenVDB's file format; versions {} to {} are supported; "
                    "write it again with a program that uses one of these versions",
                    bytes.name(), version, kOldestVersion, kNewestVersion));
  }
  static_cast<void>(bytes.take(2 * sizeof(std::uint32_t)));  // skips the version of the library
  const bool hasOffsets = bytes.value<char>() != 0;
  static_cast<void>(bytes.take(kIdentifierSize));
  static_cast<void>(readVdbMetadata(bytes));
  return hasOffsets;
}

/// Reads a transform. Returns null for a frustum map, which bands and fields do not support.
openvdb::math::Transform::Ptr readTransform(VdbBytes& bytes, std::uint32_t version) {
  VdbBytes probe = bytes;
  const std::string_view kind = probe.text();
  if (kind.find("Frustum") != std::string_view::npos) return nullptr;
  MemoryBuffer buffer(bytes.rest());
  std::istream stream(&buffer);
  stream.exceptions(std::ios::badbit | std::ios::failbit | std::ios::eofbit);
  openvdb::io::setVersion(stream, {}, version);
  auto transform = openvdb::math::Transform::createLinearTransform();
  try {
    transform->read(stream);
  } catch (const std::exception&) {
    bytes.fail("the transform of a grid cannot be read");
  }
  bytes.seek(bytes.position() + buffer.consumed());
  return transform;
}

VdbEntry readDescriptor(VdbBytes& bytes) {
  VdbEntry entry;
  entry.uniqueName = bytes.text();
  entry.name = entry.uniqueName.substr(0, entry.uniqueName.find(kNameSeparator));
  entry.type = bytes.text();
  if (entry.type.ends_with(kHalfSuffix)) {
    entry.half = true;
    entry.type.resize(entry.type.size() - kHalfSuffix.size());
  }
  entry.instanceOf = bytes.text();
  return entry;
}

/// Skips the tree of a grid and moves to the start of the next grid.
/// @param end  byte offset of the end of the grid; 0 when the file does not store it
void skipTree(VdbBytes& bytes, const VdbEntry& entry, std::int64_t end) {
  if (end > 0) {
    if (static_cast<std::size_t>(end) < bytes.position())
      bytes.fail(fmt::format("grid '{}' ends before it begins", entry.name));
    return bytes.seek(static_cast<std::size_t>(end));
  }
  if (!entry.instanceOf.empty()) return;
  if (!entry.transform ||
      (!hasFloatTree(entry) && !hasDoubleTree(entry) && !hasVectorTree(entry))) {
    throw InvalidInput(
        fmt::format("{} was written as a stream, without the offsets of its grids, so grid '{}' of "
                    "type '{}' cannot be skipped; write the level set to a separate file",
                    bytes.name(), entry.name, entry.type));
  }
  skipVdbTree(bytes, entry);
}

}  // namespace

std::vector<VdbMetadata> readVdbMetadata(VdbBytes& bytes) {
  constexpr std::size_t kMinSize = 12;  // bytes: the lengths of name, type and value
  const auto count = bytes.value<std::uint32_t>();
  if (count > bytes.remaining() / kMinSize)
    bytes.fail(
        fmt::format("its header promises {} metadata entries, which the file cannot hold", count));
  std::vector<VdbMetadata> result;
  for (std::uint32_t i = 0; i < count; ++i) {
    VdbMetadata entry;
    entry.name = bytes.text();
    entry.type = bytes.text();
    entry.value = bytes.text();
    result.push_back(entry);
  }
  return result;
}

void VdbBytes::seek(std::size_t position) {
  if (position > file_.size())
    fail(fmt::format("the file has {} bytes and refers to byte {}", file_.size(), position));
  position_ = position;
}

const char* VdbBytes::take(std::size_t size) {
  if (size > remaining()) fail(fmt::format("{} bytes are missing", size - remaining()));
  const char* result = file_.data() + position_;
  position_ += size;
  return result;
}

std::string_view VdbBytes::text() {
  const auto length = value<std::uint32_t>();
  return {take(length), length};
}

void VdbBytes::fail(const std::string& what) const {
  throw InvalidInput(fmt::format("{} is damaged at byte {}: {}; download or create the file again",
                                 *name_, position_, what));
}

const VdbMetadata* VdbEntry::find(std::string_view key) const {
  for (const VdbMetadata& entry : metadata)
    if (entry.name == key) return &entry;
  return nullptr;
}

std::string VdbEntry::gridClass() const {
  const VdbMetadata* entry = find(openvdb::GridBase::META_GRID_CLASS);
  return entry ? std::string(entry->value) : "unknown";
}

bool hasFloatTree(const VdbEntry& entry) {
  return entry.type == openvdb::FloatTree::treeType();
}
bool hasDoubleTree(const VdbEntry& entry) {
  return entry.type == openvdb::DoubleTree::treeType();
}
bool hasVectorTree(const VdbEntry& entry) {
  return entry.type == openvdb::Vec3STree::treeType() ||
         entry.type == openvdb::Vec3DTree::treeType();
}

std::vector<VdbEntry> readVdbEntries(std::string_view file, const std::string& name) {
  initializeOnce();
  VdbBytes bytes(file, name);
  const bool hasOffsets = readFileHeader(bytes);
  const auto version = VdbBytes(file.substr(sizeof kMagic), name).value<std::uint32_t>();
  constexpr std::size_t kMinSize = 40;  // bytes of a grid's descriptor: names and offsets
  const auto count = bytes.value<std::int32_t>();
  if (count < 0 || static_cast<std::size_t>(count) > bytes.remaining() / kMinSize)
    bytes.fail(fmt::format("its header promises {} grids, which the file cannot hold", count));
  std::vector<VdbEntry> entries;
  for (std::int32_t i = 0; i < count; ++i) {
    VdbEntry entry = readDescriptor(bytes);
    // Skips the offsets of the grid and of its leaf values.
    static_cast<void>(bytes.take(2 * sizeof(std::int64_t)));
    const auto end = bytes.value<std::int64_t>();
    if (hasOffsets && end <= 0)
      bytes.fail(fmt::format("the header does not state where grid '{}' ends", entry.name));
    entry.compression = bytes.value<std::uint32_t>();
    entry.metadata = readVdbMetadata(bytes);
    entry.transform = readTransform(bytes, version);
    entry.treePosition = bytes.position();
    const VdbMetadata* given = entry.find(openvdb::GridBase::META_GRID_NAME);
    if (given) entry.name = given->value;
    // Skips the tree of the last grid too, although nothing follows: a truncated file fails here.
    skipTree(bytes, entry, hasOffsets ? end : 0);
    entries.push_back(std::move(entry));
  }
  return entries;
}

}  // namespace levelset
