#pragma once

// Private to the GPU renderer: OpenGL 4.5 without a display or a window. EGL is loaded at run time,
// so that programs also start on machines without EGL.

#include <GL/glcorearb.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "render/gpu/gpu_renderer.h"

namespace render {

#define LEVELSMITH_GL_FUNCTIONS(X)                           \
  X(PFNGLATTACHSHADERPROC, AttachShader)                     \
  X(PFNGLBINDBUFFERBASEPROC, BindBufferBase)                 \
  X(PFNGLBINDTEXTUREUNITPROC, BindTextureUnit)               \
  X(PFNGLCOMPILESHADERPROC, CompileShader)                   \
  X(PFNGLCREATEBUFFERSPROC, CreateBuffers)                   \
  X(PFNGLCREATEPROGRAMPROC, CreateProgram)                   \
  X(PFNGLCREATESHADERPROC, CreateShader)                     \
  X(PFNGLCREATETEXTURESPROC, CreateTextures)                 \
  X(PFNGLDELETEBUFFERSPROC, DeleteBuffers)                   \
  X(PFNGLDELETEPROGRAMPROC, DeleteProgram)                   \
  X(PFNGLDELETESHADERPROC, DeleteShader)                     \
  X(PFNGLDELETETEXTURESPROC, DeleteTextures)                 \
  X(PFNGLDISPATCHCOMPUTEPROC, DispatchCompute)               \
  X(PFNGLFINISHPROC, Finish)                                 \
  X(PFNGLGETERRORPROC, GetError)                             \
  X(PFNGLGETGRAPHICSRESETSTATUSPROC, GetGraphicsResetStatus) \
  X(PFNGLGETINTEGER64VPROC, GetInteger64v)                   \
  X(PFNGLGETNAMEDBUFFERSUBDATAPROC, GetNamedBufferSubData)   \
  X(PFNGLGETPROGRAMINFOLOGPROC, GetProgramInfoLog)           \
  X(PFNGLGETPROGRAMIVPROC, GetProgramiv)                     \
  X(PFNGLGETSHADERINFOLOGPROC, GetShaderInfoLog)             \
  X(PFNGLGETSHADERIVPROC, GetShaderiv)                       \
  X(PFNGLGETSTRINGPROC, GetString)                           \
  X(PFNGLGETUNIFORMLOCATIONPROC, GetUniformLocation)         \
  X(PFNGLLINKPROGRAMPROC, LinkProgram)                       \
  X(PFNGLMEMORYBARRIERPROC, MemoryBarrier)                   \
  X(PFNGLNAMEDBUFFERDATAPROC, NamedBufferData)               \
  X(PFNGLSHADERSOURCEPROC, ShaderSource)                     \
  X(PFNGLTEXTUREBUFFERPROC, TextureBuffer)                   \
  X(PFNGLUNIFORM1FVPROC, Uniform1fv)                         \
  X(PFNGLUNIFORM1IPROC, Uniform1i)                           \
  X(PFNGLUSEPROGRAMPROC, UseProgram)

/// Pointers to the OpenGL functions of LEVELSMITH_GL_FUNCTIONS, named without the prefix "gl".
struct GlFunctions {
#define LEVELSMITH_GL_MEMBER(Type, name) Type name = nullptr;
  LEVELSMITH_GL_FUNCTIONS(LEVELSMITH_GL_MEMBER)
#undef LEVELSMITH_GL_MEMBER
};

/// An OpenGL 4.5 context without a window. Hardware devices are preferred to software rendering.
class GlContext {
 public:
  /// @throws NoOpenGl when EGL or OpenGL 4.5 is missing; the message lists the devices that were
  /// tried
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// Makes the context current on the calling thread and locks it against other threads. The
  /// destructor restores the previous context.
  class Current {
   public:
    explicit Current(const GlContext& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    const GlContext& context_;
    std::unique_lock<std::mutex> lock_;
    void *display_, *draw_, *read_, *before_;
  };

  const GlFunctions& gl() const { return gl_; }
  /// Name of the renderer and OpenGL version, from the driver.
  [[nodiscard]] const std::string& description() const { return description_; }
  /// Largest size of a buffer texture with 32-bit texels, bytes.
  [[nodiscard]] std::size_t largestTable() const { return largestTable_; }
  /// Number of buffer textures that a compute shader can access.
  [[nodiscard]] int tableCount() const { return tableCount_; }
  /// Checks for OpenGL errors. @pre the context is current
  /// @param what  operation that has just run, such as "tracing the rays"; part of the message
  /// @throws levelset::ResourceLimit when the context was lost or OpenGL reports an error
  void check(const char* what) const;

 private:
  struct Egl;
  std::unique_ptr<Egl> egl_;
  GlFunctions gl_;
  std::string description_;
  std::size_t largestTable_ = 0;
  int tableCount_ = 0;
  mutable std::mutex mutex_;
};

}  // namespace render
