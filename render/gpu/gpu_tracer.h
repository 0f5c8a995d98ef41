#pragma once

// Private to the GPU renderer: runs the kernel as a compute shader.

#include <memory>
#include <string>

#include "render/gpu/gl_context.h"
#include "render/kernel/kernel_scene.h"

namespace render {

/// Runs the kernel on the graphics processor. The tables of each solid are uploaded once.
/// Thread-safe; calls are serialised.
class GpuTracer : public KernelTracer {
 public:
  /// @param context  must outlive the tracer
  /// @param largestTable  largest texel buffer, bytes; 0: the limit of the driver
  /// @param grids  scene that KernelScene was built from. Its NanoVDB grids are uploaded in place
  ///        of the tables, as a reference for them. Null: the tables are uploaded.
  /// @pre with `grids` the filter is trilinear
  /// @throws levelset::ResourceLimit when the tables do not fit, or the shader does not compile
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

/// Compiles and links a compute shader. @pre the context is current
/// @throws levelset::ResourceLimit with the start of the driver's log when it does not compile
[[nodiscard]] GLuint compileCompute(const GlContext& context, const std::string& text);

}  // namespace render
