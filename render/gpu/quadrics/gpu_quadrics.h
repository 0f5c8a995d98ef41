#pragma once

// Private to the GPU renderer: ray casting of quadrics by the compute shader.

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "render/gpu/device/gl_context.h"
#include "render/gpu/device/gl_objects.h"
#include "render/gpu/device/uploaded_tables.h"
#include "render/quadrics/quadric_caster.h"

namespace render {

/// Quadrics in an OpenGL context, and the shader that casts rays at them. The bits are those of
/// QuadricCaster::firstHit(), if the driver rounds sums, products and quotients of doubles as IEEE
/// 754 requires. The boxes are visited in one fixed order, so that a ray has no stack.
class GpuQuadrics {
 public:
  /// @param context  must outlive this object
  /// @param largestTable  limit on the size of a buffer texture, bytes
  GpuQuadrics(const GlContext& context, std::size_t largestTable)
      : context_(context), largestTable_(largestTable), uploaded_(context) {}
  GpuQuadrics(const GpuQuadrics&) = delete;
  GpuQuadrics& operator=(const GpuQuadrics&) = delete;
  /// Frees all objects in the context. Runs in a job of GlContext::run().
  void release();

  /// First hits of rays. The tables of a part are uploaded by the first call, and stay as long as
  /// something else holds them.
  /// @throws levelset::ResourceLimit for quadrics that do not fit into buffer textures
  [[nodiscard]] std::vector<QuadricHit> firstHits(const QuadricCaster& caster,
                                                  const std::vector<Camera::Ray>& rays);

 private:
  /// Tables of a part in the context.
  struct Uploaded {
    std::shared_ptr<const QuadricTables> tables;
    std::array<Texels, 4> textures{};  ///< boxes, spheres, cylinders, general quadrics
    int boxCount = 0;
  };

  // These run in jobs of GlContext::run().
  void upload(Uploaded& part);
  void run(const Uploaded& part, std::vector<double>& rays);

  const GlContext& context_;
  std::size_t largestTable_;
  UploadedTables<Uploaded> uploaded_;
  GrowingBuffer rays_{GrowingBuffer::Use::Upload}, fetched_{GrowingBuffer::Use::Fetch};
  GLuint program_ = 0;
};

}  // namespace render
