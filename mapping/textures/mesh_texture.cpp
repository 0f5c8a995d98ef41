#include "mapping/textures/mesh_texture.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "levelset/error.h"
#include "levelset/progress_gate.h"
#include "mapping/maps/layer_map.h"
#include "mapping/maps/prism_map.h"
#include "mapping/textures/texture_placement.h"

namespace mapping {

using Imath::V3d;

namespace {

/// Memory per vertex of a mesh with its attributes, bytes.
double bytesPerVertex(const levelset::TriMesh& mesh) {
  const levelset::MeshAttributes& held = mesh.attributes;
  return 24 + (held.normals.empty() ? 0 : 24) + (held.uvs.empty() ? 0 : 16) +
         (held.colors.empty() ? 0 : 16);
}

/// Number of normals of length zero.
std::size_t countLost(const std::vector<V3d>& normals) {
  return static_cast<std::size_t>(std::count(normals.begin(), normals.end(), V3d(0)));
}

/// The layer map of a patch, as moveVertices() uses it.
struct ByLayers {
  const Patch& patch;
  [[nodiscard]] V3d position(const V3d& uvw) const { return layerPosition(patch, uvw); }
  [[nodiscard]] ForwardFrame frame(const V3d& uvw) const { return layerFrame(patch, uvw); }
};

/// The map through the tetrahedra of a patch, as moveVertices() uses it.
struct ByPrisms {
  const PrismMap& prisms;
  [[nodiscard]] V3d position(const V3d& uvw) const { return prisms.toPatch(uvw); }
  [[nodiscard]] ForwardFrame frame(const V3d& uvw) const { return prisms.frame(uvw); }
};

/// Moves the vertices of `texture` by the map, and with kNormals also the normals.
/// @param hand  −1 if the patch is mirrored, otherwise 1
template <bool kNormals, typename Map>
void moveVertices(const levelset::TriMesh& texture, const Map& map,
                  const TexturePlacement& placement, double hand,
                  const levelset::Progress& progress, levelset::TriMesh& mesh) {
  const V3d perSize = V3d(1) / placement.box.size();
  levelset::ProgressGate gate(progress, mesh.positions.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.positions.size(), 4096),
                    [&](const auto& range) {
                      for (std::size_t i = range.begin(); i != range.end(); ++i) {
                        const V3d uvw = placement.toUvw(texture.positions[i]);
                        if constexpr (kNormals) {
                          const ForwardFrame frame = map.frame(uvw);
                          mesh.positions[i] = frame.position;
                          mesh.attributes.normals[i] = levelset::transformedNormal(
                              texture.attributes.normals[i],
                              {frame.slopes[0] * perSize.x, frame.slopes[1] * perSize.y,
                               frame.slopes[2] * perSize.z},
                              hand);
                        } else {
                          mesh.positions[i] = map.position(uvw);
                        }
                      }
                      gate.advance(range.size());
                    });
}

/// Moves the vertices of `texture` by the map, with its normals if it has any.
template <typename Map>
void moveMesh(const levelset::TriMesh& texture, const Map& map, const TexturePlacement& placement,
              bool isMirrored, const levelset::Progress& progress, MeshTextureResult& result) {
  levelset::TriMesh& mesh = result.mesh;
  mesh.positions.resize(texture.positions.size());
  mesh.attributes = texture.attributes;
  mesh.triangles = texture.triangles;
  const double hand = isMirrored ? -1 : 1;
  if (texture.attributes.normals.empty()) {
    moveVertices<false>(texture, map, placement, hand, progress, mesh);
  } else {
    moveVertices<true>(texture, map, placement, hand, progress, mesh);
    result.lostNormals = countLost(mesh.attributes.normals);
  }
  if (isMirrored)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
}

/// Builds the tetrahedra of a patch, with outer cells for the vertices beyond the unit cube.
PrismMap prismsFor(const levelset::TriMesh& texture, const Patch& patch,
                   const TexturePlacement& placement) {
  const Imath::Box3d own = levelset::bounds(texture);
  return {patch, LatticeBorder{.embedDepth = placement.embedDepth,
                               .reach = {placement.toUvw(own.min), placement.toUvw(own.max)}}};
}

void noteLostNormals(MeshTextureResult& result) {
  if (result.lostNormals == 0) return;
  result.notes.push_back(fmt::format(
      "{} of {} normals have length zero, in the mesh or after the mapping, and stay zero",
      result.lostNormals, result.mesh.attributes.normals.size()));
}

/// Maps the mesh onto one patch. Adds no note about normals of length zero.
MeshTextureResult mapOnto(const levelset::TriMesh& texture, const Patch& patch,
                          const MeshTextureOptions& options) {
  if (!std::isfinite(options.embedDepth)) {
    throw levelset::UsageError(
        fmt::format("the embedding depth is {}; give a length with --embed", options.embedDepth));
  }
  if (texture.isEmpty()) {
    throw levelset::InvalidInput("the mesh has no triangles; give a mesh with triangles");
  }
  requireAttributes(texture);
  if (patch.layers.size() < 2 || !(patch.height > 0)) {
    throw levelset::InvalidInput("the patch has no layers of particles; build it with `patch`");
  }
  const double embedDepth = options.embedDepth / patch.height;
  const TexturePlacement placement{chooseTextureBox(levelset::bounds(texture), options.textureBox),
                                   embedDepth};
  MeshTextureResult result;
  // Bytes per particle: up to ten samples of the layer map in its cell, with their statistics.
  constexpr double kSampleBytes = 5 * 2 * 160;
  const bool isPrism = options.map == MeshMap::Prisms;
  levelset::requireMemory(
      (isPrism ? PrismMap::estimateBytes(patch)
               : kSampleBytes * static_cast<double>(patch.particleCount())) +
          (16 + bytesPerVertex(texture)) * static_cast<double>(texture.positions.size()) +
          12 * static_cast<double>(texture.triangles.size()),
      options.maxMemory);
  levelset::report(options.progress, 0);
  const auto check = [&](const std::vector<MapSample>& samples, FoldCertificate certificate) {
    result.distortion = surveyDistortion(samples, placement.box.size(), patch.mirrored);
    result.certificate = std::move(certificate);
    result.notes = checkFolds(result.distortion, result.certificate, options.allowFolds);
  };
  if (isPrism) {
    const PrismMap prisms = prismsFor(texture, patch, placement);
    check(prisms.samples(), certifyPrisms(prisms, patch.mirrored));
    moveMesh(texture, ByPrisms{prisms}, placement, patch.mirrored, options.progress, result);
  } else {
    check(sampleLayerMap(patch, embedDepth), certifyLayers(patch, embedDepth));
    moveMesh(texture, ByLayers{patch}, placement, patch.mirrored, options.progress, result);
  }
  return result;
}

}  // namespace

MeshTextureResult mapMesh(const levelset::TriMesh& texture, const Patch& patch,
                          const MeshTextureOptions& options) {
  MeshTextureResult result = mapOnto(texture, patch, options);
  noteLostNormals(result);
  return result;
}

MeshTextureResult mapMesh(const levelset::TriMesh& texture, std::span<const Patch> patches,
                          const MeshTextureOptions& options) {
  if (patches.empty()) throw levelset::UsageError("there is no patch; build one with `patch`");
  if (patches.size() * texture.positions.size() > std::numeric_limits<std::uint32_t>::max()) {
    throw levelset::ResourceLimit(fmt::format(
        "{} patches of {} vertices exceed the vertex limit of a mesh; give fewer patches",
        patches.size(), texture.positions.size()));
  }
  levelset::requireMemory(
      static_cast<double>(patches.size()) *
          (bytesPerVertex(texture) * static_cast<double>(texture.positions.size()) +
           12 * static_cast<double>(texture.triangles.size())),
      options.maxMemory);
  MeshTextureResult result;
  std::vector<Distortion> distortions;
  std::vector<FoldCertificate> certificates;
  std::size_t noted = 0;
  for (std::size_t n = 0; n < patches.size(); ++n) {
    MeshTextureOptions part = options;
    const auto share = [&](std::size_t k) {
      return static_cast<double>(k) / static_cast<double>(patches.size());
    };
    part.progress = levelset::subProgress(options.progress, share(n), share(n + 1));
    part.allowFolds = options.allowFolds || options.skipFolds;
    MeshTextureResult one = mapOnto(texture, patches[n], part);
    const bool folds = one.distortion.folded > 0 || one.certificate.verdict() == FoldVerdict::Folds;
    if (options.skipFolds && folds) continue;
    append(result.mesh, one.mesh);
    result.lostNormals += one.lostNormals;
    noted += !one.notes.empty();
    distortions.push_back(one.distortion);
    certificates.push_back(std::move(one.certificate));
  }
  if (distortions.empty()) {
    throw levelset::InvalidInput(fmt::format(
        "all of {} patches fold; use a lower height or smaller patches", patches.size()));
  }
  result.skipped = patches.size() - distortions.size();
  if (result.skipped > 0) {
    result.notes.push_back(
        fmt::format("{} of {} patches fold and were left out", result.skipped, patches.size()));
  }
  noteLostNormals(result);
  result.distortion = worstOf(distortions);
  result.certificate = worstOf(certificates);
  if (noted > 0) {
    for (const std::string& note : checkFolds(result.distortion, result.certificate, true))
      result.notes.push_back(noted == 1 ? note
                                        : fmt::format("{} (the worst of {} patches)", note, noted));
  }
  return result;
}

}  // namespace mapping
