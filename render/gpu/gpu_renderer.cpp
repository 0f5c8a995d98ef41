#include "render/gpu/gpu_renderer.h"

#include <fmt/core.h>

#include "render/gpu/device/gl_context.h"
#include "render/gpu/gpu_tracer.h"
#include "render/kernel/paint.h"
#include "render/views/picture.h"

namespace render {

Image renderGpu(const Scene& scene, const RenderOptions& options) {
  requirePicture(scene, options);
  levelset::report(options.progress, 0);
  const KernelScene surfaces(scene, options);
  if (surfaces.bounds().isEmpty()) refuseEmptyScene();
  if (options.fromNanoVdb) {  // memory of the NanoVDB grids and of their copies for the upload
    double bytes = 0;
    for (const Solid& solid : scene.solids)
      bytes += 2 * static_cast<double>(solid.band.memoryUse());
    levelset::requireMemory(bytes, options.maxBytes);
  }
  const GlContext context;
  const GpuTracer tracer(context, surfaces, 0, options.fromNanoVdb ? &scene : nullptr);
  // Edge of a tile, pixels. Each dispatch waits for the device, so a tile has many rays.
  constexpr int kGpuTile = 256;
  Image image =
      paintPicture(scene, surfaces, tracer, kGpuTile, "gpu " + context.description(), options);
  if (const std::size_t rays = tracer.bezierCounts().onProcessor; rays > 0)
    image.attributes["ls:onProcessor"] = fmt::format(
        "the processor cast {} rays through Bézier volumes, which gave up, or whose parts did not "
        "fit into the memory of the shader",
        rays);
  return image;
}

}  // namespace render
