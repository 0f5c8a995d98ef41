#pragma once

#include <cstddef>

#include "levelset/progress.h"
#include "render/filter.h"
#include "render/shading/optics_options.h"
#include "render/shading/style.h"

namespace render {

/// Options of all renderers.
struct RenderOptions {
  /// Colour samples for each pixel, at least 1. The other layers use one ray through the centre of
  /// the pixel.
  int samples = 4;
  int ambientSamples = 16;  ///< ambient occlusion rays for each colour sample; 0: no occlusion
  int shadowSamples = 4;    ///< shadow rays for each colour sample; 0: no shadows
  /// Distance, in pixels, of the picture points at which renderCpu() and renderGpu() trace light
  /// rays where light varies smoothly; between them the light is interpolated. 1: every colour
  /// sample traces its own light rays, as renderEmbree() and transparent scenes always do.
  int lightSpacing = 4;
  Filter filter = Filter::Trilinear;
  /// renderGpu() reads NanoVDB grids in place of the kernel's tables: slower, but the same bits.
  /// Requires the trilinear filter.
  bool fromNanoVdb = false;
  StyleOptions style = {};  ///< shading style of the colours
  bool thickness =
      false;  ///< adds the layer thickness: length of the ray inside the solids, world units
  /// False: renderCpu() and renderGpu() draw colours only, and leave the other layers empty where
  /// the style needs no light. The colours have the same bits.
  bool layers = true;
  bool curvature = true;  ///< adds the layers curvature.mean, .gauss, .k1 and .k2
  /// Adds the layers direction1 and direction2 with the principal directions.
  bool directions = false;
  /// True when the picture has the layers of curvatures, and of directions. Style::CurvatureLines
  /// needs both.
  [[nodiscard]] bool hasCurvature() const {
    return curvature || style.style == Style::CurvatureLines;
  }
  [[nodiscard]] bool hasDirections() const {
    return directions || style.style == Style::CurvatureLines;
  }
  /// Adds the layers light.sky and light.key: shares of the light that reaches the first surface.
  /// They are traced with ambientSamples and shadowSamples rays for each colour sample.
  bool lightLayers = false;
  /// Reflection and refraction, traced on the processor. Surfaces outside the picture are in
  /// mirrors, too.
  OpticsOptions optics = {};
  /// Adds the layers volume.R .G .B .A to a picture with Scene::volumePart.
  bool volumeLight = true;
  /// Memory limit, bytes. It applies to the image and, separately, to the kernel's tables of the
  /// scene.
  std::size_t maxBytes = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

}  // namespace render
