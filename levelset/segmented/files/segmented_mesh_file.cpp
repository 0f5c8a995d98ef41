#include "levelset/segmented/files/segmented_mesh_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <numeric>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/mesh_files/mesh_parts.h"

namespace levelset {
namespace {

struct SegmentedFormat {
  std::string extension;  ///< in lower case, without ".gz"
  bool isCompressed = false;
};

SegmentedFormat segmentedFormat(const std::filesystem::path& nameOrFormat) {
  std::string text = nameOrFormat.string();
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool isCompressed = text.ends_with(".gz");
  if (isCompressed) text.resize(text.size() - 3);
  return {text.substr(text.rfind('.') + 1), isCompressed};
}

void writeSegmentedPly(ByteWriter& out, const SegmentedMesh& mesh, const Progress& progress) {
  static_assert(std::endian::native == std::endian::little, "the header says little endian");
  const std::vector<Imath::V3d>& positions = mesh.mesh.positions;
  out.write(
      fmt::format("ply\nformat binary_little_endian 1.0\ncomment front and behind are labels of "
                  "regions, 0 is the void; normals point to front\nelement vertex {}\n"
                  "property double x\nproperty double y\nproperty double z\nelement face {}\n"
                  "property list uchar int vertex_indices\nproperty ushort front\n"
                  "property ushort behind\nend_header\n",
                  positions.size(), mesh.sides.size()));
  WriteProgress steps(progress, positions.size() + mesh.sides.size());
  for (const Imath::V3d& position : positions) {
    out.writeValue(position);
    steps.step();
  }
  for (std::size_t t = 0; t < mesh.sides.size(); ++t) {
    out.writeValue(static_cast<unsigned char>(3));
    out.writeValue(mesh.mesh.triangles[t]);
    out.writeValue(mesh.sides[t].front);
    out.writeValue(mesh.sides[t].behind);
    steps.step();
  }
}

void writeSegmentedObj(ByteWriter& out, const SegmentedMesh& mesh, const Progress& progress) {
  WriteProgress steps(progress, mesh.mesh.positions.size() + mesh.sides.size());
  for (const Imath::V3d& position : mesh.mesh.positions) {
    out.write("v");
    for (int axis = 0; axis < 3; ++axis) {
      out.write(" ");
      out.writeNumber(position[axis]);
    }
    out.write("\n");
    steps.step();
  }
  const auto keyOf = [&](std::size_t t) {
    return std::pair(mesh.sides[t].front, mesh.sides[t].behind);
  };
  std::vector<std::size_t> order(mesh.sides.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return keyOf(a) < keyOf(b); });
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (k == 0 || keyOf(order[k]) != keyOf(order[k - 1]))
      out.write(fmt::format("g interface_{}_{}\n", keyOf(order[k]).first, keyOf(order[k]).second));
    out.write("f");
    for (const std::uint32_t corner : mesh.mesh.triangles[order[k]]) {
      out.write(" ");
      out.writeNumber(std::uint64_t{corner} + 1);
    }
    out.write("\n");
    steps.step();
  }
}

}  // namespace

void writeSegmentedMesh(const std::filesystem::path& path, const SegmentedMesh& mesh,
                        const WriteSegmentedMeshOptions& options) {
  const std::filesystem::path name =
      options.format.empty() ? path : std::filesystem::path(options.format);
  if (!holdsAttributes(name))
    throw UsageError(fmt::format(
        "'{}' names no format that holds labels of regions; use ply or obj", name.string()));
  const SegmentedFormat format = segmentedFormat(name);
  report(options.progress, 0);
  ByteWriter out(path, format.isCompressed);
  if (format.extension == "ply")
    writeSegmentedPly(out, mesh, options.progress);
  else
    writeSegmentedObj(out, mesh, options.progress);
  out.commit();
  report(options.progress, 1);
}

}  // namespace levelset
