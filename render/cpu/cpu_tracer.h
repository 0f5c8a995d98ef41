#pragma once

#include "render/cpu/cpu_trace.h"
#include "render/kernel/kernel_scene.h"

namespace render {

/// Runs the kernel on the calling thread with the widest instructions that the processor supports.
class CpuTracer : public KernelTracer {
 public:
  void trace(const KernelSolid& solid, const PixelBlock& pixels, HitBlock& hits,
             ShapeBlock& shapes) const override {
    tracePixels(solid.pool, solid.fan, pixels, hits, shapes, set_);
  }
  void trace(const KernelSolid& solid, const RayBlock& rays, HitBlock& hits) const override {
    traceRays(solid.pool, rays, hits, set_);
  }
  void trace(const KernelSolid& solid, const RayBlock& rays, HitBlock& hits,
             ShapeBlock& shapes) const override {
    traceRays(solid.pool, rays, hits, shapes, set_);
  }

 private:
  InstructionSet set_ = instructionSets().back();
};

}  // namespace render
