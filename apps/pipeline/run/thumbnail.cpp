#include "apps/pipeline/run/thumbnail.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>
#include <vector>

#include "apps/process_cost.h"
#include "levelset/error.h"
#include "levelset/memory_limit.h"
#include "render/camera.h"
#include "render/cpu/cpu_renderer.h"
#include "render/images/image.h"

namespace pipeline {
namespace {

/// What of the limit is left beside what the process holds.
std::size_t memoryLeft(std::size_t maxMemory) {
  const std::size_t limit = levelset::memoryLimit(maxMemory);
  const double held = apps::processStatusBytes("VmRSS:");
  if (!std::isfinite(held)) return limit;
  return limit - std::min(limit, static_cast<std::size_t>(held));
}

/// Of Embree's tree over a mesh, and its copies of corners and faces.
constexpr double kBytesOfTriangle = 250;

std::string drawn(const Value& value, std::size_t maxBytes) {
  render::ViewedScene viewed = sceneOf(value);
  double triangles = 0;
  for (const render::MeshPart& part : viewed.scene.meshes)
    triangles += static_cast<double>(part.mesh->triangles.size());
  levelset::requireMemory(triangles * kBytesOfTriangle, maxBytes, "render");
  render::Camera& camera = viewed.scene.camera;
  if (!viewed.hasCamera)
    camera = render::framingCamera(value.plan().bounds, kThumbnailWidth, kThumbnailHeight);
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

/// Why there is none for a kind of value; null: there may be one.
const char* reasonAgainst(Kind kind) {
  switch (kind) {
    case Kind::Patch:
      return "patches are not drawn";
    case Kind::Field:
      return "fields are not drawn";
    case Kind::Surface:
      return "open surfaces are not drawn";
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
    if (picture.png.empty()) picture.missing = "no surface is to be seen";
  } catch (const levelset::ResourceLimit&) {
    picture.missing = "too little memory is left";
  } catch (const std::bad_alloc&) {
    picture.missing = "too little memory is left";
  } catch (const std::exception&) {
    picture.missing = "there is no surface that can be drawn";
  }
  return picture;
}

}  // namespace pipeline
