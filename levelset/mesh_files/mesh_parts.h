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

// Private to levelset/mesh_files and levelset/point_files: shared code of the readers and writers
// of meshes. Readers of point clouds share the text cursor and the messages.

namespace levelset {

/// Position in a file, for messages: "line 12", "vertex 3".
struct FilePosition {
  const char* unit;
  std::size_t number;
};

/// @throws InvalidInput: "'x.ply', line 12: <what>"
[[noreturn]] void failAt(const std::string& name, FilePosition place, const std::string& what);
/// @throws InvalidInput: "'x.ply' <what>"
[[noreturn]] void failFile(const std::string& name, const std::string& what);

/// Collects vertices and faces, checks them, and splits polygons once all vertices are known. A
/// face may precede its vertices.
class MeshBuilder {
 public:
  MeshBuilder(std::string name, const ReadMeshOptions& options, std::string_view input);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::size_t vertexCount() const { return mesh_.positions.size(); }
  /// Reserves memory for the counts of a header. The caller has checked them against the size of
  /// the file.
  /// @param attributeBytes  memory of the vertex attributes, bytes
  void reserve(std::size_t vertices, std::size_t triangles, std::size_t attributeBytes = 0);
  /// Declares the precision of the coordinates in the file. If it is not called, the precision is
  /// Float when every coordinate is exactly a float, else Double.
  void declarePrecision(CoordinatePrecision precision);

  /// Adds a vertex. `place` is its position in the file for messages, `at` the reading position for
  /// the progress.
  void addVertex(double x, double y, double z, FilePosition place, const char* at);
  /// Adds an attribute of the last vertex: normal, texture coordinate or colour.
  /// @throws InvalidInput for numbers that are not finite
  void addNormal(const Imath::V3d& normal, FilePosition place);
  void addUv(const Imath::V2d& uv, FilePosition place);
  void addColor(const Imath::V4f& color, FilePosition place);
  [[nodiscard]] bool wantsAttributes() const { return options_.attributes; }
  [[nodiscard]] MeshAttributes& attributes() { return mesh_.attributes; }
  /// Records that the file has attributes, which are skipped because the options exclude them.
  void dropAttributes() { droppedAttributes_ = true; }
  [[nodiscard]] bool droppedAttributes() const { return droppedAttributes_; }
  /// Reports an attribute that a TriMesh cannot hold.
  void noteUnsupported(std::string what);
  /// Sets the memory that the reader uses besides the mesh, bytes.
  void noteBytes(std::size_t bytes) { readerBytes_ = bytes; }
  [[nodiscard]] std::size_t splitCount() const { return splitVertices_.size(); }
  /// @throws ResourceLimit when `bytes` more bytes would exceed the memory limit
  void requireMore(double bytes) const;
  /// Adds a duplicate of a vertex, which may not have been read yet.
  /// @return a provisional number for the corners of faces; the final number of the n-th duplicate
  ///         is vertexCount() + n
  [[nodiscard]] std::uint64_t splitVertex(std::uint64_t vertex, FilePosition place);

  /// Adds a face. Corners count from 0; faces with fewer than three corners are skipped.
  void addFace(std::span<const std::uint64_t> corners, FilePosition place, const char* at);
  /// Completes the mesh.
  /// @throws InvalidInput when an index is out of range or there is no triangle
  [[nodiscard]] TriMesh finish();

 private:
  struct Polygon {
    std::size_t firstTriangle, corners, place;
  };
  void tick(const char* at);
  void noteIndex(std::uint64_t index, FilePosition place);
  void placeSplitVertices();
  void splitPolygons();

  TriMesh mesh_;
  std::string name_;
  const ReadMeshOptions& options_;
  std::string_view input_;
  std::vector<Polygon> polygons_;
  std::vector<std::uint32_t> splitVertices_;  // index of the original vertex, for each duplicate
  std::size_t readerBytes_ = 0;
  std::uint64_t highestIndex_ = 0;
  std::string highestUnit_ = "line";  // unit of FilePosition of the face with the highest vertex
                                      // index; a copy, because the reader frees the name of the
                                      // element
  std::size_t highestNumber_ = 0;
  std::size_t added_ = 0;
  bool precisionDeclared_ = false, droppedAttributes_ = false;
  bool allFloat_ = true;
};

/// Splits a polygon into corners.size() − 2 triangles. Uses a fan of triangles from one corner for
/// few corners if the fan stays inside the polygon; otherwise clips ears, projected along the axis
/// nearest to the polygon's normal.
/// @return false when the polygon is too complex to split in reasonable time
[[nodiscard]] bool splitPolygon(std::span<const std::uint32_t> corners,
                                const std::vector<Imath::V3d>& positions,
                                std::array<std::uint32_t, 3>* triangles);

/// Reads text token by token and counts lines.
class TextCursor {
 public:
  TextCursor(std::string_view text, const std::string& name, std::size_t firstLine = 1);

  [[nodiscard]] FilePosition place() const { return {"line", line_}; }
  [[nodiscard]] const char* at() const { return p_; }
  [[nodiscard]] std::size_t remaining() const { return static_cast<std::size_t>(end_ - p_); }
  [[nodiscard]] bool atEnd() const { return p_ == end_; }

  /// Skips blanks and, with `continuation`, a backslash before the end of a line. Returns true when
  /// a token of the same line follows. `comment` is the character that starts a comment, 0 for
  /// none.
  bool skipBlanks(char comment, bool continuation = false) {
    while (p_ != end_) {
      const char c = *p_;
      if (c == '\n' || (comment && c == comment)) {
        return false;
      } else if (static_cast<unsigned char>(c) <= ' ') {  // blanks and control characters end a
                                                          // token
        ++p_;
      } else if (c == '\\' && continuation && skipContinuation()) {
        continue;
      } else {
        return true;
      }
    }
    return false;
  }
  /// Skips blanks, comments and line ends. Returns false at the end of the text.
  bool skipToToken(char comment);
  /// Moves to the start of the next line.
  void skipLine();
  /// Takes the token at the cursor, at least one character, so that a reader always advances.
  [[nodiscard]] std::string_view token();
  /// Takes the number at the cursor; ± infinity beyond the range of a double. Fails if there is no
  /// number. `what` names the expected number in the message: "a coordinate".
  [[nodiscard]] double number(const char* what);
  /// Takes the integer at the cursor and stops at the first character that is no digit, as in
  /// 1/2/3.
  [[nodiscard]] std::int64_t integer(const char* what);
  /// Takes `c` if it is the character at the cursor.
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

/// Refuses binary data where text is expected.
void requireText(std::string_view input, const std::string& name, const char* format);

/// Refuses data after the elements that the header promises: the header then promises too few
/// elements.
/// @param what  the data that has been read: "the 12 triangles that its header promises"
void requireNoTrailingData(std::string_view input, std::size_t end, const std::string& name,
                           const std::string& what);

void readPly(std::string_view input, MeshBuilder& builder);
void readObj(std::string_view input, MeshBuilder& builder);
void readStl(std::string_view input, MeshBuilder& builder);
void readOff(std::string_view input, MeshBuilder& builder);

void writePly(ByteWriter& out, const TriMesh& mesh, const Progress& progress);
void writeObj(ByteWriter& out, const TriMesh& mesh, const Progress& progress);
void writeStl(ByteWriter& out, const TriMesh& mesh, const Progress& progress);
void writeOff(ByteWriter& out, const TriMesh& mesh, const Progress& progress);

/// Reads the properties of a mesh from the first bytes of a file of `fileSize` bytes (0: unknown).
/// Refuses a header that promises more than the file can hold, as the reader does.
[[nodiscard]] MeshFileInfo plyInfo(std::string_view head, std::size_t fileSize,
                                   const std::string& name);
[[nodiscard]] MeshFileInfo stlInfo(std::string_view head, std::size_t fileSize,
                                   const std::string& name);
[[nodiscard]] MeshFileInfo offInfo(std::string_view head, std::size_t fileSize,
                                   const std::string& name);
/// Returns true when a PLY file of `fileSize` bytes can hold the elements of its header if every
/// face is a triangle. Otherwise the file is truncated or has faces of fewer corners, and only a
/// full read can decide.
[[nodiscard]] bool plyHoldsTriangles(std::string_view head, std::size_t fileSize,
                                     const std::string& name);

/// Reports the progress every 65,536 elements.
class WriteProgress {
 public:
  WriteProgress(const Progress& progress, std::size_t total) : progress_(progress), total_(total) {}
  void step() {
    if ((++done_ & 0xFFFF) == 0)
      report(progress_, static_cast<double>(done_) / static_cast<double>(total_));
  }

 private:
  const Progress& progress_;
  std::size_t total_, done_ = 0;
};

}  // namespace levelset
