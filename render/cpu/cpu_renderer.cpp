#include "render/cpu/cpu_renderer.h"

#include "render/cpu/cpu_trace.h"
#include "render/kernel/kernel_scene.h"
#include "render/kernel/paint.h"
#include "render/shading/picture.h"

namespace render {
namespace {

class CpuTracer : public KernelTracer {
 public:
  void trace(const KernelSolid& solid, const PixelBlock& pixels, HitBlock& hits) const override {
    tracePixels(solid.pool, solid.fan, pixels, hits, set_);
  }
  void trace(const KernelSolid& solid, const RayBlock& rays, HitBlock& hits) const override {
    traceRays(solid.pool, rays, hits, set_);
  }

 private:
  InstructionSet set_ = instructionSets().back();
};

}  // namespace

Image renderCpu(const Scene& scene, const RenderOptions& options) {
  requirePicture(scene, options);
  levelset::report(options.progress, 0, "render");
  const KernelScene surfaces(scene, options.maxBytes);
  if (surfaces.bounds().isEmpty()) refuseEmptyScene();
  constexpr int kCpuTile = 16;  // pixels
  return paintPicture(scene, surfaces, CpuTracer(), kCpuTile, "cpu", options);
}

}  // namespace render
