#include "apps/viewer/editing/deform_preview.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <utility>

#include "apps/viewer/editing/solid_model.h"
#include "levelset/deform/deform_band.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/transform/resample.h"

namespace viewer {
namespace {

using Imath::V3d;
using levelset::NarrowBand;
using levelset::TriMesh;

/// Copy of a model that shows a mesh instead of its solid.
std::shared_ptr<const Model> modelWithMesh(const Model& base, TriMesh mesh) {
  auto model = std::make_shared<Model>(base);
  const render::Solid& solid = base.scene.solids.front();
  model->scene.meshes = {{.mesh = std::make_shared<const TriMesh>(std::move(mesh)),
                          .colour = solid.colour,
                          .id = solid.id,
                          .name = solid.name,
                          .opacity = solid.opacity}};
  model->scene.solids.clear();
  model->patches.clear();
  model->solidBounds = model->bounds = model->scene.bounds();
  return model;
}

}  // namespace

std::string whyNoDeformation(const Model& model) {
  return hasOneSolid(model)
             ? ""
             : "A deformation needs a model with exactly one solid; open a level set or a mesh.";
}

std::string DeformPreview::certificateText() const {
  return certificate ? levelset::describe(*certificate) : "";
}

std::string deformChain(const Model& base, const DeformDesign& design,
                        const std::filesystem::path& file) {
  const std::string actions = baseActions(base, base.scene.solids.front().band.voxelSize());
  if (actions.empty()) return "";
  return fmt::format("levelsmith {} ! {} ! write deformed.vdb", actions, design.action(file));
}

TriMesh previewMesh(const NarrowBand& band, double voxelSize, const levelset::Progress& progress) {
  const bool isCoarser = voxelSize > band.voxelSize() * 1.01;
  const NarrowBand coarse =
      isCoarser ? levelset::resample(band, voxelSize,
                                     {.progress = levelset::subProgress(progress, 0, 0.7)})
                : band;
  TriMesh mesh =
      levelset::bandToMesh(coarse, {.progress = levelset::subProgress(progress, 0.7, 1)});
  const levelset::BandSampler sampler(coarse);
  for (const V3d& point : mesh.positions) mesh.attributes.normals.push_back(sampler.normal(point));
  return mesh;
}

TriMesh deformedMesh(const TriMesh& mesh, const levelset::Deformation& map) {
  TriMesh moved = mesh;
  tbb::parallel_for(std::size_t{0}, moved.positions.size(), [&](std::size_t n) {
    const levelset::DeformationJet jet = map.jet(mesh.positions[n]);
    moved.positions[n] = jet.position;
    if (mesh.attributes.normals.empty()) return;
    const double hand = jet.determinant() < 0 ? -1 : 1;
    moved.attributes.normals[n] =
        levelset::transformedNormal(mesh.attributes.normals[n], jet.slopes, hand);
  });
  return moved;
}

// === DeformWorker

DeformWorker::DeformWorker(std::shared_ptr<const Model> base, std::function<void()> wake)
    : base_(std::move(base)),
      work_([this](const Request& request, Work&) { work(request); },
            [this](const Request& request, const std::string& message) {
              DeformPreview failed{.design = *request.design};
              // The mesh and the certificate of this design may have been made before.
              const auto last = work_.result();
              if (last && last->design.points() == request.design->points()) failed = *last;
              failed.failure = message;
              return failed;
            },
            std::move(wake)) {}

void DeformWorker::work(const Request& request) {
  const NarrowBand& fine = base_->scene.solids.front().band;
  const auto goOn = [&](double) { return !work_.isEnding(); };
  if (coarse_.isEmpty()) coarse_ = previewMesh(fine, previewVoxel(*base_), goOn);
  const std::shared_ptr<const levelset::Deformation> map = request.design->deformation();
  DeformPreview preview{.design = *request.design};
  preview.model = modelWithMesh(*base_, deformedMesh(coarse_, *map));
  work_.publish(preview);
  constexpr std::chrono::milliseconds kAnyway(300);
  const auto begin = std::chrono::steady_clock::now();
  const auto isWanted = [&](double) {
    return !work_.isEnding() &&
           (!work_.isObsolete() || std::chrono::steady_clock::now() - begin < kAnyway);
  };
  const std::size_t limit = levelset::memoryLeft(levelset::memoryLimit(levelset::kNoMemoryLimit));
  preview.certificate = map->certify({.points = coarse_.positions, .triangles = coarse_.triangles},
                                     {.maxMemory = limit, .progress = isWanted})
                            .certificate;
  work_.publish(preview);
  if (request.isDragging || work_.isObsolete()) return;
  // Refuses maps that fold, and surfaces that leave the box, in the words of the action.
  NarrowBand solid =
      levelset::deformBand(
          fine, *map, {.maxMemory = limit, .progress = [&](double) { return !work_.isObsolete(); }})
          .band;
  preview.model = modelWith(*base_, std::move(solid));
  preview.isFine = true;
  work_.publish(std::move(preview));
}

}  // namespace viewer
