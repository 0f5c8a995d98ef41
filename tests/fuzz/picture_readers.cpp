#include "apps/pipeline/values/height_file.h"
#include "render/images/grey_image.h"
#include "render/images/image.h"
#include "render/shading/style.h"
#include "tests/fuzz/readers.h"

namespace fuzz {
namespace {

void readPng(std::string_view bytes) {
  const std::filesystem::path file = scratchFile("picture.png", bytes);
  accepts([&] { static_cast<void>(render::readGreyPng(file, kMaxMemory)); });
  accepts([&] { static_cast<void>(render::readColourPng(file, kMaxMemory)); });
}

void readExr(std::string_view bytes) {
  const std::filesystem::path file = scratchFile("picture.exr", bytes);
  accepts([&] { static_cast<void>(render::readExr(file, kMaxMemory)); });
}

void readHeights(std::string_view bytes) {
  const std::filesystem::path file = scratchFile("heights.txt", bytes);
  accepts([&] {
    const mapping::HeightGrid grid = pipeline::readHeights(file, true, kMaxMemory);
    require(grid.heights.size() ==
                static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows),
            "a grid of heights is full");
    for (const double height : grid.heights)
      require(height >= 0 && height <= 1, "heights are from 0 to 1");
  });
}

}  // namespace

std::vector<Reader> pictureReaders() {
  return {{"png", readPng}, {"exr", readExr}, {"heights", readHeights}};
}

}  // namespace fuzz
