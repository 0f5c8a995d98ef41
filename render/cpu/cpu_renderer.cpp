#include "render/cpu/cpu_renderer.h"

#include "render/cpu/cpu_tracer.h"
#include "render/kernel/kernel_scene.h"
#include "render/kernel/paint.h"
#include "render/views/picture.h"

namespace render {
Image renderCpu(const Scene& scene, const RenderOptions& options) {
  requirePicture(scene, options);
  levelset::report(options.progress, 0);
  const KernelScene surfaces(scene, options);
  if (surfaces.bounds().isEmpty()) refuseEmptyScene();
  constexpr int kCpuTile = 32;  // edge of a tile, pixels
  return paintPicture(scene, surfaces, CpuTracer(), kCpuTile, "cpu", options);
}

}  // namespace render
