#include "levelset/files/band_file.h"
#include "levelset/segmented/files/segmented_file.h"
#include "levelset/segmented/meshing/segmented_to_mesh.h"
#include "tests/fuzz/readers.h"

namespace fuzz {
namespace {

using levelset::ReadBandOptions;

void readGrids(const std::filesystem::path& file) {
  std::vector<levelset::GridInfo> grids;
  accepts([&] { grids = levelset::bandFileInfo(file); });
  accepts([&] {
    levelset::BandRepairs repairs;
    static_cast<void>(levelset::readBand(file, {.maxMemory = kMaxMemory, .repairs = &repairs}));
  });
  constexpr std::size_t kMostGrids = 4;  // number of grids that are read
  for (std::size_t i = 0; i < std::min(grids.size(), kMostGrids); ++i) {
    const ReadBandOptions options{.grid = grids[i].name, .maxMemory = kMaxMemory};
    accepts([&] { static_cast<void>(levelset::readGrid(file, options)); });
    accepts([&] { static_cast<void>(levelset::readField(file, options)); });
  }
}

void readVdb(std::string_view bytes) {
  const std::filesystem::path file = scratchFile("grid.vdb", bytes);
  readGrids(file);
  if (!levelset::holdsSegmented(file)) return;
  accepts([&] {
    static_cast<void>(
        levelset::segmentedToMesh(levelset::readSegmented(file, {.maxMemory = kMaxMemory})));
  });
}

/// A file for renderers is refused by its name, and under another name by its content.
void readNvdb(std::string_view bytes) {
  const std::filesystem::path file = scratchFile("grid.nvdb", bytes);
  require(!accepts([&] { static_cast<void>(levelset::readBand(file)); }), ".nvdb is not read");
  accepts([&] { static_cast<void>(levelset::bandFileInfo(file)); });
  readGrids(scratchFile("nano.vdb", bytes));
}

}  // namespace

std::vector<Reader> gridReaders() {
  return {{"vdb", readVdb}, {"nvdb", readNvdb}};
}

}  // namespace fuzz
