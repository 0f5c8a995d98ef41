#include <fmt/core.h>

#include <algorithm>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_parts.h"

// Object File Format: Geomview manual, section 4.2.5, The Geometry Center 1998.

namespace levelset {
namespace {

struct Counts {
  std::size_t vertices = 0, faces = 0;
};

/// Reads the keyword [ST][C][N]OFF and the counts. Colours, normals and texture coordinates follow
/// the coordinates of a vertex, so they are skipped with the rest of the line.
Counts readHeader(TextCursor& cursor) {
  if (!cursor.skipToToken('#')) cursor.fail("the file holds no data; export the mesh again");
  const std::string_view keyword = cursor.token();
  if (!keyword.ends_with("OFF") || keyword.size() > 6)
    cursor.fail("the file does not begin with 'OFF'; give its actual format");
  for (const char c : keyword.substr(0, keyword.size() - 3)) {
    if (c == '4' || c == 'n')
      cursor.fail(fmt::format(
          "'{}' marks a mesh of another dimension than three; export it in three dimensions",
          keyword));
    if (c != 'C' && c != 'N' && c != 'S' && c != 'T')
      cursor.fail("the file does not begin with 'OFF'; give its actual format");
  }
  if (cursor.skipBlanks('#') && *cursor.at() == 'B')
    cursor.fail("binary OFF is not supported; export the mesh as text or as PLY");
  std::int64_t counts[2];
  for (std::int64_t& count : counts) {
    cursor.skipToToken('#');
    count = cursor.integer("the number of vertices and faces");
    if (count < 0)
      cursor.fail(fmt::format(
          "the number of vertices or faces is {}, which is negative; export the mesh again",
          count));
  }
  cursor.skipLine();  // skips the number of edges, which is unreliable
  return {static_cast<std::size_t>(counts[0]), static_cast<std::size_t>(counts[1])};
}

constexpr std::size_t kMinVertexSize = 6, kMinFaceSize = 2;  // bytes of "0 0 0\n" and "0\n"

/// Refuses a header that promises more vertices and faces than the file can hold.
/// @param remaining  number of bytes after the header
void checkCounts(const Counts& counts, std::size_t remaining, const std::string& name) {
  const std::size_t left = remaining + 1;  // the last line may lack its line end
  if (counts.vertices <= left / kMinVertexSize &&
      counts.faces <= (left - counts.vertices * kMinVertexSize) / kMinFaceSize)
    return;
  failFile(name, fmt::format(
                     "promises {} vertices and {} faces, more than its {} bytes of data can hold; "
                     "it is truncated or its header is damaged: download or export it again",
                     counts.vertices, counts.faces, remaining));
}

class OffReader {
 public:
  OffReader(std::string_view input, MeshBuilder& builder)
      : cursor_(input, builder.name()), builder_(builder) {}

  void read() {
    const Counts counts = readHeader(cursor_);
    checkCounts(counts, cursor_.remaining(), builder_.name());
    builder_.reserve(counts.vertices, std::min(counts.faces, cursor_.remaining() / 8 + 1));
    for (std::size_t i = 0; i < counts.vertices; ++i) readVertex();
    for (std::size_t i = 0; i < counts.faces; ++i) readFace();
    if (cursor_.skipToToken('#'))
      cursor_.fail(fmt::format(
          "the file has data after the {} vertices and {} faces that its header promises; the "
          "header is damaged or data was appended: export it again",
          counts.vertices, counts.faces));
  }

 private:
  void readVertex() {
    double position[3];
    for (double& coordinate : position) {
      cursor_.skipToToken('#');
      coordinate = cursor_.number("a coordinate");
    }
    builder_.addVertex(position[0], position[1], position[2], cursor_.place(), cursor_.at());
    cursor_.skipLine();
  }

  void readFace() {
    corners_.clear();
    cursor_.skipToToken('#');
    const FilePosition place = cursor_.place();
    for (std::int64_t left = readWhole("the number of corners"); left > 0; --left) {
      cursor_.skipToToken('#');
      corners_.push_back(static_cast<std::uint64_t>(readWhole("the index of a vertex")));
    }
    builder_.addFace(corners_, place, cursor_.at());
    cursor_.skipLine();  // skips colours
  }

  std::int64_t readWhole(const char* what) {
    const std::int64_t value = cursor_.integer(what);
    if (value < 0 || !cursor_.atBlank())
      cursor_.fail(fmt::format("{} is not a non-negative integer; export the mesh again", what));
    return value;
  }

  TextCursor cursor_;
  MeshBuilder& builder_;
  std::vector<std::uint64_t> corners_;
};

}  // namespace

void readOff(std::string_view input, MeshBuilder& builder) {
  requireText(input, builder.name(), "OFF");
  OffReader(input, builder).read();
}

MeshFileInfo offInfo(std::string_view head, std::size_t fileSize, const std::string& name) {
  TextCursor cursor(head, name);
  const Counts counts = readHeader(cursor);
  if (fileSize > 0) checkCounts(counts, fileSize - (head.size() - cursor.remaining()), name);
  return {"off", counts.vertices, counts.faces};
}

void writeOff(ByteWriter& out, const TriMesh& mesh, const Progress& progress) {
  out.write(fmt::format("OFF\n{} {} 0\n", mesh.positions.size(), mesh.triangles.size()));
  WriteProgress steps(progress, mesh.positions.size() + mesh.triangles.size());
  for (const Imath::V3d& p : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis) {
      out.writeNumber(p[axis]);
      out.write(axis < 2 ? " " : "\n");
    }
    steps.step();
  }
  for (const auto& triangle : mesh.triangles) {
    out.write("3");
    for (const std::uint32_t corner : triangle) {
      out.write(" ");
      out.writeNumber(std::uint64_t{corner});
    }
    out.write("\n");
    steps.step();
  }
}

}  // namespace levelset
