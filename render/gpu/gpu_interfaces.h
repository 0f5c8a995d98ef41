#pragma once

// Private to the GPU renderer: ray casting of segmented fields by the compute shader.

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "render/gpu/device/gl_context.h"
#include "render/gpu/device/gl_objects.h"
#include "render/segmented/interface_caster.h"

namespace render {

/// A segmented field in an OpenGL context, and the shader that casts rays through it. The bits are
/// those of InterfaceCaster::firstHit(), if the driver rounds sums, products and quotients of
/// doubles as IEEE 754 requires.
class GpuInterfaces {
 public:
  /// @param context  must outlive this object
  /// @param largestTable  limit on the size of a buffer texture, bytes
  GpuInterfaces(const GlContext& context, std::size_t largestTable)
      : context_(context), largestTable_(largestTable) {}
  GpuInterfaces(const GpuInterfaces&) = delete;
  GpuInterfaces& operator=(const GpuInterfaces&) = delete;
  /// Frees all objects in the context. Runs in a job of GlContext::run().
  void release();

  /// First hits of rays. The field is uploaded unless it is that of the previous call.
  /// @param wantsNormals  false: only `found`, `distance` and the labels are set
  /// @throws levelset::ResourceLimit for a field that does not fit into buffer textures
  [[nodiscard]] std::vector<InterfaceHit> firstHits(const InterfaceCaster& caster,
                                                    const std::vector<InterfaceRay>& rays,
                                                    bool wantsNormals);

 private:
  static constexpr std::size_t kTextures = 14;
  static constexpr std::size_t kFieldTextures = 9;  ///< those of a field without sheets

  // These run in jobs of GlContext::run().
  void upload(const InterfaceCaster& caster);
  void run(const std::vector<double>& input, bool wantsNormals, std::vector<double>& answers);

  const GlContext& context_;
  std::size_t largestTable_;
  std::shared_ptr<const InterfaceTables> uploaded_;  // data of the field in the textures
  std::array<Texels, kTextures> textures_{};
  GrowingBuffer rays_{GrowingBuffer::Use::Upload}, found_{GrowingBuffer::Use::Upload},
      fetched_{GrowingBuffer::Use::Fetch};
  std::array<GLuint, 2> programs_{};  ///< for fields without sheets and with them
};

}  // namespace render
