#pragma once

// Private to the GPU renderer: tables and programs in an OpenGL context.

#include <cstddef>
#include <string>

#include "render/gpu/gl_context.h"

namespace render {

/// A buffer that shaders read as a texture. Mesa's llvmpipe gathers from textures by vectors, but
/// from storage blocks lane by lane.
struct Texels {
  GLuint buffer = 0, texture = 0;
};

/// Uploads data as a buffer texture. @pre the context is current
/// @param format  OpenGL's internal format of a texel
/// @param largestTable  limit on the size of a buffer texture, bytes
/// @throws levelset::ResourceLimit when the data does not fit
[[nodiscard]] Texels makeTexels(const GlContext& context, std::size_t largestTable,
                                const void* data, std::size_t bytes, GLenum format);
/// @pre the context is current
void releaseTexels(const GlContext& context, const Texels& texels);

/// Compiles and links a compute shader. @pre the context is current
/// @throws levelset::ResourceLimit when it does not compile or link; the message has the start of
/// the driver's log
[[nodiscard]] GLuint compileCompute(const GlContext& context, const std::string& text);

}  // namespace render
