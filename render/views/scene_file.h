#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "levelset/memory_limit.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "render/scene/scene.h"

/// Scenes in files: JSON that names the files of level sets and meshes, by paths from its folder.
namespace render {

/// A scene, and whether somebody said where it is seen from.
struct ViewedScene {
  Scene scene;
  bool hasCamera = false;
};

/// True for a name, or a format, that readScene understands: .json.
[[nodiscard]] bool isSceneFormat(const std::string& name);

/// Writes the solids and meshes beside it, as FILE-NAME.vdb and FILE-NAME.ply, then the scene. What
/// has those names is replaced.
/// @throws levelset::IoError; InvalidInput for colours that are none; UsageError for an opacity
/// that
///         is none
void writeScene(const std::filesystem::path& file, const ViewedScene& scene,
                const levelset::Progress& progress = {});

struct ReadSceneOptions {
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  /// Told of each solid's file what its grid lacked to be a band.
  std::function<void(const levelset::BandRepairs&, const std::filesystem::path&)> repairs = {};
  levelset::Progress progress = {};
};

/// @throws levelset::IoError when a file cannot be read; InvalidInput, telling what and where, for
///         what is no scene; UsageError for its expression; and as levelset::readBand()
[[nodiscard]] ViewedScene readScene(const std::filesystem::path& file,
                                    const ReadSceneOptions& options = {});

/// Of solids and meshes. @throws levelset::UsageError unless each has letters, digits and _ only,
/// no
///         digit first, and none is there twice
void requireSceneNames(const std::vector<std::string>& names);

}  // namespace render
