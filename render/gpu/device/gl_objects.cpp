#include "render/gpu/device/gl_objects.h"

#include <fmt/core.h>

#include <algorithm>
#include <initializer_list>
#include <vector>

#include "levelset/error.h"

namespace render {
namespace {

/// Text of a shader of a program.
struct ShaderText {
  GLenum kind;
  const std::string& text;
};

/// @param remedy  end of the message for a failure; {} stands for the driver's log
GLuint linkedProgram(const GlContext& context, std::initializer_list<ShaderText> texts,
                     fmt::format_string<const char*> remedy) {
  const GlFunctions& gl = context.gl();
  const GLuint program = gl.CreateProgram();
  std::vector<GLuint> shaders;
  const auto refuse = [&](const char* what, auto getLog, GLuint object) {
    char log[400] = "";
    getLog(object, sizeof log, nullptr, log);
    for (const GLuint shader : shaders) gl.DeleteShader(shader);
    gl.DeleteProgram(program);
    throw levelset::ResourceLimit(fmt::format("the graphics driver ({}) does not {} {}",
                                              context.description(), what,
                                              fmt::format(remedy, static_cast<const char*>(log))));
  };
  GLint isGood = 0;
  for (const auto& [kind, text] : texts) {
    const GLuint shader = shaders.emplace_back(gl.CreateShader(kind));
    const char* lines = text.c_str();
    gl.ShaderSource(shader, 1, &lines, nullptr);
    gl.CompileShader(shader);
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &isGood);
    if (!isGood) refuse("compile", gl.GetShaderInfoLog, shader);
    gl.AttachShader(program, shader);
  }
  gl.LinkProgram(program);
  gl.GetProgramiv(program, GL_LINK_STATUS, &isGood);
  if (!isGood) refuse("link", gl.GetProgramInfoLog, program);
  for (const GLuint shader : shaders) gl.DeleteShader(shader);
  return program;
}

}  // namespace

Texels makeTexels(const GlContext& context, std::size_t largestTable, const void* data,
                  std::size_t bytes, GLenum format) {
  const GlFunctions& gl = context.gl();
  if (bytes > largestTable) {
    throw levelset::ResourceLimit(fmt::format(
        "a table of {} MB does not fit into a buffer texture of {} MB, the limit of {}; "
        "use larger voxels, or draw with --renderer cpu",
        bytes >> 20, largestTable >> 20, context.description()));
  }
  Texels texels;
  gl.CreateBuffers(1, &texels.buffer);
  gl.NamedBufferData(texels.buffer, static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
  gl.CreateTextures(GL_TEXTURE_BUFFER, 1, &texels.texture);
  gl.TextureBuffer(texels.texture, format, texels.buffer);
  return texels;
}

void releaseTexels(const GlContext& context, const Texels& texels) {
  context.gl().DeleteTextures(1, &texels.texture);
  context.gl().DeleteBuffers(1, &texels.buffer);
}

void GrowingBuffer::upload(const GlContext& context, std::span<const double> numbers) {
  reserve(context, numbers.size_bytes());
  context.gl().NamedBufferSubData(name_, 0, static_cast<GLsizeiptr>(numbers.size_bytes()),
                                  numbers.data());
}

void GrowingBuffer::reserve(const GlContext& context, std::size_t bytes) {
  if (bytes <= capacity_) return;
  std::size_t wanted = std::max(bytes, capacity_ + capacity_ / 2);
  release(context);
  const GlFunctions& gl = context.gl();
  constexpr GLbitfield kMapping = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  const GLbitfield flags = use_ == Use::Upload  ? GL_DYNAMIC_STORAGE_BIT
                           : use_ == Use::Fetch ? kMapping | GL_CLIENT_STORAGE_BIT
                                                : 0;
  const auto allocate = [&](std::size_t size) {
    gl.CreateBuffers(1, &name_);
    gl.NamedBufferStorage(name_, static_cast<GLsizeiptr>(size), nullptr, flags);
    context.check("allocating memory for rays");
  };
  try {
    allocate(wanted);
  } catch (const levelset::ResourceLimit&) {  // there may be room for what is needed now
    release(context);
    wanted = bytes;
    allocate(wanted);
  }
  if (use_ == Use::Fetch) {
    mapped_ = gl.MapNamedBufferRange(name_, 0, static_cast<GLsizeiptr>(wanted), kMapping);
    context.check("mapping memory of the graphics driver");
  }
  capacity_ = wanted;
}

void GrowingBuffer::release(const GlContext& context) {
  if (name_ != 0) context.gl().DeleteBuffers(1, &name_);  // this ends the mapping, too
  name_ = 0;
  capacity_ = 0;
  mapped_ = nullptr;
}

GLuint compileCompute(const GlContext& context, const std::string& text) {
  return linkedProgram(context, {{GL_COMPUTE_SHADER, text}},
                       "the ray caster: {}; draw with --renderer cpu");
}

GLuint compileDrawing(const GlContext& context, const std::string& vertexText,
                      const std::string& fragmentText) {
  return linkedProgram(context,
                       {{GL_VERTEX_SHADER, vertexText}, {GL_FRAGMENT_SHADER, fragmentText}},
                       "the drawing of triangles: {}; use another driver");
}

}  // namespace render
