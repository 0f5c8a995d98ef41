#include "apps/viewer/interaction/pick.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "apps/viewer/volume/volume_slices.h"
#include "levelset/grids/sample.h"

namespace viewer {
namespace {

using Imath::V3d;

std::size_t pixelAt(const render::Image& image, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
         static_cast<std::size_t>(x);
}

V3d vectorAt(const render::Image& image, const char* name, std::size_t i) {
  const auto part = [&](const char* axis) {
    return static_cast<double>(image.channels.at(fmt::format("{}.{}", name, axis))[i]);
  };
  return {part("X"), part("Y"), part("Z")};
}

/// Name of the solid or mesh that a pixel with the given id shows. If several solids have the id:
/// the solid whose surface is nearest to the point. If no solid or mesh has it, as on the clip
/// plane: the solid in which the point lies deepest. @param phi  φ of each solid at the point,
/// world units
std::string nameAt(const render::Scene& scene, std::uint32_t id, const std::vector<double>& phi) {
  std::string name;
  double least = INFINITY;
  const auto consider = [&](std::size_t i, double rank) {
    if (rank >= least) return;
    least = rank;
    name = scene.solids[i].name;
  };
  for (std::size_t i = 0; i < phi.size(); ++i)
    if (scene.solids[i].id == id) consider(i, std::abs(phi[i]));
  for (const render::MeshPart& part : scene.meshes)
    if (part.id == id && name.empty()) return part.name;
  for (const render::BezierPart& part : scene.beziers)
    if (part.id == id && name.empty()) return part.name;
  for (const render::QuadricPart& part : scene.quadrics)
    if (part.id == id && name.empty()) return part.name;
  for (const render::TerrainPart& part : scene.terrains)
    if (part.id == id && name.empty()) return part.name;
  for (std::size_t i = 0; i < phi.size() && least == INFINITY; ++i) consider(i, phi[i]);
  return name;
}

/// Point of the slices at a position in window pixels, if it lies in front of a surface.
/// @param surface  depth of the surface there; infinite without one
std::optional<SlicePoint> sliceSeen(const Frame& frame, double x, double y, double surface) {
  if (!frame.view.model->volume) return std::nullopt;
  const std::optional<SlicePoint> seen = sliceAt(frame.view.model->volume->surface.volume(),
                                                 frame.display.slices, frame.view.camera, x, y);
  return seen && seen->depth < surface ? seen : std::nullopt;
}

/// Point of the isosurface or of a slice of a volume.
/// @param i  number of the pixel in the image
std::optional<Picked> pickInVolume(const Frame& frame, int x, int y, std::size_t i) {
  const render::Image& image = *frame.image;
  const levelset::Volume& volume = frame.view.model->volume->surface.volume();
  const auto depth = static_cast<double>(image.channels.at("Z")[i]);
  Picked picked;
  picked.phi = NAN;
  picked.solid = frame.view.model->scene.solids.front().name;
  if (const auto slice = sliceSeen(frame, x + 0.5, y + 0.5, depth)) {
    picked.position = slice->position;
    picked.normal = sliceNormal(volume, slice->axis);
    picked.value = slice->value;
    return picked;
  }
  if (!std::isfinite(depth)) return std::nullopt;
  picked.position = vectorAt(image, "P", i);
  picked.normal = vectorAt(image, "N", i);
  picked.value = volume.trilinear(picked.position * volume.grid().indexToWorld.inverse());
  return picked;
}

}  // namespace

std::optional<Picked> pick(const Frame& frame, int x, int y) {
  const render::Image& image = *frame.image;
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return std::nullopt;
  const std::size_t i = pixelAt(image, x, y);
  if (frame.view.model->volume) return pickInVolume(frame, x, y, i);
  if (!std::isfinite(image.channels.at("Z")[i])) return std::nullopt;
  Picked picked{.position = vectorAt(image, "P", i), .normal = vectorAt(image, "N", i)};
  const render::Scene& scene = frame.view.model->scene;
  std::vector<double> values;
  for (const render::Solid& solid : scene.solids)
    values.push_back(levelset::BandSampler(solid.band).value(picked.position));
  picked.phi = scenePhi(scene, values);
  picked.solid = nameAt(scene, image.ids.at("id")[i], values);
  return picked;
}

std::optional<double> depthSeen(const Frame& frame, double x, double y) {
  const render::Image& image = *frame.image;
  const auto place = [](double at, int window, int size) {
    return std::clamp(static_cast<int>(at * size / window), 0, size - 1);
  };
  const render::Camera& camera = frame.view.camera;
  const std::size_t i =
      pixelAt(image, place(x, camera.width, image.width), place(y, camera.height, image.height));
  const auto depth = static_cast<double>(image.channels.at("Z")[i]);
  if (const auto slice = sliceSeen(frame, x, y, depth)) return slice->depth;
  return std::isfinite(depth) ? std::optional(depth) : std::nullopt;
}

std::string pickedJson(const std::optional<Picked>& picked) {
  if (!picked) return "null";
  const auto list = [](const V3d& v) {  // the sum turns negative zeros to zeros
    return nlohmann::ordered_json{v.x + 0.0, v.y + 0.0, v.z + 0.0};
  };
  nlohmann::ordered_json json = {{"position", list(picked->position)},
                                 {"normal", list(picked->normal)},
                                 {"phi", picked->phi},
                                 {"solid", picked->solid}};
  if (picked->value) json["value"] = *picked->value;
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace viewer
