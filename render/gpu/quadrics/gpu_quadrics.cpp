#include "render/gpu/quadrics/gpu_quadrics.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>

#include "render/gpu/device/double_root.h"
#include "render/kernel/trace_glsl.h"
#include "render/quadrics/quadric_tables.h"
#include "render/quadrics/quadric_trace.h"

namespace render {
namespace {

constexpr int kQuadricGroup = 64;  // invocations of a work group
// Rays of a dispatch, few enough to finish within the time limits of drivers.
constexpr std::size_t kQuadricRun = 1u << 16;
constexpr std::size_t kQuadricNumbers = 12;  // numbers of a ray, which the shader updates
constexpr std::size_t kNextBox = 9, kNearestAt = 10, kSlotAt = 11;
// Boxes that a call of the shader visits for a ray. Mesa's llvmpipe ends loops without notice after
// 65535 iterations of all loops of up to 16 rays.
constexpr int kMostBoxSteps = 2000;
constexpr int kQuadricWords = 25;  // words of a general quadric

constexpr const char* kQuadricDialect = R"GLSL(
#define VAR precise double
#define CONST_INT const int
const double kNoRoot = 1e300lf;
uniform int firstRay, rayCount, boxCount, firstStick, firstQuadric;
uniform float margin;
layout(binding = 0) uniform isamplerBuffer boxes;
layout(binding = 1) uniform isamplerBuffer balls;
layout(binding = 2) uniform isamplerBuffer sticks;
layout(binding = 3) uniform isamplerBuffer quadrics;
layout(std430, binding = 0) buffer Rays { double rays[]; };
)GLSL";

constexpr const char* kQuadricMain = R"GLSL(
double ofBits(int bits) { return double(intBitsToFloat(bits)); }
double ballNumber(int at) { return ofBits(texelFetch(balls, at).x); }
double stickNumber(int at) { return ofBits(texelFetch(sticks, at).x); }
double quadricNumber(int at) { return ofBits(texelFetch(quadrics, at).x); }
double quadricDouble(int at) {
  return packDouble2x32(uvec2(texelFetch(quadrics, at).x, texelFetch(quadrics, at + 1).x));
}
// True for the numbers of an empty place.
bool isNothing(int bits) { return (bits & 0x7fffffff) > 0x7f800000; }

double rootOfBall(QuadricRay ray, int slot) {
  int at = 32 * (slot >> 3) + (slot & 7);
  if (isNothing(texelFetch(balls, at).x)) return kNoRoot;
  return ballRoot(ray, ballNumber(at), ballNumber(at + 8), ballNumber(at + 16), ballNumber(at + 24));
}

double rootOfStick(QuadricRay ray, int place) {
  int at = 56 * (place >> 3) + (place & 7);
  if (isNothing(texelFetch(sticks, at).x)) return kNoRoot;
  return stickRoot(ray, stickNumber(at), stickNumber(at + 8), stickNumber(at + 16), stickNumber(at + 24),
                   stickNumber(at + 32), stickNumber(at + 40), stickNumber(at + 48)).t;
}

double rootOfQuadric(QuadricRay ray, int place) {
  int at = kQuadricWords * place;
  QuadricShape s;
  s.x = quadricNumber(at);
  s.y = quadricNumber(at + 1);
  s.z = quadricNumber(at + 2);
  s.low = quadricNumber(at + 3);
  s.high = quadricNumber(at + 4);
  s.kind = texelFetch(quadrics, at + 5).x;
  s.isCapped = texelFetch(quadrics, at + 6).x;
  s.xx = quadricDouble(at + 7);
  s.xy = quadricDouble(at + 9);
  s.xz = quadricDouble(at + 11);
  s.yx = quadricDouble(at + 13);
  s.yy = quadricDouble(at + 15);
  s.yz = quadricDouble(at + 17);
  s.zx = quadricDouble(at + 19);
  s.zy = quadricDouble(at + 21);
  s.zz = quadricDouble(at + 23);
  return quadricRoot(ray, s).t;
}

void main() {
  int n = firstRay + int(gl_GlobalInvocationID.x);
  if (n >= rayCount) return;
  int at = kNumbers * n;
  int box = int(rays[at + kNextBox]);
  if (box >= boxCount) return;
  QuadricRay ray;
  ray.x = rays[at];
  ray.y = rays[at + 1];
  ray.z = rays[at + 2];
  ray.dx = rays[at + 3];
  ray.dy = rays[at + 4];
  ray.dz = rays[at + 5];
  ray.near = rays[at + 6];
  double far = rays[at + 7];
  double start = rays[at + 8];
  double nearest = rays[at + kNearestAt];
  int slot = int(rays[at + kSlotAt]);
  // The ray in single precision, for the boxes.
  vec3 direction = vec3(float(ray.dx), float(ray.dy), float(ray.dz));
  vec3 from = vec3(float(ray.x + start * ray.dx), float(ray.y + start * ray.dy), float(ray.z + start * ray.dz));
  for (int c = 0; c < 3; ++c)
    if (abs(direction[c]) < 1e-20) direction[c] = direction[c] < 0.0 ? -1e-20 : 1e-20;
  vec3 inverse = 1.0 / direction;
  for (int step = 0; step < kMostBoxSteps && box < boxCount; ++step) {
    ivec4 low = texelFetch(boxes, 2 * box);
    ivec4 high = texelFetch(boxes, 2 * box + 1);
    vec3 a = (intBitsToFloat(low.xyz) - from) * inverse;
    vec3 b = (intBitsToFloat(high.xyz) - from) * inverse;
    vec3 enters = min(a, b);
    vec3 leaves = max(a, b);
    float enter = max(max(enters.x, enters.y), max(enters.z, -margin));
    float end = float(min(min(nearest, far) - start, double(1e30))) + 2.0 * margin;
    float leave = min(min(leaves.x, leaves.y), min(leaves.z, end));
    if (enter > leave) {
      box = low.w;
      continue;
    }
    int first = high.w;
    int count = first < 0 ? 0 : (first < firstQuadric ? 8 : 1);
    for (int lane = 0; lane < count; ++lane) {
      int own = first + lane;
      double t = kNoRoot;
      if (own < firstStick)
        t = rootOfBall(ray, own);
      else if (own < firstQuadric)
        t = rootOfStick(ray, own - firstStick);
      else
        t = rootOfQuadric(ray, own - firstQuadric);
      if (t < kNoRoot && t <= far && (t < nearest || (t == nearest && own < slot))) {
        nearest = t;
        slot = own;
      }
    }
    box = box + 1;
  }
  rays[at + kNextBox] = double(box);
  rays[at + kNearestAt] = nearest;
  rays[at + kSlotAt] = double(slot);
}
)GLSL";

std::string quadricShaderText() {
  return fmt::format(
             "#version 450 core\nlayout(local_size_x = {}) in;\n"
             "const int kNumbers = {}, kNextBox = {}, kNearestAt = {}, kSlotAt = {};\n"
             "const int kMostBoxSteps = {}, kQuadricWords = {};\n",
             kQuadricGroup, kQuadricNumbers, kNextBox, kNearestAt, kSlotAt, kMostBoxSteps,
             kQuadricWords) +
         kQuadricDialect + doubleRootText() + kQuadricsKernel + kQuadricMain;
}

/// A box with its parent's follower: the next box of a ray that misses this one.
struct ListedBox {
  float low[3];
  std::int32_t skip;
  float high[3];
  std::int32_t first;  // slot of the first primitive; −1: the children follow
};

/// Appends the boxes of the children of a node, each followed by its own.
void listBoxes(const std::vector<QuadricNode>& nodes, std::uint32_t number, std::size_t firstSlot,
               std::size_t width, std::vector<ListedBox>& list) {
  const QuadricNode& node = nodes[number];
  for (std::size_t n = 0; n < kQuadricLanes; ++n) {
    if (!(node.planes[0][n] <= node.planes[3][n])) continue;
    const std::size_t at = list.size();
    ListedBox& box = list.emplace_back();
    for (std::size_t c = 0; c < 3; ++c) {
      box.low[c] = node.planes[c][n];
      box.high[c] = node.planes[c + 3][n];
    }
    const std::uint32_t child = node.child[n];
    const bool isLeaf = (child & QuadricNode::kLeaf) != 0;
    box.first =
        isLeaf ? static_cast<std::int32_t>(firstSlot + width * (child & ~QuadricNode::kLeaf)) : -1;
    if (!isLeaf) listBoxes(nodes, child, firstSlot, width, list);
    list[at].skip = static_cast<std::int32_t>(list.size());
  }
}

std::vector<std::uint32_t> wordsOf(const std::vector<StoredQuadric>& quadrics) {
  std::vector<std::uint32_t> words;
  words.reserve(quadrics.size() * kQuadricWords);
  for (const StoredQuadric& quadric : quadrics) {
    for (const float x : quadric.position) words.push_back(std::bit_cast<std::uint32_t>(x));
    words.push_back(std::bit_cast<std::uint32_t>(quadric.low));
    words.push_back(std::bit_cast<std::uint32_t>(quadric.high));
    words.push_back(quadric.kind);
    words.push_back(quadric.isCapped);
    for (const double x : quadric.inverse) {
      const auto bits = std::bit_cast<std::uint64_t>(x);
      words.push_back(static_cast<std::uint32_t>(bits));
      words.push_back(static_cast<std::uint32_t>(bits >> 32));
    }
  }
  return words;
}

}  // namespace

void GpuQuadrics::release() {
  uploaded_.release();
  rays_.release(context_);
  fetched_.release(context_);
  if (program_ != 0) context_.gl().DeleteProgram(program_);
  program_ = 0;
}

void GpuQuadrics::upload(Uploaded& part) {
  const QuadricTables& tables = *part.tables;
  std::vector<ListedBox> boxes;
  const std::size_t firsts[] = {0, tables.firstStick(), tables.firstQuadric()};
  for (std::size_t kind = 0; kind < 3; ++kind)
    if (!tables.trees[kind].empty())
      listBoxes(tables.trees[kind], 0, firsts[kind], kind < 2 ? kQuadricLanes : 1, boxes);
  part.boxCount = static_cast<int>(boxes.size());
  std::size_t next = 0;
  // The limit counts texels of four bytes.
  const auto add = [&](const void* data, std::size_t bytes, GLenum format, std::size_t texel) {
    constexpr std::uint32_t kNone = 0;  // an empty texture is not allowed
    part.textures[next++] =
        bytes > 0 ? makeTexels(context_, largestTable_ / 4 * texel, data, bytes, format)
                  : makeTexels(context_, largestTable_, &kNone, sizeof kNone, GL_R32I);
  };
  add(boxes.data(), boxes.size() * sizeof(ListedBox), GL_RGBA32I, 16);
  add(tables.balls.data(), tables.balls.size() * sizeof(BallBlock), GL_R32I, 4);
  static_assert(sizeof(StickBlock) == 56 * sizeof(float));
  add(tables.sticks.data(), tables.sticks.size() * sizeof(StickBlock), GL_R32I, 4);
  const std::vector<std::uint32_t> words = wordsOf(tables.quadrics);
  add(words.data(), words.size() * sizeof(std::uint32_t), GL_R32I, 4);
}

void GpuQuadrics::run(const Uploaded& part, std::vector<double>& rays) {
  const QuadricTables& tables = *part.tables;
  const GlFunctions& gl = context_.gl();
  if (program_ == 0) program_ = compileCompute(context_, quadricShaderText());
  gl.UseProgram(program_);
  for (std::size_t n = 0; n < part.textures.size(); ++n)
    gl.BindTextureUnit(static_cast<GLuint>(n), part.textures[n].texture);
  const auto set = [&](const char* name, auto value) {
    gl.Uniform1i(gl.GetUniformLocation(program_, name), static_cast<GLint>(value));
  };
  set("boxCount", part.boxCount);
  set("firstStick", tables.firstStick());
  set("firstQuadric", tables.firstQuadric());
  const auto margin = static_cast<GLfloat>(tables.pad());
  gl.Uniform1fv(gl.GetUniformLocation(program_, "margin"), 1, &margin);
  castUntilDone(context_, program_,
                {kQuadricNumbers, kQuadricGroup, kQuadricRun, "casting rays at quadrics"}, rays_,
                fetched_, rays, [&](const double* ray) { return ray[kNextBox] >= part.boxCount; });
}

std::vector<QuadricHit> GpuQuadrics::firstHits(const QuadricCaster& caster,
                                               const std::vector<Camera::Ray>& rays) {
  if (rays.empty()) return {};
  const QuadricTables& tables = *caster.tables();
  std::vector<double> numbers;
  numbers.reserve(rays.size() * kQuadricNumbers);
  for (const Camera::Ray& ray : rays) {
    const QuadricKernel::QuadricRay from = relativeRay(tables, ray);
    const std::optional<double> start = startAt(tables, from);
    const int box = start ? 0 : INT32_MAX;  // a ray that misses the sphere of all boxes has ended
    numbers.insert(numbers.end(), {from.x, from.y, from.z, from.dx, from.dy, from.dz, from.near,
                                   ray.far, start.value_or(ray.near), static_cast<double>(box),
                                   QuadricKernel::kNoRoot, static_cast<double>(INT32_MAX)});
  }
  context_.run(
      [&] { run(uploaded_.of(caster.tables(), [&](Uploaded& part) { upload(part); }), numbers); });
  std::vector<QuadricHit> hits(rays.size());
  for (std::size_t n = 0; n < rays.size(); ++n) {
    const double* found = numbers.data() + kQuadricNumbers * n;
    if (found[kNearestAt] < QuadricKernel::kNoRoot)
      hits[n] =
          caster.hitAt(rays[n], found[kNearestAt], static_cast<std::uint32_t>(found[kSlotAt]));
  }
  return hits;
}

}  // namespace render
