#include "apps/viewer/effects/shown_effects.h"

#include <fmt/core.h>

#include <numbers>
#include <utility>

#include "apps/viewer/text/point_text.h"
#include "render/effects/picture_view.h"

namespace viewer {

EffectPicture withEffects(const render::Image& image, const EffectView& effects, int pixelSize) {
  render::LookOptions look;
  look.outline = effects.outline / pixelSize;
  look.halo = effects.halo / pixelSize;
  look.depthCue = effects.depthCue;
  if (effects.isOnWhite) look.background = Imath::V3d(1);
  render::EffectOptions options;
  options.occlusion = effects.occlusion;
  options.shadow = effects.shadow;
  EffectPicture result;
  if (effects.isAnaglyph) {
    const render::PictureView view(image);
    if (!view.isPerspective())
      result.note = "An anaglyph needs a view in perspective; press o.";
    else if (view.depthRange().y > 0)
      options.stereo = render::Stereo::Anaglyph;
  }
  result.image = render::withEffects(image, look, options, render::CpuScreenRunner());
  return result;
}

std::string cameraText(const render::Camera& camera) {
  return fmt::format("--from {} --to {} --up {} {}", pointText(camera.from), pointText(camera.to),
                     pointText(camera.up),
                     camera.orthoHeight ? fmt::format("--ortho {:.8g}", *camera.orthoHeight)
                                        : fmt::format("--fov {:.8g}",
                                                      camera.verticalFov * 180 / std::numbers::pi));
}

std::string effectText(const EffectView& effects, const render::Camera& camera,
                       render::Style style) {
  std::string text = fmt::format("render view.exr --renderer cpu --size {}x{} {}", camera.width,
                                 camera.height, cameraText(camera));
  // The viewer does not know the file of a matcap.
  if (style != render::Style::Lit && style != render::Style::Matcap)
    text += fmt::format(" --style {}", render::styleName(style));
  text += " ! effect view.exr view.png";
  for (const auto& [name, value] : {std::pair("outline", effects.outline),
                                    {"halo", effects.halo},
                                    {"depth-cue", effects.depthCue},
                                    {"occlusion", effects.occlusion},
                                    {"shadow", effects.shadow}})
    if (value > 0) text += fmt::format(" --{} {}", name, value);
  if (effects.isAnaglyph) text += " --stereo anaglyph";
  if (effects.isOnWhite) text += " --background 1,1,1";
  return text;
}

}  // namespace viewer
