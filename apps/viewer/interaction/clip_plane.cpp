#include "apps/viewer/interaction/clip_plane.h"

#include <Imath/ImathMatrix.h>
#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/pipeline/values/units.h"
#include "apps/viewer/model/layer_colours.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"

namespace viewer {
namespace {

using Imath::V3d;

constexpr const char* kCutName = "clip_plane";
constexpr double kBoxVoxels = 48;
// Fraction of the half width: values φ of larger magnitude may be rounded background, which is |φ|
// outside the band.
constexpr double kBeforeEnd = 1 - 1e-6;
// Length added to each edge of the cutting box, in voxels of that box. It leaves four of them on
// each side of the solids, because normals read values three voxels away.
constexpr double kBesideSolids = 8;

// Colours of φ, as in the action 'slice': Near…: next to the surface. Far…: at the end of the band.
// kDeepInside: inside the solid, beyond the band.
constexpr DisplayColour kNearInside = {0.77, 0.86, 0.91}, kFarInside = {0.35, 0.54, 0.75},
                        kNearOutside = {0.92, 0.89, 0.81}, kFarOutside = {0.81, 0.67, 0.46},
                        kDeepInside = {0.44, 0.49, 0.57};

DisplayColour mixedTones(const DisplayColour& a, const DisplayColour& b, double share) {
  DisplayColour colour;
  for (std::size_t c = 0; c < 3; ++c) colour[c] = a[c] + (b[c] - a[c]) * share;
  return colour;
}

/// Completes the unit vector n to a right-handed orthonormal frame (s, t, n).
void frameWith(const V3d& n, V3d& s, V3d& t) {
  s = (std::abs(n.x) < 0.9 ? V3d(1, 0, 0) : V3d(0, 1, 0)).cross(n).normalized();
  t = n.cross(s);
}

std::string unusedName(const render::Scene& scene, std::string name) {
  const auto isTaken = [&](const auto& part) { return part.name == name; };
  while (std::any_of(scene.solids.begin(), scene.solids.end(), isTaken) ||
         std::any_of(scene.beziers.begin(), scene.beziers.end(), isTaken))
    name += "_";
  return name;
}

/// Share of a pixel that a line covers. @param distance  distance of the line from the pixel's
/// centre, pixels; `halfWidth` is in pixels too
double lineShare(double distance, double halfWidth) {
  return std::clamp(halfWidth + 0.5 - distance, 0.0, 1.0);
}

struct PhiPainter {
  const render::Image& image;
  const render::Camera& camera;
  const PlacedPlane& plane;
  const render::Scene& scene;
  std::vector<std::uint8_t>& colours;
  // Voxel size of the finest band, and largest half width of all bands; both in world units.
  double voxel = 0, reach = 0;

  PhiPainter(const render::Image& image_, const render::Camera& camera_, const PlacedPlane& plane_,
             const render::Scene& scene_, std::vector<std::uint8_t>& colours_)
      : image(image_), camera(camera_), plane(plane_), scene(scene_), colours(colours_) {
    for (const render::Solid& solid : scene.solids) {
      if (solid.band.isEmpty()) continue;
      const double h = solid.band.voxelSize();
      voxel = voxel > 0 ? std::min(voxel, h) : h;
      reach = std::max(reach, solid.band.halfWidth() * h);
    }
  }

  void paintRows(int first, int last) const {
    std::vector<levelset::BandSampler> samplers;
    for (const render::Solid& solid : scene.solids) samplers.emplace_back(solid.band);
    for (int y = first; y < last; ++y)
      for (int x = 0; x < image.width; ++x) paintPixel(samplers, x, y);
  }

  void paintPixel(const std::vector<levelset::BandSampler>& samplers, int x, int y) const {
    const render::Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
    const double facing = ray.direction.dot(plane.normal);
    if (!(facing < 0)) return;
    const double distance = (plane.point - ray.origin).dot(plane.normal) / facing;
    const double depth = distance * ray.direction.dot(camera.axis());
    const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                          static_cast<std::size_t>(x);
    // Skip pixels in which a surface hides the plane. Solids are clipped in front of the plane, but
    // meshes are not.
    const auto seen = static_cast<double>(image.channels.at("Z")[i]);
    if (!(depth > 0 && depth < seen + 0.5 * voxel)) return;
    const V3d place = ray.origin + ray.direction * distance;
    std::vector<double> values;
    for (const levelset::BandSampler& sampler : samplers) values.push_back(sampler.value(place));
    const double phi = scenePhi(scene, values);
    if (!(phi < reach * kBeforeEnd)) return;
    const double pixel = camera.pixelSteps().down.length() * (camera.orthoHeight ? 1 : depth);
    blend(i, colourOf(phi, pixel), phi < 0 ? 1 : 0.85 * (1 - phi / reach));
  }

  /// Colour of a point of the plane with the value `phi`, world units.
  /// @param pixel  edge of a pixel at the point's depth, world units
  [[nodiscard]] DisplayColour colourOf(double phi, double pixel) const {
    DisplayColour colour = phi <= -reach * kBeforeEnd ? kDeepInside
                           : phi < 0 ? mixedTones(kNearInside, kFarInside, -phi / reach)
                                     : mixedTones(kNearOutside, kFarOutside, phi / reach);
    // Fade out the contours where they are six to three pixels apart; draw none below three.
    const double room = std::clamp((voxel / pixel - 3) / 3, 0.0, 1.0);
    const double whole = std::round(phi / voxel);
    double dark = 0;
    if (std::abs(phi) < reach - 0.3 * voxel && whole != 0)  // no contour at the end of the band
      dark = 0.45 * room * lineShare(std::abs(phi - whole * voxel) / pixel, 0.4);
    dark = std::max(dark, lineShare(std::abs(phi) / pixel, 0.9));
    for (double& c : colour) c *= 1 - dark;
    return colour;
  }

  void blend(std::size_t i, const DisplayColour& colour, double share) const {
    std::uint8_t* p = colours.data() + 4 * i;
    const double below = p[3] / 255.0 * (1 - share), alpha = share + below;
    for (std::size_t c = 0; c < 3; ++c)
      p[c] =
          static_cast<std::uint8_t>(std::lround((255 * colour[c] * share + p[c] * below) / alpha));
    p[3] = static_cast<std::uint8_t>(std::lround(255 * alpha));
  }
};

}  // namespace

ClipPlane parseClipPlane(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  ClipPlane clip;
  if (name == "x")
    clip.across = ClipPlane::Across::X;
  else if (name == "y")
    clip.across = ClipPlane::Across::Y;
  else if (name == "z")
    clip.across = ClipPlane::Across::Z;
  else if (name == "view")
    clip.across = ClipPlane::Across::View;
  else
    throw levelset::UsageError(fmt::format(
        "levelsmith-view: --clip '{}' is not a plane; give x=0.1, y=0.1, z=0.1 or view=0.1", text));
  if (equals != std::string::npos)
    clip.offset = pipeline::parseNumber(text.substr(equals + 1), "levelsmith-view: --clip");
  return clip;
}

PlacedPlane placed(const ClipPlane& clip, const render::Camera& camera,
                   const Imath::Box3d& bounds) {
  PlacedPlane plane{bounds.center(), -camera.axis()};
  if (clip.across == ClipPlane::Across::View) {
    plane.point += plane.normal * clip.offset;
    return plane;
  }
  const int axis = static_cast<int>(clip.across);
  plane.point[axis] = clip.offset;
  V3d normal(0);
  normal[axis] = 1;
  const V3d toEye = camera.orthoHeight ? -camera.axis() : camera.from - plane.point;
  plane.normal = toEye.dot(normal) < 0 ? -normal : normal;
  return plane;
}

ClippedScene::ClippedScene(const render::Scene& scene, const Imath::Box3d& bounds,
                           ClipPlane::Across across)
    : scene_(scene) {
  const double extent = std::max(bounds.size().length(), 1e-12), voxel = extent / kBoxVoxels;
  // Keep the cutting box small, because the length of occlusion rays depends on the bounds of all
  // solids.
  V3d size(extent);
  if (across != ClipPlane::Across::View) {
    V3d normal(0), s, t;
    normal[static_cast<int>(across)] = 1;
    frameWith(normal, s, t);
    const V3d whole = bounds.size();
    for (int a = 0; a < 3; ++a)
      size[a] = std::max(std::abs((a == 0 ? s : a == 1 ? t : normal).dot(whole)), extent / 4);
  }
  size += V3d(kBesideSolids * voxel);
  // Place the face of the box that cuts the solids half way between grid points of the box's grid.
  box_ = levelset::transform(levelset::makeBox(size, {0, 0, 0.5 * size.z + 0.5 * voxel}, voxel),
                             Imath::M44d().setTranslation(V3d(0, 0, -0.5 * voxel)));

  std::vector<std::string> names;
  std::string all;
  for (render::Solid& solid : scene_.solids) {
    if (solid.name.empty()) solid.name = unusedName(scene_, "solid");
    names.push_back(solid.name);
    all += (all.empty() ? "" : " | ") + solid.name;
  }
  const std::string cut = unusedName(scene_, kCutName);
  names.push_back(cut);
  for (render::BezierPart& part : scene_.beziers) {
    if (part.name.empty()) part.name = unusedName(scene_, "volume");
    names.push_back(part.name);
  }
  std::uint32_t id = 1;
  for (const render::Solid& solid : scene_.solids) id = std::max(id, solid.id + 1);
  for (const render::MeshPart& part : scene_.meshes) id = std::max(id, part.id + 1);
  for (const render::BezierPart& part : scene_.beziers) id = std::max(id, part.id + 1);
  for (const render::TerrainPart& part : scene_.terrains) id = std::max(id, part.id + 1);
  scene_.solids.push_back({.band = box_, .colour = {0.75f, 0.75f, 0.75f}, .id = id, .name = cut});
  scene_.csg = render::CsgExpression(
      fmt::format("({}) - {}", scene.csg.isEmpty() ? all : scene.csg.text(), cut), names);
}

const render::Scene& ClippedScene::at(const PlacedPlane& plane) {
  V3d s, t;
  frameWith(plane.normal, s, t);
  const V3d &n = plane.normal, &p = plane.point;
  const Imath::M44d matrix(s.x, s.y, s.z, 0, t.x, t.y, t.z, 0, n.x, n.y, n.z, 0, p.x, p.y, p.z, 1);
  scene_.solids.back().band = levelset::transform(box_, matrix);
  return scene_;
}

double scenePhi(const render::Scene& scene, const std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::infinity();
  // A Bézier volume has no φ.
  for (std::size_t n = 0; n < scene.beziers.size(); ++n)
    if (scene.isOperand(n)) return std::numeric_limits<double>::infinity();
  if (!scene.csg.isEmpty()) return scene.csg.phi(values.data());
  return *std::min_element(values.begin(), values.end());
}

void paintPhi(const render::Image& image, const render::Camera& camera, const PlacedPlane& plane,
              const render::Scene& scene, std::vector<std::uint8_t>& colours) {
  if (scene.solids.empty()) return;
  const PhiPainter painter(image, camera, plane, scene, colours);
  if (!(painter.reach > 0)) return;
  tbb::parallel_for(tbb::blocked_range<int>(0, image.height, 8),
                    [&](const auto& rows) { painter.paintRows(rows.begin(), rows.end()); });
}

}  // namespace viewer
