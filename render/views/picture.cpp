#include "render/views/picture.h"

#include <fmt/core.h>

#include <cmath>
#include <limits>
#include <string>

#include "levelset/error.h"
#include "levelset/vdb.h"
#include "render/scene/field_expression.h"
#include "render/shading/curvature_lines.h"

namespace render {
namespace {

using Imath::V3d;

constexpr int kMaxSamples = 65536;

/// Requires parts and a style whose light paths can be traced.
void requireOptics(const Scene& scene, const RenderOptions& options) {
  validate(options.optics);
  if (scene.volumePart)
    throw levelset::UsageError(
        "traced reflection and refraction do not see a volume with a transfer function; leave "
        "--reflect and --refract out");
  if (scene.segmented && options.optics.refract > 0)
    throw levelset::UsageError(
        "the surfaces of a segmentation have solids on both sides, so --refract has no index for "
        "them; leave it out, or draw one region as a level set");
  if (options.style.style == Style::CurvatureLines)
    throw levelset::UsageError(
        "the style curvature-lines draws over the colours; leave --reflect and --refract out, or "
        "give another style");
}

}  // namespace

PictureLayers::PictureLayers(Image& image, const Scene& scene, const RenderOptions& options) {
  r = image.addChannel("R").data();
  g = image.addChannel("G").data();
  b = image.addChannel("B").data();
  a = image.addChannel("A").data();
  z = image.addChannel("Z", std::numeric_limits<float>::infinity()).data();
  const char* axes[3] = {"X", "Y", "Z"};
  for (int i = 0; i < 3; ++i) {
    n[i] = image.addChannel(fmt::format("N.{}", axes[i])).data();
    p[i] = image.addChannel(fmt::format("P.{}", axes[i])).data();
  }
  const char* kinds[4] = {"mean", "gauss", "k1", "k2"};
  for (int i = 0; options.hasCurvature() && i < 4; ++i)
    curvature[i] = image.addChannel(fmt::format("curvature.{}", kinds[i])).data();
  for (int k = 0; options.hasDirections() && k < 2; ++k)
    for (int i = 0; i < 3; ++i)
      direction[k][i] = image.addChannel(fmt::format("direction{}.{}", k + 1, axes[i])).data();
  if (options.thickness) thickness = image.addChannel("thickness").data();
  if (options.lightLayers) {
    light[0] = image.addChannel("light.sky", 1).data();
    light[1] = image.addChannel("light.key", 1).data();
  }
  const char* lights[4] = {"R", "G", "B", "A"};
  for (int c = 0; scene.volumePart && options.volumeLight && c < 4; ++c)
    volume[c] = image.addChannel(fmt::format("volume.{}", lights[c])).data();
  auto& ids = image.ids["id"];
  ids.assign(image.pixelCount(), 0);
  id = ids.data();
}

void PictureLayers::setHit(std::size_t i, const Camera& camera, const Hit& hit) const {
  z[i] = static_cast<float>((hit.position - camera.from).dot(camera.axis()));
  for (int axis = 0; axis < 3; ++axis) {
    n[axis][i] = static_cast<float>(hit.normal[axis]);
    p[axis][i] = static_cast<float>(hit.position[axis]);
  }
  id[i] = hit.id;
  if (hit.isBeyondBand) ++beyondBand;
  if (hit.isSingular) ++singular;
}

void PictureLayers::addWarnings(Image& image, const Scene& scene) const {
  const auto warn = [&image](const std::string& text) {
    std::string& all = image.attributes["ls:warning"];
    all += all.empty() ? text : ". " + text;
  };
  if (const std::size_t count = singular; count > 0)
    image.attributes["ls:bezierSingular"] = fmt::format("{}", count);
  if (const std::size_t count = overruns; count > 0) {
    image.attributes["ls:bezierOverruns"] = fmt::format("{}", count);
    warn(fmt::format(
        "rays gave up {} time{} after {} undecided parts of a Bézier volume, so pixels may miss "
        "its surface; move the camera so that no ray lies in the surface",
        count, count == 1 ? "" : "s", kMostVisits));
  }
  if (const std::size_t count = open; count > 0) {
    image.attributes["ls:bezierOpen"] = fmt::format("{}", count);
    warn(fmt::format(
        "camera rays entered a Bézier volume of the expression without leaving it, or left it "
        "without entering, {} time{}; these crossings are left out, so pixels may be wrong; close "
        "the gaps of the volume, or leave it out of --csg",
        count, count == 1 ? "" : "s"));
  }
  const std::size_t count = beyondBand;
  if (count == 0) return;
  warn(fmt::format(
      "{} pixel{} show{} the {} outside a band, where the distance is unknown and the shape is "
      "wrong; widen the bands with rebuild-band",
      count, count == 1 ? "" : "s", count == 1 ? "s" : "",
      scene.morph ? "morph" : "soft expression"));
}

void PictureLayers::setCurvature(std::size_t i, const Hit& hit) const {
  const CurvatureSample& sample = hit.curvature;
  const double values[4] = {sample.mean, sample.gauss, sample.k1, sample.k2};
  for (int k = 0; curvature[0] && k < 4; ++k) curvature[k][i] = static_cast<float>(values[k]);
  if (!direction[0][0]) return;
  const V3d lines[2] = {sample.direction1, asLine(hit.normal.cross(sample.direction1))};
  for (int k = 0; k < 2; ++k)
    for (int axis = 0; axis < 3; ++axis) direction[k][axis][i] = static_cast<float>(lines[k][axis]);
}

void PictureLayers::setLight(std::size_t i, double sky, double key) const {
  light[0][i] = static_cast<float>(sky);
  light[1][i] = static_cast<float>(key);
}

void PictureLayers::setVolume(std::size_t i, const VolumeLight& lit) const {
  for (int c = 0; c < 3; ++c) volume[c][i] = static_cast<float>(lit.colour[c]);
  volume[3][i] = static_cast<float>(1 - lit.transmittance);
}

void PictureLayers::setColour(std::size_t i, const ColourSum& sum, int samples) const {
  const float weight = 1.0f / static_cast<float>(samples);
  r[i] = sum.colour.x * weight;
  g[i] = sum.colour.y * weight;
  b[i] = sum.colour.z * weight;
  a[i] = static_cast<float>(sum.coverage) * weight;
}

void requireOpacity(const Scene& scene) {
  const auto require = [](const auto& parts) {
    for (const auto& part : parts)
      if (!(part.opacity > 0 && part.opacity <= 1))
        throw levelset::UsageError(
            fmt::format("an opacity of {} is out of range; give more than 0 and at most 1, or "
                        "leave the part out",
                        part.opacity));
  };
  require(scene.solids);
  require(scene.meshes);
  require(scene.beziers);
}

void requireLight(const Scene& scene) {
  const V3d& d = scene.key.direction;
  const double sum = d.x + d.y + d.z + scene.key.strength + scene.ambient;
  if (!std::isfinite(sum) || d == V3d(0) ||
      !(scene.key.softness >= 0 && scene.key.softness < 1.5) || scene.key.strength < 0 ||
      scene.ambient < 0) {
    throw levelset::UsageError(fmt::format(
        "a light towards {},{},{} of strength {}, softness {} and ambient {} is not valid; "
        "give finite numbers, none negative, and a softness below 1.5 radians",
        d.x, d.y, d.z, scene.key.strength, scene.key.softness, scene.ambient));
  }
}

void requirePicture(const Scene& scene, const RenderOptions& options) {
  validate(scene.camera);
  const auto inRange = [](int count, int low) { return count >= low && count <= kMaxSamples; };
  if (!inRange(options.samples, 1) || !inRange(options.ambientSamples, 0) ||
      !inRange(options.shadowSamples, 0)) {
    throw levelset::UsageError(fmt::format(
        "{} samples, {} ambient and {} shadow samples are out of range; give 1 to {} "
        "samples and 0 to {} of "
        "the others",
        options.samples, options.ambientSamples, options.shadowSamples, kMaxSamples, kMaxSamples));
  }
  requireLight(scene);
  requireOpacity(scene);
  const StyleOptions& style = options.style;
  if (!(style.curvatureRange >= 0 && std::isfinite(style.curvatureRange)) ||
      !(style.lineWidth >= 0 && style.lineWidth <= 1000)) {
    throw levelset::UsageError(
        fmt::format("a curvature range of {} or a line width of {} pixels is out of range; give a "
                    "range of 0 or more, and a width from 0 to 1000 pixels",
                    style.curvatureRange, style.lineWidth));
  }
  if (style.style == Style::CurvatureLines) {
    if (!scene.isOpaque() || scene.volumePart)
      throw levelset::UsageError(
          "the style curvature-lines shows the first surface along each ray, and does not support "
          "transparent parts and volumes with a transfer function; draw them without it");
    if (style.lineWidth > kWidestStreak)
      throw levelset::UsageError(fmt::format(
          "a line width of {} pixels is too large for the style curvature-lines; give at "
          "most {} pixels",
          style.lineWidth, kWidestStreak));
  }
  if (options.optics.isActive()) requireOptics(scene, options);
  if (style.style == Style::Matcap && !style.matcap)
    throw levelset::UsageError("the style matcap needs a picture of a shaded ball; give a PNG");
  if (options.fromNanoVdb && options.filter != Filter::Trilinear)
    throw levelset::UsageError(
        "NanoVDB grids support only the trilinear filter; use that filter, or draw from bricks");
  if (scene.volumePart && scene.ground)
    throw levelset::UsageError(
        "a volume with a transfer function has no shadow; leave --ground out, or draw the scene "
        "without the volume");
  requireOperands(scene);
  requireFields(scene);
  if (scene.isBlended() && options.filter != Filter::Trilinear)
    throw levelset::UsageError(
        fmt::format("soft expressions and morphs support only the trilinear filter, not "
                    "{}; omit the filter",
                    filterName(options.filter)));
  if (scene.isBlended() && options.fromNanoVdb)
    throw levelset::UsageError(
        "soft expressions and morphs cannot be drawn from NanoVDB grids; draw from "
        "bricks");
  if (scene.segmented && scene.isBlended())
    throw levelset::UsageError(
        "a segmentation cannot be drawn beside a soft expression or a morph; draw it alone");
  if (!scene.beziers.empty() && scene.isBlended())
    throw levelset::UsageError(
        "a Bézier volume cannot be drawn beside a soft expression or a morph; draw it alone");
  if (!scene.beziers.empty() && options.thickness)
    throw levelset::UsageError(
        "the thickness of Bézier volumes cannot be measured; omit --thickness");
  if (!scene.quadrics.empty() && scene.isBlended())
    throw levelset::UsageError(
        "quadrics cannot be drawn beside a soft expression or a morph; draw them alone");
  if (!scene.quadrics.empty() && options.thickness)
    throw levelset::UsageError("the thickness of quadrics cannot be measured; omit --thickness");
  if (!scene.terrains.empty() && scene.isBlended())
    throw levelset::UsageError(
        "a terrain cannot be drawn beside a soft expression or a morph; draw it alone");
  if (!scene.terrains.empty() && options.thickness)
    throw levelset::UsageError("the thickness of a terrain cannot be measured; omit --thickness");
  for (const TerrainPart& part : scene.terrains) requireRamp(part.ramp);
  if (scene.segmented && options.filter != Filter::Trilinear)
    throw levelset::UsageError(fmt::format(
        "segmentations support only the trilinear filter, not {}; omit the filter, or make a mesh "
        "or a level set of the segmentation first",
        filterName(options.filter)));
  if (!scene.mapped.empty() && options.filter != Filter::Trilinear)
    throw levelset::UsageError(
        fmt::format("mapped textures support only the trilinear filter, not {}; omit the filter",
                    filterName(options.filter)));
  if (!scene.mapped.empty() && options.thickness)
    throw levelset::UsageError(
        "the thickness of solids with mapped textures cannot be measured; omit --thickness, or map "
        "the texture without --instances");
  // Half width of a band that the spline filters need, voxels: 3, less a margin for rounding.
  constexpr double kReach = 2.99;
  if (scene.hasVolume() && (scene.isBlended() || !scene.csg.isEmpty()))
    throw levelset::UsageError(
        "a volume cannot be an operand of an expression or a morph, because its isosurface may be "
        "open; make a solid of it with isosurface");
  for (const Solid& solid : scene.solids) {
    if (solid.volume && solid.quantization.bits != 32)
      throw levelset::UsageError(
          "the values of a volume are stored in 32 bits in the tables; omit --value-bits");
    if (solid.volume && options.fromNanoVdb)
      throw levelset::UsageError("a volume cannot be drawn from NanoVDB grids; draw from bricks");
    if (options.filter == Filter::Trilinear || solid.volume || solid.band.isEmpty()) continue;
    const bool isComputed =
        options.filter == Filter::BSplineQi || options.filter == Filter::BccQuadratic;
    if (isComputed && solid.quantization.bits != 32)
      throw levelset::UsageError(
          fmt::format("the filter {} does not support values of {} bits; use 32 bits, or another "
                      "filter",
                      filterName(options.filter), solid.quantization.bits));
    if (solid.band.halfWidth() >= kReach) continue;
    throw levelset::InvalidInput(fmt::format(
        "the filter {} reads values up to 3 voxels from the surface, but the band has a "
        "half width of {:.3g}; widen it with rebuild-band, or use the trilinear filter",
        filterName(options.filter), solid.band.halfWidth()));
  }
  const double pixels = static_cast<double>(scene.camera.width) * scene.camera.height;
  const double channels = 12 + (options.hasCurvature() ? 4 : 0) +
                          (options.hasDirections() ? 6 : 0) + (options.thickness ? 1 : 0) +
                          (options.lightLayers ? 2 : 0) +
                          (scene.volumePart && options.volumeLight ? 4 : 0);
  // The line field, and the noise while it is made.
  const double streaks = options.style.style == Style::CurvatureLines ? 30 : 0;
  levelset::requireMemory(pixels * (4 * channels + streaks), options.maxBytes);
}

void refuseEmptyScene() {
  throw levelset::InvalidInput("the scene has no surface; add at least one solid with a zero set");
}

std::map<std::string, std::string> sceneAttributes(const Scene& scene,
                                                   const RenderOptions& options) {
  const Filter filter = options.filter;
  std::string grids, voxelSizes, bits;
  for (const Solid& solid : scene.solids) {
    if (solid.isEmpty(filter)) continue;
    const char* comma = grids.empty() ? "" : ", ";
    if (solid.volume)
      grids += fmt::format("{}volume {:016x} at {}", comma, solid.volume->volume().contentHash(),
                           solid.volume->isovalue());
    else
      grids += fmt::format("{}{} {:016x}", comma, levelset::vdb(solid.band).getName(),
                           solid.band.contentHash());
    voxelSizes += fmt::format("{}{}", comma, solid.voxelSize());
    bits += fmt::format("{}{}", comma, solid.quantization.bits);
  }
  std::map<std::string, std::string> attributes = {
      {"ls:filter", filterName(filter)},
      {"ls:normal", filter == Filter::Trilinear ? "bspline-qi" : filterName(filter)},
      {"ls:grid", grids},
      {"ls:voxelSize", voxelSizes},
      {"ls:valueBits", bits}};
  std::string meshes;
  for (const MeshPart& part : scene.meshes)
    meshes +=
        fmt::format("{}{} triangles", meshes.empty() ? "" : ", ", part.mesh->triangles.size());
  if (!meshes.empty()) attributes["ls:mesh"] = meshes;
  std::string mapped;
  for (const MappedTexture& texture : scene.mapped)
    mapped += fmt::format("{}{:016x} in {} shells", mapped.empty() ? "" : ", ",
                          texture.band.contentHash(), texture.shells ? texture.shells->size() : 0);
  if (!mapped.empty()) attributes["ls:mapped"] = mapped;
  if (scene.segmented)
    attributes["ls:segmentation"] =
        fmt::format("segmentation {:016x}", scene.segmented->caster.field().contentHash());
  std::string beziers;
  for (const BezierPart& part : scene.beziers)
    beziers += fmt::format("{}{} patches", beziers.empty() ? "" : ", ",
                           part.caster.volume().patches.size());
  if (!beziers.empty()) attributes["ls:bezier"] = beziers;
  std::string quadrics;
  for (const QuadricPart& part : scene.quadrics)
    quadrics += fmt::format("{}{} quadrics", quadrics.empty() ? "" : ", ", part.caster.count());
  if (!quadrics.empty()) attributes["ls:quadrics"] = quadrics;
  std::string terrains;
  for (const TerrainPart& part : scene.terrains) {
    const levelset::HeightField& field = part.caster.field();
    terrains += fmt::format("{}{}x{} samples {:016x}", terrains.empty() ? "" : ", ", field.columns,
                            field.rows, field.contentHash());
  }
  if (!terrains.empty()) attributes["ls:terrain"] = terrains;
  if (scene.volumePart) {
    const DirectVolume& volume = scene.volumePart->volume;
    attributes["ls:volume"] = fmt::format("volume {:016x}", volume.volume().contentHash());
    attributes["ls:transfer"] = transferText(volume.transfer().points());
  }
  attributes["ls:style"] = styleName(options.style.style);
  if (const OpticsOptions& optics = options.optics; optics.isActive())
    attributes["ls:optics"] =
        fmt::format("reflect {}, refract {}, index {}, environment {}, bounces {}", optics.reflect,
                    optics.refract, optics.index, optics.environment, optics.bounces);
  if (!scene.csg.isEmpty()) attributes["ls:csg"] = scene.csg.text();
  if (scene.softness > 0) attributes["ls:soft"] = fmt::format("{}", scene.softness);
  if (scene.morph) attributes["ls:morph"] = fmt::format("{}", *scene.morph);
  return attributes;
}

void finishColours(Image& image, const Scene& scene, const RenderOptions& options,
                   double diagonal) {
  if (options.style.style != Style::CurvatureLines) return;
  drawCurvatureLines(image, scene.camera, options.style, curvatureRangeOf(options.style, diagonal));
}

void addViewAttributes(Image& image, const Scene& scene, double extent) {
  image.attributes[kExtentAttribute] = fmt::format("{:.9g}", extent);
  image.attributes["software"] = "Levelsmith " LEVELSMITH_VERSION;
  image.attributes["depthType"] = "distance along the view axis";
  if (scene.camera.near > 0) image.attributes["ls:near"] = fmt::format("{}", scene.camera.near);
  if (scene.camera.far) image.attributes["ls:far"] = fmt::format("{}", *scene.camera.far);
  const auto floats = [](const Imath::M44d& m) {
    std::vector<float> values;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) values.push_back(static_cast<float>(m[i][j]));
    return values;
  };
  image.matrices["worldToCamera"] = floats(scene.camera.worldToCamera());
  image.matrices["worldToNDC"] = floats(scene.camera.worldToNdc());
}

}  // namespace render
