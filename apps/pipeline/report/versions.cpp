#include "apps/pipeline/report/versions.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "render/library_version.h"

namespace pipeline {
namespace {

#ifdef __clang__
constexpr const char* kCompiler = __VERSION__;  // includes the name of the compiler
#else
constexpr const char* kCompiler = "GCC " __VERSION__;
#endif

}  // namespace

std::vector<levelset::LibraryVersion> programVersions() {
  std::vector<levelset::LibraryVersion> all = {{"levelsmith", LEVELSMITH_VERSION}};
  for (const auto& list : {levelset::libraryVersions(), render::libraryVersions()})
    all.insert(all.end(), list.begin(), list.end());
  all.push_back({"fmt", fmt::format("{}.{}.{}", FMT_VERSION / 10000, FMT_VERSION / 100 % 100,
                                    FMT_VERSION % 100)});
  all.push_back(
      {"nlohmann-json", fmt::format("{}.{}.{}", NLOHMANN_JSON_VERSION_MAJOR,
                                    NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH)});
  all.push_back({"compiler", kCompiler});
  return all;
}

}  // namespace pipeline
