#include "apps/viewer/model/model.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/mesh.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/terrain/files/height_field_file.h"
#include "levelset/terrain/tiles/tiled_ground.h"
#include "levelset/volume_files/volume_file.h"
#include "mapping/patches/patch_file.h"
#include "render/views/scene_file.h"

namespace viewer {
namespace {

namespace fs = std::filesystem;
using levelset::UsageError;

constexpr const char* kFormats =
    "vdb, nii, mha, mhd, nrrd, nhdr, mrc or map, ply, obj, stl or off (also .gz), asc, hgt, flt, "
    "bil, tif, dem, dt0 to dt2 or lst, json or patch";

enum class FileKind { Band, Volume, Mesh, Terrain, Scene, Patch, Unknown };

FileKind kindOf(const fs::path& file) {
  if (mapping::isPatchFormat(file.string())) return FileKind::Patch;
  if (render::isSceneFormat(file.string())) return FileKind::Scene;
  if (levelset::isMeshFormat(file)) return FileKind::Mesh;
  if (levelset::isBandFormat(file)) return FileKind::Band;
  // A raw file has no header, and the viewer has no options for its layout.
  if (levelset::isVolumeFormat(file) && !levelset::isRawFormat(file)) return FileKind::Volume;
  if (levelset::isHeightFormat(file) || levelset::isTiledGroundFormat(file))
    return FileKind::Terrain;
  return FileKind::Unknown;
}

/// Name of a solid from the name of its file. It has only letters, digits and _, as CSG expressions
/// require.
std::string solidNameOf(const fs::path& file) {
  const std::string stem = file.stem().string();
  std::string name;
  if (stem.empty() || std::isdigit(static_cast<unsigned char>(stem[0]))) name += '_';
  for (const char c : stem) name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

levelset::NarrowBand bandOfMesh(const fs::path& file, const OpenOptions& options) {
  const levelset::TriMesh mesh = levelset::readMesh(
      file, {.attributes = false, .progress = levelset::subProgress(options.progress, 0, 0.2)});
  const Imath::V3d size = levelset::bounds(mesh).size();
  const double longest = std::max({size.x, size.y, size.z});
  // Meshes with holes or wrong orientation are accepted, because they are only viewed.
  return levelset::withContext("'" + file.string() + "'", [&] {
    return levelset::meshToBand(mesh, longest / static_cast<double>(options.resolution),
                                {.acceptSign = true,
                                 .searchSelfIntersections = false,
                                 .progress = levelset::subProgress(options.progress, 0.2, 1)})
        .band;
  });
}

/// Name of the first grid of numbers in a .vdb file without a level set; empty for other files.
std::string volumeGridOf(const fs::path& file) {
  if (!levelset::isVdbFormat(file)) return "";
  const std::vector<levelset::GridInfo> grids = levelset::bandFileInfo(file);
  const auto isLevelSet = [](const levelset::GridInfo& grid) { return grid.isLevelSet; };
  if (std::any_of(grids.begin(), grids.end(), isLevelSet)) return "";
  for (const levelset::GridInfo& grid : grids)
    for (const char* type : {"float", "half", "double"})
      if (grid.type == type) return grid.name;
  return "";
}

void showVolume(const fs::path& file, const levelset::Volume& volume, const OpenOptions& options,
                Model& model) {
  model.volume = std::make_shared<const ShownVolume>(
      shownVolume(volume, levelset::subProgress(options.progress, 0.5, 1)));
  model.scene.solids.push_back(
      {.band = {},
       .name = solidNameOf(file),
       .volume = std::make_shared<const render::VolumeSurface>(model.volume->surface)});
}

/// Paths of the level sets, meshes, volumes, Bézier volumes, quadrics and terrains that a scene
/// file names.
/// @pre readScene() accepts the file
std::vector<fs::path> solidFilesOf(const fs::path& scene) {
  std::vector<fs::path> files;
  std::ifstream stream(scene);
  const auto json = nlohmann::json::parse(stream, nullptr, false);
  for (const char* list : {"solids", "meshes", "volumes", "beziers", "quadrics", "terrains"}) {
    if (!json.is_object() || !json.contains(list) || !json[list].is_array()) continue;
    for (const auto& part : json[list])
      if (part.is_object() && part.contains("file") && part["file"].is_string())
        files.push_back(scene.parent_path() / part["file"].get<std::string>());
  }
  return files;
}

void readSolids(const fs::path& file, FileKind kind, const OpenOptions& options, Model& model) {
  if (kind == FileKind::Scene) {
    render::ViewedScene viewed = render::readScene(file, {.progress = options.progress});
    if (viewed.hasCamera) model.camera = viewed.scene.camera;
    model.scene = std::move(viewed.scene);
    const std::vector<fs::path> named = solidFilesOf(file);
    model.watched.insert(model.watched.end(), named.begin(), named.end());
  } else if (kind == FileKind::Terrain) {
    model.terrain = std::make_shared<const ShownTerrain>(readShownTerrain(file, options.progress));
  } else if (kind == FileKind::Volume) {
    const levelset::Progress progress = levelset::subProgress(options.progress, 0, 0.5);
    showVolume(file, levelset::readVolume(file, {.progress = progress}), options, model);
  } else if (const std::string grid = volumeGridOf(file); !grid.empty()) {
    const levelset::Progress progress = levelset::subProgress(options.progress, 0, 0.5);
    const levelset::FieldGrid field =
        levelset::readField(file, {.grid = grid, .progress = progress});
    showVolume(file, levelset::volumeOf(field), options, model);
  } else {
    levelset::NarrowBand band = kind == FileKind::Mesh
                                    ? bandOfMesh(file, options)
                                    : levelset::readBand(file, {.progress = options.progress});
    model.scene.solids.push_back({.band = std::move(band), .name = solidNameOf(file)});
  }
}

void measureModel(Model& model) {
  std::size_t voxels = 0, particles = 0;
  for (const render::Solid& solid : model.scene.solids) {
    if (!solid.volume) voxels += solid.band.activeVoxelCount();
  }
  // The view must not depend on the isovalue.
  model.solidBounds = model.volume ? model.scene.volumeBounds() : model.scene.bounds();
  if (model.scene.volumePart) model.solidBounds.extendBy(model.scene.volumeBounds());
  if (model.terrain) model.solidBounds = boundsOf(*model.terrain);
  model.bounds = model.solidBounds;
  for (const mapping::Patch& patch : model.patches) {
    for (const mapping::ParticleLayer& level : patch.layers)
      for (const Imath::V3d& particle : level.positions) model.bounds.extendBy(particle);
    particles += patch.particleCount();
  }
  if (model.terrain) {
    model.description = model.terrain->description;
  } else if (model.volume) {
    const levelset::Volume& volume = model.volume->surface.volume();
    const Imath::V3i size = volume.size();
    model.description =
        fmt::format("volume of {} x {} x {} {}, values {:.6g} to {:.6g}", size.x, size.y, size.z,
                    levelset::volumeTypeName(volume.type()), volume.lowest(), volume.highest());
  } else if (!model.scene.solids.empty())
    model.description =
        fmt::format("{} solid{}, {:.2f} million voxels", model.scene.solids.size(),
                    model.scene.solids.size() == 1 ? "" : "s", static_cast<double>(voxels) * 1e-6);
  if (!model.scene.meshes.empty())
    model.description +=
        fmt::format("{}{} mesh{}", model.description.empty() ? "" : "; ", model.scene.meshes.size(),
                    model.scene.meshes.size() == 1 ? "" : "es");
  if (!model.scene.terrains.empty())
    model.description +=
        fmt::format("{}{} terrain{}", model.description.empty() ? "" : "; ",
                    model.scene.terrains.size(), model.scene.terrains.size() == 1 ? "" : "s");
  if (model.scene.volumePart)
    model.description += fmt::format("{}1 volume", model.description.empty() ? "" : "; ");
  if (!model.patches.empty())
    model.description +=
        fmt::format("{}{} patch{}, {} particles", model.description.empty() ? "" : "; ",
                    model.patches.size(), model.patches.size() == 1 ? "" : "es", particles);
}

}  // namespace

bool Model::canCut() const {
  // Clipping subtracts a box by a CSG expression. Without an expression of its own, the scene's
  // solids would be joined to a union, which hides surfaces inside transparent solids.
  const bool hidesNothing = scene.isOpaque() || !scene.csg.isEmpty();
  return !volume && !solidBounds.isEmpty() && !scene.solids.empty() && !scene.isBlended() &&
         hidesNothing &&
         std::none_of(scene.solids.begin(), scene.solids.end(),
                      [](const render::Solid& solid) { return solid.band.isOpenSurface(); });
}

bool canOpen(const fs::path& file) {
  return kindOf(file) != FileKind::Unknown;
}

void requireReadable(const std::vector<fs::path>& files) {
  const fs::path* solid = nullptr;
  for (const fs::path& file : files) {
    const FileKind kind = kindOf(file);
    if (kind == FileKind::Unknown)
      throw UsageError(
          fmt::format("open: '{}' has an unknown format; use {}", file.string(), kFormats));
    std::error_code wrong;
    if (!fs::exists(file, wrong))
      throw levelset::IoError(
          fmt::format("open: '{}' does not exist; check its name", file.string()));
    if (kind == FileKind::Patch) continue;
    if (solid)
      throw UsageError(fmt::format(
          "open: '{}' is a second level set, volume, mesh, terrain or scene after '{}'; open "
          "one of them, or combine both in a scene (see levelsmith help scene)",
          file.string(), solid->string()));
    solid = &file;
  }
}

Model openModel(const std::vector<fs::path>& files, const OpenOptions& options) {
  requireReadable(files);
  Model model;
  std::vector<fs::path> patchFiles;
  for (const fs::path& file : files) {
    const FileKind kind = kindOf(file);
    if (kind == FileKind::Patch) {
      patchFiles.push_back(file);
      continue;
    }
    model.files.push_back(file);
    model.watched.push_back(file);
    readSolids(file, kind, options, model);
  }
  for (const fs::path& file : patchFiles) {
    for (mapping::Patch& patch : mapping::readPatches(file))
      model.patches.push_back(std::move(patch));
    model.files.push_back(file);
    model.watched.push_back(file);
  }
  measureModel(model);
  return model;
}

std::vector<fs::path> filesWith(const std::vector<fs::path>& shown, const fs::path& file) {
  if (kindOf(file) != FileKind::Patch) return {file};
  std::vector<fs::path> files = shown;
  if (std::find(files.begin(), files.end(), file) == files.end()) files.push_back(file);
  return files;
}

}  // namespace viewer
