#include <cmath>

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

}  // namespace

std::vector<Reader> volumeReaders() {
  return {{"nifti", readNifti}, {"metaimage", readMetaImage}, {"nrrd", readNrrd}, {"mrc", readMrc}};
}

}  // namespace fuzz
