#pragma once

#include <Imath/ImathBox.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "levelset/progress.h"
#include "mapping/patches/patch.h"
#include "render/scene/scene.h"

namespace viewer {

/// The contents of the opened files. Constant after reading.
struct Model {
  render::Scene scene;                        ///< without a camera
  std::optional<render::Camera> camera = {};  ///< camera of a scene file
  std::vector<mapping::Patch> patches;
  Imath::Box3d solidBounds;  ///< box of the drawn surfaces, world units; empty when there are none
  Imath::Box3d bounds;       ///< box that also contains the particles
  std::string description = {};  ///< one line for the user
  std::vector<std::filesystem::path>
      files;  ///< files that were read: first the solid's, then the patches'
  std::vector<std::filesystem::path> watched = {};  ///< `files` and the files that they name

  [[nodiscard]] double extent() const { return solidBounds.size().length(); }
  /// True when there are solids that a clip plane can cut. Blended scenes cannot be cut, because
  /// the plane would be blended with the fields.
  [[nodiscard]] bool canCut() const;
};

/// Options of openModel().
struct OpenOptions {
  long resolution = 256;  ///< voxels along the longest side of a mesh
  levelset::Progress progress = {};
};

/// True for file names that can be opened.
[[nodiscard]] bool canOpen(const std::filesystem::path& file);

/// Reads a level set, a mesh (which is converted to a level set) or a scene, and patches to show
/// with it.
/// @param files  at most one level set, mesh or scene, and any number of patches, in any order
/// @throws levelset::UsageError for unknown file names, or two solids
/// @throws as readBand(), readMesh(), meshToBand(), readScene() and readPatches()
[[nodiscard]] Model openModel(const std::vector<std::filesystem::path>& files,
                              const OpenOptions& options = {});

/// Checks files before they are read: each must exist and have a known format, and at most one may
/// be a solid.
/// @throws levelset::UsageError for an unknown format or a second solid
/// @throws levelset::IoError for a missing file
void requireReadable(const std::vector<std::filesystem::path>& files);

/// Files to open when a file is added to those shown. A patch is added, or read again; any other
/// file replaces them.
[[nodiscard]] std::vector<std::filesystem::path> filesWith(
    const std::vector<std::filesystem::path>& shown, const std::filesystem::path& file);

}  // namespace viewer
