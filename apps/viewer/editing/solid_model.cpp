#include "apps/viewer/editing/solid_model.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "levelset/files/band_file.h"
#include "levelset/mesh_files/mesh_file.h"

namespace viewer {

bool hasOneSolid(const Model& model) {
  return !model.volume && model.scene.solids.size() == 1 && model.scene.meshes.empty() &&
         !model.scene.isBlended() && !model.solidBounds.isEmpty() &&
         !model.scene.solids.front().band.isOpenSurface();
}

double previewVoxel(const Model& base) {
  constexpr double kVoxels = 96;
  const Imath::V3d size = base.solidBounds.size();
  return std::max(base.scene.solids.front().band.voxelSize(),
                  std::max({size.x, size.y, size.z}) / kVoxels);
}

std::shared_ptr<const Model> modelWith(const Model& base, levelset::NarrowBand solid) {
  auto model = std::make_shared<Model>(base);
  model->scene.solids.front().band = std::move(solid);
  model->patches.clear();
  model->solidBounds = model->bounds = model->scene.bounds();
  return model;
}

std::string baseActions(const Model& base, double voxelSize) {
  if (base.files.empty()) return "";
  const std::string read = "read " + quoted(base.files.front().string());
  if (levelset::isBandFormat(base.files.front())) return read;
  if (!levelset::isMeshFormat(base.files.front())) return "";
  return read + fmt::format(" ! level-set --voxel {}", voxelSize);
}

std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

}  // namespace viewer
