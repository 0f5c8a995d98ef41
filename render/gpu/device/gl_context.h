#pragma once

// Private to the GPU renderer: OpenGL 4.5 without a display or a window. EGL is loaded at run time,
// so that programs also start on machines without EGL.

#include <GL/glcorearb.h>

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "render/gpu/device/no_opengl.h"

namespace render {

#define LEVELSMITH_GL_FUNCTIONS(X)                                       \
  X(PFNGLATTACHSHADERPROC, AttachShader)                                 \
  X(PFNGLBINDBUFFERPROC, BindBuffer)                                     \
  X(PFNGLBINDBUFFERBASEPROC, BindBufferBase)                             \
  X(PFNGLBINDFRAMEBUFFERPROC, BindFramebuffer)                           \
  X(PFNGLBINDTEXTUREUNITPROC, BindTextureUnit)                           \
  X(PFNGLBINDVERTEXARRAYPROC, BindVertexArray)                           \
  X(PFNGLCHECKNAMEDFRAMEBUFFERSTATUSPROC, CheckNamedFramebufferStatus)   \
  X(PFNGLCLEARNAMEDFRAMEBUFFERFVPROC, ClearNamedFramebufferfv)           \
  X(PFNGLCLIPCONTROLPROC, ClipControl)                                   \
  X(PFNGLCOMPILESHADERPROC, CompileShader)                               \
  X(PFNGLCOPYNAMEDBUFFERSUBDATAPROC, CopyNamedBufferSubData)             \
  X(PFNGLCREATEBUFFERSPROC, CreateBuffers)                               \
  X(PFNGLCREATEFRAMEBUFFERSPROC, CreateFramebuffers)                     \
  X(PFNGLCREATEPROGRAMPROC, CreateProgram)                               \
  X(PFNGLCREATERENDERBUFFERSPROC, CreateRenderbuffers)                   \
  X(PFNGLCREATESHADERPROC, CreateShader)                                 \
  X(PFNGLCREATETEXTURESPROC, CreateTextures)                             \
  X(PFNGLCREATEVERTEXARRAYSPROC, CreateVertexArrays)                     \
  X(PFNGLDELETEBUFFERSPROC, DeleteBuffers)                               \
  X(PFNGLDELETEFRAMEBUFFERSPROC, DeleteFramebuffers)                     \
  X(PFNGLDELETEPROGRAMPROC, DeleteProgram)                               \
  X(PFNGLDELETERENDERBUFFERSPROC, DeleteRenderbuffers)                   \
  X(PFNGLDELETESHADERPROC, DeleteShader)                                 \
  X(PFNGLDELETETEXTURESPROC, DeleteTextures)                             \
  X(PFNGLDELETEVERTEXARRAYSPROC, DeleteVertexArrays)                     \
  X(PFNGLDEPTHFUNCPROC, DepthFunc)                                       \
  X(PFNGLDISPATCHCOMPUTEPROC, DispatchCompute)                           \
  X(PFNGLENABLEPROC, Enable)                                             \
  X(PFNGLFINISHPROC, Finish)                                             \
  X(PFNGLGETERRORPROC, GetError)                                         \
  X(PFNGLGETGRAPHICSRESETSTATUSPROC, GetGraphicsResetStatus)             \
  X(PFNGLGETINTEGER64VPROC, GetInteger64v)                               \
  X(PFNGLGETPROGRAMINFOLOGPROC, GetProgramInfoLog)                       \
  X(PFNGLGETPROGRAMIVPROC, GetProgramiv)                                 \
  X(PFNGLGETSHADERINFOLOGPROC, GetShaderInfoLog)                         \
  X(PFNGLGETSHADERIVPROC, GetShaderiv)                                   \
  X(PFNGLGETSTRINGPROC, GetString)                                       \
  X(PFNGLGETUNIFORMLOCATIONPROC, GetUniformLocation)                     \
  X(PFNGLLINKPROGRAMPROC, LinkProgram)                                   \
  X(PFNGLMAPNAMEDBUFFERRANGEPROC, MapNamedBufferRange)                   \
  X(PFNGLMEMORYBARRIERPROC, MemoryBarrier)                               \
  X(PFNGLMULTIDRAWELEMENTSINDIRECTPROC, MultiDrawElementsIndirect)       \
  X(PFNGLNAMEDBUFFERDATAPROC, NamedBufferData)                           \
  X(PFNGLNAMEDBUFFERSTORAGEPROC, NamedBufferStorage)                     \
  X(PFNGLNAMEDBUFFERSUBDATAPROC, NamedBufferSubData)                     \
  X(PFNGLNAMEDFRAMEBUFFERDRAWBUFFERSPROC, NamedFramebufferDrawBuffers)   \
  X(PFNGLNAMEDFRAMEBUFFERREADBUFFERPROC, NamedFramebufferReadBuffer)     \
  X(PFNGLNAMEDFRAMEBUFFERRENDERBUFFERPROC, NamedFramebufferRenderbuffer) \
  X(PFNGLNAMEDRENDERBUFFERSTORAGEPROC, NamedRenderbufferStorage)         \
  X(PFNGLPIXELSTOREIPROC, PixelStorei)                                   \
  X(PFNGLREADPIXELSPROC, ReadPixels)                                     \
  X(PFNGLSHADERSOURCEPROC, ShaderSource)                                 \
  X(PFNGLTEXTUREBUFFERPROC, TextureBuffer)                               \
  X(PFNGLUNIFORM1FVPROC, Uniform1fv)                                     \
  X(PFNGLUNIFORM1IPROC, Uniform1i)                                       \
  X(PFNGLUNIFORM2FVPROC, Uniform2fv)                                     \
  X(PFNGLUNIFORM3FVPROC, Uniform3fv)                                     \
  X(PFNGLUSEPROGRAMPROC, UseProgram)                                     \
  X(PFNGLVERTEXARRAYELEMENTBUFFERPROC, VertexArrayElementBuffer)         \
  X(PFNGLVIEWPORTPROC, Viewport)

/// Pointers to the OpenGL functions of LEVELSMITH_GL_FUNCTIONS, named without the prefix "gl".
struct GlFunctions {
#define LEVELSMITH_GL_MEMBER(Type, name) Type name = nullptr;
  LEVELSMITH_GL_FUNCTIONS(LEVELSMITH_GL_MEMBER)
#undef LEVELSMITH_GL_MEMBER
};

/// An OpenGL 4.5 context without a window, on a thread of its own. Hardware devices are preferred
/// to software rendering. The context stays current on that thread, because drivers take long to
/// move a context from thread to thread.
class GlContext {
 public:
  /// @throws NoOpenGl when EGL or OpenGL 4.5 is missing; the message lists the devices that were
  /// tried
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// Runs a job on the context's thread and waits for its end. Jobs of several threads run one
  /// after the other. A job may call run() itself. Exceptions of the job are thrown here.
  void run(const std::function<void()>& job) const;

  /// OpenGL's functions. Only jobs of run() may call them.
  const GlFunctions& gl() const { return gl_; }
  /// Name of the renderer and OpenGL version, from the driver.
  [[nodiscard]] const std::string& description() const { return description_; }
  /// Largest size of a buffer texture with 32-bit texels, bytes.
  [[nodiscard]] std::size_t largestTable() const { return largestTable_; }
  /// Number of buffer textures that a compute shader can access.
  [[nodiscard]] int tableCount() const { return tableCount_; }
  /// Checks for OpenGL errors. Only jobs of run() may call this function.
  /// @param what  operation that has just run, such as "tracing the rays"; part of the message
  /// @throws levelset::ResourceLimit when the context was lost or OpenGL reports an error
  void check(const char* what) const;

 private:
  struct Egl;
  struct Waiting;

  void open();  // opens the context on the calling thread
  void work();  // loop of the context's thread
  void end();   // stops the context's thread

  std::unique_ptr<Egl> egl_;
  GlFunctions gl_;
  std::string description_;
  std::size_t largestTable_ = 0;
  int tableCount_ = 0;
  mutable std::mutex mutex_;
  mutable std::condition_variable hasWork_, hasAnswer_;
  mutable std::deque<Waiting*> waiting_;  // jobs that have not started
  bool isEnding_ = false;
  std::thread thread_;  // the last member: it uses the others
};

}  // namespace render
