#include <fmt/core.h>

#include <algorithm>
#include <string>
#include <utility>

#include "apps/pipeline/graph/regions_of_interest.h"
#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/pictures/camera_options.h"
#include "apps/pipeline/operators/pictures/comparison_json.h"
#include "apps/pipeline/operators/pictures/molecule_pictures.h"
#include "apps/pipeline/operators/pictures/picture_look.h"
#include "apps/pipeline/operators/pictures/picture_optics.h"
#include "apps/pipeline/operators/pictures/segmented_pictures.h"
#include "apps/pipeline/operators/pictures/volume_pictures.h"
#include "apps/pipeline/operators/terrain/terrain_pictures.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "render/camera.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "render/images/image.h"
#include "render/kernel/frustum_culling.h"
#include "render/scene/scene.h"

namespace pipeline {
namespace {

using levelset::UsageError;

/// Builds the scene to draw from the operand. The camera options override the camera of the
/// operand, if it has one.
render::Scene sceneOf(Invocation& in) {
  const Value& drawn = in.operands[0];
  requireVolumeOptions(in);
  render::ViewedScene viewed = isVolumeKind(drawn.kind())           ? volumeScene(in)
                               : drawn.kind() == Kind::Segmentation ? segmentedScene(in)
                               : drawn.kind() == Kind::Molecule     ? moleculeScene(in)
                               : drawn.kind() == Kind::Terrain      ? terrainScene(in)
                                                                    : sceneOf(drawn);
  viewed.scene.camera = cameraOf(in, drawn.plan().bounds,
                                 viewed.hasCamera ? &viewed.scene.camera : nullptr, &viewed.scene);
  return viewed.scene;
}

std::vector<std::string> styleNames() {
  std::vector<std::string> names;
  for (const render::Style style : render::kStyles) names.emplace_back(render::styleName(style));
  return names;
}

render::Style styleNamed(const std::string& name) {
  for (const render::Style style : render::kStyles)
    if (name == render::styleName(style)) return style;
  return render::Style::Lit;
}

constexpr long kMostSamples = 4096;

void validateDraw(const Invocation& asked) {
  Invocation in = asked;
  assumePreset(in);
  validateCamera(in);
  validateLook(in);
  validateOptics(in);
  if (in.integer("samples") > kMostSamples)
    throw UsageError(fmt::format("render: --samples {} is too many; give at most {}",
                                 in.text("samples"), kMostSamples));
  const std::string style = in.text("style");
  if ((style == "matcap") != in.given("matcap"))
    throw UsageError(in.given("matcap")
                         ? "render: --matcap applies only to --style matcap; leave it out, or give "
                           "--style matcap"
                         : "render: --style matcap needs --matcap with a PNG of a shaded ball");
  for (const char* layer : {"thickness", "directions", "light-layers"})
    if (in.flag(layer) && render::imageFormat(in.text("file"), in.text("format")) != "exr")
      throw UsageError(
          fmt::format("render: a PNG has no layers, so --{} is lost; name an .exr", layer));
  if (in.given("along") && !render::showsDirections(styleNamed(style)))
    throw UsageError(
        fmt::format("render: --style {} shows no principal direction; leave --along out", style));
  if (in.given("line") && style != "tone" && style != "ink" && style != "curvature-lines")
    throw UsageError(fmt::format(
        "render: --style {} draws no silhouette lines and no streaks; leave --line out", style));
  if (in.text("tables") == "nanovdb") {
    const std::string renderer = in.text("renderer");
    if (renderer != "gpu" && renderer != "both")
      throw UsageError(
          fmt::format("render: --renderer {} cannot read a NanoVDB grid; leave --tables out, or "
                      "give --renderer gpu",
                      renderer));
    if (in.text("filter") != "trilinear" || in.text("value-bits") != "32")
      throw UsageError(
          "render: --tables nanovdb supports only the trilinear filter and values of 32 bits; "
          "leave --filter and --value-bits out, or give --tables bricks");
  }
  const std::string filter = in.text("filter");
  if (in.text("value-bits") != "32" && (filter == "bspline-qi" || filter == "bcc-quadratic"))
    throw UsageError(fmt::format(
        "render: --filter {} computes spline coefficients, which cannot be stored in fewer "
        "bits; leave --value-bits out, or give another filter",
        filter));
  if (in.flag("ground") && !render::usesLights(styleNamed(style)))
    throw UsageError(fmt::format("render: --style {} has no shadows; leave --ground out", style));
  validateVolumePicture(in);
  validateHide(in);
  validateMoleculePicture(in);
  validateTerrainPicture(in);
  if (in.given("reflection-lines") && style != "reflection-lines")
    throw UsageError(fmt::format(
        "render: --style {} shows no reflections; leave --reflection-lines out", style));
  if (in.given("curvature-range") &&
      (style == "lit" || style == "tone" || style == "matcap" || style == "reflection-lines"))
    throw UsageError(
        fmt::format("render: --style {} shows no curvatures; leave --curvature-range out", style));
  if (render::imageFormat(in.text("file"), in.text("format")).empty()) {
    throw UsageError(
        fmt::format("render: '{}' is of no known format; use .exr or .png, or --format",
                    in.text(in.given("format") ? "format" : "file")));
  }
  if (!in.given("png")) return;
  const std::string file = in.text("file"), png = in.text("png");
  if (levelset::isStandardOutput(file) && levelset::isStandardOutput(png))
    throw UsageError("render: two images cannot share standard output; use a file for one");
  if (levelset::isSameFile(file, png))
    throw UsageError(fmt::format(
        "render: '{}' is named twice, as the image and by --png; give two different files", file));
}

std::vector<std::string> targetsOf(const Invocation& in) {
  std::vector<std::string> targets{in.text("file")};
  if (in.given("png")) targets.push_back(in.text("png"));
  return targets;
}

/// Draws with the kernel: by OpenGL, or by the processor where OpenGL is missing or the shader
/// cannot draw the scene.
render::Image drawByKernel(Invocation& in, const render::Scene& scene,
                           const render::RenderOptions& options) {
  try {
    return render::renderGpu(scene, options);
  } catch (const levelset::ResourceLimit& error) {
    in.notes.warnings.push_back(
        fmt::format("{}; --renderer both uses the processor instead", error.what()));
    return render::renderCpu(scene, options);
  }
}

std::vector<std::string> pictureFilterNames() {
  std::vector<std::string> names;
  for (const render::Filter filter : render::kFilters)
    names.emplace_back(render::filterName(filter));
  return names;
}

render::StyleOptions styleOf(const Invocation& in) {
  render::StyleOptions options;
  options.style = styleNamed(in.text("style"));
  if (in.given("curvature-range")) options.curvatureRange = in.number("curvature-range");
  options.lineWidth = in.number("line");
  options.reflectionLines = in.integerAs<int>("reflection-lines");
  options.direction = in.text("along") == "k2" ? 2 : 1;
  if (in.given("matcap"))
    options.matcap = std::make_shared<const render::ColourImage>(
        render::readColourPng(in.text("matcap"), in.maxMemory));
  return options;
}

/// Quantizes the values of all solids to --value-bits, and adds a note with the displacement of the
/// surfaces.
void coarsen(Invocation& in, render::Scene& scene) {
  const int bits = std::stoi(in.text("value-bits"));
  if (bits == 32) return;
  if (scene.hasVolume() || isVolumeKind(in.operands[0].kind()))
    throw UsageError(
        "render: the values of a volume are stored in 32 bits in the ray caster; leave "
        "--value-bits out");
  double bytes = 0;
  for (const render::Solid& solid : scene.solids)
    bytes += static_cast<double>(solid.band.memoryUse());
  levelset::requireMemory(bytes, in.maxMemory);
  render::SurfaceShift most;
  for (render::Solid& solid : scene.solids) {
    if (solid.band.isEmpty()) continue;
    render::QuantizedBand coarse = render::quantized(solid.band, bits);
    solid.band = std::move(coarse.band);
    solid.quantization = coarse.quantization;
    most.largest = std::max(most.largest, coarse.shift.largest);
    most.rms = std::max(most.rms, coarse.shift.rms);
  }
  in.notes.notes.push_back(fmt::format(
      "render: values of {} bits displace the surface by at most {:.2g} voxels, {:.2g} voxels rms",
      bits, most.largest, most.rms));
}

Value draw(Invocation& in) {
  assumePreset(in);
  render::Scene scene = sceneOf(in);
  applyLookTo(in, scene);
  coarsen(in, scene);
  if (in.flag("ground") && scene.volumePart)
    throw UsageError("render: a volume with a transfer function has no shadow; leave --ground out");
  if (in.flag("ground")) {
    if (scene.bounds().isEmpty())
      in.notes.warnings.push_back(
          "render: the scene has no surface between its samples, so no ground is drawn");
    else
      scene.ground = render::groundOf(scene, scene.camera.up);
  }
  const std::string renderer = in.text("renderer");
  const bool isBoth = renderer == "both";
  if (!scene.mapped.empty() && (isBoth || renderer == "embree"))
    throw UsageError(
        fmt::format("render: --renderer {} does not draw mapped textures; give --renderer cpu or "
                    "gpu, or map the texture without --instances",
                    renderer));
  render::RenderOptions options;
  options.samples = in.integerAs<int>("samples");
  options.lightSpacing = in.integerAs<int>("light-spacing");
  options.filter = filterOf(in);
  options.fromNanoVdb = in.text("tables") == "nanovdb";
  options.style = styleOf(in);
  options.thickness = in.flag("thickness");
  options.directions =
      in.flag("directions") || (isBoth && render::showsDirections(styleNamed(in.text("style"))));
  options.maxBytes = in.maxMemory;
  options.progress = in.progress;
  const bool isExr = render::imageFormat(in.text("file"), in.text("format")) != "png";
  options.layers = isBoth || scene.isBlended() || (isExr && !isStereo(in));
  options.volumeLight = isBoth || isExr;
  applyLookTo(in, options);
  options.optics = opticsOf(in);
  const double surfaceShare = isBoth ? 0.5 : 1;
  options.progress = levelset::subProgress(in.progress, 0, surfaceShare);
  const auto drawn = [&](const render::Scene& seen) {
    return renderer == "cpu"   ? render::renderCpu(seen, options)
           : renderer == "gpu" ? render::renderGpu(seen, options)
           : isBoth            ? drawByKernel(in, seen, options)
                               : render::renderEmbree(seen, options);
  };
  const auto eyeOf = [&](const render::Scene& seen, int number) {
    options.progress = levelset::subProgress(in.progress, 0.5 * number, 0.5 * (number + 1));
    render::Image image = drawn(seen);
    return hasLook(in) ? finishLook(in, std::move(image)) : image;
  };
  render::Image image = isStereo(in) ? drawStereo(in, scene, eyeOf) : drawn(scene);
  const auto read = image.attributes.find("ls:read");
  if (read != image.attributes.end() &&
      (!scene.solids.empty() || !scene.meshes.empty() || !scene.quadrics.empty() ||
       !scene.terrains.empty() || scene.segmented))
    in.notes.notes.push_back(fmt::format("render: {}", read->second));
  if (const auto cast = image.attributes.find("ls:onProcessor"); cast != image.attributes.end())
    in.notes.notes.push_back(fmt::format("render: {}", cast->second));
  if (const auto told = image.attributes.find("ls:warning"); told != image.attributes.end())
    in.notes.warnings.push_back(fmt::format("render: {}", told->second));
  if (const auto count = image.attributes.find("ls:bezierSingular");
      count != image.attributes.end())
    in.notes.notes.push_back(
        fmt::format("render: pixels that show a double root of a Bézier volume, or a point where "
                    "its map is singular: {}",
                    count->second));
  const auto write = [&](const render::Image& finished) {
    render::writeImage(in.text("file"), finished, in.text("format"));
    if (in.given("png")) render::writeImage(in.text("png"), finished, "png");
  };
  if (hasLook(in) && !isStereo(in))
    write(finishLook(in, isBoth ? image : std::move(image)));
  else
    write(image);
  if (isBoth) {
    // One sample without lights suffices for the comparison: geometric layers are sampled at the
    // centres of pixels, and colours have no tolerance.
    options.samples = 1;
    options.ambientSamples = options.shadowSamples = 0;
    options.lightLayers = false;
    options.optics = {};
    options.progress = levelset::subProgress(in.progress, surfaceShare, 1);
    const render::ImageComparison found =
        render::compareImages(image, render::renderEmbree(scene, options));
    in.notes.detailsJson = comparisonJson(found).dump();
    if (found.bothHit == 0 && !scene.volumePart)
      in.notes.warnings.push_back(
          "render: no pixel shows a surface in both pictures (kernel and embree), so no layer was "
          "compared");
    if (!found.agrees())
      throw levelset::NumericalError(
          fmt::format("render: the pictures of the kernel and of embree differ: {}; draw one with "
                      "each renderer and compare them with compare-images",
                      found.reason()));
  }
  return in.operands[0];
}

/// Returns the box of the solid that is inside the frame of the picture, if this part alone
/// determines the picture; otherwise the complete solid. Shadows depend on parts outside the frame.
/// The default view, the default range of curvatures and quantized values depend on the size of the
/// complete solid.
RegionOfInterest roiOfDraw(Invocation& in, std::size_t, const RegionOfInterest&) {
  assumePreset(in);
  if (hasLook(in) || hasOptics(in) || isStereo(in) || in.flag("light-layers")) return {};
  const render::Style style = styleNamed(in.text("style"));
  const bool isFramed = in.operands[0].kind() == Kind::Band && in.given("from") && in.given("to") &&
                        in.text("value-bits") == "32";
  const bool isOfFrame =
      !render::usesLights(style) && (style != render::Style::Ink || in.given("curvature-range"));
  if (!isFramed || !isOfFrame) return {};
  const Plan plan = in.operands[0].plan();
  const Imath::Box3d all = grown(plan.bounds, plan.halfWidth * plan.voxelSize);
  render::Scene scene;
  scene.camera = cameraOf(in, plan.bounds);
  const render::FrustumCulling culling(scene, {.style = {.style = style}}, all);
  constexpr int kCells = 24;
  const Imath::V3d side = all.size() / kCells;
  Imath::Box3d seen;
  for (int i = 0; i < kCells * kCells * kCells; ++i) {
    const int x = i % kCells, y = i / kCells % kCells, z = i / (kCells * kCells);
    const Imath::V3d low = all.min + side * Imath::V3d(x, y, z);
    if (culling.keeps(low + side / 2, side.length() / 2))
      seen.extendBy(Imath::Box3d(low, low + side));
  }
  if (seen.isEmpty())
    return {};  // no part is in the frame: request the complete solid, not an empty region
  constexpr double kRead = 8;  // margin around the visible part, voxels: normals, curvatures and
                               // splines read values there
  return {.region = grown(seen, kRead * plan.voxelSize)};
}

Plan planDraw(Invocation& in) {
  requireVolumeOptions(in);
  (void)cameraOf(in, in.operands[0].plan().bounds);
  return in.operands[0].plan();
}

}  // namespace

Operator renderOperator() {
  Operator picture = {
      .name = "render",
      .group = "Pictures",
      .summary =
          "draw a solid, volume, mesh, segmentation, molecule, terrain or scene to an EXR or PNG",
      .details =
          "Layers of the EXR: R G B A, Z (along the view axis, +inf for a miss), N.X N.Y N.Z, P.X "
          "P.Y P.Z, curvature.mean .gauss .k1 .k2, id. Without --from, the view is the scene's "
          "own, or a three-quarter view that frames the solid. 'gpu' and 'cpu' run one kernel in "
          "single precision, with the same bits; they cast rays through Bézier volumes in double "
          "precision, and light rays through these on the processor. 'embree' finds hits by "
          "independent code in double precision. 'both' draws with the kernel, writes that "
          "picture, compares the layers with "
          "those of embree, and ends with exit code 5 where they differ by more than two correct "
          "renderers may. A preset sets these options unless they are given: " +
          presetText() + ".",
      .example =
          "levelsmith torus --radius 2 --tube 0.8 --voxel 0.05 ! render torus.png --size "
          "320x240 --from 5,4,6 --to 0,0,0",
      .params =
          {{.name = "file",
            .type = ParamType::Path,
            .doc = "picture to write, .exr or .png, or - for standard output",
            .required = true,
            .position = 0},
           {.name = "png", .type = ParamType::Path, .doc = "also write the colours to this .png"},
           {.name = "renderer",
            .type = ParamType::Choice,
            .doc = "renderer; both: draws with gpu (cpu where OpenGL cannot draw the scene) and "
                   "embree, and "
                   "compares the two",
            .fallback = "cpu",
            .choices = {"gpu", "cpu", "embree", "both"}},
           {.name = "filter",
            .type = ParamType::Choice,
            .doc = "interpolation between grid points: trilinear; tricubic, Catmull-Rom splines "
                   "through the values; bspline, a tricubic B-spline, which shrinks the solid; "
                   "bspline-qi, the same spline with corrected coefficients; super-quadratic, "
                   "cubic-c1 and bcc-quadratic, splines on tetrahedra, which smooth the values",
            .fallback = "trilinear",
            .choices = pictureFilterNames()},
           {.name = "tables",
            .type = ParamType::Choice,
            .doc = "with --renderer gpu or both: data that the shader reads; bricks, or a NanoVDB "
                   "grid, which is slower and gives the same bits",
            .fallback = "bricks",
            .choices = {"bricks", "nanovdb"}},
           {.name = "value-bits",
            .type = ParamType::Choice,
            .doc = "bits of each distance value in the memory of the ray caster; 16 and 8 save "
                   "memory and displace the surface, by a length that the report gives",
            .fallback = "32",
            .choices = {"32", "16", "8"}},
           {.name = "style",
            .type = ParamType::Choice,
            .doc = "style of the colours; mean, gauss and principal show curvatures, directions "
                   "and curvature-lines a principal direction",
            .fallback = "lit",
            .choices = styleNames()},
           {.name = "matcap",
            .type = ParamType::Path,
            .doc = "with --style matcap: a PNG of a shaded ball, which gives the colour for each "
                   "normal"},
           {.name = "curvature-range",
            .type = ParamType::Number,
            .doc =
                "curvature, per world unit, that has the colour half way to the end of the "
                "colour scale, and at which --style ink begins to draw ridges and valleys; "
                "principal directions fade where both curvatures differ by less than a twentieth; "
                "default: 40 / diagonal of the bounding box",
            .range = Range::Positive},
           {.name = "line",
            .type = ParamType::Number,
            .doc = "with --style tone or ink: width of the silhouette lines, in pixels; with "
                   "--style curvature-lines: width of the streaks, at most 16",
            .fallback = "2",
            .range = Range::NonNegative},
           {.name = "reflection-lines",
            .type = ParamType::Integer,
            .doc = "with --style reflection-lines: number of lines, at equal angles around the "
                   "vertical axis of the picture",
            .fallback = "32",
            .range = Range::Positive},
           {.name = "along",
            .type = ParamType::Choice,
            .doc = "with --style directions or curvature-lines: principal direction that is shown; "
                   "k1, that of the "
                   "largest normal curvature, or k2, that of the least",
            .fallback = "k1",
            .choices = {"k1", "k2"}},
           {.name = "directions",
            .type = ParamType::Flag,
            .doc = "add layers to the EXR with both principal directions: direction1.X .Y .Z, "
                   "along which the normal curvature is k1, and direction2.X .Y .Z"},
           {.name = "thickness",
            .type = ParamType::Flag,
            .doc = "add a layer to the EXR with the length of each pixel's ray inside the solids, "
                   "world units"},
           {.name = "samples",
            .type = ParamType::Integer,
            .doc = "number of colour samples per pixel",
            .fallback = "4",
            .range = Range::Positive},
           {.name = "light-spacing",
            .type = ParamType::Integer,
            .doc = "with --renderer cpu, gpu or both: distance in pixels of the points at which "
                   "light rays are traced; where light and surface vary smoothly, light is "
                   "interpolated between them; 1: trace light rays for every colour sample",
            .fallback = "4",
            .range = Range::Positive},
           {.name = "ground",
            .type = ParamType::Flag,
            .doc = "draw the shadow of the surfaces on a plane below them, across --up; the plane "
                   "itself is transparent"},
           {.name = "format",
            .type = ParamType::Text,
            .doc = "format of the picture: exr or png; default: by its extension"}},
      .operands = {{Kind::Band, Kind::Mesh, Kind::Scene, Kind::Volume, Kind::Field, Kind::Adaptive,
                    Kind::Segmentation, Kind::Molecule, Kind::Terrain}},
      .flow = Flow::PassesThrough,
      .run = draw,
      .plan = planDraw,
      .regionOfInterest = roiOfDraw,
      .validate = validateDraw,
      .targets = targetsOf,
      .usesStandardOutput =
          [](const Invocation& in) {
            return levelset::isStandardOutput(in.text("file")) ||
                   (in.given("png") && levelset::isStandardOutput(in.text("png")));
          },
  };
  std::vector<Param> ofKinds = volumePictureParams();
  ofKinds.push_back(hideParam());
  for (Param& param : moleculePictureParams()) ofKinds.push_back(std::move(param));
  for (Param& param : terrainPictureParams()) ofKinds.push_back(std::move(param));
  const auto filter = std::find_if(picture.params.begin(), picture.params.end(),
                                   [](const Param& param) { return param.name == "filter"; });
  picture.params.insert(std::next(filter), ofKinds.begin(), ofKinds.end());
  addLookParams(picture.params);
  addOpticsParams(picture.params);
  addCameraParams(picture.params);
  return picture;
}

}  // namespace pipeline
