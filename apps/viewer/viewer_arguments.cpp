#include "apps/viewer/viewer_arguments.h"

#include <fmt/core.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <tuple>

#include "apps/pipeline/values/units.h"
#include "apps/viewer/screenshot.h"
#include "levelset/error.h"

namespace viewer {
namespace {

using levelset::UsageError;

// Largest number of voxels along the longest side of a mesh; smaller voxels are not visible.
constexpr long kMostResolution = 4096;

constexpr const char* kHelp = R"(levelsmith-view [FILE…] [options]
Shows a level set (.vdb), a volume (.nii .mha .nrrd .mrc …), a mesh (.ply .obj .stl .off, also .gz) or a scene (.json),
and patches (.patch) with it.

  --size WxH          size of the picture, pixels                       [1280x800]
  --from, --to X,Y,Z  position of the eye and target                    [frames the model]
  --up X,Y,Z          up direction                                      [0,1,0; of a volume 0,0,1]
  --fov DEGREES       vertical field of view                            [35]
  --ortho L           orthographic projection; height of the view, world units
  --layer NAME        displayed layer: colour, normal, depth, position, mean, gauss, k1, k2, id or thickness
  --style NAME        shading style: lit, tone, mean, gauss, principal, accessibility, ink, matcap,
                      reflection-lines, directions or curvature-lines
  --matcap FILE       with --style matcap: a PNG of a shaded ball       [a ball of the viewer]
  --opacity N         opacity of the surfaces, above 0 and at most 1    [1]
  --range N           curvature at the ends of the colours, times the model's diagonal [40]
  --clip PLANE        clip plane that shows phi: x=0.1, y=0.1, z=0.1, or view=0.1 (in front of the centre)
  --isovalue N        of a volume: value of the isosurface, or none     [with --transfer: none; else the first of 'histogram']
  --inside SIDE       of a volume: side of the isovalue that is solid, above or below [above]
  --filter NAME       of a volume: interpolation, as in 'render'        [trilinear]
  --transfer POINTS   of a volume: direct volume rendering, as in 'render', or auto
  --slices i=N,j=N,k=N  of a volume: slices across axes of its grid, by index
  --grey LOW,HIGH     of a volume: values that slices show as black and as white [all but 1 % of the values]
  --lattice FILE      deforms the solid by a lattice, which can be edited
  --cage FILE         deforms the solid by a cage, a closed mesh around it, which can be edited
  --moved FILE        with --cage: a mesh with the same triangles and moved vertices
  --coordinates NAME  with --cage: mean-value or green                  [mean-value]
  --patches LINES     lines of the patches: none, outline, base or all  [all]
  --resolution N      voxels along the longest side of a mesh           [256]
  --renderer NAME     auto, cpu or gpu                                  [auto]
  --help, --version

Options for scripts, without an open window (a display is required, for example with xvfb-run):
  --screenshot FILE   writes the complete picture, .png or .exr, and exits
  --interface         the screenshot shows the entire window
  --pick X,Y          prints the surface point at a pixel as JSON, and exits
  --play FILE         plays simulated mouse and keyboard input first; docs/viewer.md lists the commands

Left button: turn; middle or right: move; wheel: zoom; click: pick a point. docs/viewer.md lists the keys.
)";

std::string whereOf(const std::string& option) {
  return "levelsmith-view: " + option;
}

std::array<int, 2> parsePixel(const std::string& text) {
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos)
    throw UsageError(fmt::format(
        "levelsmith-view: --pick '{}' is not a pixel; give X,Y, for example 640,400", text));
  const long x = pipeline::parseInteger(text.substr(0, comma), whereOf("--pick")),
             y = pipeline::parseInteger(text.substr(comma + 1), whereOf("--pick"));
  constexpr long kMost = 1L << 28;
  if (x < 0 || y < 0 || x > kMost || y > kMost)
    throw UsageError(
        fmt::format("levelsmith-view: --pick {} has a negative or too large coordinate; 0,0 is the "
                    "upper left corner",
                    text));
  return {static_cast<int>(x), static_cast<int>(y)};
}

double parsePositive(const std::string& text, const std::string& option) {
  const double number = pipeline::parseNumber(text, whereOf(option));
  if (!(number > 0))
    throw UsageError(
        fmt::format("{} {} is out of range; give a positive number", whereOf(option), text));
  return number;
}

render::Style styleNamed(const std::string& name) {
  std::string all;
  for (const render::Style style : render::kStyles) {
    if (render::styleName(style) == name) return style;
    all += (all.empty() ? "" : ", ") + std::string(render::styleName(style));
  }
  throw UsageError(
      fmt::format("levelsmith-view: --style '{}' is unknown; give one of {}", name, all));
}

render::Filter filterNamed(const std::string& name) {
  std::string all;
  for (const render::Filter filter : render::kFilters) {
    if (render::filterName(filter) == name) return filter;
    all += (all.empty() ? "" : ", ") + std::string(render::filterName(filter));
  }
  throw UsageError(
      fmt::format("levelsmith-view: --filter '{}' is unknown; give one of {}", name, all));
}

void setInside(Arguments& to, const std::string& text) {
  if (text != "above" && text != "below")
    throw UsageError(
        fmt::format("levelsmith-view: --inside '{}' is unknown; give above or below", text));
  to.inside = text == "below" ? render::VolumeInside::Below : render::VolumeInside::Above;
}

void setCoordinates(Arguments& to, const std::string& text) {
  if (text != "mean-value" && text != "green")
    throw UsageError(fmt::format(
        "levelsmith-view: --coordinates '{}' is unknown; give mean-value or green", text));
  to.cageCoordinates =
      text == "green" ? levelset::CageCoordinates::Green : levelset::CageCoordinates::MeanValue;
}

std::array<double, 2> parseGrey(const std::string& text) {
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos)
    throw UsageError(fmt::format(
        "levelsmith-view: --grey '{}' is not a pair of values; give LOW,HIGH, for example 0,255",
        text));
  const double low = pipeline::parseNumber(text.substr(0, comma), whereOf("--grey")),
               high = pipeline::parseNumber(text.substr(comma + 1), whereOf("--grey"));
  if (!(low < high))
    throw UsageError(fmt::format(
        "levelsmith-view: --grey {} is not ascending; give the value of black first", text));
  return {low, high};
}

Renderer rendererNamed(const std::string& name) {
  if (name == "auto") return Renderer::Auto;
  if (name == "cpu") return Renderer::Cpu;
  if (name == "gpu") return Renderer::Gpu;
  throw UsageError(
      fmt::format("levelsmith-view: --renderer '{}' is unknown; give auto, cpu or gpu", name));
}

using Setter = std::function<void(Arguments&, const std::string&)>;

const std::map<std::string, Setter>& setters() {
  static const std::map<std::string, Setter> all = {
      {"--size",
       [](Arguments& to, const std::string& text) {
         std::tie(to.width, to.height) = pipeline::parseImageSize(text, whereOf("--size"));
         to.hasSize = true;
       }},
      {"--from",
       [](Arguments& to, const std::string& text) {
         to.from = pipeline::parsePoint(text, whereOf("--from"));
       }},
      {"--to",
       [](Arguments& to, const std::string& text) {
         to.to = pipeline::parsePoint(text, whereOf("--to"));
       }},
      {"--up",
       [](Arguments& to, const std::string& text) {
         to.up = pipeline::parsePoint(text, whereOf("--up"));
       }},
      {"--fov",
       [](Arguments& to, const std::string& text) {
         to.verticalFov = parsePositive(text, "--fov") * std::numbers::pi / 180;
       }},
      {"--ortho", [](Arguments& to,
                     const std::string& text) { to.orthoHeight = parsePositive(text, "--ortho"); }},
      {"--layer",
       [](Arguments& to, const std::string& text) { to.display.layer = layerNamed(text); }},
      {"--style", [](Arguments& to, const std::string& text) { to.style = styleNamed(text); }},
      {"--matcap",
       [](Arguments& to, const std::string& text) {
         to.matcap = std::make_shared<const render::ColourImage>(render::readColourPng(text));
       }},
      {"--opacity",
       [](Arguments& to, const std::string& text) {
         to.opacity = parsePositive(text, "--opacity");
         if (to.opacity > 1)
           throw UsageError(fmt::format(
               "levelsmith-view: --opacity {} is out of range; give more than 0 and at most 1",
               text));
       }},
      {"--range",
       [](Arguments& to, const std::string& text) {
         to.display.curvatureRange = parsePositive(text, "--range");
       }},
      {"--clip", [](Arguments& to, const std::string& text) { to.clip = parseClipPlane(text); }},
      {"--isovalue",
       [](Arguments& to, const std::string& text) {
         to.hidesIsosurface = text == "none";
         if (to.hidesIsosurface)
           to.isovalue.reset();
         else
           to.isovalue = pipeline::parseNumber(text, whereOf("--isovalue"));
       }},
      {"--inside", setInside},
      {"--filter", [](Arguments& to, const std::string& text) { to.filter = filterNamed(text); }},
      {"--transfer",
       [](Arguments& to, const std::string& text) {
         if (text != "auto") (void)render::TransferFunction(render::parseTransfer(text), 1);
         to.transfer = text;
       }},
      {"--slices", [](Arguments& to, const std::string& text) { to.slices = parseSlices(text); }},
      {"--grey", [](Arguments& to, const std::string& text) { to.grey = parseGrey(text); }},
      {"--lattice", [](Arguments& to, const std::string& text) { to.lattice = text; }},
      {"--cage", [](Arguments& to, const std::string& text) { to.cage = text; }},
      {"--moved", [](Arguments& to, const std::string& text) { to.movedCage = text; }},
      {"--coordinates", setCoordinates},
      {"--patches",
       [](Arguments& to, const std::string& text) { to.display.patches = patchLinesNamed(text); }},
      {"--resolution",
       [](Arguments& to, const std::string& text) {
         to.resolution = pipeline::parseInteger(text, whereOf("--resolution"));
         if (to.resolution < 4 || to.resolution > kMostResolution)
           throw UsageError(
               fmt::format("levelsmith-view: --resolution {} is out of range; give a number of "
                           "voxels from 4 to {}",
                           text, kMostResolution));
       }},
      {"--renderer",
       [](Arguments& to, const std::string& text) { to.renderer = rendererNamed(text); }},
      {"--screenshot", [](Arguments& to, const std::string& text) { to.screenshot = text; }},
      {"--pick", [](Arguments& to, const std::string& text) { to.pick = parsePixel(text); }},
      {"--play", [](Arguments& to, const std::string& text) { to.play = text; }},
  };
  return all;
}

const std::map<std::string, bool Arguments::*>& flags() {
  static const std::map<std::string, bool Arguments::*> all = {
      {"--interface", &Arguments::isInterface},
      {"--help", &Arguments::asksHelp},
      {"-h", &Arguments::asksHelp},
      {"--version", &Arguments::asksVersion}};
  return all;
}

[[noreturn]] void refuseOption(const std::string& option) {
  std::vector<std::string> known;
  for (const auto& [name, setter] : setters()) known.push_back(name);
  for (const auto& [name, flag] : flags()) known.push_back(name);
  const std::string meant = pipeline::didYouMean(option, known);
  throw UsageError(fmt::format("levelsmith-view: there is no option {}; {}", option,
                               meant.empty() ? "levelsmith-view --help lists the options"
                                             : fmt::format("did you mean {}?", meant)));
}

void requireSense(const Arguments& arguments) {
  if (arguments.asksHelp || arguments.asksVersion) return;
  if (arguments.screenshot) requireScreenshotName(*arguments.screenshot, arguments.isInterface);
  if (arguments.isInterface && !arguments.screenshot)
    throw UsageError(
        "levelsmith-view: --interface requires a screenshot; add --screenshot "
        "FILE");
  if (arguments.isScript() && arguments.files.empty())
    throw UsageError(
        "levelsmith-view: --screenshot, --pick and --play need a file to show; give its name");
  if (!arguments.lattice.empty() && !arguments.cage.empty())
    throw UsageError("levelsmith-view: --lattice and --cage exclude each other; give one of them");
  if (arguments.cage.empty() && (!arguments.movedCage.empty() ||
                                 arguments.cageCoordinates != levelset::CageCoordinates::MeanValue))
    throw UsageError("levelsmith-view: --moved and --coordinates require --cage; add --cage");
  if (arguments.matcap && arguments.style != render::Style::Matcap)
    throw UsageError(
        "levelsmith-view: --matcap applies only to --style matcap; add --style matcap");
  if (arguments.to && !arguments.from)
    throw UsageError("levelsmith-view: --to requires --from; add --from");
  if (arguments.verticalFov && !(*arguments.verticalFov < std::numbers::pi))
    throw UsageError("levelsmith-view: --fov is too wide; give an angle below 180 degrees");
  if (arguments.pick &&
      ((*arguments.pick)[0] >= arguments.width || (*arguments.pick)[1] >= arguments.height) &&
      arguments.hasSize)
    throw UsageError(
        fmt::format("levelsmith-view: --pick {},{} lies outside the picture of {}x{} pixels; 0,0 "
                    "is its upper left corner",
                    (*arguments.pick)[0], (*arguments.pick)[1], arguments.width, arguments.height));
}

}  // namespace

Arguments parseArguments(const std::vector<std::string>& words) {
  Arguments arguments;
  bool areOptionsOver = false;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (areOptionsOver || word.size() < 2 || word[0] != '-') {
      if (word.empty())
        throw UsageError("levelsmith-view: a file name is empty; give a name or omit it");
      arguments.files.emplace_back(word);
      continue;
    }
    if (word == "--") {
      areOptionsOver = true;
      continue;
    }
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    if (const auto flag = flags().find(name);
        flag != flags().end() && equals == std::string::npos) {
      arguments.*flag->second = true;
      continue;
    }
    const auto setter = setters().find(name);
    if (setter == setters().end()) refuseOption(name);
    if (equals == std::string::npos && i + 1 == words.size())
      throw UsageError(
          fmt::format("levelsmith-view: {} has no value; give one after the option", name));
    setter->second(arguments, equals == std::string::npos ? words[++i] : word.substr(equals + 1));
  }
  requireSense(arguments);
  return arguments;
}

std::string viewerHelp() {
  return kHelp;
}

IsosurfaceView firstIsosurface(const Arguments& arguments, const Model& model) {
  IsosurfaceView view = firstIsosurface(*model.volume);
  view.isShown = !arguments.hidesIsosurface && (arguments.isovalue || arguments.transfer.empty());
  view.isovalue = arguments.isovalue.value_or(view.isovalue);
  view.inside = arguments.inside.value_or(view.inside);
  view.filter = arguments.filter.value_or(view.filter);
  return view;
}

LightView firstLight(const Arguments& arguments, const Model& model) {
  if (arguments.transfer.empty()) return {};
  return {.transfer = arguments.transfer == "auto"
                          ? render::suggestedTransfer(model.volume->histogram)
                          : render::parseTransfer(arguments.transfer)};
}

SliceView firstSlices(const Arguments& arguments, const Model& model) {
  SliceView slices = firstSlices(*model.volume);
  slices.at = arguments.slices;
  if (arguments.grey) {
    slices.black = (*arguments.grey)[0];
    slices.white = (*arguments.grey)[1];
  }
  return slices;
}

void requireFit(const Arguments& arguments, const Model& model) {
  if (arguments.hasVolumeOption() && !model.volume)
    throw UsageError(
        "levelsmith-view: --isovalue, --inside, --filter, --transfer, --slices and --grey are for "
        "volumes, and the model is none; omit them");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!arguments.slices[axis]) continue;
    const int last = model.volume->surface.volume().size()[static_cast<int>(axis)] - 1;
    if (!(*arguments.slices[axis] >= 0 && *arguments.slices[axis] <= last))
      throw UsageError(fmt::format(
          "levelsmith-view: --slices: {} = {} lies outside the grid; give an index from 0 to {}",
          "ijk"[axis], *arguments.slices[axis], last));
  }
  if (arguments.clip && !model.canCut())
    throw levelset::InvalidInput(
        "levelsmith-view: --clip needs solids that can be cut, and the model has none; omit "
        "--clip");
}

render::Camera firstCamera(const Arguments& arguments, const Model& model, int width, int height) {
  render::Camera camera;
  // In the coordinates of medical images, z points to the head; in terrains, upwards.
  if (model.volume || model.terrain) camera.up = Imath::V3d(0, 0, 1);
  const Imath::Box3d nothing(Imath::V3d(-1), Imath::V3d(1));
  const Imath::Box3d& bounds = model.bounds.isEmpty() ? nothing : model.bounds;
  if (model.camera && !arguments.from) {
    camera = *model.camera;
    if (arguments.up) camera.up = *arguments.up;
    if (arguments.verticalFov) {
      camera.verticalFov = *arguments.verticalFov;
      camera.orthoHeight.reset();
    }
  } else if (arguments.from) {
    camera.from = *arguments.from;
    camera.to = arguments.to.value_or(bounds.center());
    if (arguments.up) camera.up = *arguments.up;
    if (arguments.verticalFov) camera.verticalFov = *arguments.verticalFov;
  } else {
    const double fov = arguments.verticalFov.value_or(camera.verticalFov);
    const Imath::V3d up = arguments.up.value_or(camera.up);
    // The particles of patches are not in the scene, and isosurfaces of volumes change.
    const bool isFramedByBox =
        model.bounds.isEmpty() || !model.patches.empty() || model.volume || model.terrain;
    camera = isFramedByBox ? render::framingCamera(bounds, width, height, fov, up)
                           : render::framingCamera(model.scene, width, height, fov, up);
  }
  if (arguments.orthoHeight) camera.orthoHeight = arguments.orthoHeight;
  camera.width = width;
  camera.height = height;
  render::validate(camera);
  return camera;
}

}  // namespace viewer
