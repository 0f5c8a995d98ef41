#include "apps/pipeline/run/thumbnail.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>
#include <vector>

#include "apps/process_cost.h"
#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "render/camera.h"
#include "render/cpu/cpu_renderer.h"
#include "render/images/image.h"

namespace pipeline {
namespace {

/// Memory that the limit leaves beside the resident memory of the process, bytes.
std::size_t memoryLeft(std::size_t maxMemory) {
  const std::size_t limit = levelset::memoryLimit(maxMemory);
  const double held = apps::processStatusBytes("VmRSS:");
  if (!std::isfinite(held)) return limit;
  return limit - std::min(limit, static_cast<std::size_t>(held));
}

/// Memory of Embree's tree over a mesh, with its copies of vertices and faces, bytes per triangle.
constexpr double kBytesOfTriangle = 250;

std::string drawn(const Value& value, std::size_t maxBytes) {
  render::ViewedScene viewed = sceneOf(value);
  double triangles = 0;
  for (const render::MeshPart& part : viewed.scene.meshes)
    triangles += static_cast<double>(part.mesh->triangles.size());
  levelset::requireMemory(triangles * kBytesOfTriangle, maxBytes);
  render::Camera& camera = viewed.scene.camera;
  if (!viewed.hasCamera)
    camera = render::framingCamera(viewed.scene, kThumbnailWidth, kThumbnailHeight,
                                   camera.verticalFov, camera.up);
  camera.width = kThumbnailWidth;
  camera.height = kThumbnailHeight;
  const render::Image image = render::renderCpu(
      viewed.scene,
      {.ambientSamples = 2, .shadowSamples = 1, .curvature = false, .maxBytes = maxBytes});
  const std::vector<float>& alpha = image.channels.at("A");
  if (std::none_of(alpha.begin(), alpha.end(), [](float a) { return a > 0; })) return {};
  const std::vector<char> bytes = render::pngBytes(image);
  return {bytes.begin(), bytes.end()};
}

/// Reason why a kind of value has no picture; null if it may have one.
const char* reasonAgainst(Kind kind) {
  switch (kind) {
    case Kind::Patch:
      return "a patch has no thumbnail";
    case Kind::Field:
      return "a field has no thumbnail";
    case Kind::Surface:
      return "an open surface has no thumbnail";
    case Kind::Volume:
      return "a volume has no thumbnail";
    case Kind::Points:
      return "a point cloud has no thumbnail";
    case Kind::Deformation:
      return "a deformation has no thumbnail";
    default:
      return nullptr;
  }
}

}  // namespace

Thumbnail thumbnailOf(const Value& value, std::size_t maxMemory) {
  Thumbnail picture;
  if (const char* reason = reasonAgainst(value.kind())) {
    picture.missing = reason;
    return picture;
  }
  try {
    picture.png = drawn(value, memoryLeft(maxMemory));
    if (picture.png.empty()) picture.missing = "no surface is visible";
  } catch (const levelset::ResourceLimit&) {
    picture.missing = "too little memory is left";
  } catch (const std::bad_alloc&) {
    picture.missing = "too little memory is left";
  } catch (const std::exception&) {
    picture.missing = "the value has no surface to draw";
  }
  return picture;
}

}  // namespace pipeline
