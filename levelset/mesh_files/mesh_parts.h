#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "levelset/files/byte_io.h"
#include "levelset/mesh_files/mesh_file.h"

// Private to levelset/files: what the readers and writers of the mesh formats share.

namespace levelset {

/// Where in a file something was found: "line 12", "vertex 3".
struct Place {
  const char* unit;
  std::size_t number;
};

/// @throws InvalidInput: "read: 'x.ply', line 12: <what>"
[[noreturn]] void failAt(const std::string& name, Place place, const std::string& what);
/// @throws InvalidInput: "read: 'x.ply' <what>"
[[noreturn]] void failFile(const std::string& name, const std::string& what);

/// Collects vertices and faces, checks them, and splits polygons once all vertices are there (a
/// face may come before its vertices).
class MeshBuilder {
 public:
  MeshBuilder(std::string name, const ReadMeshOptions& options, std::string_view input);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::size_t vertexCount() const { return mesh_.positions.size(); }
  /// The numbers of a header; the caller has checked them against the size of the file.
  /// @param attributeBytes  that the vertices' attributes will take
  void reserve(std::size_t vertices, std::size_t triangles, std::size_t attributeBytes = 0);
  /// Of the stored numbers; without it, float if every coordinate fits.
  void declarePrecision(CoordinatePrecision precision);

  /// `at` is where reading stands, for the progress.
  void addVertex(double x, double y, double z, Place place, const char* at);
  /// The last vertex's. @throws InvalidInput for numbers that are not finite
  void addNormal(const Imath::V3d& normal, Place place);
  void addUv(const Imath::V2d& uv, Place place);
  void addColor(const Imath::V4f& color, Place place);
  [[nodiscard]] bool wantsAttributes() const { return options_.attributes; }
  [[nodiscard]] MeshAttributes& attributes() { return mesh_.attributes; }
  /// Attributes are there, and not wanted.
  void dropAttributes() { droppedAttributes_ = true; }
  [[nodiscard]] bool droppedAttributes() const { return droppedAttributes_; }
  /// Something that a mesh cannot carry.
  void leaveAside(std::string what);
  /// What the reader holds beside the mesh.
  void noteBytes(std::size_t bytes) { readerBytes_ = bytes; }
  [[nodiscard]] std::size_t splitCount() const { return splitVertices_.size(); }
  /// @throws ResourceLimit if so much more than is held does not fit
  void requireMore(double bytes) const;
  /// Another vertex at the place of one that may be still to come.
  /// @return what stands for it as a corner of faces; its number will be vertexCount() + n for the
  ///         n-th of these
  [[nodiscard]] std::uint64_t splitVertex(std::uint64_t vertex, Place place);

  /// Corners count from 0; faces with fewer than three are skipped.
  void addFace(std::span<const std::uint64_t> corners, Place place, const char* at);
  /// @throws InvalidInput when an index is out of range or there is no triangle
  [[nodiscard]] TriMesh finish();

 private:
  struct Polygon {
    std::size_t firstTriangle, corners, place;
  };
  void tick(const char* at);
  void noteIndex(std::uint64_t index, Place place);
  void placeSplitVertices();
  void splitPolygons();

  TriMesh mesh_;
  std::string name_;
  const ReadMeshOptions& options_;
  std::string_view input_;
  std::vector<Polygon> polygons_;
  std::vector<std::uint32_t> splitVertices_;  // of which vertex
  std::size_t readerBytes_ = 0;
  std::uint64_t highestIndex_ = 0;
  std::string highestUnit_ = "line";  // of its own: what named it may be gone when it is told
  std::size_t highestNumber_ = 0;
  std::size_t added_ = 0;
  bool precisionDeclared_ = false, droppedAttributes_ = false;
  bool allFloat_ = true;
};

/// Splits the polygon with those corners into corners.size() − 2 triangles: a fan where there are
/// few corners and that keeps within the polygon, else by clipping ears in the plane that fits
/// best.
/// @return false when the polygon is too intricate to split in reasonable time
[[nodiscard]] bool splitPolygon(std::span<const std::uint32_t> corners,
                                const std::vector<Imath::V3d>& positions,
                                std::array<std::uint32_t, 3>* triangles);

/// Walks through text token by token and counts lines.
class TextCursor {
 public:
  TextCursor(std::string_view text, const std::string& name, std::size_t firstLine = 1);

  [[nodiscard]] Place place() const { return {"line", line_}; }
  [[nodiscard]] const char* at() const { return p_; }
  [[nodiscard]] std::size_t remaining() const { return static_cast<std::size_t>(end_ - p_); }
  [[nodiscard]] bool atEnd() const { return p_ == end_; }

  /// Skips blanks (and, with `continuation`, a backslash before the line's end); true when a token
  /// of the same line follows. `comment` begins a comment, 0 for none.
  bool skipBlanks(char comment, bool continuation = false) {
    while (p_ != end_) {
      const char c = *p_;
      if (c == '\n' || (comment && c == comment)) {
        return false;
      } else if (static_cast<unsigned char>(c) <= ' ') {  // what ends a token is stepped over
        ++p_;
      } else if (c == '\\' && continuation && skipContinuation()) {
        continue;
      } else {
        return true;
      }
    }
    return false;
  }
  /// Skips blanks, comments and line ends; false at the end of the text.
  bool skipToToken(char comment);
  /// To the beginning of the next line.
  void skipLine();
  /// The token at the cursor, taken: one character at least, lest a reader stands still.
  [[nodiscard]] std::string_view token();
  /// The number at the cursor, taken; ± infinity when it is beyond a double. Fails at no number.
  [[nodiscard]] double number(const char* what);
  /// The integer at the cursor, taken without what follows it (as in 1/2/3).
  [[nodiscard]] std::int64_t integer(const char* what);
  /// Takes `c` if it stands at the cursor.
  bool take(char c) {
    if (p_ == end_ || *p_ != c) return false;
    ++p_;
    return true;
  }
  [[nodiscard]] bool atBlank() const {
    return p_ == end_ || static_cast<unsigned char>(*p_) <= ' ' || *p_ == '\\';
  }
  [[noreturn]] void fail(const std::string& what) const { failAt(name_, place(), what); }

 private:
  bool skipContinuation();
  [[noreturn]] void failNumber(const char* what) const;

  const char* p_;
  const char* end_;
  std::size_t line_;
  const std::string& name_;
};

/// Reading stops here when text was promised and binary data found.
void requireText(std::string_view input, const std::string& name, const char* format);

/// Nothing but blanks may follow what the header promises: else it promises too little.
/// @param what  that has been read, "the 12 triangles that its header promises"
void requireNothingBehind(std::string_view input, std::size_t end, const std::string& name,
                          const std::string& what);

void readPly(std::string_view input, MeshBuilder& builder);
void readObj(std::string_view input, MeshBuilder& builder);
void readStl(std::string_view input, MeshBuilder& builder);
void readOff(std::string_view input, MeshBuilder& builder);

void writePly(ByteWriter& out, const TriMesh& mesh, const Progress& progress);
void writeObj(ByteWriter& out, const TriMesh& mesh, const Progress& progress);
void writeStl(ByteWriter& out, const TriMesh& mesh, const Progress& progress);
void writeOff(ByteWriter& out, const TriMesh& mesh, const Progress& progress);

/// From the first bytes of a file of `fileSize` bytes (0: not known). A header that promises more
/// than that many bytes can hold is refused as a reader refuses it.
[[nodiscard]] MeshFileInfo plyInfo(std::string_view head, std::size_t fileSize,
                                   const std::string& name);
[[nodiscard]] MeshFileInfo stlInfo(std::string_view head, std::size_t fileSize,
                                   const std::string& name);
[[nodiscard]] MeshFileInfo offInfo(std::string_view head, std::size_t fileSize,
                                   const std::string& name);
/// Can a PLY file of that size hold what its header promises if every face is a triangle? Where it
/// cannot, it was cut off or has faces of fewer corners, and only a full read tells.
[[nodiscard]] bool plyHoldsTriangles(std::string_view head, std::size_t fileSize,
                                     const std::string& name);

/// Reports every so many elements, without a call for each.
class WriteProgress {
 public:
  WriteProgress(const Progress& progress, std::size_t total) : progress_(progress), total_(total) {}
  void step() {
    if ((++done_ & 0xFFFF) == 0)
      report(progress_, static_cast<double>(done_) / static_cast<double>(total_), "write");
  }

 private:
  const Progress& progress_;
  std::size_t total_, done_ = 0;
};

}  // namespace levelset
