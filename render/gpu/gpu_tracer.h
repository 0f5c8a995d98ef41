#pragma once

// Private to the GPU renderer: runs the kernel as a compute shader.

#include <memory>
#include <vector>

#include "render/gpu/bezier/gpu_beziers.h"
#include "render/gpu/device/gl_context.h"
#include "render/kernel/kernel_scene.h"

namespace render {

/// Runs the kernel on the graphics processor. The tables of each solid are uploaded once.
/// Thread-safe: concurrent calls run one after the other.
class GpuTracer : public KernelTracer {
 public:
  /// @param context  must outlive the tracer
  /// @param largestTable  limit on the size of a buffer texture, bytes; 0: the limit of the driver
  /// @param grids  scene that `scene` was built from. Its solids are uploaded as NanoVDB grids in
  /// place of brick tables, as a reference for the tables. Null: the brick tables are uploaded.
  /// @pre with `grids` the filter is trilinear
  /// @throws levelset::ResourceLimit when the tables do not fit into the buffer textures, or the
  /// shader does not compile; also for the reasons of GpuFields
  GpuTracer(const GlContext& context, const KernelScene& scene, std::size_t largestTable = 0,
            const Scene* grids = nullptr);
  ~GpuTracer() override;

  void trace(const KernelSolid& solid, const PixelBlock& pixels, HitBlock& hits,
             ShapeBlock& shapes) const override;
  void trace(const KernelSolid& solid, const RayBlock& rays, HitBlock& hits) const override;
  /// Traces on the processor: the shader computes shapes for rays of the camera only.
  void trace(const KernelSolid& solid, const RayBlock& rays, HitBlock& hits,
             ShapeBlock& shapes) const override;
  [[nodiscard]] std::vector<double> search(const FieldTraversal& fields,
                                           const std::vector<FieldSegment>& segments,
                                           FieldQuestion question) const override;
  /// @throws levelset::ResourceLimit for the reasons of GpuLight::light()
  [[nodiscard]] std::vector<VolumeLight> volumeLight(const DirectVolume& volume,
                                                     const std::vector<VolumeSegment>& segments,
                                                     const VolumeShading* shading) const override;
  /// @throws levelset::ResourceLimit for the reasons of GpuInterfaces::firstHits()
  [[nodiscard]] std::vector<InterfaceHit> interfaceHits(const InterfaceCaster& caster,
                                                        const std::vector<InterfaceRay>& rays,
                                                        bool wantsNormals) const override;
  /// @throws levelset::ResourceLimit for the reasons of GpuBeziers::rootsOn()
  [[nodiscard]] SharedTree::Roots bezierRoots(const SharedTree& tree,
                                              const std::vector<Camera::Ray>& rays,
                                              TreeCounts* counts) const override;
  /// @throws levelset::ResourceLimit for the reasons of GpuQuadrics::firstHits()
  [[nodiscard]] std::vector<QuadricHit> quadricHits(
      const QuadricCaster& caster, const std::vector<Camera::Ray>& rays) const override;
  /// @throws levelset::ResourceLimit for the reasons of GpuTerrains::firstHits()
  [[nodiscard]] std::vector<TerrainHit> terrainHits(
      const TerrainCaster& caster, const std::vector<Camera::Ray>& rays) const override;

  /// Work of all calls of bezierRoots() so far.
  [[nodiscard]] GpuBezierCounts bezierCounts() const;
  /// Returns the wall time, seconds, of the shaders of all trace() calls so far. The time of
  /// transfers is not included.
  [[nodiscard]] double shaderSeconds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace render
