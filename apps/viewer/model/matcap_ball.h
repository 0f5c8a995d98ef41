#pragma once

#include <memory>

#include "render/shading/style.h"

namespace viewer {

/// The viewer's own picture of a shaded ball, for the style matcap without --matcap: a warm light
/// from the upper left, a cool light from below, a highlight, and a dark rim. Linear values.
[[nodiscard]] std::shared_ptr<const render::ColourImage> matcapBall();

}  // namespace viewer
