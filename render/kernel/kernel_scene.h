#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/memory_limit.h"
#include "render/bricks/brick_pool.h"
#include "render/kernel/csg_traversal.h"
#include "render/kernel/field_traversal.h"
#include "render/kernel/ray_block.h"
#include "render/kernel/ray_fan.h"
#include "render/meshes/mesh_rays.h"
#include "render/scene/csg_expression.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"
#include "render/shading/shading.h"

namespace render {

/// A solid of a scene as the kernel sees it.
struct KernelSolid {
  std::size_t index = 0;  ///< in Scene::solids
  std::uint32_t id = 0;
  double voxelSize = 1, opacity = 1;
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
  std::vector<char> flipped;        ///< is that solid's outside inside what the scene makes of it?
  ShapeBlock shapes;

  explicit PixelHits(std::size_t size)
      : depth(size), solid(size, -1), flipped(size, 0), shapes(size) {}
};

/// Rays of pixels on their way through the solids, from surface to surface.
struct PixelTraversal {
  PixelBlock pixels;
  CsgTraversal solids;
  struct Crossings {  ///< with one solid, the next of each ray
    std::vector<double> depth;
    ShapeBlock shapes;
  };
  std::vector<Crossings> next;
};

/// The surfaces of a scene made ready for the kernel, whoever runs it. Of two solids hit at the
/// same depth the one of the smaller voxels counts, of two such the first one by id.
class KernelScene {
 public:
  /// For any camera. @param maxBytes  for what the kernel reads
  /// @param filter    what is drawn of the grids
  /// @pre the camera is valid
  /// @throws levelset::ResourceLimit before anything is allocated; and as makeBricks()
  explicit KernelScene(const Scene& scene, std::size_t maxBytes = levelset::kNoMemoryLimit,
                       Filter filter = Filter::Trilinear);
  /// For that picture: what it does not need is left out. @pre as above
  KernelScene(const Scene& scene, const RenderOptions& options);

  /// Takes the camera, where the solids are and how opaque, anew from a scene; tables and meshes
  /// stay.
  /// @pre made for any camera, not for a picture; the camera is valid; the scene has the solids and
  /// the expression that this was made of
  void updateView(const Scene& scene);

  [[nodiscard]] const std::vector<KernelSolid>& solids() const { return solids_; }
  /// World-space box of the cells that hold surface, and of the meshes; empty when there are none.
  [[nodiscard]] const Imath::Box3d& bounds() const { return bounds_; }
  /// The same of blocks: what places are as exact as, in single precision.
  [[nodiscard]] const Imath::Box3d& tableBounds() const { return tableBounds_; }
  [[nodiscard]] const MeshRays& meshes() const { return meshes_; }
  /// What is drawn of the solids where the scene blends them: then there are no solids(), and
  /// castPixels() and thickness() find nothing; or null.
  [[nodiscard]] const FieldTraversal* fields() const { return fields_ ? &*fields_ : nullptr; }
  [[nodiscard]] std::size_t bytes() const;
  /// Blocks of the solids by what was done with them.
  struct Counts {
    std::size_t crossed = 0, halo = 0;  // held
    std::size_t omitted = 0;            // with those that are
    std::size_t culled = 0;             // crossed, out of what the picture needs
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }

  /// Of the solids; meshes() are for the caller.
  [[nodiscard]] PixelHits castPixels(const KernelTracer& tracer, const PixelBlock& pixels) const;
  [[nodiscard]] PixelTraversal startTraversal(const PixelBlock& pixels) const;
  /// What rays meet next: those that were told to go on, the others what they met before.
  [[nodiscard]] PixelHits castNext(const KernelTracer& tracer, PixelTraversal& traversal) const;
  /// @return how far each ray is within what is drawn of the solids and is seen, along the view
  /// axis, world units
  [[nodiscard]] std::vector<double> thickness(const KernelTracer& tracer,
                                              const PixelBlock& pixels) const;
  /// @return for each ray the share of its light that what it meets within its maxDistance lets
  /// through
  [[nodiscard]] std::vector<double> transmittances(const KernelTracer& tracer,
                                                   const std::vector<LightRay>& rays) const;

 private:
  [[nodiscard]] PixelHits castFirst(const KernelTracer& tracer, const PixelBlock& pixels) const;
  /// Is a place within what is drawn that those solids hold?
  [[nodiscard]] bool isInside(const std::vector<char>& inside) const;
  /// Dims the light of the rays from `first` up to `last`.
  void dimBySolids(const KernelTracer& tracer, const std::vector<LightRay>& rays, std::size_t first,
                   std::size_t last, std::vector<double>& light) const;
  void dimByCsg(const KernelTracer& tracer, const std::vector<LightRay>& rays, std::size_t first,
                std::size_t last, std::vector<double>& light) const;

  /// @param isPicture  leave out what it does not need
  void makeTables(const Scene& scene, const RenderOptions& options, bool isPicture);

  /// Where a surface is, of which the tables may hold a part or nothing.
  struct Extent {
    std::size_t index;           // in Scene::solids
    Imath::Box3d cells, blocks;  // that it crosses, in indices
  };
  std::vector<Extent> extents_;
  Counts counts_;
  std::vector<KernelSolid> solids_;  // by voxel size and id
  CsgExpression csg_;                // of those
  MeshRays meshes_;
  std::optional<FieldTraversal> fields_;
  Imath::Box3d bounds_, tableBounds_;
  double near_ = 0, far_ = Camera::kNoDepth;  // depths that the camera sees
};

}  // namespace render
