#include <cmath>

#include "levelset/point_files/point_file.h"
#include "tests/fuzz/readers.h"

namespace fuzz {
namespace {

void readPointsAs(const char* name, std::string_view bytes) {
  const std::filesystem::path file = scratchFile(name, bytes);
  accepts([&] { static_cast<void>(levelset::pointFileInfo(file)); });
  static_cast<void>(levelset::lacksFaces(file));
  static_cast<void>(levelset::holdsPointGrid(file));
  for (const bool attributes : {true, false}) {
    std::vector<std::string> notes;
    accepts([&] {
      const levelset::PointCloud cloud = levelset::readPoints(
          file, {.attributes = attributes, .maxMemory = kMaxMemory, .notes = &notes});
      require(!cloud.isEmpty(), "a cloud that was read has points");
      levelset::requirePoints(cloud);
    });
  }
}

/// Reads the bytes as each format of text, since the formats differ in few words.
void readTextPoints(std::string_view bytes) {
  readPointsAs("points.xyz", bytes);
  readPointsAs("points.csv", bytes);
  readPointsAs("points.pts", bytes);
}

}  // namespace

std::vector<Reader> pointReaders() {
  return {{"points", readTextPoints},
          {"points_ply", [](std::string_view bytes) { readPointsAs("points.ply", bytes); }},
          {"points_vdb", [](std::string_view bytes) { readPointsAs("points.vdb", bytes); }},
          {"points_obj", [](std::string_view bytes) { readPointsAs("points.obj", bytes); }}};
}

}  // namespace fuzz
