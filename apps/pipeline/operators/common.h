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

/// Returns the format of the parameter `file`: --format, or the extension of the name.
inline std::string formatName(const Invocation& in) {
  if (in.given("format")) return in.text("format");
  if (in.text("file") != "-") return in.text("file");
  throw levelset::UsageError(
      fmt::format("{}: '-' has no extension to tell the format; give --format", in.op().name));
}

/// Warnings about repairs that made a grid from a file a band.
inline std::vector<std::string> sentencesOf(const levelset::BandRepairs& repairs,
                                            const std::filesystem::path& file) {
  std::vector<std::string> sentences;
  if (repairs.activeTiles > 0)
    sentences.push_back(
        fmt::format("{} active tiles of {} were split into voxels; 'reinitialize' gives them "
                    "distances",
                    repairs.activeTiles, file.string()));
  if (repairs.inactiveValues > 0)
    sentences.push_back(fmt::format(
        "{} inactive values of {} were set to the background of their sign; run 'check' "
        "to see whether the signs are right",
        repairs.inactiveValues, file.string()));
  return sentences;
}

using levelset::grown;
using levelset::kDistanceTolerance;

inline Param voxelParam(const char* doc = "edge of a voxel") {
  return {.name = "voxel",
          .type = ParamType::Length,
          .doc = doc,
          .range = Range::Positive,
          .allowsVoxels = false};
}
inline Param resolutionParam() {
  return {.name = "resolution",
          .type = ParamType::Integer,
          .doc = "in place of --voxel: voxels along the longest side of the object",
          .range = Range::Positive};
}
inline void requireVoxelSize(const Invocation& in) {
  in.requireVoxelSize();
}
inline Param halfWidthParam(const char* fallback = "3") {
  return {.name = "half-width",
          .type = ParamType::Number,
          .doc = "extent of the band on each side, in voxels",
          .fallback = fallback,
          .range = Range::Positive};
}

}  // namespace pipeline
