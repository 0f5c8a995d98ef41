#pragma once

#include <cstddef>

#include "levelset/progress.h"
#include "render/filter.h"
#include "render/shading/style.h"

namespace render {

/// Options of all renderers.
struct RenderOptions {
  int samples = 4;          ///< per pixel, at least 1; for colour layers only
  int ambientSamples = 16;  ///< per colour sample; 0: no occlusion
  int shadowSamples = 4;    ///< per colour sample; 0: no shadows
  Filter filter = Filter::Trilinear;
  /// renderGpu() reads NanoVDB grids in place of the kernel's tables: slower, but the same bits.
  /// Requires the trilinear filter.
  bool fromNanoVdb = false;
  StyleOptions style = {};  ///< shading style of the colours
  bool thickness = false;   ///< writes the layer thickness: length of the ray inside the solids
  bool curvature = true;    ///< writes the layers curvature.mean .gauss .k1 .k2
  std::size_t maxBytes = levelset::kNoMemoryLimit;  ///< memory limit of image and scene
  levelset::Progress progress = {};
};

}  // namespace render
