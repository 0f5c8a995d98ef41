#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <streambuf>
#include <string>
#include <string_view>
#include <vector>

#include "levelset/progress.h"
#include "levelset/vdb.h"

// Private to levelset/files: our own reader of .vdb files. OpenVDB's trusts every count and size
// in the file: on a damaged one it loops for hours, writes past buffers or leaks. Here each is
// checked against the bytes that are there before it is believed; only the decompression is
// OpenVDB's, of blocks whose sizes are known to be right.

namespace levelset {

/// A stretch of a file, read from front to back, never beyond its end.
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
  /// Length, then characters.
  [[nodiscard]] std::string_view text();
  [[nodiscard]] std::string_view rest() const { return file_.substr(position_); }
  /// @throws InvalidInput: "read: 'x.vdb' is damaged at byte 123: <what>; …"
  [[noreturn]] void fail(const std::string& what) const;
  [[nodiscard]] const std::string& name() const { return *name_; }

 private:
  std::string_view file_;
  const std::string* name_;
  std::size_t position_ = 0;
};

/// Lets OpenVDB's functions, which read streams, read bytes in memory.
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

/// One grid of a file, all but its tree.
struct VdbEntry {
  std::string name, type;  ///< type as OpenVDB writes it, without the suffix for half floats
  std::string instanceOf;  ///< unique name of the grid whose tree this one shares; else empty
  std::string uniqueName;
  bool half = false;
  std::uint32_t compression = 0;
  std::vector<VdbMetadata> metadata;
  openvdb::math::Transform::Ptr transform;  ///< null when it is of a kind we do not read
  std::size_t treePosition = 0;             ///< byte in the file

  [[nodiscard]] const VdbMetadata* find(std::string_view key) const;
  [[nodiscard]] std::string gridClass() const;
};

/// Every grid of the file, from its headers; trees are stepped over.
/// @throws InvalidInput when the file is damaged
[[nodiscard]] std::vector<VdbEntry> readVdbEntries(std::string_view file, const std::string& name);

struct VdbTreeLimits {
  std::size_t maxMemory = kNoMemoryLimit;
  bool keepsTiles = false;  ///< active tiles stay tiles: they need not fit as voxels
  Progress progress = {};
};

/// The tree of an entry of float or double values, as a float tree.
/// @throws InvalidInput when the file is damaged; ResourceLimit before the tree passes its limit
[[nodiscard]] openvdb::FloatTree::Ptr readVdbTree(std::string_view file, const std::string& name,
                                                  const VdbEntry& entry,
                                                  const VdbTreeLimits& limits);
/// The same of float or double vectors.
[[nodiscard]] openvdb::Vec3STree::Ptr readVdbVectorTree(std::string_view file,
                                                        const std::string& name,
                                                        const VdbEntry& entry,
                                                        const VdbTreeLimits& limits);

/// The background of such a tree, from its head alone.
[[nodiscard]] double readVdbBackground(std::string_view file, const std::string& name,
                                       const VdbEntry& entry);

/// Takes bytes past the tree of an entry, for files that do not say where it ends.
void skipVdbTree(VdbBytes& bytes, const VdbEntry& entry);

[[nodiscard]] bool hasFloatTree(const VdbEntry& entry);
[[nodiscard]] bool hasDoubleTree(const VdbEntry& entry);
/// Of float or double vectors.
[[nodiscard]] bool hasVectorTree(const VdbEntry& entry);

}  // namespace levelset
