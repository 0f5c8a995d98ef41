#include <fmt/core.h>

#include "levelset/error.h"
#include "levelset/files/mesh_parts.h"

// Wavefront OBJ: Wavefront Technologies, "The Advanced Visualizer Manual", appendix B1, 1992.

namespace levelset {
namespace {

class ObjReader {
 public:
  ObjReader(std::string_view input, MeshBuilder& builder)
      : cursor_(input, builder.name()), builder_(builder) {}

  void read() {
    while (!cursor_.atEnd()) {
      if (cursor_.skipBlanks('#', true)) readStatement();
      cursor_.skipLine();
    }
  }

 private:
  void readStatement() {
    const std::string_view keyword = cursor_.token();
    if (keyword == "v") return readVertex();
    if (keyword == "f" || keyword == "fo") return readFace();
    while (cursor_.skipBlanks('#', true)) skipToken();  // a continued line belongs to its statement
  }

  /// A backslash that continues no line is part of a name.
  void skipToken() {
    if (cursor_.token().empty()) cursor_.take('\\');
  }

  void readVertex() {
    const Place place = cursor_.place();
    double position[3];
    for (double& coordinate : position) {
      cursor_.skipBlanks('#', true);
      coordinate = cursor_.number("a coordinate");
    }
    builder_.addVertex(position[0], position[1], position[2], place, cursor_.at());
    while (cursor_.skipBlanks('#', true)) skipToken();  // weight or colour
  }

  void readFace() {
    const Place place = cursor_.place();
    corners_.clear();
    while (cursor_.skipBlanks('#', true)) {
      corners_.push_back(readIndex());
      while (cursor_.take('/'))
        if (!cursor_.atBlank() && *cursor_.at() != '/')
          static_cast<void>(cursor_.integer("the index of a texture coordinate or normal"));
      if (!cursor_.atBlank())
        cursor_.fail(
            "a corner of a face is not v, v/t, v//n or v/t/n; export "
            "the mesh again");
    }
    builder_.addFace(corners_, place, cursor_.at());
  }

  /// From 0; negative ones count back from the latest vertex.
  std::uint64_t readIndex() {
    const std::int64_t index = cursor_.integer("the index of a vertex");
    const auto count = static_cast<std::int64_t>(builder_.vertexCount());
    if (index > 0) return static_cast<std::uint64_t>(index - 1);
    if (index == 0)
      cursor_.fail("a face names vertex 0, but OBJ counts from 1; export the mesh again");
    if (index < -count)
      cursor_.fail(
          fmt::format("a face names vertex {}, but only {} stand before it; repair the mesh or "
                      "export it again",
                      index, count));
    return static_cast<std::uint64_t>(count + index);
  }

  TextCursor cursor_;
  MeshBuilder& builder_;
  std::vector<std::uint64_t> corners_;
};

}  // namespace

void readObj(std::string_view input, MeshBuilder& builder) {
  requireText(input, builder.name(), "OBJ");
  ObjReader(input, builder).read();
}

void writeObj(ByteWriter& out, const TriMesh& mesh, const Progress& progress) {
  WriteProgress steps(progress, mesh.positions.size() + mesh.triangles.size());
  for (const Imath::V3d& p : mesh.positions) {
    out.write("v");
    for (int axis = 0; axis < 3; ++axis) {
      out.write(" ");
      out.writeNumber(p[axis]);
    }
    out.write("\n");
    steps.step();
  }
  for (const auto& triangle : mesh.triangles) {
    out.write("f");
    for (const std::uint32_t corner : triangle) {
      out.write(" ");
      out.writeNumber(std::uint64_t{corner} + 1);
    }
    out.write("\n");
    steps.step();
  }
}

}  // namespace levelset
