#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/memory_limit.h"
#include "render/csg.h"
#include "render/embree/mesh_rays.h"
#include "render/kernel/brick_pool.h"
#include "render/kernel/field_walk.h"
#include "render/kernel/ray_block.h"
#include "render/kernel/ray_fan.h"
#include "render/scene.h"
#include "render/shading/shading.h"

namespace render {

/// A solid of a scene as the kernel sees it.
struct KernelSolid {
  std::size_t index = 0;  ///< in Scene::solids
  std::uint32_t id = 0;
  double voxelSize = 1;
  BrickPool pool;
  RayFan fan;
  Imath::M44d tableToWorld, worldToTable;
};

/// Runs the kernel somewhere. The hits of all tracers have the same bits.
class KernelTracer {
 public:
  virtual ~KernelTracer() = default;
  /// @param hits, shapes  as long as the pixels; shapes only where something is hit
  virtual void trace(const KernelSolid& solid, const PixelBlock& pixels, HitBlock& hits,
                     ShapeBlock& shapes) const = 0;
  virtual void trace(const KernelSolid& solid, const RayBlock& rays, HitBlock& hits) const = 0;
};

/// What a block of pixels shows.
struct PixelHits {
  std::vector<double> depth;        ///< along the view axis, world units
  std::vector<std::int32_t> solid;  ///< index in KernelScene::solids(), or −1
  std::vector<char> turned;         ///< is that solid's outside inside what the scene makes of it?
  ShapeBlock shapes;

  explicit PixelHits(std::size_t size)
      : depth(size), solid(size, -1), turned(size, 0), shapes(size) {}
};

/// The surfaces of a scene made ready for the kernel, whoever runs it. Of two solids hit at the
/// same depth the one of the smaller voxels counts, of two such the first one by id.
class KernelScene {
 public:
  /// @param maxBytes  for what the kernel reads
  /// @param filter    what is drawn of the grids
  /// @pre the camera is valid
  /// @throws levelset::ResourceLimit before anything is allocated; and as makeBricks()
  explicit KernelScene(const Scene& scene, std::size_t maxBytes = levelset::kNoMemoryLimit,
                       Filter filter = Filter::Trilinear);

  /// Takes the camera, and where the solids are, anew from a scene; tables and meshes
  /// stay.
  /// @pre the camera is valid; the scene has the solids and the expression that this was made of
  void look(const Scene& scene);

  [[nodiscard]] const std::vector<KernelSolid>& solids() const { return solids_; }
  /// World-space box of the cells that hold surface, and of the meshes; empty when there are none.
  [[nodiscard]] const Imath::Box3d& bounds() const { return bounds_; }
  [[nodiscard]] const MeshRays& meshes() const { return meshes_; }
  /// What is drawn of the solids where the scene blends them: then there are no solids(), and
  /// castPixels() and thickness() find nothing; or null.
  [[nodiscard]] const FieldWalk* fields() const { return fields_ ? &*fields_ : nullptr; }
  [[nodiscard]] std::size_t bytes() const;
  [[nodiscard]] std::size_t blocksLeftOut() const;

  /// Of the solids; meshes() are for the caller.
  [[nodiscard]] PixelHits castPixels(const KernelTracer& tracer, const PixelBlock& pixels) const;
  /// @return how far each ray is within what is drawn of the solids, along the view axis, world
  /// units
  [[nodiscard]] std::vector<double> thickness(const KernelTracer& tracer,
                                              const PixelBlock& pixels) const;
  /// @return for each ray 1 if it meets something within its reach, else 0
  [[nodiscard]] std::vector<char> findBlocked(const KernelTracer& tracer,
                                              const std::vector<LightRay>& rays) const;

 private:
  [[nodiscard]] PixelHits castFirst(const KernelTracer& tracer, const PixelBlock& pixels) const;
  [[nodiscard]] PixelHits castCsg(const KernelTracer& tracer, const PixelBlock& pixels) const;
  /// Is a place within what is drawn that those solids hold?
  [[nodiscard]] bool isInside(const std::vector<char>& inside) const;
  /// Those of the rays from `first` up to `last` that are blocked.
  void blockFirst(const KernelTracer& tracer, const std::vector<LightRay>& rays, std::size_t first,
                  std::size_t last, std::vector<char>& blocked) const;
  void blockCsg(const KernelTracer& tracer, const std::vector<LightRay>& rays, std::size_t first,
                std::size_t last, std::vector<char>& blocked) const;

  std::vector<KernelSolid> solids_;  // by voxel size and id
  CsgExpression csg_;                // of those
  MeshRays meshes_;
  std::optional<FieldWalk> fields_;
  Imath::Box3d bounds_;
};

}  // namespace render
