#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "levelset/memory/memory_limit.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "render/scene/scene.h"

/// Scene files: JSON documents that name files of level sets and meshes, by paths relative to the
/// folder of the document.
namespace render {

/// A scene, and whether its file sets the camera. If not, `scene.camera` has default values.
struct ViewedScene {
  Scene scene;
  bool hasCamera = false;
};

/// True for the format "json" and for file names with the extension .json, which readScene() reads.
[[nodiscard]] bool isSceneFormat(const std::string& name);

/// Writes each solid, mesh, Bézier volume and terrain into the folder of the scene file, as
/// STEM-NAME.vdb, STEM-NAME.ply, STEM-NAME.json and STEM-NAME.asc. STEM is the scene file's name
/// without extension. Then it writes the scene file. Existing files are replaced.
/// @throws levelset::IoError when a file cannot be written
/// @throws levelset::InvalidInput for invalid colours
/// @throws levelset::UsageError for an invalid opacity, and for mapped textures, which a file
///         cannot hold
void writeScene(const std::filesystem::path& file, const ViewedScene& scene,
                const levelset::Progress& progress = {});

/// Options of readScene().
struct ReadSceneOptions {
  std::size_t maxMemory = levelset::kNoMemoryLimit;  ///< limit for all solids and meshes, bytes
  /// Called for each solid with its file and the repairs that turned the grid of that file into a
  /// band.
  std::function<void(const levelset::BandRepairs&, const std::filesystem::path&)> repairs = {};
  levelset::Progress progress = {};
};

/// Reads a scene. The file of a Bézier volume (bezier_file.h) is a scene with that volume alone,
/// and a file of quadrics (quadric_file.h) is a scene with these.
/// @throws levelset::IoError when a file cannot be read
/// @throws levelset::InvalidInput for a file that is not a scene; the message names the reason and
///         the location
/// @throws levelset::UsageError for an invalid expression
/// @throws as levelset::readBand()
[[nodiscard]] ViewedScene readScene(const std::filesystem::path& file,
                                    const ReadSceneOptions& options = {});

/// Checks the names of all solids and meshes of a scene.
/// @throws levelset::UsageError unless names are unique and consist of letters, digits and _, with
///         no digit first
void requireSceneNames(const std::vector<std::string>& names);

}  // namespace render
