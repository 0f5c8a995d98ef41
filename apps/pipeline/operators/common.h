#pragma once

// Parameters that several operators share.

#include <Imath/ImathBox.h>
#include <fmt/core.h>

#include <filesystem>
#include <string>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "levelset/error.h"
#include "levelset/narrow_band.h"

namespace pipeline {

/// Returns --format if it is given, otherwise the name of the file, whose extension gives the
/// format.
inline std::string formatName(const Invocation& in) {
  if (in.given("format")) return in.text("format");
  if (in.text("file") != "-") return in.text("file");
  throw levelset::UsageError(
      fmt::format("{}: '-' has no extension that gives the format; give --format", in.op().name));
}

/// Returns one warning for each kind of repair that was needed to read a grid of a file as a band.
inline std::vector<std::string> sentencesOf(const levelset::BandRepairs& repairs,
                                            const std::filesystem::path& file) {
  std::vector<std::string> sentences;
  if (repairs.activeTiles > 0)
    sentences.push_back(
        fmt::format("{} active tiles of {} were split into voxels that all have the value of their "
                    "tile; run 'reinitialize' to compute their distances",
                    repairs.activeTiles, file.string()));
  if (repairs.inactiveValues > 0)
    sentences.push_back(
        fmt::format("{} inactive values of {} were set to plus or minus the background value, by "
                    "their sign; run 'check' to test the signs",
                    repairs.inactiveValues, file.string()));
  return sentences;
}

using levelset::grown;
using levelset::kDistanceTolerance;

inline Param voxelParam(const char* doc = "voxel size: edge length of a voxel") {
  return {.name = "voxel",
          .type = ParamType::Length,
          .doc = doc,
          .range = Range::Positive,
          .allowsVoxels = false};
}
inline Param resolutionParam() {
  return {.name = "resolution",
          .type = ParamType::Integer,
          .doc = "number of voxels along the longest side of the object, in place of --voxel",
          .range = Range::Positive};
}
inline void requireVoxelSize(const Invocation& in) {
  in.requireVoxelSize();
}
inline Param halfWidthParam(const char* fallback = "3") {
  return {.name = "half-width",
          .type = ParamType::Number,
          .doc =
              "half width of the band: distance from the surface to the end of the band on each "
              "side, in voxels",
          .fallback = fallback,
          .range = Range::Positive};
}

}  // namespace pipeline
