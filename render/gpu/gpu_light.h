#pragma once

// Private to the GPU renderer: direct volume rendering by the compute shader.

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "levelset/volumes/volume.h"
#include "render/direct/direct_volume.h"
#include "render/gpu/device/gl_context.h"
#include "render/gpu/device/gl_objects.h"

namespace render {

/// A volume in an OpenGL context, and the shader that integrates its light. The bits are those of
/// DirectVolume::light(), if the driver rounds sums, products and quotients of doubles as IEEE 754
/// requires, and errs by at most one unit in the last place of square roots.
class GpuLight {
 public:
  /// Largest number of points of a transfer function.
  static constexpr std::size_t kMostPoints = 256;

  /// @param context  must outlive this object
  /// @param largestTable  limit on the size of a buffer texture, bytes
  GpuLight(const GlContext& context, std::size_t largestTable)
      : context_(context), largestTable_(largestTable) {}
  GpuLight(const GpuLight&) = delete;
  GpuLight& operator=(const GpuLight&) = delete;
  /// Frees all objects in the context. Runs in a job of GlContext::run().
  void release();

  /// Light on parts of rays. The volume is uploaded unless it is that of the previous call.
  /// @param shading  null: colours do not depend on the gradient
  /// @throws levelset::ResourceLimit for a volume that does not fit into a buffer texture, and for
  /// a transfer function of more than kMostPoints points
  [[nodiscard]] std::vector<VolumeLight> light(const DirectVolume& volume,
                                               const std::vector<VolumeSegment>& segments,
                                               const VolumeShading* shading);

 private:
  // These run in jobs of GlContext::run().
  void upload(const DirectVolume& volume);
  void run(const std::vector<double>& input, const std::vector<double>& numbers, bool isShaded,
           std::vector<double>& answers);

  const GlContext& context_;
  std::size_t largestTable_;
  std::shared_ptr<const LightTables> uploaded_;  // data of the volume in the textures
  Texels values_, marks_;
  GrowingBuffer numbers_{GrowingBuffer::Use::Upload}, rays_{GrowingBuffer::Use::Upload},
      found_{GrowingBuffer::Use::Upload}, fetched_{GrowingBuffer::Use::Fetch};
  std::array<GLuint, 5> programs_{};  // for each levelset::VolumeType
};

}  // namespace render
