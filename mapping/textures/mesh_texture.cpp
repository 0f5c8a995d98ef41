#include "mapping/textures/mesh_texture.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <utility>

#include "levelset/error.h"
#include "levelset/progress_gate.h"
#include "mapping/maps/level_map.h"
#include "mapping/textures/texture_placement.h"

namespace mapping {

using Imath::V3d;

MeshTextureResult mapMesh(const levelset::TriMesh& texture, const Patch& patch,
                          const MeshTextureOptions& options) {
  constexpr const char* kTexture = "texture";
  if (!std::isfinite(options.sink)) {
    throw levelset::UsageError(
        fmt::format("{}: the sink is {}; give a length", kTexture, options.sink));
  }
  if (texture.isEmpty()) {
    throw levelset::InvalidInput(
        fmt::format("{}: the mesh has no triangles; give one with some", kTexture));
  }
  if (patch.levels.size() < 2 || !(patch.height > 0)) {
    throw levelset::InvalidInput(
        fmt::format("{}: the patch has no levels of particles; make it with `patch`", kTexture));
  }
  const double sink = options.sink / patch.height;
  const TexturePlacement placement{chooseTextureBox(levelset::bounds(texture), options.textureBox),
                                   sink};
  MeshTextureResult result;
  constexpr double kSampleBytes = 5 * 2 * 160;
  levelset::requireMemory(kSampleBytes * static_cast<double>(patch.particleCount()) +
                              40 * static_cast<double>(texture.positions.size()) +
                              12 * static_cast<double>(texture.triangles.size()),
                          options.maxMemory, kTexture);
  levelset::report(options.progress, 0, kTexture);
  result.distortion =
      surveyDistortion(sampleLevelMap(patch, sink), placement.box.size(), patch.mirrored);
  result.notes = judgeFolds(result.distortion, options.allowFolds);

  levelset::TriMesh& mesh = result.mesh;
  mesh.positions.resize(texture.positions.size());
  levelset::ProgressGate gate(options.progress, mesh.positions.size(), kTexture);
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, mesh.positions.size(), 4096), [&](const auto& range) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          mesh.positions[i] = levelPosition(patch, placement.toUvw(texture.positions[i]));
        gate.advance(range.size());
      });
  mesh.triangles = texture.triangles;
  if (patch.mirrored)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return result;
}

}  // namespace mapping
