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

/// Scene files: JSON that names files of level sets and meshes, by paths relative to its folder.
namespace render {

/// A scene. `hasCamera` is true when its file sets the camera.
struct ViewedScene {
  Scene scene;
  bool hasCamera = false;
};

/// True for a file name or format that readScene() reads: .json.
[[nodiscard]] bool isSceneFormat(const std::string& name);

/// Writes the solids and meshes beside the scene file, as FILE-NAME.vdb and FILE-NAME.ply, then the
/// scene. Existing files of these names are replaced.
/// @throws levelset::IoError when a file cannot be written
/// @throws levelset::InvalidInput for invalid colours
/// @throws levelset::UsageError for an invalid opacity
void writeScene(const std::filesystem::path& file, const ViewedScene& scene,
                const levelset::Progress& progress = {});

/// Options of readScene().
struct ReadSceneOptions {
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  /// Called for each solid with the repairs that turned its grid into a band, and its file.
  std::function<void(const levelset::BandRepairs&, const std::filesystem::path&)> repairs = {};
  levelset::Progress progress = {};
};

/// Reads a scene.
/// @throws levelset::IoError when a file cannot be read
/// @throws levelset::InvalidInput for a file that is not a scene; the message names the reason and
///         the location
/// @throws levelset::UsageError for an invalid expression
/// @throws as levelset::readBand()
[[nodiscard]] ViewedScene readScene(const std::filesystem::path& file,
                                    const ReadSceneOptions& options = {});

/// Checks the names of solids and meshes.
/// @throws levelset::UsageError unless names are unique and consist of letters, digits and _, with
///         no digit first
void requireSceneNames(const std::vector<std::string>& names);

}  // namespace render
