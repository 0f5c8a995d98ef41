#include "apps/pipeline/values/terrain_picture.h"

#include <fmt/core.h>

#include "levelset/error.h"
#include "levelset/terrain/files/height_field_file.h"
#include "render/images/grey_image.h"
#include "render/images/image.h"

namespace pipeline {

bool isTerrainPicture(const std::string& nameOrFormat) {
  return nameOrFormat == "png" || render::imageFormat(nameOrFormat) == "png";
}

levelset::HeightField readTerrainPicture(const std::filesystem::path& file, std::size_t maxMemory) {
  const render::GreyImage image = render::readGreyPng(file, maxMemory);
  levelset::HeightField terrain{.columns = image.width, .rows = image.height};
  terrain.heights.resize(image.values.size());
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column) {
      const std::size_t pixel =
          static_cast<std::size_t>(image.height - 1 - row) * static_cast<std::size_t>(image.width) +
          static_cast<std::size_t>(column);
      float& height = terrain.heights[terrain.index(column, row)];
      height = static_cast<float>(image.values[pixel]);
      if (image.alpha.empty() || image.alpha[pixel] == 1) continue;
      if (image.alpha[pixel] != 0)
        throw levelset::InvalidInput(fmt::format(
            "{}: the pixel in column {} and row {} is partly transparent, so its height "
            "is unclear; make pixels opaque, or transparent where heights are missing",
            file.string(), column + 1, image.height - row));
      height = levelset::kMissingHeight;
    }
  levelset::requireHeights(terrain);
  return terrain;
}

}  // namespace pipeline
