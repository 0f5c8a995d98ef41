#include "render/gpu/gpu_effects.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include "levelset/error.h"
#include "render/gpu/device/double_root.h"
#include "render/gpu/device/gl_context.h"
#include "render/gpu/device/gl_objects.h"
#include "render/kernel/trace_glsl.h"

namespace render {
namespace {

constexpr int kScreenGroup = 64;                        // invocations of a work group
constexpr std::size_t kScreenRun = 1u << 16;            // pixels of a dispatch
constexpr GLuint kScreenFound = 0, kScreenNumbers = 1;  // bindings of storage blocks

constexpr const char* kScreenDialect = R"GLSL(
#define VAR precise double
#define CONST_INT const int
uniform int firstPixel, pixelCount, width, height, perspective;
layout(binding = 0) uniform samplerBuffer pixels;
layout(binding = 1) uniform samplerBuffer earlier;
layout(std430, binding = 0) writeonly buffer Answers { float found[]; };
layout(std430, binding = 1) readonly buffer Numbers { double numbers[]; };
bool isPerspective;

double pixelDepth(int x, int y) { return double(texelFetch(pixels, y * width + x).x); }
double pixelNormal(int x, int y, int axis) {
  return double(texelFetch(pixels, y * width + x)[1 + axis]);
}
double earlierAt(int x, int y) { return double(texelFetch(earlier, y * width + x).x); }
double number(int n) { return numbers[n]; }
)GLSL";

constexpr const char* kScreenMain = R"GLSL(
void main() {
  int n = firstPixel + int(gl_GlobalInvocationID.x);
  if (n >= pixelCount) return;
  isPerspective = perspective != 0;
  found[n] = float(ANSWER(n % width, n / width));
}
)GLSL";

constexpr std::array<const char*, 5> kScreenAnswers = {"outlineStrength", "outlineAt", "openShare",
                                                       "keyShare", "smoothed"};

class GpuScreenRunner : public ScreenRunner {
 public:
  GpuScreenRunner() = default;
  ~GpuScreenRunner() override {
    context_.run([&] {
      for (const GLuint program : programs_)
        if (program != 0) context_.gl().DeleteProgram(program);
      for (GrowingBuffer* buffer : {&numbers_, &found_, &fetched_}) buffer->release(context_);
    });
  }
  GpuScreenRunner(const GpuScreenRunner&) = delete;
  GpuScreenRunner& operator=(const GpuScreenRunner&) = delete;

  [[nodiscard]] std::vector<float> run(const ScreenTables& tables, ScreenPass pass,
                                       const std::vector<float>& earlier) const override {
    std::vector<float> answers(tables.pixels.size() / 4);
    context_.run([&] { runPass(tables, pass, earlier, answers); });
    return answers;
  }

 private:
  // These run in jobs of GlContext::run().
  void runPass(const ScreenTables& tables, ScreenPass pass, const std::vector<float>& earlier,
               std::vector<float>& answers) const {
    constexpr float kNothing = 0;
    const std::size_t largest = context_.largestTable();
    Texels pixels, before;
    try {
      pixels = makeTexels(context_, 4 * largest, tables.pixels.data(),
                          tables.pixels.size() * sizeof(float), GL_RGBA32F);
      before = makeTexels(context_, largest, earlier.empty() ? &kNothing : earlier.data(),
                          std::max<std::size_t>(earlier.size(), 1) * sizeof(float), GL_R32F);
      dispatch(tables, programOf(pass), pixels, before, answers);
    } catch (...) {
      releaseTexels(context_, pixels);
      releaseTexels(context_, before);
      throw;
    }
    releaseTexels(context_, pixels);
    releaseTexels(context_, before);
  }

  GLuint programOf(ScreenPass pass) const {
    GLuint& program = programs_[static_cast<std::size_t>(pass)];
    if (program == 0)
      program = compileCompute(
          context_, fmt::format("#version 450 core\nlayout(local_size_x = {}) in;\n"
                                "#define ANSWER {}\n",
                                kScreenGroup, kScreenAnswers[static_cast<std::size_t>(pass)]) +
                        kScreenDialect + doubleRootText() + kScreenKernel + kScreenMain);
    return program;
  }

  void dispatch(const ScreenTables& tables, GLuint program, const Texels& pixels,
                const Texels& before, std::vector<float>& answers) const {
    const GlFunctions& gl = context_.gl();
    const std::size_t bytes = answers.size() * sizeof(float);
    numbers_.upload(context_, tables.numbers);
    found_.reserve(context_, bytes);
    fetched_.reserve(context_, bytes);
    gl.UseProgram(program);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kScreenFound, found_.name());
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kScreenNumbers, numbers_.name());
    gl.BindTextureUnit(0, pixels.texture);
    gl.BindTextureUnit(1, before.texture);
    const auto set = [&](const char* name, auto value) {
      gl.Uniform1i(gl.GetUniformLocation(program, name), static_cast<GLint>(value));
    };
    set("width", tables.width);
    set("height", tables.height);
    set("perspective", tables.isPerspective ? 1 : 0);
    set("pixelCount", answers.size());
    for (std::size_t first = 0; first < answers.size(); first += kScreenRun) {
      set("firstPixel", first);
      const std::size_t count = std::min(kScreenRun, answers.size() - first);
      gl.DispatchCompute(static_cast<GLuint>((count + kScreenGroup - 1) / kScreenGroup), 1, 1);
      gl.Finish();
    }
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    gl.CopyNamedBufferSubData(found_.name(), fetched_.name(), 0, 0, static_cast<GLsizeiptr>(bytes));
    gl.MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    gl.Finish();
    context_.check("computing an effect");
    std::memcpy(answers.data(), fetched_.mapped(), bytes);
  }

  GlContext context_;
  mutable std::array<GLuint, 5> programs_{};  // for each ScreenPass
  mutable GrowingBuffer numbers_{GrowingBuffer::Use::Upload}, found_{GrowingBuffer::Use::Device},
      fetched_{GrowingBuffer::Use::Fetch};
};

}  // namespace

std::unique_ptr<ScreenRunner> makeGpuScreenRunner() {
  return std::make_unique<GpuScreenRunner>();
}

}  // namespace render
