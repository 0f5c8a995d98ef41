#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "levelset/mesh_files/mesh_parts.h"

namespace levelset {
namespace {

std::string attributeProperties(const MeshAttributes& held) {
  const char* real = held.precision == CoordinatePrecision::Float ? "float" : "double";
  const char* color = held.colorPrecision == ColorPrecision::Byte ? "uchar" : "float";
  std::string text;
  if (!held.normals.empty())
    text += fmt::format("property {0} nx\nproperty {0} ny\nproperty {0} nz\n", real);
  if (!held.uvs.empty()) text += fmt::format("property {0} s\nproperty {0} t\n", real);
  if (!held.colors.empty()) {
    text += fmt::format("property {0} red\nproperty {0} green\nproperty {0} blue\n", color);
    if (held.hasAlpha) text += fmt::format("property {} alpha\n", color);
  }
  return text;
}

void writeAttributes(ByteWriter& out, const MeshAttributes& held, std::size_t v) {
  const bool asFloat = held.precision == CoordinatePrecision::Float;
  const auto write = [&](double number) {
    if (asFloat)
      out.writeValue(static_cast<float>(number));
    else
      out.writeValue(number);
  };
  if (!held.normals.empty())
    for (int axis = 0; axis < 3; ++axis) write(held.normals[v][axis]);
  if (!held.uvs.empty())
    for (int axis = 0; axis < 2; ++axis) write(held.uvs[v][axis]);
  for (int i = 0; i < (held.colors.empty() ? 0 : held.hasAlpha ? 4 : 3); ++i) {
    const float part = held.colors[v][i];
    if (held.colorPrecision == ColorPrecision::Byte)
      out.writeValue(static_cast<unsigned char>(std::lround(std::clamp(part, 0.0f, 1.0f) * 255)));
    else
      out.writeValue(part);
  }
}

}  // namespace

void writePly(ByteWriter& out, const TriMesh& mesh, const Progress& progress) {
  static_assert(std::endian::native == std::endian::little, "the header says little endian");
  const bool asFloat = mesh.precision == CoordinatePrecision::Float;
  const char* real = asFloat ? "float" : "double";
  // Many readers interpret the index as a signed int, so the unsigned type is used only where
  // necessary.
  const char* index = mesh.positions.size() > 0x7FFFFFFF ? "uint" : "int";
  out.write(
      fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {0}\n"
                  "property {1} x\nproperty {1} y\nproperty {1} z\n{4}element face {2}\n"
                  "property list uchar {3} vertex_indices\nend_header\n",
                  mesh.positions.size(), real, mesh.triangles.size(), index,
                  attributeProperties(mesh.attributes)));
  WriteProgress steps(progress, mesh.positions.size() + mesh.triangles.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (asFloat)
      out.writeValue(Imath::V3f(mesh.positions[v]));
    else
      out.writeValue(mesh.positions[v]);
    if (!mesh.attributes.isEmpty()) writeAttributes(out, mesh.attributes, v);
    steps.step();
  }
  for (const auto& triangle : mesh.triangles) {
    out.writeValue(static_cast<unsigned char>(3));
    out.writeValue(triangle);
    steps.step();
  }
}

}  // namespace levelset
