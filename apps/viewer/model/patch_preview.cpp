#include "apps/viewer/model/patch_preview.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/transform/resample.h"
#include "mapping/placement/make_patch.h"
#include "mapping/surface/geodesic.h"
#include "mapping/surface/surface_projection.h"
#include "mapping/textures/geometric_texture.h"

namespace viewer {
namespace {

using Imath::V3d;
using levelset::NarrowBand;

double longestSideOf(const Imath::Box3d& box) {
  const V3d size = box.size();
  return std::max({size.x, size.y, size.z});
}

/// Geodesics between successive points; empty where the surface does not connect them.
std::vector<V3d> pathThrough(const mapping::SurfaceField& field, const std::vector<V3d>& points) {
  std::vector<V3d> path;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const std::vector<V3d> part = mapping::geodesic(field, 0, points[i], points[i + 1]);
    if (part.empty()) return {};
    path.insert(path.end(), part.begin() + (path.empty() ? 0 : 1), part.end());
  }
  return path;
}

/// Quotes a text for the shell.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

/// Actions that make the solid of the model from its file; empty if no file has this solid alone.
std::string baseActions(const Model& base, double voxelSize) {
  if (base.files.empty()) return "";
  const std::string read = "read " + quoted(base.files.front().string());
  if (levelset::isBandFormat(base.files.front())) return read;
  if (!levelset::isMeshFormat(base.files.front())) return "";
  return read + fmt::format(" ! level-set --voxel {}", voxelSize);
}

std::shared_ptr<const Model> modelWith(const Model& base, NarrowBand textured) {
  auto model = std::make_shared<Model>(base);
  model->scene.solids.front().band = std::move(textured);
  model->patches.clear();
  model->solidBounds = model->bounds = model->scene.bounds();
  return model;
}

void makePreview(const Model& base, const NarrowBand& surface, const levelset::Progress& progress,
                 PatchPreview& preview) {
  const PatchDesign& design = preview.design;
  std::array<V3d, 4> corners;
  std::copy(design.corners.begin(), design.corners.end(), corners.begin());
  const Imath::V2d size = sizeOf(preview.sides);
  preview.height = heightOf(design, size);
  preview.patchText = patchAction(design, preview.height);
  mapping::PatchOptions how{.sides = design.sides,
                            .progress = levelset::subProgress(progress, 0, 0.4)};
  if (!preview.isFine) {
    constexpr double kCells = 16;
    how.layers = 3;
    how.spacing = std::sqrt(size.x * size.y) / kCells;
  }
  preview.patch = mapping::makePatch(surface, corners, preview.height, how).patch;
  if (design.texture == TextureKind::None) return;
  const double voxel = surface.voxelSize();
  const TextureTile tile =
      makeTexture(design, size, voxel, levelset::subProgress(progress, 0.4, 0.5));
  mapping::TextureOptions options;
  options.voxelSize = voxel;
  options.progress = levelset::subProgress(progress, 0.5, 1);
  preview.model =
      modelWith(base, mapping::mapTexture(surface, tile.solid, *preview.patch, options).band);
  const std::string actions = baseActions(base, voxel);
  if (actions.empty()) return;
  preview.chainText = fmt::format(
      "levelsmith {} --as base ! {} --as patch ! {} --as tile ! texture @base @tile @patch --voxel "
      "{} ! write textured.vdb",
      actions, preview.patchText, tile.action, voxel);
}

}  // namespace

std::string whyNoPatch(const Model& model) {
  if (!model.volume && model.scene.solids.size() == 1 && model.scene.meshes.empty() &&
      !model.scene.isBlended() && !model.solidBounds.isEmpty() &&
      !model.scene.solids.front().band.isOpenSurface())
    return "";
  return "A patch needs a model with exactly one solid; open a level set or a mesh.";
}

double previewVoxel(const Model& base) {
  constexpr double kVoxels = 96;
  return std::max(base.scene.solids.front().band.voxelSize(),
                  longestSideOf(base.solidBounds) / kVoxels);
}

PatchPaths sidesOf(const NarrowBand& base, const PatchDesign& design) {
  const mapping::SurfaceField field(base);
  const auto projected = [&](V3d point) {
    return field.project(point, 0) ? point : mapping::closestSurfacePoint(base, point);
  };
  PatchPaths sides;
  for (std::size_t side = 0; side < 4; ++side) {
    const auto [first, last] = kSideEnds[side];
    if (first >= design.corners.size() || last >= design.corners.size()) continue;
    std::vector<V3d> points = {projected(design.corners[first])};
    for (const V3d& point : design.sides[side]) points.push_back(projected(point));
    points.push_back(projected(design.corners[last]));
    sides[side] = pathThrough(field, points);
  }
  return sides;
}

PatchPreview previewPatch(const Model& base, const NarrowBand& surface, const PatchDesign& design,
                          PreviewQuality quality, const levelset::Progress& progress) {
  PatchPreview preview;
  preview.isFine = quality == PreviewQuality::Fine;
  preview.design = design;
  try {
    preview.sides = sidesOf(surface, design);
    if (design.isWhole()) makePreview(base, surface, progress, preview);
  } catch (const levelset::Cancelled&) {
    throw;
  } catch (const levelset::Error& error) {
    preview.failure = error.what();
  }
  return preview;
}

// === PatchWorker

PatchWorker::PatchWorker(std::shared_ptr<const Model> base, std::function<void()> wake)
    : base_(std::move(base)), wake_(std::move(wake)), thread_([this] { run(); }) {}

PatchWorker::~PatchWorker() {
  {
    const std::scoped_lock lock(mutex_);
    isEnding_ = true;
    isNewer_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void PatchWorker::request(const PatchDesign& design, bool isDragging) {
  {
    const std::scoped_lock lock(mutex_);
    pending_ = Request{design, isDragging};
    isNewer_ = true;
  }
  changed_.notify_all();
}

std::shared_ptr<const PatchPreview> PatchWorker::preview() const {
  const std::scoped_lock lock(mutex_);
  return preview_;
}

bool PatchWorker::isBusy() const {
  const std::scoped_lock lock(mutex_);
  return isWorking_ || pending_;
}

void PatchWorker::publish(PatchPreview preview) {
  {
    const std::scoped_lock lock(mutex_);
    preview_ = std::make_shared<const PatchPreview>(std::move(preview));
  }
  if (wake_) wake_();
}

void PatchWorker::work(const Request& request) {
  const NarrowBand& fine = base_->scene.solids.front().band;
  const double voxel = previewVoxel(*base_);
  const bool isCoarser = voxel > fine.voxelSize() * 1.01;
  const auto isEnding = [this] {
    const std::scoped_lock lock(mutex_);
    return isEnding_;
  };
  const auto goOn = [&](double) { return !isEnding(); };
  if (isCoarser && coarse_.isEmpty()) coarse_ = levelset::resample(fine, voxel, {.progress = goOn});
  if (isCoarser || request.isDragging) {
    const NarrowBand& surface = isCoarser ? coarse_ : fine;
    PatchPreview sides;
    sides.design = request.design;
    sides.sides = sidesOf(surface, request.design);
    // Until the new texture is there, the previous one stays.
    if (const auto previous = preview(); previous && request.design.isWhole())
      sides.model = previous->model;
    publish(std::move(sides));
    publish(previewPatch(*base_, surface, request.design, PreviewQuality::Coarse, goOn));
  }
  if (request.isDragging || isNewer_) return;
  publish(previewPatch(*base_, fine, request.design, PreviewQuality::Fine,
                       [this](double) { return !isNewer_; }));
}

void PatchWorker::run() {
  for (;;) {
    Request request;
    {
      std::unique_lock lock(mutex_);
      isWorking_ = false;
      changed_.wait(lock, [&] { return isEnding_ || pending_; });
      if (isEnding_) return;
      request = *std::exchange(pending_, std::nullopt);
      isWorking_ = true;
      isNewer_ = false;
    }
    try {
      work(request);
    } catch (const levelset::Cancelled&) {
      // A newer request follows, or the end.
    } catch (const std::exception& error) {
      PatchPreview failed;
      failed.design = request.design;
      failed.failure = error.what();
      publish(std::move(failed));
    }
  }
}

}  // namespace viewer
