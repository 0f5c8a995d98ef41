#include <cmath>

#include "levelset/mesh_files/mesh_file.h"
#include "tests/fuzz/readers.h"

namespace fuzz {
namespace {

void requireSound(const levelset::TriMesh& mesh) {
  require(!mesh.triangles.empty(), "a mesh that was read has triangles");
  for (const Imath::V3d& p : mesh.positions)
    require(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z),
            "the coordinates of a mesh are finite");
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      require(vertex < mesh.positions.size(), "a triangle has vertices of its mesh");
}

void readAs(const char* name, std::string_view bytes) {
  const std::filesystem::path file = scratchFile(name, bytes);
  accepts([&] { static_cast<void>(levelset::meshFileInfo(file)); });
  for (const bool attributes : {true, false}) {
    std::vector<std::string> unsupported;
    accepts([&] {
      requireSound(levelset::readMesh(
          file, {.attributes = attributes, .maxMemory = kMaxMemory, .unsupported = &unsupported}));
    });
  }
}

}  // namespace

std::vector<Reader> meshReaders() {
  return {{"ply", [](std::string_view bytes) { readAs("mesh.ply", bytes); }},
          {"obj", [](std::string_view bytes) { readAs("mesh.obj", bytes); }},
          {"stl", [](std::string_view bytes) { readAs("mesh.stl", bytes); }},
          {"off", [](std::string_view bytes) { readAs("mesh.off", bytes); }},
          {"gzip", [](std::string_view bytes) { readAs("mesh.off.gz", bytes); }}};
}

}  // namespace fuzz
