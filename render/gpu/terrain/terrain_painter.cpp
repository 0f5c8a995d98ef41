#include "render/gpu/terrain/terrain_painter.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "render/gpu/device/gl_context.h"
#include "render/gpu/device/gl_objects.h"
#include "render/gpu/terrain/patch_slots.h"
#include "render/gpu/terrain/picture_target.h"
#include "render/kernel/trace_glsl.h"
#include "render/terrain/patch_borders.h"
#include "render/terrain/resident_patches.h"
#include "render/terrain/terrain_patch.h"

namespace render {
namespace {

using Imath::V3d;

constexpr const char* kGroundVersion = "#version 450 core\n";

/// A command of glMultiDrawElementsIndirect.
struct DrawCommand {
  GLuint count = 0, instances = 1, firstIndex = 0;
  GLint baseVertex = 0;
  GLuint baseInstance = 0;
};

/// Place of the patch of a slot, as the shader reads it.
struct SlotPlace {
  std::int32_t firstColumn = 0, firstRow = 0, stride = 0, cellsX = 0;
  std::int32_t lastColumn = 0, lastRow = 0, cellsY = 0, missingBits = 0;
};

/// Numbers of a camera for the shader, in world units relative to the eye.
struct GroundView {
  V3d clipX, clipY, axis;
  double shift = 0;
  std::array<double, 2> clipZ{}, clipW{}, depths{};

  /// @param reach  range of depths of the ground, for parallel views
  GroundView(const Camera& camera, const std::array<double, 2>& reach, double spacing) {
    const Camera::PixelSteps steps = camera.pixelSteps();
    const double pixelWidth = steps.right.length(), pixelHeight = steps.down.length();
    clipX = steps.right / (pixelWidth * pixelWidth * 0.5 * camera.width);
    clipY = -steps.down / (pixelHeight * pixelHeight * 0.5 * camera.height);
    axis = camera.axis();
    constexpr double kFar = 1e30;
    depths = {camera.near, std::min(camera.farthest(), kFar)};
    // Depths are stored in reverse, as floats: 1 at the near plane, towards 0 far away.
    if (camera.orthoHeight) {
      const double span = reach[1] > reach[0] ? reach[1] - reach[0] : 1;
      clipZ = {(reach[1] + span) / (3 * span), -1 / (3 * span)};
      clipW = {1, 0};
    } else {
      constexpr double kNearest = 1e-5;  // of the distance of samples
      clipZ = {std::max(camera.near, kNearest * spacing), 0};
      clipW = {0, 1};
      shift = 2 * camera.axisShift / camera.width;
    }
  }
};

class GlTerrainPainter final : public TerrainPainter {
 public:
  GlTerrainPainter(const levelset::GroundLayout& layout, std::size_t maxBytes)
      : grid_(layout), side_(layout.pyramid.cells + 1), sets_(layout.pyramid.cells) {
    const std::size_t bytes = patchSamples() * sizeof(float);
    // Numbers of vertices are 32-bit integers.
    const auto most =
        std::min(context_.largestTable() / bytes, (std::size_t{1} << 30) / patchSamples());
    std::size_t all = 0;
    for (const levelset::PyramidLevel& level : layout.pyramid.levels) all += level.patches.size();
    slots_ = PatchSlots(std::min({maxBytes / bytes, std::max<std::size_t>(most, 1), all}));
    if (slots_.capacity() == 0)
      throw levelset::UsageError(
          fmt::format("the heights of a terrain may take {} bytes on the device, but a patch takes "
                      "{}; allow more",
                      maxBytes, bytes));
    places_.resize(slots_.capacity());
    try {
      context_.run([&] { open(); });
    } catch (...) {
      context_.run([&] { close(); });
      throw;
    }
  }
  ~GlTerrainPainter() override {
    context_.run([&] { close(); });
  }
  GlTerrainPainter(const GlTerrainPainter&) = delete;
  GlTerrainPainter& operator=(const GlTerrainPainter&) = delete;

  TerrainPicture draw(const TerrainSelection& selection, const Camera& camera,
                      const TerrainPaint& paint) override {
    validate(camera);
    // Colours, surfaces and depths, on the device and in the picture.
    constexpr double kPixelBytes = 44;
    levelset::requireMemory(kPixelBytes * camera.width * camera.height,
                            levelset::memoryLimit(levelset::kNoMemoryLimit));
    if (!(paint.towardsLight.length() > 0))
      throw levelset::UsageError("the light of a terrain has no direction; give one");
    TerrainPicture picture;
    context_.run([&] { drawAll(selection, camera, paint, picture); });
    return picture;
  }

  [[nodiscard]] Cost cost() const override { return cost_; }

 private:
  [[nodiscard]] std::size_t patchSamples() const {
    return static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_);
  }

  // These run in jobs of GlContext::run().
  void open() {
    const GlFunctions& gl = context_.gl();
    program_ = compileDrawing(context_, std::string(kGroundVersion) + kGroundKernel,
                              std::string(kGroundVersion) + kGroundPaintKernel);
    gl.CreateVertexArrays(1, &vertices_);
    gl.CreateBuffers(1, &indices_);
    gl.NamedBufferStorage(indices_,
                          static_cast<GLsizeiptr>(sets_.indices().size() * sizeof(std::uint16_t)),
                          sets_.indices().data(), 0);
    gl.VertexArrayElementBuffer(vertices_, indices_);
    gl.CreateBuffers(1, &commandBuffer_);
    heights_ = makeTexels(context_, context_.largestTable(), nullptr,
                          slots_.capacity() * patchSamples() * sizeof(float), GL_R32F);
    placeTexels_ = makeTexels(context_, context_.largestTable(), nullptr,
                              slots_.capacity() * sizeof(SlotPlace), GL_RGBA32I);
    context_.check("allocating the heights of a terrain");
  }
  void close() {
    const GlFunctions& gl = context_.gl();
    target_.release(context_);
    releaseTexels(context_, heights_);
    releaseTexels(context_, placeTexels_);
    gl.DeleteBuffers(1, &commandBuffer_);
    gl.DeleteBuffers(1, &indices_);
    gl.DeleteVertexArrays(1, &vertices_);
    if (program_ != 0) gl.DeleteProgram(program_);
  }

  void drawAll(const TerrainSelection& selection, const Camera& camera, const TerrainPaint& paint,
               TerrainPicture& picture) {
    target_.begin(context_, camera.width, camera.height);
    useProgram(selection, camera, paint);
    cost_ = {};
    slots_.startPicture();
    for (const TerrainSelection::Part& part : selection.parts) {
      auto slot = slots_.place(part.heights->serial);
      if (!slot) {  // all slots have patches of this picture
        flush();
        slots_.startPicture();
        slot = slots_.place(part.heights->serial);
      }
      if (slot->isNew) upload(slot->number, part);
      places_[slot->number] = placeOf(part, camera);
      mostSlot_ = std::max(mostSlot_, slot->number);
      const PatchBorderSets::Range& range = sets_.range(part.coarserSides);
      commands_.push_back({.count = static_cast<GLuint>(range.count),
                           .firstIndex = static_cast<GLuint>(range.first),
                           .baseVertex = static_cast<GLint>(slot->number * patchSamples())});
      cost_.triangles += range.count / 3;
    }
    flush();
    context_.check("drawing a terrain");
    picture = target_.end(context_);
  }

  /// Draws the patches that have been placed.
  void flush() {
    if (commands_.empty()) return;
    const GlFunctions& gl = context_.gl();
    gl.NamedBufferSubData(placeTexels_.buffer, 0,
                          static_cast<GLsizeiptr>((mostSlot_ + 1) * sizeof(SlotPlace)),
                          places_.data());
    gl.NamedBufferData(commandBuffer_,
                       static_cast<GLsizeiptr>(commands_.size() * sizeof(DrawCommand)),
                       commands_.data(), GL_STREAM_DRAW);
    gl.BindBuffer(GL_DRAW_INDIRECT_BUFFER, commandBuffer_);
    gl.BindVertexArray(vertices_);
    gl.MultiDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_SHORT, nullptr,
                                 static_cast<GLsizei>(commands_.size()), 0);
    ++cost_.calls;
    commands_.clear();
    mostSlot_ = 0;
  }

  void upload(std::size_t slot, const TerrainSelection::Part& part) {
    const std::size_t bytes = patchSamples() * sizeof(float);
    context_.gl().NamedBufferSubData(heights_.buffer, static_cast<GLintptr>(slot * bytes),
                                     static_cast<GLsizeiptr>(bytes), part.heights->heights.data());
    ++cost_.uploads;
  }

  /// Sample from which the shader counts.
  [[nodiscard]] std::array<int, 2> nearestSample(const Camera& camera) const {
    const levelset::GroundLayout& layout = grid_.layout();
    const auto nearest = [](double place, int samples) {
      return static_cast<int>(std::clamp(std::round(place), 0.0, samples - 1.0));
    };
    return {nearest((camera.from.x - layout.origin.x) / layout.spacing.x, layout.columns),
            nearest((camera.from.y - layout.origin.y) / layout.spacing.y, layout.rows)};
  }

  [[nodiscard]] SlotPlace placeOf(const TerrainSelection::Part& part, const Camera& camera) const {
    const TerrainPatch patch{part.level, part.column, part.row};
    const auto [column, row] = nearestSample(camera);
    const int cells = side_ - 1, stride = 1 << part.level;
    SlotPlace place;
    place.firstColumn = grid_.sampleColumn(patch, 0) - column;
    place.firstRow = grid_.sampleRow(patch, 0) - row;
    place.lastColumn = grid_.sampleColumn(patch, cells) - column;
    place.lastRow = grid_.sampleRow(patch, cells) - row;
    place.stride = stride;
    const auto cellsOf = [&](std::int64_t first, std::int64_t last) {
      return static_cast<std::int32_t>((last - first + stride - 1) / stride);
    };
    place.cellsX = cellsOf(place.firstColumn, place.lastColumn);
    place.cellsY = cellsOf(place.firstRow, place.lastRow);
    place.missingBits = std::bit_cast<std::int32_t>(grid_.errors(patch).lowest);
    return place;
  }

  void useProgram(const TerrainSelection& selection, const Camera& camera,
                  const TerrainPaint& paint) {
    const GlFunctions& gl = context_.gl();
    const levelset::GroundLayout& layout = grid_.layout();
    const GroundView view(camera,
                          camera.orthoHeight ? reachOf(selection, camera) : std::array<double, 2>{},
                          std::min(layout.spacing.x, layout.spacing.y));
    const auto [column, row] = nearestSample(camera);
    const auto high = static_cast<float>(camera.from.z);
    gl.UseProgram(program_);
    gl.Uniform1i(uniform("side"), side_);
    set2("spacing", {layout.spacing.x, layout.spacing.y});
    set2("offset", {layout.origin.x + column * layout.spacing.x - camera.from.x,
                    layout.origin.y + row * layout.spacing.y - camera.from.y});
    set2("eyeHeight", {static_cast<double>(high), camera.from.z - static_cast<double>(high)});
    set3("clipX", view.clipX);
    set3("clipY", view.clipY);
    set3("axis", view.axis);
    const auto shift = static_cast<float>(view.shift);
    gl.Uniform1fv(uniform("shift"), 1, &shift);
    set2("clipZ", view.clipZ);
    set2("clipW", view.clipW);
    set2("depths", view.depths);
    set3("colour", {static_cast<double>(paint.colour.x), static_cast<double>(paint.colour.y),
                    static_cast<double>(paint.colour.z)});
    set3("towardsLight", paint.towardsLight.normalized());
    gl.BindTextureUnit(0, heights_.texture);
    gl.BindTextureUnit(1, placeTexels_.texture);
  }
  [[nodiscard]] GLint uniform(const char* name) const {
    return context_.gl().GetUniformLocation(program_, name);
  }
  void set2(const char* name, const std::array<double, 2>& value) const {
    const std::array<float, 2> numbers = {static_cast<float>(value[0]),
                                          static_cast<float>(value[1])};
    context_.gl().Uniform2fv(uniform(name), 1, numbers.data());
  }
  void set3(const char* name, const V3d& value) const {
    const Imath::V3f numbers(value);
    context_.gl().Uniform3fv(uniform(name), 1, &numbers.x);
  }

  /// Range of the depths of the boxes of all patches.
  [[nodiscard]] std::array<double, 2> reachOf(const TerrainSelection& selection,
                                              const Camera& camera) const {
    const V3d axis = camera.axis();
    std::array<double, 2> reach = {0, 0};
    for (const TerrainSelection::Part& part : selection.parts) {
      Imath::Box3d box = grid_.box({part.level, part.column, part.row});
      box.min -= camera.from;
      box.max -= camera.from;
      reach = {std::min(reach[0], -extentOf(box, -axis)), std::max(reach[1], extentOf(box, axis))};
    }
    return reach;
  }

  GlContext context_;
  PatchGrid grid_;
  int side_;
  PatchBorderSets sets_;
  PatchSlots slots_;
  PictureTarget target_;
  GLuint program_ = 0, vertices_ = 0, indices_ = 0, commandBuffer_ = 0;
  Texels heights_, placeTexels_;
  std::vector<SlotPlace> places_;  // for each slot
  std::size_t mostSlot_ = 0;       // of those placed since the last draw call
  std::vector<DrawCommand> commands_;
  Cost cost_;
};

}  // namespace

std::unique_ptr<TerrainPainter> makeTerrainPainter(const levelset::GroundLayout& layout,
                                                   std::size_t maxBytes) {
  return std::make_unique<GlTerrainPainter>(layout, maxBytes);
}

}  // namespace render
