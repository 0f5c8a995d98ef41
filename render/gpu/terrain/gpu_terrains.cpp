#include "render/gpu/terrain/gpu_terrains.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#include "render/kernel/trace_glsl.h"
#include "render/terrain/rays/terrain_tables.h"

namespace render {
namespace {

constexpr int kTerrainGroup = 64;  // invocations of a work group
// Rays of a dispatch, few enough to finish within the time limits of drivers.
constexpr std::size_t kTerrainRun = 1u << 16;
constexpr std::size_t kTerrainNumbers = 15;  // numbers of a ray, which the shader updates
constexpr std::size_t kWalkAt = 9;           // HeightWalk: level, i, j, t, column, halfRow

constexpr const char* kTerrainDialect = R"GLSL(
#define VAR precise double
#define RAY const HeightRay
#define RAY_OUT inout HeightRay
#define WALK inout HeightWalk
const double kNoRoot = 1e300lf, kMissing = 1e300lf, kSplitter = 134217729.0lf;
const double kLeastSlope = 1e-200lf, kMostInverse = 1e200lf;
uniform int firstRay, rayCount, columns, cellsU, cellsV, topLevel;
uniform int firstLeftOutU, lastLeftOutU, firstLeftOutV, lastLeftOutV;
uniform int firstNode[32];
layout(binding = 0) uniform isamplerBuffer heights;
layout(binding = 1) uniform isamplerBuffer nodes;
layout(std430, binding = 0) buffer Rays { double rays[]; };

double heightAt(int column, int row) {
  int bits = texelFetch(heights, row * columns + column).x;
  return (bits & 0x7fffffff) > 0x7f800000 ? kMissing : double(intBitsToFloat(bits));
}
int nodeAt(int level, int i, int j) {
  return firstNode[level] + j * (((cellsU - 1) >> level) + 1) + i;
}
double lowestIn(int level, int i, int j) {
  return double(intBitsToFloat(texelFetch(nodes, nodeAt(level, i, j)).x));
}
double highestIn(int level, int i, int j) {
  return double(intBitsToFloat(texelFetch(nodes, nodeAt(level, i, j)).y));
}
int trailingOnes(int bits) { return findLSB(~bits); }
)GLSL";

constexpr const char* kTerrainMain = R"GLSL(
void main() {
  int n = firstRay + int(gl_GlobalInvocationID.x);
  if (n >= rayCount) return;
  int at = kNumbers * n;
  HeightWalk walk;
  walk.level = int(rays[at + kWalkAt]);
  if (walk.level > topLevel) return;
  walk.i = int(rays[at + kWalkAt + 1]);
  walk.j = int(rays[at + kWalkAt + 2]);
  walk.t = rays[at + kWalkAt + 3];
  walk.column = int(rays[at + kWalkAt + 4]);
  walk.halfRow = int(rays[at + kWalkAt + 5]);
  HeightRay ray;
  ray.u = rays[at];
  ray.v = rays[at + 1];
  ray.w = rays[at + 2];
  ray.du = rays[at + 3];
  ray.dv = rays[at + 4];
  ray.dw = rays[at + 5];
  ray.near = rays[at + 6];
  ray.far = rays[at + 7];
  ray.pad = rays[at + 8];
  completeRay(ray);
  walkHeights(ray, false, kMostWalkSteps, walk);
  rays[at + kWalkAt] = double(walk.level);
  rays[at + kWalkAt + 1] = double(walk.i);
  rays[at + kWalkAt + 2] = double(walk.j);
  rays[at + kWalkAt + 3] = walk.t;
  rays[at + kWalkAt + 4] = double(walk.column);
  rays[at + kWalkAt + 5] = double(walk.halfRow);
}
)GLSL";

std::string terrainShaderText() {
  return fmt::format(
             "#version 450 core\nlayout(local_size_x = {}) in;\n"
             "const int kNumbers = {}, kWalkAt = {}, kMostWalkSteps = {};\n",
             kTerrainGroup, kTerrainNumbers, kWalkAt, GpuTerrains::kMostSteps) +
         kTerrainDialect + kHeightRaysKernel + kTerrainMain;
}

}  // namespace

void GpuTerrains::release() {
  uploaded_.release();
  rays_.release(context_);
  fetched_.release(context_);
  if (program_ != 0) context_.gl().DeleteProgram(program_);
  program_ = 0;
}

void GpuTerrains::upload(Uploaded& part) {
  const TerrainTables& tables = *part.tables;
  // The limit counts texels of four bytes.
  const auto add = [&](std::size_t place, const std::vector<float>& numbers, GLenum format,
                       std::size_t texel) {
    constexpr std::uint64_t kNone = 0;  // an empty texture is not allowed
    part.textures[place] = numbers.empty()
                               ? makeTexels(context_, largestTable_, &kNone, texel, format)
                               : makeTexels(context_, largestTable_ / 4 * texel, numbers.data(),
                                            numbers.size() * sizeof(float), format);
  };
  add(0, tables.field->heights, GL_R32I, 4);
  add(1, tables.ranges, GL_RG32I, 8);
}

void GpuTerrains::run(const Uploaded& part, std::vector<double>& rays) {
  const TerrainTables& tables = *part.tables;
  const GlFunctions& gl = context_.gl();
  if (program_ == 0) program_ = compileCompute(context_, terrainShaderText());
  gl.UseProgram(program_);
  for (std::size_t n = 0; n < part.textures.size(); ++n)
    gl.BindTextureUnit(static_cast<GLuint>(n), part.textures[n].texture);
  const auto set = [&](const std::string& name, auto value) {
    gl.Uniform1i(gl.GetUniformLocation(program_, name.c_str()), static_cast<GLint>(value));
  };
  set("columns", tables.field->columns);
  set("cellsU", tables.cellsU);
  set("cellsV", tables.cellsV);
  set("topLevel", tables.topLevel);
  set("firstLeftOutU", tables.leftOut[0]);
  set("lastLeftOutU", tables.leftOut[1]);
  set("firstLeftOutV", tables.leftOut[2]);
  set("lastLeftOutV", tables.leftOut[3]);
  for (std::size_t level = 0; level < tables.firstNode.size(); ++level)
    set(fmt::format("firstNode[{}]", level), tables.firstNode[level]);
  castUntilDone(context_, program_,
                {kTerrainNumbers, kTerrainGroup, kTerrainRun, "casting rays at a terrain"}, rays_,
                fetched_, rays, [&](const double* ray) { return ray[kWalkAt] > tables.topLevel; });
}

std::vector<TerrainHit> GpuTerrains::firstHits(const TerrainCaster& caster,
                                               const std::vector<Camera::Ray>& rays) {
  if (rays.empty()) return {};
  const TerrainTables& tables = *caster.tables();
  const HeightKernel::HeightWalk walk = tables.start();
  std::vector<double> numbers;
  numbers.reserve(rays.size() * kTerrainNumbers);
  for (const Camera::Ray& ray : rays) {
    const HeightKernel::HeightRay from = tables.gridRay(ray);
    numbers.insert(numbers.end(),
                   {from.u, from.v, from.w, from.du, from.dv, from.dw, from.near, from.far,
                    from.pad, static_cast<double>(walk.level), 0, 0, walk.t, 0, 0});
  }
  context_.run(
      [&] { run(uploaded_.of(caster.tables(), [&](Uploaded& part) { upload(part); }), numbers); });
  std::vector<TerrainHit> hits(rays.size());
  for (std::size_t n = 0; n < rays.size(); ++n) {
    const double* found = numbers.data() + kTerrainNumbers * n + kWalkAt;
    if (found[3] < HeightKernel::kNoRoot)
      hits[n] =
          caster.hitAt(rays[n], found[3], static_cast<int>(found[4]), static_cast<int>(found[5]));
  }
  return hits;
}

}  // namespace render
