#include "apps/viewer/terrain/shown_terrain.h"

#include <fmt/core.h>

#include <array>
#include <chrono>
#include <cmath>
#include <utility>

#include "levelset/error.h"
#include "levelset/terrain/files/height_field_file.h"
#include "levelset/terrain/height_pyramid.h"
#include "levelset/terrain/tiles/tiled_ground.h"
#include "render/terrain/terrain_patch.h"

namespace viewer {
namespace {

constexpr double kTerrainPixels = 1;     // pixel error of the pictures
constexpr std::uint32_t kTerrainId = 1;  // id of the ground in pictures

/// Linear colours of the 256 values of a byte.
std::array<float, 256> linearOfBytes() {
  std::array<float, 256> linear{};
  for (std::size_t n = 0; n < linear.size(); ++n)
    linear[n] = static_cast<float>(render::linearOfDisplay(static_cast<double>(n) / 255));
  return linear;
}

std::string descriptionOf(const levelset::GroundLayout& layout) {
  return fmt::format("terrain of {} x {} samples, {:.6g} x {:.6g} apart", layout.columns,
                     layout.rows, layout.spacing.x, layout.spacing.y);
}

void requireKnown(bool isAnyKnown, const std::filesystem::path& file) {
  if (!isAnyKnown)
    throw levelset::InvalidInput(
        fmt::format("'{}' has no known height; choose another file", file.string()));
}

ShownTerrain openShownTiles(const std::filesystem::path& file) {
  ShownTerrain shown;
  shown.store = levelset::openTiledGround(file);
  const levelset::GroundLayout& layout = shown.store->layout();
  if (layout.isGeographic)
    throw levelset::InvalidInput(
        fmt::format("'{}' is in degrees; make a terrain in metres with 'read {} ! terrain "
                    "--metric'",
                    file.string(), file.string()));
  const render::PatchGrid grid(layout);
  requireKnown(!grid.box(grid.root()).isEmpty(), file);
  shown.description = descriptionOf(layout) + ", tiled";
  return shown;
}

}  // namespace

ShownTerrain readShownTerrain(const std::filesystem::path& file,
                              const levelset::Progress& progress) {
  if (levelset::isTiledGroundFormat(file)) return openShownTiles(file);
  levelset::HeightField field =
      levelset::readHeightField(file, {.progress = levelset::subProgress(progress, 0, 0.6)});
  ShownTerrain shown;
  shown.wasGeographic = field.isGeographic;
  if (shown.wasGeographic) field = levelset::metricHeights(std::move(field));
  requireKnown(field.missingCount() < field.heights.size(), file);
  levelset::HeightPyramid pyramid = levelset::heightPyramid(
      field, {.cells = kShownCells, .progress = levelset::subProgress(progress, 0.6, 1)});
  shown.field = std::make_shared<const levelset::HeightField>(std::move(field));
  shown.store = levelset::patchStoreOf(shown.field, std::move(pyramid));
  shown.description = descriptionOf(shown.store->layout()) +
                      (shown.wasGeographic ? " (degrees became metres)" : "");
  return shown;
}

Imath::Box3d boundsOf(const ShownTerrain& terrain) {
  const render::PatchGrid grid(terrain.store->layout());
  return grid.box(grid.root());
}

TerrainFrames::TerrainFrames(const ShownTerrain& terrain)
    : reading_(terrain.isReadAtOnce ? render::TerrainDetail::Reading::Now
                                    : render::TerrainDetail::Reading::Background),
      detail_(terrain.store, {.onArrival = [this] { noteArrival(); }}),
      painter_(render::makeTerrainPainter(detail_.layout())) {}

void TerrainFrames::noteArrival() {
  {
    const std::scoped_lock lock(mutex_);
    ++arrivals_;
  }
  hasNew_.notify_all();
}

TerrainFrames::Drawn TerrainFrames::draw(const render::Camera& camera) {
  const int arrivals = arrivals_;
  const render::TerrainSelection selection = detail_.select(camera, kTerrainPixels, reading_);
  Drawn drawn;
  drawn.image = std::make_shared<render::Image>(imageOf(painter_->draw(selection, camera), camera));
  // Patches that arrived after they were looked up are drawn by the next picture.
  drawn.isFinal = selection.isComplete || (detail_.isIdle() && arrivals == arrivals_);
  drawnArrivals_ = arrivals;
  for (const std::string& warning : detail_.takeWarnings()) note_ = warning;
  drawn.note = note_;
  return drawn;
}

void TerrainFrames::waitForPatch() {
  constexpr std::chrono::milliseconds kLongest(20);
  std::unique_lock lock(mutex_);
  hasNew_.wait_for(lock, kLongest, [this] { return arrivals_ != drawnArrivals_; });
}

render::Image imageOf(const render::TerrainPicture& picture, const render::Camera& camera) {
  static const std::array<float, 256> kLinear = linearOfBytes();
  render::Image image(picture.width, picture.height);
  std::array<std::vector<float>*, 4> colours = {&image.addChannel("R"), &image.addChannel("G"),
                                                &image.addChannel("B"), &image.addChannel("A")};
  std::array<std::vector<float>*, 3> normals = {&image.addChannel("N.X"), &image.addChannel("N.Y"),
                                                &image.addChannel("N.Z")};
  std::array<std::vector<float>*, 3> positions = {
      &image.addChannel("P.X"), &image.addChannel("P.Y"), &image.addChannel("P.Z")};
  std::vector<float>& depths = image.addChannel("Z");
  std::vector<std::uint32_t>& ids = image.ids["id"];
  ids.resize(image.pixelCount());
  const render::CameraRays rays(camera);
  for (std::size_t n = 0; n < image.pixelCount(); ++n) {
    const Imath::V4f& surface = picture.surfaces[n];
    depths[n] = surface.w;
    if (std::isinf(surface.w)) continue;
    ids[n] = kTerrainId;
    for (std::size_t c = 0; c < 3; ++c) (*colours[c])[n] = kLinear[picture.colours[4 * n + c]];
    (*colours[3])[n] = 1;
    const auto x = static_cast<int>(n) % picture.width, y = static_cast<int>(n) / picture.width;
    const render::Camera::Ray ray = rays.at(x + 0.5, y + 0.5);
    const Imath::V3d p = ray.origin + ray.direction * (static_cast<double>(surface.w) /
                                                       ray.direction.dot(rays.axis()));
    for (int axis = 0; axis < 3; ++axis) {
      (*normals[static_cast<std::size_t>(axis)])[n] = surface[axis];
      (*positions[static_cast<std::size_t>(axis)])[n] = static_cast<float>(p[axis]);
    }
  }
  return image;
}

}  // namespace viewer
