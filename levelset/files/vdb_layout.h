#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <optional>
#include <streambuf>
#include <string>
#include <string_view>
#include <vector>

#include "levelset/progress.h"
#include "levelset/vdb.h"

// Private to levelset/files and point_files: this library's own reader of .vdb files. OpenVDB's
// reader trusts all counts and sizes in a file. On a damaged file it loops for hours, writes past
// buffers or leaks memory. This reader checks each count and size against the bytes present. Only
// the decompression is OpenVDB's, for blocks whose sizes have been checked.

namespace levelset {

/// A byte range of a file that is read from front to back, never beyond its end.
class VdbBytes {
 public:
  VdbBytes(std::string_view file, const std::string& name) : file_(file), name_(&name) {}

  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t remaining() const { return file_.size() - position_; }
  void seek(std::size_t position);
  /// @throws InvalidInput when fewer than `size` bytes are left
  [[nodiscard]] const char* take(std::size_t size);
  template <typename T>
  [[nodiscard]] T value() {
    T result;
    std::memcpy(&result, take(sizeof(T)), sizeof(T));
    return result;
  }
  /// Reads a length and then that many characters.
  [[nodiscard]] std::string_view text();
  [[nodiscard]] std::string_view rest() const { return file_.substr(position_); }
  /// @throws InvalidInput: "'x.vdb' is damaged at byte 123: <what>; …"
  [[noreturn]] void fail(const std::string& what) const;
  [[nodiscard]] const std::string& name() const { return *name_; }

 private:
  std::string_view file_;
  const std::string* name_;
  std::size_t position_ = 0;
};

/// Stream buffer on bytes in memory, for OpenVDB's functions that read streams.
class MemoryBuffer : public std::streambuf {
 public:
  explicit MemoryBuffer(std::string_view bytes) {
    char* begin = const_cast<char*>(bytes.data());  // never written to
    setg(begin, begin, begin + bytes.size());
  }
  [[nodiscard]] std::size_t consumed() const { return static_cast<std::size_t>(gptr() - eback()); }
};

struct VdbMetadata {
  std::string_view name, type, value;
};

/// One grid of a file, without its tree.
struct VdbEntry {
  std::string name, type;  ///< type: OpenVDB's tree type, without the suffix for half floats
  std::string instanceOf;  ///< unique name of the grid that owns a shared tree; else empty
  std::string uniqueName;
  bool half = false;
  std::uint32_t compression = 0;
  std::vector<VdbMetadata> metadata;
  openvdb::math::Transform::Ptr transform;  ///< null for a frustum, which is not supported
  std::size_t treePosition = 0;             ///< byte offset of the tree in the file

  [[nodiscard]] const VdbMetadata* find(std::string_view key) const;
  [[nodiscard]] std::string gridClass() const;
};

/// Reads a list of metadata. @throws InvalidInput when the file is damaged
[[nodiscard]] std::vector<VdbMetadata> readVdbMetadata(VdbBytes& bytes);

/// Reads the headers of all grids of the file and skips the trees.
/// @throws InvalidInput when the file is damaged
[[nodiscard]] std::vector<VdbEntry> readVdbEntries(std::string_view file, const std::string& name);

struct VdbTreeLimits {
  std::size_t maxMemory = kNoMemoryLimit;
  /// True: active tiles stay tiles, so the memory limit does not count their voxels.
  bool keepsTiles = false;
  /// Only leaves and active tiles that intersect this index box are read; empty: all.
  std::optional<openvdb::CoordBBox> region = {};
  /// Called with the origin of each leaf; no leaf is read then. May be empty.
  std::function<void(const openvdb::Coord&)> visit = {};
  /// Called with the byte offset up to which leaf values have been located; may be empty.
  std::function<void(std::size_t)> passed = {};
  Progress progress = {};
};

/// Reads the tree of an entry with float or double values, as a float tree.
/// @throws InvalidInput when the file is damaged
/// @throws ResourceLimit before the tree exceeds limits.maxMemory
[[nodiscard]] openvdb::FloatTree::Ptr readVdbTree(std::string_view file, const std::string& name,
                                                  const VdbEntry& entry,
                                                  const VdbTreeLimits& limits);
/// Reads the tree of an entry with float or double vectors, as a float vector tree.
/// @throws as readVdbTree
[[nodiscard]] openvdb::Vec3STree::Ptr readVdbVectorTree(std::string_view file,
                                                        const std::string& name,
                                                        const VdbEntry& entry,
                                                        const VdbTreeLimits& limits);

/// Reads the background of a float or double tree, without its nodes.
[[nodiscard]] double readVdbBackground(std::string_view file, const std::string& name,
                                       const VdbEntry& entry);

/// Skips the tree of an entry, for files that do not store the end of a grid.
void skipVdbTree(VdbBytes& bytes, const VdbEntry& entry);

[[nodiscard]] bool hasFloatTree(const VdbEntry& entry);
[[nodiscard]] bool hasDoubleTree(const VdbEntry& entry);
/// Returns true for float or double vectors.
[[nodiscard]] bool hasVectorTree(const VdbEntry& entry);

}  // namespace levelset
