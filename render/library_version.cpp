#include "render/library_version.h"

#include <OpenEXR/OpenEXRConfig.h>
#include <embree3/rtcore_config.h>
#include <fmt/core.h>
#include <nanovdb/NanoVDB.h>
#include <png.h>

namespace render {

std::vector<levelset::LibraryVersion> libraryVersions() {
  return {
      {"NanoVDB", fmt::format("{}.{}.{}", NANOVDB_MAJOR_VERSION_NUMBER,
                              NANOVDB_MINOR_VERSION_NUMBER, NANOVDB_PATCH_VERSION_NUMBER)},
      {"Embree", RTC_VERSION_STRING},
      {"OpenEXR", OPENEXR_VERSION_STRING},
      {"libpng", png_get_libpng_ver(nullptr)},
  };
}

}  // namespace render
