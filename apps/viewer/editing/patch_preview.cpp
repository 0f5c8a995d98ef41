#include "apps/viewer/editing/patch_preview.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/viewer/editing/solid_model.h"
#include "levelset/error.h"
#include "levelset/transform/resample.h"
#include "mapping/placement/make_patch.h"
#include "mapping/surface/geodesic.h"
#include "mapping/surface/surface_projection.h"
#include "mapping/textures/geometric_texture.h"

namespace viewer {
namespace {

using Imath::V3d;
using levelset::NarrowBand;

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
  return hasOneSolid(model)
             ? ""
             : "A patch needs a model with exactly one solid; open a level set or a mesh.";
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
    : base_(std::move(base)),
      work_([this](const Request& request, Work&) { work(request); },
            [](const Request& request, const std::string& message) {
              PatchPreview failed;
              failed.design = request.design;
              failed.failure = message;
              return failed;
            },
            std::move(wake)) {}

void PatchWorker::work(const Request& request) {
  const NarrowBand& fine = base_->scene.solids.front().band;
  const double voxel = previewVoxel(*base_);
  const bool isCoarser = voxel > fine.voxelSize() * 1.01;
  const auto goOn = [&](double) { return !work_.isEnding(); };
  if (isCoarser && coarse_.isEmpty()) coarse_ = levelset::resample(fine, voxel, {.progress = goOn});
  if (isCoarser || request.isDragging) {
    const NarrowBand& surface = isCoarser ? coarse_ : fine;
    PatchPreview sides;
    sides.design = request.design;
    sides.sides = sidesOf(surface, request.design);
    // Until the new texture is there, the previous one stays.
    if (const auto previous = preview(); previous && request.design.isWhole())
      sides.model = previous->model;
    work_.publish(std::move(sides));
    work_.publish(previewPatch(*base_, surface, request.design, PreviewQuality::Coarse, goOn));
  }
  if (request.isDragging || work_.isObsolete()) return;
  work_.publish(previewPatch(*base_, fine, request.design, PreviewQuality::Fine,
                             [this](double) { return !work_.isObsolete(); }));
}

}  // namespace viewer
