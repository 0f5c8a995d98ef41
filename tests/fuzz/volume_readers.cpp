#include <algorithm>
#include <cmath>

#include "levelset/terrain/files/height_field_file.h"
#include "levelset/terrain/tiles/tiled_ground.h"
#include "levelset/volume_files/volume_file.h"
#include "tests/fuzz/readers.h"

namespace fuzz {
namespace {

void readVolumeFile(const char* name, std::string_view bytes) {
  const std::filesystem::path file = scratchFile(name, bytes);
  accepts([&] { static_cast<void>(levelset::volumeFileInfo(file)); });
  accepts([&] {
    const levelset::Volume volume = levelset::readVolume(file, {.maxMemory = kMaxMemory});
    require(std::isfinite(volume.lowest()) && std::isfinite(volume.highest()),
            "the values of a volume are finite");
    const Imath::V3i last = volume.size() - Imath::V3i(1);
    const double value = volume.at(last.x, last.y, last.z);
    require(value >= volume.lowest() && value <= volume.highest(), "the range holds all values");
  });
}

void readNifti(std::string_view bytes) {
  readVolumeFile("some.nii", bytes);
  readVolumeFile("some.nii.gz", bytes);
}
void readMetaImage(std::string_view bytes) {
  readVolumeFile("some.mha", bytes);
}
void readNrrd(std::string_view bytes) {
  readVolumeFile("some.nrrd", bytes);
}
void readMrc(std::string_view bytes) {
  readVolumeFile("some.mrc", bytes);
}

void readTerrainFile(const std::filesystem::path& file) {
  accepts([&] {
    const levelset::HeightField field = levelset::readHeightField(file, {.maxMemory = kMaxMemory});
    const std::filesystem::path again = scratchFile("again.asc", "");
    writeHeightField(again, field);
    const levelset::HeightField same = levelset::readHeightField(again);
    require(
        same.columns == field.columns && same.rows == field.rows &&
            std::equal(same.heights.begin(), same.heights.end(), field.heights.begin(),
                       [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }),
        "a terrain is read as it was written");
  });
}
void readAsc(std::string_view bytes) {
  readTerrainFile(scratchFile("some.asc", bytes));
}
/// Reads a grid with a header. `bytes` are the header, a zero byte, and the heights.
void readBil(std::string_view bytes) {
  const std::size_t zero = std::min(bytes.find('\0'), bytes.size());
  static_cast<void>(scratchFile("some.hdr", bytes.substr(0, zero)));
  const std::string_view heights = bytes.substr(std::min(zero + 1, bytes.size()));
  readTerrainFile(scratchFile("some.bil", heights));
  readTerrainFile(scratchFile("some.flt", heights));
}
/// Reads the header, the index and the first patches of each level. A fuzzer ignores checksums.
void readTiles(std::string_view bytes) {
  const std::filesystem::path file = scratchFile("some.lst", bytes);
  accepts([&] { static_cast<void>(levelset::tiledGroundHash(file)); });
  accepts([&] {
    const auto tiles = levelset::openTiledGround(file, kMaxMemory);
    const levelset::HeightPyramid& pyramid = tiles->layout().pyramid;
    std::vector<float> heights(static_cast<std::size_t>((pyramid.cells + 1) * (pyramid.cells + 1)));
    for (std::size_t n = 0; n < pyramid.levels.size(); ++n)
      for (int patch = 0; patch < std::min(pyramid.levels[n].columns, 8); ++patch)
        accepts([&] {
          tiles->readPatch(static_cast<int>(n), patch, 0, heights);
          for (const float height : heights)
            require(!std::isinf(height), "heights are finite or missing");
        });
  });
}

}  // namespace

std::vector<Reader> volumeReaders() {
  return {{"nifti", readNifti}, {"metaimage", readMetaImage},
          {"nrrd", readNrrd},   {"mrc", readMrc},
          {"asc", readAsc},     {"bil", readBil},
          {"tiles", readTiles}};
}

}  // namespace fuzz
