#include "render/gpu/gpu_fields.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

#include "levelset/error.h"
#include "render/kernel/trace_glsl.h"

namespace render {
namespace {

using Join = FieldExpression::Join;

constexpr int kFieldGroup = 64;  // invocations of a work group
// Rays of a dispatch, few enough to finish within the time limits of drivers in double precision.
constexpr std::size_t kFieldRun = 1u << 16;
constexpr std::size_t kRayNumbers = 7;  // numbers of a ray in the shader's input
constexpr std::size_t kGridTables = 4;  // buffer textures of a field
constexpr double kLost = -1;            // the shader's answer for a ray that it gave up

/// Bindings of storage blocks in the shader.
enum FieldBinding : GLuint { kRaysOfFields, kAnswers, kNumbers };

constexpr const char* kFieldDialect = R"GLSL(
uniform int firstRay, rayCount, wantsLength;
layout(std430, binding = 0) readonly buffer Rays { double rays[]; };
layout(std430, binding = 1) writeonly buffer Answers { double found[]; };
layout(std430, binding = 2) readonly buffer Numbers { double numbers[]; };
)GLSL";

std::string fieldShaderText(const FieldExpression& e) {
  const std::size_t grids = e.operands.size();
  std::string each, steps;
  for (std::size_t g = 0; g < grids; ++g) each += fmt::format(" DO({})", g);
  for (std::size_t n = 0; n < e.steps.size(); ++n)
    steps += fmt::format(" DO({}, {}, {}, {})", grids + n, static_cast<int>(e.steps[n].join),
                         e.steps[n].a, e.steps[n].b);
  std::string text = fmt::format(
      "#version 450 core\nlayout(local_size_x = {}) in;\n"
      "const int kGrids = {}, kValues = {}, kDrawn = {}, kInside = {};\n"
      "const int kUnion = {}, kIntersection = {}, kDifference = {}, kMorph = {};\n"
      "#define EACH_GRID(DO){}\n#define EACH_STEP(DO){}\n",
      kFieldGroup, grids, e.valueCount(), e.drawn, FieldGrid::kInside,
      static_cast<int>(Join::Union), static_cast<int>(Join::Intersection),
      static_cast<int>(Join::Difference), static_cast<int>(Join::Morph), each, steps);
  const char* const kinds[kGridTables] = {"isamplerBuffer pages", "isamplerBuffer entriesOf",
                                          "samplerBuffer ranges", "samplerBuffer values"};
  for (std::size_t k = 0; k < kGridTables; ++k)
    text += fmt::format("layout(binding = {}) uniform {}[kGrids];\n", k * grids, kinds[k]);
  return text + kFieldDialect + kFieldKernel;
}

/// The contents of the shader's block Numbers, in the order of render/shaders/field.glsl.
std::vector<double> numbersOf(const FieldTraversal& fields) {
  const FieldExpression& e = fields.expression();
  std::vector<double> numbers = {std::numeric_limits<double>::infinity(), e.softness, e.share,
                                 fields.noise()};
  for (const FieldGrid& grid : fields.grids()) {
    for (int row = 0; row < 4; ++row)
      for (int a = 0; a < 3; ++a) numbers.push_back(grid.worldToIndex()[row][a]);
    numbers.push_back(grid.background());
    for (int a = 0; a < 3; ++a) numbers.push_back(grid.size(a));
  }
  return numbers;
}

void requireFew(const FieldExpression& e, std::size_t textures) {
  const std::size_t most = std::min(GpuFields::kMostFields, textures / kGridTables);
  if (e.operands.size() > most)
    throw levelset::ResourceLimit(fmt::format(
        "the expression has {} solids, but --renderer gpu blends at most {} here; leave some out, "
        "or draw with --renderer cpu",
        e.operands.size(), most));
  if (e.steps.size() > GpuFields::kMostJoins)
    throw levelset::ResourceLimit(fmt::format(
        "the expression has {} soft operations, but --renderer gpu supports at most {}; shorten "
        "it, or draw with --renderer cpu",
        e.steps.size(), GpuFields::kMostJoins));
}

}  // namespace

GpuFields::GpuFields(const GlContext& context, const FieldTraversal& fields,
                     std::size_t largestTable)
    : context_(context), largestTable_(largestTable) {
  requireFew(fields.expression(), static_cast<std::size_t>(context.tableCount()));
  try {
    for (const FieldGrid& grid : fields.grids()) upload(grid);
  } catch (...) {
    release();
    throw;
  }
}

void GpuFields::upload(const FieldGrid& grid) {
  const auto add = [&](const auto& table, GLenum format) {
    const auto first =
        table.empty() ? typename std::decay_t<decltype(table)>::value_type{} : table.front();
    // An empty table has one texel, because OpenGL has no empty textures.
    const void* data = table.empty() ? &first : table.data();
    tables_.push_back(makeTexels(context_, largestTable_, data,
                                 std::max<std::size_t>(table.size(), 1) * sizeof first, format));
  };
  add(grid.pages(), GL_R32I);
  add(grid.entries(), GL_R32I);
  std::vector<float> ranges;
  for (const FieldGrid::Range& range : grid.ranges())
    for (const double value : {range.low, range.high}) ranges.push_back(static_cast<float>(value));
  if (ranges.empty()) ranges.resize(2);
  add(ranges, GL_RG32F);
  add(grid.allValues(), GL_R32F);
}

void GpuFields::release() {
  const GlFunctions& gl = context_.gl();
  for (const Texels& table : tables_) releaseTexels(context_, table);
  tables_.clear();
  for (GrowingBuffer* buffer : {&numbers_, &rays_, &found_, &fetched_}) buffer->release(context_);
  if (program_ != 0) gl.DeleteProgram(program_);
}

std::vector<double> GpuFields::search(const FieldTraversal& fields,
                                      const std::vector<FieldSegment>& segments,
                                      FieldQuestion question) {
  std::vector<double> answers(segments.size());
  if (segments.empty()) return answers;
  std::vector<double> input;
  input.reserve(kRayNumbers * segments.size());
  for (const FieldSegment& segment : segments) {
    for (const Imath::V3d& v : {segment.start, segment.direction})
      input.insert(input.end(), {v.x, v.y, v.z});
    input.push_back(segment.end);
  }
  const std::vector<double> numbers = numbersOf(fields);
  context_.run([&] { run(fields.expression(), numbers, input, question, answers); });
  // Rays that the shader gave up, see kMostSteps in render/shaders/field.glsl.
  for (std::size_t n = 0; n < answers.size(); ++n)
    if (answers[n] == kLost) answers[n] = fields.search(segments[n], question);
  return answers;
}

void GpuFields::run(const FieldExpression& expression, const std::vector<double>& numbers,
                    const std::vector<double>& input, FieldQuestion question,
                    std::vector<double>& answers) {
  const GlFunctions& gl = context_.gl();
  if (program_ == 0) program_ = compileCompute(context_, fieldShaderText(expression));
  gl.UseProgram(program_);
  rays_.upload(context_, input);
  numbers_.upload(context_, numbers);
  const std::size_t answerBytes = answers.size() * sizeof(double);
  found_.reserve(context_, answerBytes);
  fetched_.reserve(context_, answerBytes);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kRaysOfFields, rays_.name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kAnswers, found_.name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kNumbers, numbers_.name());
  const std::size_t grids = tables_.size() / kGridTables;
  for (std::size_t n = 0; n < tables_.size(); ++n)
    gl.BindTextureUnit(static_cast<GLuint>(n % kGridTables * grids + n / kGridTables),
                       tables_[n].texture);
  const auto set = [&](const char* name, std::size_t value) {
    gl.Uniform1i(gl.GetUniformLocation(program_, name), static_cast<GLint>(value));
  };
  set("rayCount", answers.size());
  set("wantsLength", question == FieldQuestion::InsideLength ? 1 : 0);
  for (std::size_t first = 0; first < answers.size(); first += kFieldRun) {
    set("firstRay", first);
    const std::size_t count = std::min(kFieldRun, answers.size() - first);
    gl.DispatchCompute(static_cast<GLuint>((count + kFieldGroup - 1) / kFieldGroup), 1, 1);
    gl.Finish();
  }
  gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  gl.CopyNamedBufferSubData(found_.name(), fetched_.name(), 0, 0,
                            static_cast<GLsizeiptr>(answerBytes));
  gl.MemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
  gl.Finish();
  context_.check("searching the fields");
  std::memcpy(answers.data(), fetched_.mapped(), answerBytes);
}

}  // namespace render
