#pragma once

#include "levelset/error.h"

namespace render {

/// Error: OpenGL 4.5 without a display is not available.
struct NoOpenGl : levelset::ResourceLimit {
  using ResourceLimit::ResourceLimit;
};

}  // namespace render
