#include "render/gpu/terrain/picture_target.h"

#include <fmt/core.h>

#include <array>
#include <limits>

#include "levelset/error.h"

namespace render {

void PictureTarget::release(const GlContext& context) {
  const GlFunctions& gl = context.gl();
  gl.DeleteFramebuffers(1, &frame_);
  for (GLuint* buffer : {&colours_, &surfaces_, &order_}) {
    gl.DeleteRenderbuffers(1, buffer);
    *buffer = 0;
  }
  frame_ = 0;
  width_ = height_ = 0;
}

void PictureTarget::allocate(const GlContext& context, int width, int height) {
  const GlFunctions& gl = context.gl();
  GLint64 most = 0;
  gl.GetInteger64v(GL_MAX_RENDERBUFFER_SIZE, &most);
  if (width > most || height > most)
    throw levelset::ResourceLimit(
        fmt::format("a picture of {}x{} pixels is too large; OpenGL supports at most {} pixels "
                    "along a side here; choose a smaller size",
                    width, height, most));
  release(context);
  gl.CreateFramebuffers(1, &frame_);
  const auto attach = [&](GLuint& buffer, GLenum format, GLenum place) {
    gl.CreateRenderbuffers(1, &buffer);
    gl.NamedRenderbufferStorage(buffer, format, width, height);
    gl.NamedFramebufferRenderbuffer(frame_, place, GL_RENDERBUFFER, buffer);
  };
  attach(colours_, GL_RGBA8, GL_COLOR_ATTACHMENT0);
  attach(surfaces_, GL_RGBA32F, GL_COLOR_ATTACHMENT1);
  attach(order_, GL_DEPTH_COMPONENT32F, GL_DEPTH_ATTACHMENT);
  constexpr std::array<GLenum, 2> kDrawn = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  gl.NamedFramebufferDrawBuffers(frame_, 2, kDrawn.data());
  context.check("allocating the picture of a terrain");
  width_ = width;
  height_ = height;
}

void PictureTarget::begin(const GlContext& context, int width, int height) {
  if (width != width_ || height != height_) allocate(context, width, height);
  const GlFunctions& gl = context.gl();
  constexpr std::array<float, 4> kNothing = {0, 0, 0, 0};
  constexpr std::array<float, 4> kEndless = {0, 0, 0, std::numeric_limits<float>::infinity()};
  gl.BindFramebuffer(GL_FRAMEBUFFER, frame_);
  gl.Viewport(0, 0, width, height);
  gl.ClearNamedFramebufferfv(frame_, GL_COLOR, 0, kNothing.data());
  gl.ClearNamedFramebufferfv(frame_, GL_COLOR, 1, kEndless.data());
  gl.ClearNamedFramebufferfv(frame_, GL_DEPTH, 0, kNothing.data());
  gl.ClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
  gl.Enable(GL_DEPTH_TEST);
  gl.DepthFunc(GL_GREATER);
  gl.Enable(GL_CLIP_DISTANCE0);
  gl.Enable(GL_CLIP_DISTANCE1);
}

TerrainPicture PictureTarget::end(const GlContext& context) const {
  const GlFunctions& gl = context.gl();
  TerrainPicture picture{.width = width_, .height = height_, .colours = {}, .surfaces = {}};
  const auto pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  picture.colours.resize(4 * pixels);
  picture.surfaces.resize(pixels);
  gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl.NamedFramebufferReadBuffer(frame_, GL_COLOR_ATTACHMENT0);
  gl.ReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, picture.colours.data());
  gl.NamedFramebufferReadBuffer(frame_, GL_COLOR_ATTACHMENT1);
  gl.ReadPixels(0, 0, width_, height_, GL_RGBA, GL_FLOAT, picture.surfaces.data());
  context.check("reading the picture of a terrain");
  return picture;
}

}  // namespace render
