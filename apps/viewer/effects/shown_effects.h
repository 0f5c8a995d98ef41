#pragma once

#include <optional>
#include <string>

#include "render/camera.h"
#include "render/effects/effects.h"
#include "render/images/image.h"
#include "render/shading/style.h"

namespace viewer {

/// Effects of the action `effect` on the picture of the viewer. Widths are in pixels of the window;
/// 0: the effect is off.
struct EffectView {
  double outline = 0, halo = 0;
  double depthCue = 0, occlusion = 0, shadow = 0;  ///< strengths, from 0 to 1
  bool isAnaglyph = false;
  bool isOnWhite = false;  ///< white background

  [[nodiscard]] bool isEmpty() const { return *this == EffectView{}; }
  bool operator==(const EffectView&) const = default;
};

/// A picture with effects.
struct EffectPicture {
  render::Image image;
  std::string note = {};  ///< sentence on effects that were left out; empty: none
};

/// Applies effects. @param image  with the layers and the header of a picture of `render`
/// @param pixelSize  edge of its pixels, in pixels of the window
[[nodiscard]] EffectPicture withEffects(const render::Image& image, const EffectView& effects,
                                        int pixelSize);

/// Actions that draw a view and apply the effects: "render view.exr … ! effect view.exr view.png
/// …".
[[nodiscard]] std::string effectText(const EffectView& effects, const render::Camera& camera,
                                     render::Style style);

/// Options of a camera: "--from … --to … --up … --fov …".
[[nodiscard]] std::string cameraText(const render::Camera& camera);

}  // namespace viewer
