#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <optional>
#include <string>

#include "levelset/operator/options.h"
#include "levelset/progress.h"
#include "render/effects/screen_pass.h"
#include "render/images/image.h"

/// Effects that are computed from the layers of a picture: depth, normals, positions and the camera
/// in the header of its EXR.
namespace render {

/// Lines, depth cues and backgrounds. Their colours are display colours from 0 to 1, as in a PNG.
/// They are mixed as displayed, so that outlines and edges look smooth.
struct LookOptions {
  double outline = 0;
  double creaseAngle = 40;
  std::optional<double> outlineStep = {};
  Imath::V3d lineColour{0.06, 0.06, 0.08};
  double halo = 0;
  double depthCue = 0;
  std::optional<double> depthCueNear = {}, depthCueFar = {};
  std::optional<double> xray = {};
  std::optional<Imath::V3d> background = {};

  template <class Visitor>
  static void describe(Visitor& visit) {
    using levelset::OptionRange;
    using levelset::OptionUnit;
    visit("outline", &LookOptions::outline,
          {.help = "width of lines along silhouettes and creases, in pixels; 0: no lines",
           .range = OptionRange::NonNegative});
    visit("crease-angle", &LookOptions::creaseAngle,
          {.help = "with --outline: angle between normals beside each other that is a crease, in "
                   "degrees; 180: silhouettes only",
           .range = OptionRange::Positive});
    visit("outline-step", &LookOptions::outlineStep,
          {.help = "with --outline or --halo: jump of depth that separates two surfaces; default: "
                   "1 % of the diagonal of the scene",
           .unit = OptionUnit::Length,
           .range = OptionRange::Positive,
           .allowsVoxels = false});
    visit("line-colour", &LookOptions::lineColour,
          {.help = "with --outline: display colour of the lines, red, green and blue from 0 to 1"});
    visit("halo", &LookOptions::halo,
          {.help = "width, in pixels, of a rim around nearer surfaces. It is drawn on the surfaces "
                   "behind them, and fades outwards. It has the colour of the background, or else "
                   "white",
           .range = OptionRange::NonNegative});
    visit("depth-cue", &LookOptions::depthCue,
          {.help = "share, from 0 to 1, by which the farthest surfaces fade to the background, or "
                   "else to white",
           .range = OptionRange::NonNegative});
    visit("depth-cue-near", &LookOptions::depthCueNear,
          {.help = "with --depth-cue: depth at which fading begins; default: the nearest surface",
           .unit = OptionUnit::Length,
           .range = OptionRange::NonNegative,
           .allowsVoxels = false});
    visit("depth-cue-far", &LookOptions::depthCueFar,
          {.help = "with --depth-cue: depth at which fading is complete; default: the farthest "
                   "surface",
           .unit = OptionUnit::Length,
           .range = OptionRange::Positive,
           .allowsVoxels = false});
    visit("xray", &LookOptions::xray,
          {.help = "show the thickness in place of colours: bright where rays pass much more than "
                   "this length inside the solids",
           .unit = OptionUnit::Length,
           .range = OptionRange::Positive,
           .allowsVoxels = false});
    visit("background", &LookOptions::background,
          {.help = "display colour behind the picture, red, green and blue from 0 to 1; default: "
                   "transparent"});
  }
};

enum class SolidTexture { None, Checker, Noise, Marble, Wood };
enum class Stereo { None, Anaglyph, SideBySide, CrossEyed };

/// Pictures for two eyes.
struct StereoOptions {
  Stereo stereo = Stereo::None;
  std::optional<double> eyeDistance = {}, screenDepth = {};

  template <class Visitor>
  static void describe(Visitor& visit) {
    using levelset::OptionRange;
    using levelset::OptionUnit;
    visit("stereo", &StereoOptions::stereo,
          {{"none", Stereo::None},
           {"anaglyph", Stereo::Anaglyph},
           {"side-by-side", Stereo::SideBySide},
           {"cross-eyed", Stereo::CrossEyed}},
          {.help = "pictures for two eyes: an anaglyph for red and cyan glasses, or both beside "
                   "each other, with the left one left or (cross-eyed) right"});
    visit("eye-distance", &StereoOptions::eyeDistance,
          {.help = "with --stereo: distance of the eyes; default: a thirtieth of the least depth",
           .unit = OptionUnit::Length,
           .range = OptionRange::Positive,
           .allowsVoxels = false});
    visit("screen-depth", &StereoOptions::screenDepth,
          {.help = "with --stereo: depth that appears in the plane of the picture; default: half "
                   "way between the nearest and the farthest surface",
           .unit = OptionUnit::Length,
           .range = OptionRange::Positive,
           .allowsVoxels = false});
  }
};

/// Effects beside those of LookOptions.
struct EffectOptions : StereoOptions {
  double occlusion = 0;
  std::optional<double> occlusionRadius = {};
  double shadow = 0;
  Imath::V3d light{-0.4, 0.7, 0.6};
  double lightRadius = 8.6;
  std::optional<double> occluderDepth = {};
  SolidTexture solidTexture = SolidTexture::None;
  std::optional<double> textureSize = {};
  double reflect = 0;
  double refract = 0;
  double index = 1.5;
  std::string environment = "studio";
  int reflectionLines = 0;
  int reduce = 1;

  template <class Visitor>
  static void describe(Visitor& visit) {
    using levelset::OptionRange;
    using levelset::OptionUnit;
    visit("occlusion", &EffectOptions::occlusion,
          {.help = "strength, from 0 to 1, of ambient occlusion: hollows are darker, as far as the "
                   "depth of the picture shows",
           .range = OptionRange::NonNegative});
    visit("occlusion-radius", &EffectOptions::occlusionRadius,
          {.help = "with --occlusion: largest distance of surfaces that hide the sky; default: a "
                   "quarter of the diagonal of the scene",
           .unit = OptionUnit::Length,
           .range = OptionRange::Positive,
           .allowsVoxels = false});
    visit("shadow", &EffectOptions::shadow,
          {.help = "strength, from 0 to 1, of the soft shadow of a key light, as far as the depth "
                   "of the picture shows",
           .range = OptionRange::NonNegative});
    visit("light", &EffectOptions::light,
          {.help = "with --shadow: direction towards the light, x to the right, y upwards, z "
                   "towards the eye"});
    visit("light-radius", &EffectOptions::lightRadius,
          {.help = "with --shadow: angle, in degrees, under which the radius of the light appears",
           .range = OptionRange::NonNegative});
    visit("occluder-depth", &EffectOptions::occluderDepth,
          {.help = "with --occlusion or --shadow: extent of solids behind the surface that is "
                   "seen; default: 5 % of the diagonal of the scene",
           .unit = OptionUnit::Length,
           .range = OptionRange::Positive,
           .allowsVoxels = false});
    visit("solid-texture", &EffectOptions::solidTexture,
          {{"none", SolidTexture::None},
           {"checker", SolidTexture::Checker},
           {"noise", SolidTexture::Noise},
           {"marble", SolidTexture::Marble},
           {"wood", SolidTexture::Wood}},
          {.help = "pattern in space that gives the surfaces their colours"});
    visit("texture-size", &EffectOptions::textureSize,
          {.help = "with --solid-texture: size of its pattern; default: a tenth of the diagonal of "
                   "the scene",
           .unit = OptionUnit::Length,
           .range = OptionRange::Positive,
           .allowsVoxels = false});
    visit("reflect", &EffectOptions::reflect,
          {.help = "share of light, from 0 to 1, that the surfaces mirror straight on; more at "
                   "grazing angles, by Schlick's formula",
           .range = OptionRange::NonNegative});
    visit(
        "refract", &EffectOptions::refract,
        {.help = "share of the colours, from 0 to 1, that is replaced by the environment as clear "
                 "glass shows it: refracted and, by Fresnel's equations, reflected",
         .range = OptionRange::NonNegative});
    visit("index", &EffectOptions::index,
          {.help = "with --refract: index of refraction", .range = OptionRange::Positive});
    visit("environment", &EffectOptions::environment,
          {.help = "with --reflect or --refract: studio, a room with soft lights, or an EXR of all "
                   "directions, twice as wide as high, with y upwards"});
    visit("reflection-lines", &EffectOptions::reflectionLines,
          {.help = "number of parallel lines that a mirroring surface shows in place of the "
                   "colours; 0: none",
           .range = OptionRange::NonNegative});
    StereoOptions::describe(visit);
    visit("reduce", &EffectOptions::reduce,
          {.help = "edge of the squares of pixels of which each becomes one pixel, for smooth "
                   "edges; widths of lines are in pixels of the result",
           .range = OptionRange::Positive});
  }
};

/// @throws levelset::UsageError for a light that appears under 85 degrees or more
void validateLightRadius(double degrees);
/// @throws levelset::UsageError for more than 16 pixels along the edge of one
void validateReduction(long reduce);

/// Checks the options before a picture is read.
/// @param pixelScale  as withLook()
/// @throws levelset::UsageError
void validate(const LookOptions& look, int pixelScale);
/// Checks the options before a picture is read. @throws levelset::UsageError
void validate(const EffectOptions& options);

/// Applies lines, depth cues, x-ray and background.
/// @param pixelScale  edge of the squares of pixels that will become one pixel; widths of lines are
///        in pixels after that
/// @throws levelset::InvalidInput for a picture without the layers or the camera that they need
[[nodiscard]] Image withLook(Image image, const LookOptions& look, int pixelScale,
                             const ScreenRunner& runner);

/// Averages the colours of squares of pixels, as displayed. The other layers keep the pixel in the
/// middle of each square. If `edge` is even, its middle lies half a pixel of `image` to the right
/// of the middle of the square, and half a pixel below.
/// @throws levelset::UsageError unless `edge` divides both edges of the picture
[[nodiscard]] Image reducedPicture(Image image, int edge);

/// Applies all effects, in this order: solid texture, environment, reflection lines, shadow and
/// occlusion, those of LookOptions, stereo, reduction (of each eye). Adds the layers outline,
/// light.sky and light.key of the effects that are asked for.
/// @param maxMemory  limit for the environment's picture, bytes
/// @throws levelset::InvalidInput for a picture without the layers or the camera that they need
/// @throws as readExr() for the environment
[[nodiscard]] Image withEffects(Image image, const LookOptions& look, const EffectOptions& options,
                                const ScreenRunner& runner,
                                std::size_t maxMemory = levelset::kNoMemoryLimit);

}  // namespace render
