#pragma once

#include <cstddef>

#include "levelset/progress.h"
#include "render/filter.h"
#include "render/shading/style.h"

namespace render {

struct RenderOptions {
  int samples = 4;          ///< per pixel, at least 1; colour only
  int ambientSamples = 16;  ///< per colour sample; 0: no occlusion
  int shadowSamples = 4;    ///< per colour sample; 0: no shadows
  Filter filter = Filter::Trilinear;
  /// renderGpu() reads the NanoVDB grids themselves: slower, and the same bits. Trilinear only.
  bool fromNanoVdb = false;
  StyleOptions style = {};  ///< of the colours
  bool thickness = false;   ///< layer thickness: how far the ray is within the solids
  bool curvature = true;    ///< layers curvature.mean .gauss .k1 .k2
  std::size_t maxBytes = levelset::kNoMemoryLimit;  ///< for the image and the scene
  levelset::Progress progress = {};
};

}  // namespace render
