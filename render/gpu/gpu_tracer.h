#pragma once

// Private to the GPU renderer: the kernel as a compute shader.

#include <memory>
#include <string>

#include "render/gpu/gl_context.h"
#include "render/kernel/kernel_scene.h"

namespace render {

/// The kernel on the graphics processor. Each solid's tables are uploaded once. Safe to call from
/// many threads, which take turns.
class GpuTracer : public KernelTracer {
 public:
  /// @param context       must outlive it
  /// @param largestTable  bytes of a buffer of texels at most; 0: what the driver says
  /// @param grids         of which the scene was made: their NanoVDB grids are uploaded in the
  /// place
  ///                      of the tables, the reference that those are held against; none: the
  ///                      tables
  /// @pre with grids the filter is trilinear
  /// @throws levelset::ResourceLimit where the tables do not fit, or the shader does not compile
  GpuTracer(const GlContext& context, const KernelScene& scene, std::size_t largestTable = 0,
            const Scene* grids = nullptr);
  ~GpuTracer() override;

  void trace(const KernelSolid& solid, const PixelBlock& pixels, HitBlock& hits,
             ShapeBlock& shapes) const override;
  void trace(const KernelSolid& solid, const RayBlock& rays, HitBlock& hits) const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A compute shader, ready to run. @pre the context is current
/// @throws levelset::ResourceLimit with the driver's first words where it does not compile
[[nodiscard]] GLuint compileCompute(const GlContext& context, const std::string& text);

}  // namespace render
