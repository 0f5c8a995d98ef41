#include "levelset/library_version.h"

#include <Imath/ImathConfig.h>
#include <OpenMesh/Core/System/config.h>
#include <fmt/core.h>
#include <muParser.h>
#include <oneapi/tbb/version.h>
#include <openvdb/version.h>
#include <zlib.h>

#include <Eigen/Core>

namespace levelset {

std::vector<LibraryVersion> libraryVersions() {
  return {
      {"OpenVDB", OPENVDB_LIBRARY_VERSION_STRING},
      {"TBB", TBB_runtime_version()},
      {"Imath", IMATH_VERSION_STRING},
      {"Eigen",
       fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
      {"OpenMesh", fmt::format("{}.{}", OM_GET_VER, OM_GET_MAJ)},
      {"muParser", mu::Parser().GetVersion(mu::pviBRIEF)},
      {"zlib", zlibVersion()},
  };
}

}  // namespace levelset
