#pragma once

#include <cstddef>

#include "levelset/progress.h"
#include "render/filter.h"
#include "render/shading/style.h"

namespace render {

/// Options of all renderers.
struct RenderOptions {
  int samples = 4;          ///< colour samples for each pixel, at least 1; data layers use one ray
  int ambientSamples = 16;  ///< ambient occlusion rays for each colour sample; 0: no occlusion
  int shadowSamples = 4;    ///< shadow rays for each colour sample; 0: no shadows
  Filter filter = Filter::Trilinear;
  /// renderGpu() reads NanoVDB grids in place of the kernel's tables: slower, but the same bits.
  /// Requires the trilinear filter.
  bool fromNanoVdb = false;
  StyleOptions style = {};  ///< shading style of the colours
  bool thickness =
      false;  ///< adds the layer thickness: length of the ray inside the solids, world units
  bool curvature = true;  ///< adds the layers curvature.mean, .gauss, .k1 and .k2
  std::size_t maxBytes =
      levelset::kNoMemoryLimit;  ///< memory limit for the image and the tables of the scene, bytes
  levelset::Progress progress = {};
};

}  // namespace render
