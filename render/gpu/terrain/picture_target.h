#pragma once

// Private to the drawing of terrains.

#include "render/gpu/device/gl_context.h"
#include "render/gpu/terrain/terrain_painter.h"

namespace render {

/// A framebuffer with colours, normals and depths along the view axis, and a depth buffer. All
/// functions run in jobs of GlContext::run().
class PictureTarget {
 public:
  /// Clears the buffers, and makes them the target of drawing.
  /// @throws levelset::ResourceLimit for a size that OpenGL does not support
  void begin(const GlContext& context, int width, int height);
  /// Reads the picture.
  [[nodiscard]] TerrainPicture end(const GlContext& context) const;
  void release(const GlContext& context);

 private:
  void allocate(const GlContext& context, int width, int height);

  int width_ = 0, height_ = 0;
  GLuint frame_ = 0, colours_ = 0, surfaces_ = 0, order_ = 0;
};

}  // namespace render
