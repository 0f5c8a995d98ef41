#include "render/gpu/gpu_interfaces.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

#include "render/kernel/trace_glsl.h"
#include "render/segmented/interface_tables.h"

namespace render {
namespace {

constexpr int kInterfaceGroup = 64;  // invocations of a work group
// Rays of a dispatch, few enough to finish within the time limits of drivers in double precision.
constexpr std::size_t kInterfaceRun = 1u << 16;
constexpr std::size_t kInterfaceNumbers = 14;  // numbers of a ray
constexpr std::size_t kInterfaceAnswers = 10;  // state, distance, labels, two gradients
// Iterations of loops in one call of the shader. Mesa's llvmpipe ends loops without notice after
// 65535 iterations of all loops of up to 16 rays.
constexpr int kMostInterfaceSteps = 1000;

/// Bindings of storage blocks in the shader.
constexpr GLuint kRaysOfField = 0, kInterfacesFound = 1;

constexpr const char* kInterfaceDialect = R"GLSL(
#define VAR precise double
#define IN(Type) Type
#define INOUT(Type) inout Type
#define CONST_INT const int
#define CONST_DOUBLE const double
uniform int firstRay, rayCount, pointsX, pointsY, pointsZ, groupsY, groupsZ, gradients;
uniform float backgroundValue;
layout(binding = 0) uniform usamplerBuffer blocks;
layout(binding = 1) uniform usamplerBuffer words;
layout(binding = 2) uniform usamplerBuffer distances;
layout(binding = 3) uniform usamplerBuffer extras;
layout(binding = 4) uniform usamplerBuffer palettes;
layout(binding = 5) uniform isamplerBuffer groupEntries;
layout(binding = 6) uniform isamplerBuffer entries;
layout(binding = 7) uniform usamplerBuffer masks;
layout(binding = 8) uniform usamplerBuffer shown;
layout(std430, binding = 0) buffer Rays { double rays[]; };
layout(std430, binding = 1) buffer Answers { double answers[]; };
double background;
bool wantsGradients;

// A float as a double. Drivers may replace floats below the least normal number by 0, so these are
// converted as integers.
double ofFloat(uint bits) {
  double tiny = double(bits & 0x7fffffu) / double(1 << 30) / double(1 << 30) / double(1 << 30) /
                double(1 << 30) / double(1 << 29);
  double result = (bits & 0x7f800000u) == 0u ? tiny : double(uintBitsToFloat(bits & 0x7fffffffu));
  return (bits & 0x80000000u) == 0u ? result : -result;
}

int groupEntry(int n) { return texelFetch(groupEntries, n).x; }
int tableEntry(int n) { return texelFetch(entries, n).x; }
uint maskWord(int n) { return texelFetch(masks, n).x; }
uint blockWord(int n) { return texelFetch(blocks, n).x; }
uint wordAt(int n) { return texelFetch(words, n).x; }
int paletteLabel(int n) { return int(texelFetch(palettes, n).x); }
double distanceAt(int n) { return ofFloat(texelFetch(distances, n).x); }
uint extraKey(int n) { return texelFetch(extras, 2 * n).x; }
double extraValue(int n) { return ofFloat(texelFetch(extras, 2 * n + 1).x); }
bool isShown(int label) { return ((texelFetch(shown, label >> 5).x >> uint(label & 31)) & 1u) != 0u; }
int bitsIn(uint x) { return bitCount(x); }
)GLSL";

constexpr const char* kSheetDialect = R"GLSL(
const bool hasSheets = true;
layout(binding = 9) uniform usamplerBuffer sheetCells;
layout(binding = 10) uniform isamplerBuffer sheetLists;
layout(binding = 11) uniform isamplerBuffer sheetTriangles;
layout(binding = 12) uniform usamplerBuffer sheetVertices;
layout(binding = 13) uniform usamplerBuffer sheetNormals;
uint sheetCellWord(int n) { return texelFetch(sheetCells, n).x; }
int sheetEntry(int n) { return texelFetch(sheetLists, n).x; }
int sheetCorner(int n) { return texelFetch(sheetTriangles, n).x; }
double sheetVertex(int n) { return packDouble2x32(texelFetch(sheetVertices, n).xy); }
double sheetNormal(int n) { return ofFloat(texelFetch(sheetNormals, n).x); }
)GLSL";

// Compilers remove the code for sheets then.
constexpr const char* kNoSheetsDialect = R"GLSL(
const bool hasSheets = false;
uint sheetCellWord(int n) { return 0u; }
int sheetEntry(int n) { return 0; }
int sheetCorner(int n) { return 0; }
double sheetVertex(int n) { return 0.0; }
double sheetNormal(int n) { return 0.0; }
)GLSL";

constexpr const char* kInterfaceMain = R"GLSL(
void main() {
  int n = firstRay + int(gl_GlobalInvocationID.x);
  if (n >= rayCount) return;
  int at = kRayNumbers * n;
  int answer = kAnswers * n;
  if (answers[answer] > 0.0) return;  // done by an earlier dispatch
  background = ofFloat(floatBitsToUint(backgroundValue));
  wantsGradients = gradients != 0;
  CrossingRay ray;
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
  ray.label = int(rays[at + 11]);
  ray.checks = int(rays[at + 12]);
  ray.begin = rays[at + 13];
  ray.state = kGoing;
  ray.sheet.triangle = -1;
  ray.sheet.t = 0.0;
  ray.sheet.shareA = 0.0;
  ray.sheet.shareB = 0.0;
  ray.sheet.shareC = 0.0;
  ray.front = 0;
  ray.behind = 0;
  ray.facetX = 0.0;
  ray.facetY = 0.0;
  ray.facetZ = 0.0;
  ray.smoothX = 0.0;
  ray.smoothY = 0.0;
  ray.smoothZ = 0.0;
  followInterfaces(ray, kMostSteps);
  answers[answer] = double(ray.state);
  if (ray.state == kGoing) {
    rays[at + 6] = ray.t;
    rays[at + 8] = double(ray.x);
    rays[at + 9] = double(ray.y);
    rays[at + 10] = double(ray.z);
    rays[at + 11] = double(ray.label);
    rays[at + 12] = double(ray.checks);
  } else {
    answers[answer + 1] = ray.t;
    answers[answer + 2] = double(ray.front);
    answers[answer + 3] = double(ray.behind);
    answers[answer + 4] = ray.facetX;
    answers[answer + 5] = ray.facetY;
    answers[answer + 6] = ray.facetZ;
    answers[answer + 7] = ray.smoothX;
    answers[answer + 8] = ray.smoothY;
    answers[answer + 9] = ray.smoothZ;
  }
}
)GLSL";

std::string interfaceShaderText(bool hasSheets) {
  return fmt::format(
             "#version 450 core\nlayout(local_size_x = {}) in;\n"
             "const int kRayNumbers = {}, kAnswers = {}, kMostSteps = {};\n",
             kInterfaceGroup, kInterfaceNumbers, kInterfaceAnswers, kMostInterfaceSteps) +
         kInterfaceDialect + (hasSheets ? kSheetDialect : kNoSheetsDialect) + kGridWalkKernel +
         kSheetsKernel + kInterfacesKernel + kInterfaceMain;
}

}  // namespace

void GpuInterfaces::release() {
  for (Texels& texels : textures_) {
    if (texels.texture != 0) releaseTexels(context_, texels);
    texels = {};
  }
  for (GrowingBuffer* buffer : {&rays_, &found_, &fetched_}) buffer->release(context_);
  for (GLuint& program : programs_) {
    if (program != 0) context_.gl().DeleteProgram(program);
    program = 0;
  }
  uploaded_ = nullptr;
}

void GpuInterfaces::upload(const InterfaceCaster& caster) {
  if (uploaded_ == caster.tables()) return;
  const InterfaceTables& tables = *caster.tables();
  uploaded_ = nullptr;
  for (Texels& texels : textures_) {
    if (texels.texture != 0) releaseTexels(context_, texels);
    texels = {};
  }
  std::size_t next = 0;
  // The limit counts texels of four bytes.
  const auto add = [&](const void* data, std::size_t bytes, GLenum format, std::size_t texel) {
    constexpr std::uint32_t kNone = 0;  // an empty texture is not allowed
    textures_[next++] = bytes > 0
                            ? makeTexels(context_, largestTable_ / 4 * texel, data, bytes, format)
                            : makeTexels(context_, largestTable_, &kNone, sizeof kNone, format);
  };
  const auto addWords = [&](const FieldArray& array) { add(array.data, array.bytes, GL_R32UI, 4); };
  const auto addVector = [&](const auto& numbers, GLenum format) {
    add(numbers.data(), numbers.size() * 4, format, 4);
  };
  addWords(tables.blocks);
  addWords(tables.words);
  addWords(tables.distances);
  addWords(tables.extras);
  add(tables.palettes.data, tables.palettes.bytes, GL_R16UI, 2);
  addVector(tables.groupEntries, GL_R32I);
  addVector(tables.table, GL_R32I);
  addVector(tables.masks, GL_R32UI);
  addVector(tables.shown, GL_R32UI);
  if (tables.sheets) {
    addVector(tables.sheetCells, GL_R32UI);
    addVector(tables.sheetLists, GL_R32I);
    addVector(tables.sheetTriangles, GL_R32I);
    add(tables.sheetVertices.data(), tables.sheetVertices.size() * 8, GL_RG32UI, 8);
    addVector(tables.sheetNormals, GL_R32UI);
  }
  context_.check("uploading the segmentation");
  uploaded_ = caster.tables();
}

std::vector<InterfaceHit> GpuInterfaces::firstHits(const InterfaceCaster& caster,
                                                   const std::vector<InterfaceRay>& rays,
                                                   bool wantsNormals) {
  std::vector<InterfaceHit> hits(rays.size());
  std::vector<double> input;
  std::vector<std::size_t> inside;  // indices of the rays that meet the grid
  for (std::size_t n = 0; n < rays.size(); ++n) {
    const InterfaceStart start = caster.start(rays[n]);
    if (!start.isInside) continue;
    inside.push_back(n);
    for (const Imath::V3d& v : {start.from, start.step}) input.insert(input.end(), {v.x, v.y, v.z});
    input.insert(input.end(), {start.t, start.end});
    for (int axis = 0; axis < 3; ++axis) input.push_back(start.cell[axis]);
    input.insert(input.end(),
                 {static_cast<double>(start.label), start.label < 0 ? 1.0 : 0.0, start.begin});
  }
  if (inside.empty()) return hits;
  std::vector<double> answers(kInterfaceAnswers * inside.size());
  context_.run([&] {
    upload(caster);
    run(input, wantsNormals, answers);
  });
  constexpr double kCrossedState = 2;  // kCrossed of the shader
  for (std::size_t n = 0; n < inside.size(); ++n) {
    const double* answer = answers.data() + kInterfaceAnswers * n;
    if (answer[0] != kCrossedState) continue;
    hits[inside[n]] = caster.hitOf(
        rays[inside[n]], answer[1], static_cast<int>(answer[2]), static_cast<int>(answer[3]),
        Imath::V3d(answer[4], answer[5], answer[6]), Imath::V3d(answer[7], answer[8], answer[9]));
  }
  return hits;
}

void GpuInterfaces::run(const std::vector<double>& input, bool wantsNormals,
                        std::vector<double>& answers) {
  const GlFunctions& gl = context_.gl();
  const InterfaceTables& tables = *uploaded_;
  const bool hasSheets = tables.sheets != nullptr;
  GLuint& program = programs_[hasSheets ? 1 : 0];
  if (program == 0) program = compileCompute(context_, interfaceShaderText(hasSheets));
  gl.UseProgram(program);
  const std::size_t rays = answers.size() / kInterfaceAnswers;
  std::fill(answers.begin(), answers.end(), 0.0);  // not done
  rays_.upload(context_, input);
  found_.upload(context_, answers);
  const std::size_t answerBytes = answers.size() * sizeof(double);
  fetched_.reserve(context_, answerBytes);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kRaysOfField, rays_.name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kInterfacesFound, found_.name());
  for (std::size_t n = 0; n < (hasSheets ? kTextures : kFieldTextures); ++n)
    gl.BindTextureUnit(static_cast<GLuint>(n), textures_[n].texture);
  const auto set = [&](const char* name, auto value) {
    gl.Uniform1i(gl.GetUniformLocation(program, name), static_cast<GLint>(value));
  };
  set("pointsX", tables.points.x);
  set("pointsY", tables.points.y);
  set("pointsZ", tables.points.z);
  set("groupsY", tables.groups.y);
  set("groupsZ", tables.groups.z);
  set("gradients", wantsNormals ? 1 : 0);
  set("rayCount", rays);
  const auto background = static_cast<GLfloat>(tables.background);
  gl.Uniform1fv(gl.GetUniformLocation(program, "backgroundValue"), 1, &background);
  for (bool isDone = false; !isDone;) {
    for (std::size_t first = 0; first < rays; first += kInterfaceRun) {
      set("firstRay", first);
      const std::size_t count = std::min(kInterfaceRun, rays - first);
      gl.DispatchCompute(static_cast<GLuint>((count + kInterfaceGroup - 1) / kInterfaceGroup), 1,
                         1);
      gl.Finish();
    }
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    gl.CopyNamedBufferSubData(found_.name(), fetched_.name(), 0, 0,
                              static_cast<GLsizeiptr>(answerBytes));
    gl.MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    gl.Finish();
    context_.check("casting rays through the segmentation");
    std::memcpy(answers.data(), fetched_.mapped(), answerBytes);
    isDone = true;
    for (std::size_t n = 0; n < rays && isDone; ++n) isDone = answers[kInterfaceAnswers * n] > 0;
  }
}

}  // namespace render
