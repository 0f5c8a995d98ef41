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

/// What was read to be looked at, never changed afterwards.
struct Model {
  render::Scene scene;                        ///< its camera is no concern of a model
  std::optional<render::Camera> camera = {};  ///< that a scene's file told
  std::vector<mapping::Patch> patches;
  Imath::Box3d solidBounds;      ///< of what is drawn of them, world units; empty for nothing
  Imath::Box3d bounds;           ///< of particles, too
  std::string description = {};  ///< one line for people
  std::vector<std::filesystem::path> files;  ///< that it was read from: the solid's, then patches'
  std::vector<std::filesystem::path> watched = {};  ///< those, and the ones that they name

  [[nodiscard]] double extent() const { return solidBounds.size().length(); }
  /// Is there anything to cut, and does it have an inside to show? A plane that cuts blended fields
  /// would be blended into them.
  [[nodiscard]] bool canCut() const;
};

struct OpenOptions {
  long resolution = 256;  ///< of meshes: voxels along the longest side
  levelset::Progress progress = {};
};

/// True for names of files that can be opened.
[[nodiscard]] bool canOpen(const std::filesystem::path& file);

/// Reads a level set, a mesh (which becomes a level set) or a scene, and patches to show with it.
/// @param files  one of the former at most, and any number of patches, in any order
/// @throws levelset::UsageError for names that cannot be opened, or two solids; as readBand(),
///         readMesh(), meshToBand(), readScene() and readPatches()
[[nodiscard]] Model openModel(const std::vector<std::filesystem::path>& files,
                              const OpenOptions& options = {});

/// What can be told of files before they are read: that each is there and of a known format, and
/// that there is no second solid.
/// @throws levelset::UsageError; levelset::IoError
void requireReadable(const std::vector<std::filesystem::path>& files);

/// What to open when a file comes on top of what is shown: a patch is added to it, or read anew;
/// anything else takes its place.
[[nodiscard]] std::vector<std::filesystem::path> filesWith(
    const std::vector<std::filesystem::path>& shown, const std::filesystem::path& file);

}  // namespace viewer
