#include "render/gpu/gpu_light.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

#include "levelset/error.h"
#include "render/direct/light_tables.h"
#include "render/gpu/device/double_root.h"
#include "render/kernel/trace_glsl.h"

namespace render {
namespace {

using levelset::VolumeType;

constexpr int kLightGroup = 64;  // invocations of a work group
// Rays of a dispatch, few enough to finish within the time limits of drivers in double precision.
constexpr std::size_t kLightRun = 1u << 16;
constexpr std::size_t kLightRayNumbers = 16;  // numbers of a ray, the members of VolumeRay
constexpr std::size_t kLightAnswers = 4;      // colour and transmittance
// Iterations of loops in one call of the shader. Mesa's llvmpipe ends loops without notice after
// 65535 iterations of all loops of up to 16 rays.
constexpr int kMostSteps = 2000;

/// Bindings of storage blocks in the shader.
constexpr GLuint kRaysOfLight = 0, kLightFound = 1, kLightConstants = 2;

constexpr const char* kLightDialect = R"GLSL(
#define VAR precise double
#define IN(Type) Type
#define INOUT(Type) inout Type
#define CONST_INT const int
#define INVERSE(n) (double(1) / double(n))
uniform int firstRay, rayCount, pointsX, pointsY, pointsZ, blocksY, blocksZ, groupsY, groupsZ;
uniform int firstBlock, pieceCount, shaded;
layout(binding = 0) uniform usamplerBuffer values;
layout(binding = 1) uniform usamplerBuffer marks;
layout(std430, binding = 0) buffer Rays { double rays[]; };
layout(std430, binding = 1) buffer Answers { double found[]; };
layout(std430, binding = 2) readonly buffer Numbers { double numbers[]; };
bool isShaded;
double scaleSlope, scaleIntercept, tolerance, piecesPerDepth, leastPassed, plainGradient;
double ambientLight, toLightX, toLightY, toLightZ;

double pieceNumber(int n) { return numbers[kLightNumbers + n]; }
double worldToIndex(int n) { return numbers[kWorldToIndex + n]; }
bool groupHasExtinction(int n) { return texelFetch(marks, n).x != 0u; }
bool blockHasExtinction(int n) { return texelFetch(marks, firstBlock + n).x != 0u; }

// A float as a double. Drivers may replace floats below the least normal number by 0, so these are
// converted as integers.
double ofFloat(uint bits) {
  double tiny = double(bits & 0x7fffffu) / double(1 << 30) / double(1 << 30) / double(1 << 30) /
                double(1 << 30) / double(1 << 29);
  double result = (bits & 0x7f800000u) == 0u ? tiny : double(uintBitsToFloat(bits & 0x7fffffffu));
  return (bits & 0x80000000u) == 0u ? result : -result;
}

double numberAt(int x, int y, int z) {
  int n = (z * pointsY + y) * pointsX + x;
  uint word = texelFetch(values, n >> kWordShift).x;
  int low = (n & ((1 << kWordShift) - 1)) * kNumberBits;
  return NUMBER(word, low);
}
)GLSL";

constexpr const char* kLightMain = R"GLSL(
void main() {
  int n = firstRay + int(gl_GlobalInvocationID.x);
  if (n >= rayCount) return;
  int at = kRayNumbers * n;
  int answer = kAnswers * n;
  if (found[answer + 3] >= 0.0) return;  // done by an earlier dispatch
  isShaded = shaded != 0;
  scaleSlope = numbers[kScaleSlope];
  scaleIntercept = numbers[kScaleIntercept];
  tolerance = numbers[kPieceTolerance];
  piecesPerDepth = numbers[kPiecesPerDepth];
  leastPassed = numbers[kLeastPassed];
  plainGradient = numbers[kPlainGradient];
  ambientLight = numbers[kAmbientLight];
  toLightX = numbers[kToLight];
  toLightY = numbers[kToLight + 1];
  toLightZ = numbers[kToLight + 2];
  VolumeRay ray;
  ray.fromX = rays[at];
  ray.fromY = rays[at + 1];
  ray.fromZ = rays[at + 2];
  ray.stepX = rays[at + 3];
  ray.stepY = rays[at + 4];
  ray.stepZ = rays[at + 5];
  ray.t = rays[at + 6];
  ray.end = rays[at + 7];
  ray.x = int(rays[at + 8]);
  ray.y = int(rays[at + 9]);
  ray.z = int(rays[at + 10]);
  ray.pieces = int(rays[at + 11]);
  ray.red = rays[at + 12];
  ray.green = rays[at + 13];
  ray.blue = rays[at + 14];
  ray.passed = rays[at + 15];
  follow(ray, kMostSteps);
  if (ray.pieces == kEnded) {
    found[answer] = ray.red;
    found[answer + 1] = ray.green;
    found[answer + 2] = ray.blue;
    found[answer + 3] = ray.passed;
    return;
  }
  rays[at + 6] = ray.t;
  rays[at + 8] = double(ray.x);
  rays[at + 9] = double(ray.y);
  rays[at + 10] = double(ray.z);
  rays[at + 11] = double(ray.pieces);
  rays[at + 12] = ray.red;
  rays[at + 13] = ray.green;
  rays[at + 14] = ray.blue;
  rays[at + 15] = ray.passed;
}
)GLSL";

int bytesOf(VolumeType type) {
  return static_cast<int>(levelset::volumeTypeSize(type));
}

std::string lightShaderText(VolumeType type) {
  const char* number = type == VolumeType::F32 ? "ofFloat(word)"
                       : type == VolumeType::U8 || type == VolumeType::U16
                           ? "double(bitfieldExtract(word, low, kNumberBits))"
                           : "double(bitfieldExtract(int(word), low, kNumberBits))";
  return fmt::format(
             "#version 450 core\nlayout(local_size_x = {}) in;\n"
             "const int kScaleSlope = {}, kScaleIntercept = {}, kPieceTolerance = {},\n"
             "          kPiecesPerDepth = {}, kLeastPassed = {}, kPlainGradient = {},\n"
             "          kAmbientLight = {}, kToLight = {}, kWorldToIndex = {}, kLightNumbers = "
             "{},\n"
             "          kRayNumbers = {}, kAnswers = {}, kMostSteps = {},\n"
             "          kWordShift = {}, kNumberBits = {};\n"
             "#define NUMBER(word, low) {}\n",
             kLightGroup, kScaleSlope, kScaleIntercept, kPieceTolerance, kPiecesPerDepth,
             kLeastPassed, kPlainGradient, kAmbientLight, kToLight, kWorldToIndex, kLightNumbers,
             kLightRayNumbers, kLightAnswers, kMostSteps,
             bytesOf(type) == 1   ? 2
             : bytesOf(type) == 2 ? 1
                                  : 0,
             8 * bytesOf(type), number) +
         kLightDialect + doubleRootText() + kGridWalkKernel + kTransferKernel + kDirectKernel +
         kLightMain;
}

}  // namespace

void GpuLight::release() {
  const GlFunctions& gl = context_.gl();
  for (Texels* texels : {&values_, &marks_}) {
    if (texels->texture != 0) releaseTexels(context_, *texels);
    *texels = {};
  }
  for (GrowingBuffer* buffer : {&numbers_, &rays_, &found_, &fetched_}) buffer->release(context_);
  for (GLuint& program : programs_) {
    if (program != 0) gl.DeleteProgram(program);
    program = 0;
  }
  uploaded_ = nullptr;
}

void GpuLight::upload(const DirectVolume& volume) {
  if (uploaded_ == volume.tables()) return;
  const LightTables& tables = *volume.tables();
  if (volume.transfer().points().size() > kMostPoints)
    throw levelset::ResourceLimit(fmt::format(
        "the transfer function has {} points, but --renderer gpu supports at most {}; give fewer, "
        "or draw with --renderer cpu",
        volume.transfer().points().size(), kMostPoints));
  const bool hasNumbers = uploaded_ && uploaded_->volume.numbers() == tables.volume.numbers() &&
                          uploaded_->volume.memoryUse() == tables.volume.memoryUse();
  uploaded_ = nullptr;
  if (marks_.texture != 0) releaseTexels(context_, marks_);
  marks_ = {};
  if (!hasNumbers) {
    if (values_.texture != 0) releaseTexels(context_, values_);
    values_ = {};
    // Texels are words. The last one may end behind the numbers.
    const std::size_t bytes = tables.volume.memoryUse(), words = (bytes + 3) / 4;
    values_ = makeTexels(context_, largestTable_, nullptr, 4 * words, GL_R32UI);
    context_.gl().NamedBufferSubData(values_.buffer, 0, static_cast<GLsizeiptr>(bytes),
                                     tables.volume.numbers());
  }
  std::vector<std::uint8_t> marks(tables.groupHasExtinction.begin(),
                                  tables.groupHasExtinction.end());
  marks.insert(marks.end(), tables.hasExtinction.begin(), tables.hasExtinction.end());
  marks_ = makeTexels(context_, largestTable_ / 4, marks.data(), marks.size(), GL_R8UI);
  context_.check("uploading the volume");
  uploaded_ = volume.tables();
}

std::vector<VolumeLight> GpuLight::light(const DirectVolume& volume,
                                         const std::vector<VolumeSegment>& segments,
                                         const VolumeShading* shading) {
  std::vector<VolumeLight> light(segments.size());
  std::vector<double> input;
  std::vector<std::size_t> inside;  // indices of the segments that meet the grid
  for (std::size_t n = 0; n < segments.size(); ++n) {
    const LightStart start = volume.start(segments[n]);
    if (!start.isInside) continue;
    inside.push_back(n);
    for (const Imath::V3d& v : {start.from, start.step}) input.insert(input.end(), {v.x, v.y, v.z});
    input.insert(input.end(), {start.t, start.end});
    for (int axis = 0; axis < 3; ++axis) input.push_back(start.cell[axis]);
    input.insert(input.end(), {0, 0, 0, 0, 1});  // pieces, colour, transmittance
  }
  if (inside.empty()) return light;
  const LightTables& tables = *volume.tables();
  const LightNumbers constants = lightNumbers(tables, shading);
  std::vector<double> numbers(constants.begin(), constants.end());
  numbers.insert(numbers.end(), tables.pieces.begin(), tables.pieces.end());
  std::vector<double> answers(kLightAnswers * inside.size());
  context_.run([&] {
    upload(volume);
    run(input, numbers, shading != nullptr, answers);
  });
  for (std::size_t n = 0; n < inside.size(); ++n) {
    const double* answer = answers.data() + kLightAnswers * n;
    light[inside[n]] = {Imath::V3d(answer[0], answer[1], answer[2]), answer[3]};
  }
  return light;
}

void GpuLight::run(const std::vector<double>& input, const std::vector<double>& numbers,
                   bool isShaded, std::vector<double>& answers) {
  const GlFunctions& gl = context_.gl();
  const LightTables& tables = *uploaded_;
  GLuint& program = programs_[static_cast<std::size_t>(tables.volume.type())];
  if (program == 0) program = compileCompute(context_, lightShaderText(tables.volume.type()));
  gl.UseProgram(program);
  const std::size_t rays = answers.size() / kLightAnswers;
  std::fill(answers.begin(), answers.end(), -1.0);  // not done
  rays_.upload(context_, input);
  numbers_.upload(context_, numbers);
  found_.upload(context_, answers);
  const std::size_t answerBytes = answers.size() * sizeof(double);
  fetched_.reserve(context_, answerBytes);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kRaysOfLight, rays_.name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kLightFound, found_.name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kLightConstants, numbers_.name());
  gl.BindTextureUnit(0, values_.texture);
  gl.BindTextureUnit(1, marks_.texture);
  const auto set = [&](const char* name, auto value) {
    gl.Uniform1i(gl.GetUniformLocation(program, name), static_cast<GLint>(value));
  };
  set("pointsX", tables.volume.size().x);
  set("pointsY", tables.volume.size().y);
  set("pointsZ", tables.volume.size().z);
  set("blocksY", tables.blocks.y);
  set("blocksZ", tables.blocks.z);
  set("groupsY", tables.groups.y);
  set("groupsZ", tables.groups.z);
  set("shaded", isShaded ? 1 : 0);
  set("firstBlock", tables.groupHasExtinction.size());
  set("pieceCount", tables.pieceCount);
  set("rayCount", rays);
  for (bool isDone = false; !isDone;) {
    for (std::size_t first = 0; first < rays; first += kLightRun) {
      set("firstRay", first);
      const std::size_t count = std::min(kLightRun, rays - first);
      gl.DispatchCompute(static_cast<GLuint>((count + kLightGroup - 1) / kLightGroup), 1, 1);
      gl.Finish();
    }
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    gl.CopyNamedBufferSubData(found_.name(), fetched_.name(), 0, 0,
                              static_cast<GLsizeiptr>(answerBytes));
    gl.MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    gl.Finish();
    context_.check("integrating the light of the volume");
    std::memcpy(answers.data(), fetched_.mapped(), answerBytes);
    isDone = true;
    for (std::size_t n = 0; n < rays && isDone; ++n) isDone = answers[kLightAnswers * n + 3] >= 0;
  }
}

}  // namespace render
