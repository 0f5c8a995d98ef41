#include "render/cpu/cpu_renderer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>

#include "render/cpu/cpu_trace.h"
#include "render/kernel/kernel_scene.h"
#include "render/kernel/paint.h"
#include "render/shading/picture.h"

namespace render {
namespace {

constexpr int kCpuTile = 16;  // pixels

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
  const Camera& camera = scene.camera;
  Image image(camera.width, camera.height);
  const KernelPainter painter(scene, surfaces, options, image);
  const CpuTracer tracer;

  const int across = (camera.width + kCpuTile - 1) / kCpuTile, down = (camera.height + kCpuTile - 1) / kCpuTile;
  std::mutex reporting;
  int done = 0;
  tbb::parallel_for(0, across * down, [&](int tile) {
    const int left = tile % across * kCpuTile, top = tile / across * kCpuTile;
    painter.paint(tracer, {left, top, std::min(left + kCpuTile, camera.width),
                           std::min(top + kCpuTile, camera.height)});
    const std::scoped_lock lock(reporting);
    levelset::report(options.progress, static_cast<double>(++done) / (across * down), "render");
  });
  image.attributes = sceneAttributes(scene);
  image.attributes["ls:renderer"] = "cpu";
  image.attributes["ls:mode"] = "exact";
  addViewAttributes(image, scene);
  return image;
}

}  // namespace render
