# Finds the third-party packages. Used by this build and by the installed package; the latter finds
# only packages that the requested components link.

list(APPEND CMAKE_MODULE_PATH /usr/lib/${CMAKE_CXX_LIBRARY_ARCHITECTURE}/cmake/OpenVDB
     /usr/lib/x86_64-linux-gnu/cmake/OpenVDB)

find_package(Threads REQUIRED)
find_package(Imath CONFIG REQUIRED)
find_package(TBB CONFIG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(fmt CONFIG REQUIRED)
if(NOT TARGET OpenVDB::openvdb)
  find_package(OpenVDB REQUIRED)
endif()
find_package(Eigen3 CONFIG REQUIRED)
find_package(OpenMesh REQUIRED)
find_package(muparser CONFIG REQUIRED)

if(LEVELSMITH_RENDER)
  find_package(embree 3 CONFIG REQUIRED)
  find_package(OpenEXR CONFIG REQUIRED)
  find_package(PNG REQUIRED)
endif()
if(LEVELSMITH_MAPPING OR LEVELSMITH_RENDER)
  find_package(nlohmann_json CONFIG REQUIRED)
endif()
