#include "render/gpu/gpu_tracer.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstring>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "render/cpu/cpu_trace.h"
#include "render/gpu/device/gl_objects.h"
#include "render/gpu/gpu_fields.h"
#include "render/gpu/gpu_interfaces.h"
#include "render/gpu/gpu_light.h"
#include "render/gpu/nano_grid.h"
#include "render/gpu/quadrics/gpu_quadrics.h"
#include "render/gpu/terrain/gpu_terrains.h"
#include "render/kernel/trace_glsl.h"

namespace render {
namespace {

constexpr int kGroup = 64;  // invocations of a work group
constexpr std::size_t kOneRun =
    1u << 18;  // rays of a dispatch, few enough to finish within the time limits of drivers
constexpr int kRayParts = 12, kHitParts = 5;

/// Bindings of storage blocks in the shader.
constexpr GLuint kRays = 0, kHits = 1;
/// Bindings of texture units in the shader.
constexpr GLuint kPages = 0, kEntries = 1, kMasks = 2, kFirstValues = 3;

/// GLSL definitions of the types, macros and table look-ups that render/shaders/*.glsl use.
constexpr const char* kDialect = R"GLSL(
#define Real float
#define Int int
#define Bool bool
#define VAR precise float
#define IN(Type) Type
#define INOUT(Type) inout Type
#define IN_ARRAY(Type, name, size) Type name[size]
#define INOUT_ARRAY(Type, name, size) inout Type name[size]
#define CONST_INT const int
#define CONST_FLOAT const float
#define NUMBER(x) (x)
#define AND(a, b) ((a) && (b))
#define OR(a, b) ((a) || (b))
#define NOT(a) (!(a))

struct Fan {
  float origin[3], originX[3], originY[3];
  float direction[3], directionX[3], directionY[3];
  float low[3], high[3];
};
uniform Fan fan;
uniform int pagesY, pagesZ, tableSizeX, tableSizeY, tableSizeZ;
uniform int firstRay, rayCount;

layout(binding = 0) uniform isamplerBuffer pages;
layout(binding = 1) uniform isamplerBuffer entries;
layout(binding = 2) uniform isamplerBuffer masks;
layout(std430, binding = 0) readonly buffer Rays { float rays[]; };
layout(std430, binding = 1) writeonly buffer Hits { int hits[]; };

// OpenGL lets drivers round a quotient of floats to a neighbour. A quotient of two floats in double
// precision is never so close to the middle of two floats that its last bits decide.
Real quotient(Real a, Real b) { return float(double(a) / double(b)); }
Real real(float v) { return v; }
Int integer(int v) { return v; }
Bool no() { return false; }
Real toReal(Int v) { return float(v); }
Int toInt(Real v) { return int(v); }
Real select(Bool c, Real a, Real b) { return c ? a : b; }
Int select(Bool c, Int a, Int b) { return c ? a : b; }
Bool select(Bool c, Bool a, Bool b) { return c ? a : b; }
Real smaller(Real a, Real b) { return b < a ? b : a; }
Int smaller(Int a, Int b) { return b < a ? b : a; }
Real larger(Real a, Real b) { return a < b ? b : a; }
Int larger(Int a, Int b) { return a < b ? b : a; }
Int bit(Bool c, int n) { return c ? n : 0; }
Bool differ(Bool a, Bool b) { return a != b; }
Bool any(Bool c) { return c; }
Bool many(Bool walking, Bool alive) { return walking; }
Int loadPage(Int i) { return texelFetch(pages, i).x; }
Int loadEntry(Int i) { return texelFetch(entries, i).x; }
Int loadMask(Int i) { return texelFetch(masks, i).x; }
)GLSL";

constexpr const char* kMain = R"GLSL(
void main() {
  int n = firstRay + int(gl_GlobalInvocationID.x);
  if (n >= rayCount) return;
  Ray ray = rayNumber(n);
  Hit hit = trace(ray, passingNumber(n));
  hits[n] = hit.found ? (hit.enters ? kEnters : kLeaves) : 0;
  hits[rayCount + n] = floatBitsToInt(hit.t);
  hits[2 * rayCount + n] = hit.x;
  hits[3 * rayCount + n] = hit.y;
  hits[4 * rayCount + n] = hit.z;
  addShape(n, ray, hit);
}
)GLSL";

constexpr const char* kPixelRays = R"GLSL(
Ray rayNumber(int n) { return viewRay(rays[n], rays[rayCount + n]); }
int passingNumber(int n) { return int(rays[2 * rayCount + n]); }

void addShape(int n, Ray ray, Hit hit) {
  // llvmpipe executes all branches, but skips loops that no ray enters.
  for (int i = hit.found ? 0 : 1; i < 1; ++i) {
    Shape s = shapeOf(hit);
    float parts[kShapeParts] = float[kShapeParts](s.gx, s.gy, s.gz, s.tx, s.ty, s.tz, s.hxx, s.hyy,
                                                  s.hzz, s.hxy, s.hxz, s.hyz, s.error, s.inX, s.inY, s.inZ);
    for (int p = 0; p < kShapeParts; ++p)
      hits[(kHitParts + p) * rayCount + n] = floatBitsToInt(parts[p]);
  }
}
)GLSL";

constexpr const char* kListedRays = R"GLSL(
Ray rayNumber(int n) {
  Ray ray;
  ray.ox = rays[n];
  ray.oy = rays[rayCount + n];
  ray.oz = rays[2 * rayCount + n];
  ray.dx = rays[3 * rayCount + n];
  ray.dy = rays[4 * rayCount + n];
  ray.dz = rays[5 * rayCount + n];
  ray.ix = rays[6 * rayCount + n];
  ray.iy = rays[7 * rayCount + n];
  ray.iz = rays[8 * rayCount + n];
  ray.start = rays[9 * rayCount + n];
  ray.end = rays[10 * rayCount + n];
  return ray;
}
int passingNumber(int n) { return int(rays[11 * rayCount + n]); }

void addShape(int n, Ray ray, Hit hit) {}
)GLSL";

constexpr const char* kNanoText = R"GLSL(
uniform int nanoRoot, nanoTiles, nanoFar, nanoOriginX, nanoOriginY, nanoOriginZ;
)GLSL";

/// Properties of rays and grid that select a shader.
struct Variant {
  bool isPixels;
  Filter filter;
  bool isNano;
  int valueBits;
  int blocks;  // number of buffer textures that store the values of the solid
  auto operator<=>(const Variant&) const = default;
};

/// GLSL declarations of the values in one buffer texture, or in several of 2^shift values each, and
/// of the look-up function loadValue().
std::string valueText(const Variant& variant, int shift) {
  const bool isCode = variant.valueBits != 32;
  const char* prefix = isCode ? "u" : variant.isNano ? "i" : "";
  const char* type = isCode ? "uint" : variant.isNano ? "int" : "float";
  std::string text;
  for (int b = 0; b < variant.blocks; ++b) {
    text += fmt::format("layout(binding = {}) uniform {}samplerBuffer values{};\n",
                        static_cast<int>(kFirstValues) + b, prefix, b);
  }
  text += fmt::format("{} loadHeld(Int i) {{\n", type);
  for (int b = 0; b + 1 < variant.blocks; ++b)
    text += fmt::format("  if (i >> {} == {}) return texelFetch(values{}, i & {}).x;\n", shift, b,
                        b, (1 << shift) - 1);
  text += variant.blocks == 1 ? "  return texelFetch(values0, i).x;\n}\n"
                              : fmt::format("  return texelFetch(values{}, i & {}).x;\n}}\n",
                                            variant.blocks - 1, (1 << shift) - 1);
  // Integer words of a NanoVDB grid are never loaded as floats, because a float load may change
  // their bits.
  if (variant.isNano)
    return text + "Real loadValue(Int i) { return intBitsToFloat(loadHeld(i)); }\n";
  if (!isCode) return text + "Real loadValue(Int i) { return loadHeld(i); }\n";
  return text + fmt::format(
                    "uniform float valueStep;\n"
                    "Real loadValue(Int i) {{\n"
                    "  VAR fromZero = float(int(loadHeld(i))) + {}.5;\n"
                    "  VAR value = fromZero * valueStep;\n"
                    "  return value;\n}}\n",
                    1 - (1 << (variant.valueBits - 1)));
}

constexpr const char* kLoadThree = R"GLSL(
void loadThree(Int first, inout Real a, inout Real b, inout Real c) {
  a = loadValue(first);
  b = loadValue(first + 1);
  c = loadValue(first + 2);
}
void loadFour(Int first, inout Real a, inout Real b, inout Real c, inout Real d) {
  loadThree(first, a, b, c);
  d = loadValue(first + 3);
}
)GLSL";

std::string shaderText(const Variant& variant, int shift) {
  return fmt::format(
             "#version 450 core\nlayout(local_size_x = {}) in;\n"
             "const int kBrickEdge = {}, kBrickValues = {}, kPageShift = {},\n"
             "          kFirstOfEntry = {}, kStridesOfEntry = {}, kStrideShift = {},\n"
             "          kHitParts = {}, kShapeParts = {}, kEnters = {}, kLeaves = {};\n"
             "const bool isSpline = {}, isTricubic = {}, isBcc = {};\n"
             "const int tetraDegree = {}, kCubeEdge = {}, kCubeValues = {}, kSites = {};\n",
             kGroup, BrickPool::kEdge, BrickPool::kValues,
             std::countr_zero(static_cast<unsigned>(BrickPool::kPage)), BrickPool::kFirstOfEntry,
             BrickPool::kStridesOfEntry, BrickPool::kStrideShift, kHitParts, ShapeBlock::kParts,
             HitBlock::kEnters, HitBlock::kLeaves, isTricubicInCells(variant.filter),
             variant.filter == Filter::Tricubic, variant.filter == Filter::BccQuadratic,
             tetrahedralDegree(variant.filter), BrickPool::kCubeEdge, BrickPool::kCubeValues,
             BrickPool::kSites) +
         kDialect + valueText(variant, shift) + kLoadThree + kRootsKernel +
         (variant.isNano ? kNanoText + NanoGrid::layout() + kNanoVdbKernel : kBricksKernel) +
         kWindowKernel + kSplineKernel + kTetraKernel + kBccKernel + kTraceKernel + kShapeKernel +
         kBccShapeKernel + kTetraShapeKernel + (variant.isPixels ? kPixelRays : kListedRays) +
         kMain;
}

}  // namespace

struct GpuTracer::Impl {
  struct Tables {
    Texels pages, entries, masks;
    std::vector<Texels> values;
    std::optional<NanoGrid> nano;  // header data of the NanoVDB grid; its words are in `values`
  };

  const GlContext& context;
  const GlFunctions& gl;
  const std::size_t largestTable;
  int shift = 0;  // log2 of the largest number of values in a buffer texture
  std::map<const KernelSolid*, Tables> tables;
  GrowingBuffer rays{GrowingBuffer::Use::Upload}, hits{GrowingBuffer::Use::Device},
      fetched{GrowingBuffer::Use::Fetch};
  std::map<Variant, GLuint> programs;
  std::optional<GpuFields> fields;
  GpuLight light;
  GpuInterfaces interfaces;
  GpuBeziers beziers;
  GpuQuadrics quadrics;
  GpuTerrains terrains;
  double shaderSeconds = 0;

  Impl(const GlContext& context_, std::size_t largestTable_)
      : context(context_),
        gl(context_.gl()),
        largestTable(largestTable_ > 0 ? largestTable_ : context_.largestTable()),
        light(context_, largestTable),
        interfaces(context_, largestTable),
        beziers(context_),
        quadrics(context_, largestTable),
        terrains(context_, largestTable) {
    shift = static_cast<int>(std::bit_width(largestTable / sizeof(float))) - 1;
    shift = std::min(shift, 30);  // indices of values fit into a signed 32-bit integer
  }

  void release() {
    for (auto& [solid, t] : tables) {
      for (const Texels& texels : {t.pages, t.entries, t.masks}) releaseTexels(context, texels);
      for (const Texels& texels : t.values) releaseTexels(context, texels);
    }
    for (GrowingBuffer* buffer : {&rays, &hits, &fetched}) buffer->release(context);
    for (const auto& [variant, program] : programs) gl.DeleteProgram(program);
    if (fields) fields->release();
    light.release();
    interfaces.release();
    beziers.release();
    quadrics.release();
    terrains.release();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  Texels texelsOf(const void* data, std::size_t bytes, GLenum format) {
    return makeTexels(context, largestTable, data, bytes, format);
  }

  /// Uploads the values of a solid into as many buffer textures as they need.
  /// @param bytes, size  size of all values and of one value, bytes
  /// @param format  OpenGL's internal format of a value
  void uploadValues(Tables& t, const void* values, std::size_t bytes, std::size_t size,
                    GLenum format) {
    const std::size_t perBlock = size << shift;
    const std::size_t blocks = (bytes + perBlock - 1) / perBlock;
    if (blocks + kFirstValues > static_cast<std::size_t>(context.tableCount())) {
      throw levelset::ResourceLimit(
          fmt::format("{} MB of values need {} buffer textures, but {} offers {}; use "
                      "larger voxels, or "
                      "draw with --renderer cpu",
                      bytes >> 20, blocks, context.description(),
                      context.tableCount() - static_cast<int>(kFirstValues)));
    }
    for (std::size_t first = 0; first < bytes; first += perBlock)
      t.values.push_back(texelsOf(static_cast<const std::uint8_t*>(values) + first,
                                  std::min(perBlock, bytes - first), format));
  }

  void upload(const KernelSolid& solid) {
    const BrickPool& pool = solid.pool;
    Tables& t = tables[&solid];
    const auto textureOf = [&](const auto& data) {
      return texelsOf(data.data(), data.size() * sizeof data[0], GL_R32I);
    };
    t.pages = textureOf(pool.page);
    t.entries = textureOf(pool.entry);
    t.masks = textureOf(pool.mask);
    const std::size_t bytes = pool.valueBytes();
    if (pool.quantization.bits == 32)
      uploadValues(t, pool.value.data(), bytes, 4, GL_R32F);
    else if (pool.quantization.bits == 16)
      uploadValues(t, pool.code.data(), bytes, 2, GL_R16UI);
    else
      uploadValues(t, pool.code.data(), bytes, 1, GL_R8UI);
  }

  void upload(const KernelSolid& solid, const levelset::NarrowBand& band) {
    Tables& t = tables[&solid];
    NanoGrid nano = makeNanoGrid(band);
    uploadValues(t, nano.words.data(), nano.words.size() * sizeof nano.words[0], 4, GL_R32I);
    nano.words = {};
    t.nano = std::move(nano);
  }

  GLuint programFor(const KernelSolid& solid, bool isPixels) {
    const Tables& t = tables.at(&solid);
    const Variant variant{.isPixels = isPixels,
                          .filter = solid.pool.filter,
                          .isNano = t.nano.has_value(),
                          .valueBits = t.nano ? 32 : solid.pool.quantization.bits,
                          .blocks = static_cast<int>(t.values.size())};
    GLuint& program = programs[variant];
    if (program == 0) program = compileCompute(context, shaderText(variant, shift));
    return program;
  }

  void setNumbers(GLuint program, const KernelSolid& solid) {
    const auto place = [&](const char* name) { return gl.GetUniformLocation(program, name); };
    const BrickPool& pool = solid.pool;
    if (const std::optional<NanoGrid>& nano = tables.at(&solid).nano) {
      gl.Uniform1i(place("nanoRoot"), nano->root);
      gl.Uniform1i(place("nanoTiles"), nano->tiles);
      gl.Uniform1i(place("nanoFar"), nano->far);
      gl.Uniform1i(place("nanoOriginX"), pool.origin[0]);
      gl.Uniform1i(place("nanoOriginY"), pool.origin[1]);
      gl.Uniform1i(place("nanoOriginZ"), pool.origin[2]);
    }
    if (pool.quantization.bits != 32) gl.Uniform1fv(place("valueStep"), 1, &pool.quantization.step);
    gl.Uniform1i(place("pagesY"), pool.pages[1]);
    gl.Uniform1i(place("pagesZ"), pool.pages[2]);
    gl.Uniform1i(place("tableSizeX"), pool.pages[0] * BrickPool::kPage);
    gl.Uniform1i(place("tableSizeY"), pool.pages[1] * BrickPool::kPage);
    gl.Uniform1i(place("tableSizeZ"), pool.pages[2] * BrickPool::kPage);
    const RayFan& fan = solid.fan;
    const auto three = [&](const char* name, const float(&v)[3]) {
      gl.Uniform1fv(place(name), 3, v);
    };
    three("fan.origin[0]", fan.origin);
    three("fan.originX[0]", fan.originX);
    three("fan.originY[0]", fan.originY);
    three("fan.direction[0]", fan.direction);
    three("fan.directionX[0]", fan.directionX);
    three("fan.directionY[0]", fan.directionY);
    three("fan.low[0]", fan.low);
    three("fan.high[0]", fan.high);
  }

  void bind(const KernelSolid& solid) {
    const Tables& t = tables.at(&solid);
    const auto bindTo = [&](GLuint place, GLuint buffer) {
      gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, place, buffer);
    };
    gl.BindTextureUnit(kPages, t.pages.texture);
    gl.BindTextureUnit(kEntries, t.entries.texture);
    gl.BindTextureUnit(kMasks, t.masks.texture);
    bindTo(kRays, rays.name());
    bindTo(kHits, hits.name());
    for (std::size_t b = 0; b < t.values.size(); ++b)
      gl.BindTextureUnit(kFirstValues + static_cast<GLuint>(b), t.values[b].texture);
  }

  /// Traces `count` rays and reads the hits back.
  /// @param input  components of the rays: for pixels x, y and passing, else RayBlock's arrays, one
  /// array after the other
  /// @param shapes  receives the surface's shape at the hits of the rays through pixels; null for
  /// the rays of a RayBlock
  /// Runs in a job of GlContext::run().
  void run(const KernelSolid& solid, const std::vector<float>& input, std::size_t count,
           HitBlock& found, ShapeBlock* shapes) {
    const GLuint program = programFor(solid, shapes != nullptr);
    gl.UseProgram(program);
    setNumbers(program, solid);
    const std::size_t inputBytes = input.size() * sizeof(float);
    const std::size_t parts = kHitParts + (shapes ? ShapeBlock::kParts : 0);
    const std::size_t hitBytes = parts * count * sizeof(int);
    rays.reserve(context, inputBytes);
    hits.reserve(context, hitBytes);
    fetched.reserve(context, hitBytes);
    gl.NamedBufferSubData(rays.name(), 0, static_cast<GLsizeiptr>(inputBytes), input.data());
    bind(solid);
    const auto place = [&](const char* name) { return gl.GetUniformLocation(program, name); };
    gl.Uniform1i(place("rayCount"), static_cast<GLint>(count));
    gl.Finish();
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t first = 0; first < count; first += kOneRun) {
      gl.Uniform1i(place("firstRay"), static_cast<GLint>(first));
      const std::size_t groups = (std::min(kOneRun, count - first) + kGroup - 1) / kGroup;
      gl.DispatchCompute(static_cast<GLuint>(groups), 1, 1);
      gl.Finish();
    }
    shaderSeconds +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl.CopyNamedBufferSubData(hits.name(), fetched.name(), 0, 0, static_cast<GLsizeiptr>(hitBytes));
    gl.MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    gl.Finish();
    context.check("tracing the rays");
    const auto copyTo = [&](auto& to, std::size_t part) {
      std::memcpy(to.data(), static_cast<const int*>(fetched.mapped()) + part * count,
                  count * sizeof(int));
    };
    copyTo(found.found, 0);
    copyTo(found.t, 1);
    copyTo(found.x, 2);
    copyTo(found.y, 3);
    copyTo(found.z, 4);
    for (std::size_t p = 0; shapes && p < ShapeBlock::kParts; ++p)
      copyTo(shapes->part[p], kHitParts + p);
  }
};

GpuTracer::GpuTracer(const GlContext& context, const KernelScene& scene, std::size_t largestTable,
                     const Scene* grids) {
  impl_ = std::make_unique<Impl>(context, largestTable);
  context.run([&] {
    try {
      for (const KernelSolid& solid : scene.solids()) {
        if (grids)
          impl_->upload(solid, grids->solids[solid.index].band);
        else
          impl_->upload(solid);
      }
      if (scene.fields()) impl_->fields.emplace(context, *scene.fields(), impl_->largestTable);
    } catch (...) {
      impl_->release();
      throw;
    }
  });
}

GpuTracer::~GpuTracer() {
  try {
    impl_->context.run([&] { impl_->release(); });
  } catch (const levelset::Error&) {  // the context was lost, and its objects with it
  }
}

void GpuTracer::trace(const KernelSolid& solid, const PixelBlock& pixels, HitBlock& hits,
                      ShapeBlock& shapes) const {
  std::vector<float> input(pixels.x);
  input.insert(input.end(), pixels.y.begin(), pixels.y.end());
  input.insert(input.end(), pixels.passing.begin(),
               pixels.passing.end());  // integers up to 2^24 are exact as floats
  if (pixels.size() == 0) return;
  impl_->context.run([&] { impl_->run(solid, input, pixels.size(), hits, &shapes); });
}

void GpuTracer::trace(const KernelSolid& solid, const RayBlock& rays, HitBlock& hits) const {
  std::vector<float> input;
  input.reserve(kRayParts * rays.size);
  for (const auto* part : {&rays.ox, &rays.oy, &rays.oz, &rays.dx, &rays.dy, &rays.dz, &rays.ix,
                           &rays.iy, &rays.iz, &rays.start, &rays.end})
    input.insert(input.end(), part->begin(), part->end());
  input.insert(input.end(), rays.passing.begin(), rays.passing.end());
  if (rays.size == 0) return;
  impl_->context.run([&] { impl_->run(solid, input, rays.size, hits, nullptr); });
}

std::vector<double> GpuTracer::search(const FieldTraversal& fields,
                                      const std::vector<FieldSegment>& segments,
                                      FieldQuestion question) const {
  return impl_->fields->search(fields, segments, question);
}

std::vector<VolumeLight> GpuTracer::volumeLight(const DirectVolume& volume,
                                                const std::vector<VolumeSegment>& segments,
                                                const VolumeShading* shading) const {
  return impl_->light.light(volume, segments, shading);
}

void GpuTracer::trace(const KernelSolid& solid, const RayBlock& rays, HitBlock& hits,
                      ShapeBlock& shapes) const {
  traceRays(solid.pool, rays, hits, shapes);
}

std::vector<InterfaceHit> GpuTracer::interfaceHits(const InterfaceCaster& caster,
                                                   const std::vector<InterfaceRay>& rays,
                                                   bool wantsNormals) const {
  return impl_->interfaces.firstHits(caster, rays, wantsNormals);
}

SharedTree::Roots GpuTracer::bezierRoots(const SharedTree& tree,
                                         const std::vector<Camera::Ray>& rays,
                                         TreeCounts* counts) const {
  return impl_->beziers.rootsOn(tree, tree.screensOf(rays), counts);
}

std::vector<QuadricHit> GpuTracer::quadricHits(const QuadricCaster& caster,
                                               const std::vector<Camera::Ray>& rays) const {
  return impl_->quadrics.firstHits(caster, rays);
}

std::vector<TerrainHit> GpuTracer::terrainHits(const TerrainCaster& caster,
                                               const std::vector<Camera::Ray>& rays) const {
  return impl_->terrains.firstHits(caster, rays);
}

GpuBezierCounts GpuTracer::bezierCounts() const {
  GpuBezierCounts counts;
  impl_->context.run([&] { counts = impl_->beziers.counts(); });
  return counts;
}

double GpuTracer::shaderSeconds() const {
  double seconds = 0;
  impl_->context.run([&] { seconds = impl_->shaderSeconds; });
  return seconds;
}

}  // namespace render
