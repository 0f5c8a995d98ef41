#pragma once

// Private to the GPU renderer: tables that stay in the OpenGL context between pictures, and shaders
// that cast rays in several calls.

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "render/gpu/device/gl_context.h"
#include "render/gpu/device/gl_objects.h"

namespace render {

/// Tables in an OpenGL context, which stay as long as something else holds them. All functions run
/// in jobs of GlContext::run().
/// @tparam Part  has `tables`, a shared pointer, and `textures`, an array of Texels
template <typename Part>
class UploadedTables {
 public:
  /// @param context  must outlive this object
  explicit UploadedTables(const GlContext& context) : context_(context) {}

  /// @param upload  fills the textures of a new part
  template <typename Tables, typename Upload>
  const Part& of(const std::shared_ptr<const Tables>& tables, const Upload& upload) {
    for (const Part& part : parts_)
      if (part.tables == tables) return part;
    std::erase_if(parts_, [this](Part& part) {
      const bool isUnused = part.tables.use_count() == 1;
      if (isUnused) free(part);
      return isUnused;
    });
    Part part;
    part.tables = tables;
    try {
      upload(part);
    } catch (...) {
      free(part);
      throw;
    }
    return parts_.emplace_back(std::move(part));
  }

  void release() {
    for (Part& part : parts_) free(part);
    parts_.clear();
  }

 private:
  void free(Part& part) {
    for (Texels& texels : part.textures) {
      if (texels.texture != 0) releaseTexels(context_, texels);
      texels = {};
    }
  }

  const GlContext& context_;
  std::vector<Part> parts_;
};

/// Casting of rays by a shader that keeps the state of each ray in the numbers of the ray, and does
/// a limited number of steps in one call.
struct RayCalls {
  std::size_t perRay;  ///< numbers of a ray
  std::size_t group;   ///< rays of a work group
  std::size_t run;     ///< rays of a call, so that no call takes too long for the driver
  const char* what;    ///< names the job in error messages
};

/// Calls a program, whose uniforms are set, until all rays are done. Runs in a job of
/// GlContext::run().
/// @param rays     state of the rays; read and replaced
/// @param isDone   tells from the numbers of a ray whether it is done
template <typename IsDone>
void castUntilDone(const GlContext& context, GLuint program, const RayCalls& calls,
                   GrowingBuffer& uploaded, GrowingBuffer& fetched, std::vector<double>& rays,
                   const IsDone& isDone) {
  const GlFunctions& gl = context.gl();
  const std::size_t count = rays.size() / calls.perRay, bytes = rays.size() * sizeof(double);
  uploaded.upload(context, rays);
  fetched.reserve(context, bytes);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, uploaded.name());
  gl.Uniform1i(gl.GetUniformLocation(program, "rayCount"), static_cast<GLint>(count));
  const GLint firstRay = gl.GetUniformLocation(program, "firstRay");
  for (bool areDone = false; !areDone;) {
    for (std::size_t first = 0; first < count; first += calls.run) {
      gl.Uniform1i(firstRay, static_cast<GLint>(first));
      const std::size_t some = std::min(calls.run, count - first);
      gl.DispatchCompute(static_cast<GLuint>((some + calls.group - 1) / calls.group), 1, 1);
      gl.Finish();
    }
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    gl.CopyNamedBufferSubData(uploaded.name(), fetched.name(), 0, 0,
                              static_cast<GLsizeiptr>(bytes));
    gl.MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    gl.Finish();
    context.check(calls.what);
    std::memcpy(rays.data(), fetched.mapped(), bytes);
    areDone = true;
    for (std::size_t n = 0; n < count && areDone; ++n) areDone = isDone(&rays[calls.perRay * n]);
  }
}

}  // namespace render
