#pragma once

// Private to the GPU renderer. OpenGL 4.5 without a display or a window: EGL is loaded at run time,
// so that programs start where there is none.

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

/// The functions of OpenGL that are used, without their prefix.
struct GlFunctions {
#define LEVELSMITH_GL_MEMBER(Type, name) Type name = nullptr;
  LEVELSMITH_GL_FUNCTIONS(LEVELSMITH_GL_MEMBER)
#undef LEVELSMITH_GL_MEMBER
};

/// A context of OpenGL 4.5 of its own. Hardware is preferred to software.
class GlContext {
 public:
  /// @throws NoOpenGl where there is no EGL, or no OpenGL 4.5, with what was tried
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// While it lives the calling thread, and no other, may call OpenGL; then what was current before
  /// is again.
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
  /// Renderer and version as the driver tells them.
  [[nodiscard]] const std::string& description() const { return description_; }
  /// Bytes of the largest buffer of 32-bit texels.
  [[nodiscard]] std::size_t largestTable() const { return largestTable_; }
  /// Of those that a compute shader can see.
  [[nodiscard]] int tableCount() const { return tableCount_; }
  /// @pre current  @throws levelset::ResourceLimit when the context was lost or OpenGL reports an
  ///                       error, with `what` was being done
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
