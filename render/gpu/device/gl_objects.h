#pragma once

// Private to the GPU renderer: tables and programs in an OpenGL context.

#include <cstddef>
#include <span>
#include <string>

#include "render/gpu/device/gl_context.h"

namespace render {

/// A buffer that shaders read as a texture. Mesa's llvmpipe gathers from textures by vectors, but
/// from storage blocks lane by lane.
struct Texels {
  GLuint buffer = 0, texture = 0;
};

/// Uploads data as a buffer texture. Runs in a job of GlContext::run().
/// @param format  OpenGL's internal format of a texel
/// @param largestTable  limit on the size of a buffer texture, bytes
/// @throws levelset::ResourceLimit when the data does not fit
[[nodiscard]] Texels makeTexels(const GlContext& context, std::size_t largestTable,
                                const void* data, std::size_t bytes, GLenum format);
/// Runs in a job of GlContext::run().
void releaseTexels(const GlContext& context, const Texels& texels);

/// A buffer of at least the size that was last reserved. It grows and never shrinks, because
/// drivers take long to allocate. All functions run in jobs of GlContext::run().
class GrowingBuffer {
 public:
  enum class Use {
    Upload,  ///< written with NamedBufferSubData
    Device,  ///< read and written by shaders only
    Fetch    ///< target of copies, mapped into the memory of the process
  };
  explicit GrowingBuffer(Use use) : use_(use) {}

  /// Makes room for `bytes`. The contents are lost if the buffer grows.
  /// @throws levelset::ResourceLimit when the memory of the device does not suffice
  void reserve(const GlContext& context, std::size_t bytes);
  /// Makes room for numbers, and copies them into the buffer. @pre the buffer is for Use::Upload
  /// @throws levelset::ResourceLimit as reserve()
  void upload(const GlContext& context, std::span<const double> numbers);
  void release(const GlContext& context);
  [[nodiscard]] GLuint name() const { return name_; }
  /// Size of the memory, bytes.
  [[nodiscard]] std::size_t capacity() const { return capacity_; }
  /// Address of the contents. @pre the buffer is for Use::Fetch
  [[nodiscard]] const void* mapped() const { return mapped_; }

 private:
  Use use_;
  GLuint name_ = 0;
  std::size_t capacity_ = 0;
  const void* mapped_ = nullptr;
};

/// Compiles and links a compute shader. Runs in a job of GlContext::run().
/// @throws levelset::ResourceLimit when it does not compile or link; the message has the start of
/// the driver's log
[[nodiscard]] GLuint compileCompute(const GlContext& context, const std::string& text);
/// Compiles and links a vertex and a fragment shader. Runs in a job of GlContext::run().
/// @throws levelset::ResourceLimit as compileCompute()
[[nodiscard]] GLuint compileDrawing(const GlContext& context, const std::string& vertexText,
                                    const std::string& fragmentText);

}  // namespace render
