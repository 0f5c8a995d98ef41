#pragma once

#include <Imath/ImathBox.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/viewer/terrain/shown_terrain.h"
#include "apps/viewer/volume/shown_volume.h"
#include "levelset/progress.h"
#include "mapping/patches/patch.h"
#include "render/scene/scene.h"

namespace viewer {

/// The contents of the opened files. A model is not changed after it has been read.
struct Model {
  render::Scene scene;                        ///< solids and meshes; its camera is not used
  std::optional<render::Camera> camera = {};  ///< camera of the scene file, if one is set there
  std::vector<mapping::Patch> patches;
  /// If not null, the only solid of the scene is the first isosurface of this volume.
  std::shared_ptr<const ShownVolume> volume = {};
  /// If not null, the model is this terrain, and its scene is empty.
  std::shared_ptr<const ShownTerrain> terrain = {};
  Imath::Box3d solidBounds;  ///< box of the drawn surfaces or of the volume's grid, world units;
                             ///< empty when there are none
  Imath::Box3d bounds;       ///< box of the surfaces and of the patches' particles, world units
  std::string description = {};  ///< numbers of solids, voxels and patches, as a line for the user
  std::vector<std::filesystem::path>
      files;  ///< files that were read: first the level set, mesh or scene, then the patches
  std::vector<std::filesystem::path> watched = {};  ///< `files`, and the files that a scene names

  /// Diagonal of solidBounds, world units.
  [[nodiscard]] double extent() const { return solidBounds.size().length(); }
  /// True when a clip plane can cut the solids. Blended scenes cannot be cut, because the clip
  /// plane would be blended with the solids. Neither can open surfaces, and scenes with a
  /// transparent solid or mesh but without an expression, and volumes.
  [[nodiscard]] bool canCut() const;
};

/// Options of openModel().
struct OpenOptions {
  long resolution = 256;  ///< voxels along the longest side of a mesh
  levelset::Progress progress = {};
};

/// True for file names with an extension that the viewer can open.
[[nodiscard]] bool canOpen(const std::filesystem::path& file);

/// Reads a level set, a mesh (which is converted to a level set), a volume, a terrain or a scene,
/// and the patches that are shown together with it. A .vdb file without a level set is read as a
/// volume.
/// @param files  at most one file that is no patch, and any number of patches, in any order
/// @throws levelset::UsageError for an unknown extension, or a second file that is no patch
/// @throws as readBand(), readVolume(), readShownTerrain(), readMesh(), meshToBand(), readScene()
/// and
///         readPatches()
[[nodiscard]] Model openModel(const std::vector<std::filesystem::path>& files,
                              const OpenOptions& options = {});

/// Checks files before they are read: each must exist and have a known extension, and at most one
/// may be other than a patch.
/// @throws levelset::UsageError for an unknown extension, or a second file that is no patch
/// @throws levelset::IoError for a missing file
void requireReadable(const std::vector<std::filesystem::path>& files);

/// Files to open when the user opens `file` while the files `shown` are open. A patch is added to
/// `shown`, or read again if it is there. Any other file replaces `shown`.
[[nodiscard]] std::vector<std::filesystem::path> filesWith(
    const std::vector<std::filesystem::path>& shown, const std::filesystem::path& file);

}  // namespace viewer
