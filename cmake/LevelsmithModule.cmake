# levelsmith_module(NAME HEADERS … [PUBLIC libs…] [PRIVATE libs…])
#
# Builds one library from all .cpp files below the calling folder: alias Levelsmith::NAME, C++20,
# warnings, header self-check, install and export. HEADERS lists the public headers, relative to the
# calling folder; they are included by their path from the repository root. Sources are found by a
# glob, so a new operator needs no line in a list. Public headers are listed because each of them is
# part of the public interface.

include(GNUInstallDirs)

add_library(levelsmith_warnings INTERFACE)
target_compile_options(levelsmith_warnings INTERFACE -Wall -Wextra -Wshadow -Wconversion)
if(LEVELSMITH_STRICT)
  target_compile_options(levelsmith_warnings INTERFACE -Werror)
endif()

# Disable contraction of a*b+c, so that results have the same bits on all machines.
add_library(levelsmith_flags INTERFACE)
target_compile_options(levelsmith_flags INTERFACE -ffp-contract=off)

# Tests are linked with the sanitizers but not instrumented, because that takes as long as for the
# modules.
set(LEVELSMITH_SANITIZE "" CACHE STRING "Sanitizers for the modules and the command, as -fsanitize= takes them")
add_library(levelsmith_sanitizers INTERFACE)
if(LEVELSMITH_SANITIZE)
  target_compile_options(levelsmith_sanitizers INTERFACE -fsanitize=${LEVELSMITH_SANITIZE}
                         -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(levelsmith_sanitizers INTERFACE -fsanitize=${LEVELSMITH_SANITIZE})
endif()

# A regular expression of sources. `./dev asan-quick` sets it, since its tests use few operators.
set(LEVELSMITH_LEFT_OUT "" CACHE STRING "Sources of the modules that are not compiled")

function(levelsmith_module name)
  cmake_parse_arguments(ARG "" "" "HEADERS;PUBLIC;PRIVATE" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  if(LEVELSMITH_LEFT_OUT)
    list(FILTER sources EXCLUDE REGEX "${LEVELSMITH_LEFT_OUT}")
  endif()
  add_library(${name} STATIC ${sources})
  levelsmith_unity_groups(${name})
  add_library(Levelsmith::${name} ALIAS ${name})
  target_compile_features(${name} PUBLIC cxx_std_20)
  set_target_properties(${name} PROPERTIES
    OUTPUT_NAME levelsmith_${name} POSITION_INDEPENDENT_CODE ON VERIFY_INTERFACE_HEADER_SETS ON)
  target_sources(${name} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${ARG_HEADERS})
  target_link_libraries(${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE}
                        $<BUILD_INTERFACE:levelsmith_warnings> $<BUILD_INTERFACE:levelsmith_flags>
                        $<BUILD_INTERFACE:levelsmith_sanitizers>)
  install(TARGETS ${name} EXPORT Levelsmith_${name} COMPONENT ${name}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/levelsmith)
  install(EXPORT Levelsmith_${name} NAMESPACE Levelsmith:: COMPONENT ${name}
          DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Levelsmith FILE Levelsmith_${name}.cmake)
endfunction()

# levelset/vdb.h is the most expensive include. It is precompiled unless the build is a unity build.
function(levelsmith_precompile_vdb name)
  if(LEVELSMITH_PCH AND NOT CMAKE_UNITY_BUILD)
    target_precompile_headers(${name} PRIVATE ${PROJECT_SOURCE_DIR}/levelset/vdb.h)
  endif()
endfunction()

function(levelsmith_install_package)
  include(CMakePackageConfigHelpers)
  set(destination ${CMAKE_INSTALL_LIBDIR}/cmake/Levelsmith)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/LevelsmithConfig.cmake.in
                                ${PROJECT_BINARY_DIR}/LevelsmithConfig.cmake
                                INSTALL_DESTINATION ${destination})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/LevelsmithConfigVersion.cmake
                                   COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/LevelsmithConfig.cmake
                ${PROJECT_BINARY_DIR}/LevelsmithConfigVersion.cmake
                ${PROJECT_SOURCE_DIR}/cmake/LevelsmithDependencies.cmake
          DESTINATION ${destination} COMPONENT levelset)
endfunction()
