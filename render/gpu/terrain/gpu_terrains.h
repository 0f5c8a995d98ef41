#pragma once

// Private to the GPU renderer: ray casting of terrains by the compute shader.

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "render/gpu/device/gl_context.h"
#include "render/gpu/device/gl_objects.h"
#include "render/gpu/device/uploaded_tables.h"
#include "render/terrain/rays/terrain_caster.h"

namespace render {

/// Terrains in an OpenGL context, and the shader that casts rays at them. The bits are those of
/// TerrainCaster::firstHit(), if the driver rounds sums, products and quotients of doubles as IEEE
/// 754 requires. The nodes of the pyramid are visited in an order that needs no stack.
class GpuTerrains {
 public:
  /// Nodes that a ray visits in one call of the shader. Longer walks need several calls. Mesa's
  /// llvmpipe ends loops without notice after 65535 iterations of all loops of up to 16 rays.
  static constexpr int kMostSteps = 3000;

  /// @param context  must outlive this object
  /// @param largestTable  limit on the size of a buffer texture, bytes
  GpuTerrains(const GlContext& context, std::size_t largestTable)
      : context_(context), largestTable_(largestTable), uploaded_(context) {}
  GpuTerrains(const GpuTerrains&) = delete;
  GpuTerrains& operator=(const GpuTerrains&) = delete;
  /// Frees all objects in the context. Runs in a job of GlContext::run().
  void release();

  /// First hits of rays. The tables of a terrain are uploaded by the first call, and stay as long
  /// as something else holds them.
  /// @throws levelset::ResourceLimit for a terrain that does not fit into buffer textures
  [[nodiscard]] std::vector<TerrainHit> firstHits(const TerrainCaster& caster,
                                                  const std::vector<Camera::Ray>& rays);

 private:
  /// Tables of a terrain in the context.
  struct Uploaded {
    std::shared_ptr<const TerrainTables> tables;
    std::array<Texels, 2> textures{};  ///< heights, nodes of the pyramid
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
