#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "levelset/memory/memory_limit.h"
#include "render/bezier/solid_crossings.h"
#include "render/bricks/brick_pool.h"
#include "render/direct/direct_volume.h"
#include "render/kernel/csg_traversal.h"
#include "render/kernel/field_traversal.h"
#include "render/kernel/ray_block.h"
#include "render/kernel/ray_fan.h"
#include "render/mapped/mapped_rays.h"
#include "render/meshes/mesh_rays.h"
#include "render/scene/csg_expression.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"
#include "render/shading/shading.h"

namespace render {

/// A solid of a scene with its brick tables for the kernel.
struct KernelSolid {
  std::size_t index = 0;  ///< index in Scene::solids
  std::uint32_t id = 0;
  double voxelSize = 1, opacity = 1;
  bool isVolume = false;
  BrickPool pool;
  RayFan fan;
  Imath::M44d tableToWorld, worldToTable;
};

/// Hits of several rays with the surfaces in Bézier volumes, in order of their distance.
struct BezierHits {
  std::vector<std::size_t> first = {};  ///< hits of ray n: from first[n] to before first[n + 1]
  std::vector<Hit> hits = {};
};

/// Interface of the kernel's back ends, on the processor and on the GPU. All of them return the
/// same bits. Fields of a blended scene are searched by FieldTracer::search().
class KernelTracer : public FieldTracer {
 public:
  /// Finds the first crossing of the ray through each pixel with the solid's surface, after those
  /// that pixels.passing skips. @param hits, shapes  must have as many entries as `pixels`;
  /// `shapes` is written only for hits
  virtual void trace(const KernelSolid& solid, const PixelBlock& pixels, HitBlock& hits,
                     ShapeBlock& shapes) const = 0;
  virtual void trace(const KernelSolid& solid, const RayBlock& rays, HitBlock& hits) const = 0;
  /// The same, with the shape of the surface at each hit. @param shapes  as for pixels
  virtual void trace(const KernelSolid& solid, const RayBlock& rays, HitBlock& hits,
                     ShapeBlock& shapes) const = 0;
  /// Light of a volume on parts of rays. The default integrates on the calling thread.
  /// @param shading  null: colours do not depend on the gradient
  [[nodiscard]] virtual std::vector<VolumeLight> volumeLight(
      const DirectVolume& volume, const std::vector<VolumeSegment>& segments,
      const VolumeShading* shading) const;
  /// First hits of rays with the interfaces of a segmented field. The default casts on the calling
  /// thread.
  /// @param wantsNormals  false: only InterfaceHit::found is set
  [[nodiscard]] virtual std::vector<InterfaceHit> interfaceHits(
      const InterfaceCaster& caster, const std::vector<InterfaceRay>& rays,
      bool wantsNormals) const;
  /// Roots of rays of the camera in a Bézier volume. The default casts on the calling thread.
  /// @param counts  receives the work of the processor; may be null
  [[nodiscard]] virtual SharedTree::Roots bezierRoots(const SharedTree& tree,
                                                      const std::vector<Camera::Ray>& rays,
                                                      TreeCounts* counts) const;
  /// First hits of rays of the camera with quadrics. The default casts on the calling thread.
  [[nodiscard]] virtual std::vector<QuadricHit> quadricHits(
      const QuadricCaster& caster, const std::vector<Camera::Ray>& rays) const;
  /// First hits of rays with a terrain. The default casts on the calling thread.
  [[nodiscard]] virtual std::vector<TerrainHit> terrainHits(
      const TerrainCaster& caster, const std::vector<Camera::Ray>& rays) const;
};

/// Hits of the rays through a block of pixels with solids, at most one for each ray.
struct PixelHits {
  std::vector<double> depth;  ///< along the view axis, world units
  /// Index in KernelScene::solids(), or their number plus that of a Bézier operand; −1: no hit.
  std::vector<std::int32_t> solid;
  /// 1: the drawn shape is on the outside of the hit solid, as for a subtracted solid.
  std::vector<char> flipped;
  ShapeBlock shapes;
  /// Roots of the hits with Bézier operands; empty without any.
  std::vector<BezierRoot> roots = {};

  explicit PixelHits(std::size_t size)
      : depth(size), solid(size, -1), flipped(size, 0), shapes(size) {}
};

/// Crossings of rays with the Bézier volumes that are operands of the expression.
struct OperandCrossings {
  /// For each operand and ray, in order of their distance.
  std::vector<std::vector<std::vector<BezierRoot>>> roots = {};
  std::size_t open = 0;      ///< number of pairs with SolidCrossings::isOpen
  std::size_t overruns = 0;  ///< TreeCounts::overruns
};

/// State of rays through pixels that continue from one surface to the next.
struct PixelTraversal {
  PixelBlock pixels;
  CsgTraversal solids;
  struct Crossings {  ///< next crossing of each ray with one solid
    std::vector<double> depth;
    ShapeBlock shapes;
    std::vector<BezierRoot> roots = {};  ///< on a Bézier operand, which has no shapes
  };
  std::vector<Crossings> next;
  OperandCrossings beziers = {};

  /// Hits of rays that have met the drawn shape, from the next crossings of the solids.
  static void takeMet(const CsgTraversal& walk, const std::vector<Crossings>& next,
                      PixelHits& hits);
};

/// A scene prepared for the kernel, independent of the back end. When two solids are hit at the
/// same depth, the solid with the smaller voxels counts; for equal voxels, the solid with the lower
/// id.
class KernelScene {
 public:
  /// Prepares the scene for any camera.
  /// @param maxBytes  memory limit of the kernel's brick tables, bytes
  /// @param filter  interpolation of the grids
  /// @pre the camera is valid
  /// @throws levelset::ResourceLimit when the estimated memory exceeds `maxBytes`, before anything
  /// is allocated; also for the reasons of makeBricks()
  explicit KernelScene(const Scene& scene, std::size_t maxBytes = levelset::kNoMemoryLimit,
                       Filter filter = Filter::Trilinear);
  /// Prepares the scene for one picture from the scene's camera; blocks that cannot affect the
  /// picture are culled. @pre the camera is valid
  KernelScene(const Scene& scene, const RenderOptions& options);

  /// Copies the camera of the scene, for which it splits Bézier volumes, and the transforms and
  /// opacities of its solids. Brick tables and meshes are not changed.
  /// @pre this object was built for any camera, not for one picture; the camera is valid; the scene
  /// has the solids and the expression that this object was built from
  void updateView(const Scene& scene);

  [[nodiscard]] const std::vector<KernelSolid>& solids() const { return solids_; }
  /// World-space box of the meshes, the shells of mapped textures, the Bézier volumes, the
  /// quadrics, the terrains, the interfaces of a segmented field and the grid cells that the
  /// solids' surfaces cross; empty when there are none. For a blended scene: Scene::bounds(). If a
  /// volume has no surface and nothing else is drawn: Scene::volumeBounds().
  [[nodiscard]] const Imath::Box3d& bounds() const { return bounds_; }
  /// World-space box of the meshes, the shells of mapped textures, the Bézier volumes, the
  /// quadrics, the terrains, the interfaces of a segmented field and the blocks that the solids'
  /// surfaces cross.
  /// For a blended scene: Scene::bounds(). Its size determines the absolute error of
  /// single-precision positions.
  [[nodiscard]] const Imath::Box3d& tableBounds() const { return tableBounds_; }
  [[nodiscard]] const MeshRays& meshes() const { return meshes_; }
  [[nodiscard]] const MappedRays& mapped() const { return mapped_; }
  /// Traversal of the fields of a blended scene; null for any other scene. For a blended scene
  /// solids() is empty, and castPixels() and thickness() find nothing.
  [[nodiscard]] const FieldTraversal* fields() const { return fields_ ? &*fields_ : nullptr; }
  /// Segmented field of the scene; null without one.
  [[nodiscard]] const SegmentedPart* segmented() const {
    return segmented_ ? &*segmented_ : nullptr;
  }
  /// Surfaces in Bézier volumes.
  [[nodiscard]] const std::vector<BezierPart>& beziers() const { return beziers_; }
  /// Hits of rays of the camera with the surfaces in Bézier volumes that are no operands, up to the
  /// first opaque one; empty without any.
  [[nodiscard]] BezierHits castBeziers(const KernelTracer& tracer,
                                       const std::vector<Camera::Ray>& rays,
                                       TreeCounts* counts = nullptr) const;
  /// Returns true for a hit from castBeziers().
  [[nodiscard]] bool isOnBezier(const Hit& hit) const {
    return !hit.isOnMesh && !hit.isOnGround && hit.solid >= bezierSolid_ &&
           hit.solid < bezierSolid_ + beziers_.size() && !isOperand(hit.solid - bezierSolid_);
  }
  /// Hit of a ray on a Bézier operand. @pre hits.solid[i] is the number of one
  [[nodiscard]] Hit hitOnOperand(const Camera::Ray& ray, const PixelHits& hits,
                                 std::size_t i) const;
  /// Quadrics of the scene.
  [[nodiscard]] const std::vector<QuadricPart>& quadrics() const { return quadrics_; }
  /// First hits of rays of the camera with the quadrics; empty without any.
  [[nodiscard]] std::vector<Hit> castQuadrics(const KernelTracer& tracer,
                                              const std::vector<Camera::Ray>& rays) const;
  /// Terrains of the scene.
  [[nodiscard]] const std::vector<TerrainPart>& terrains() const { return terrains_; }
  /// First hits of rays with the terrains; empty without any.
  [[nodiscard]] std::vector<Hit> castTerrains(const KernelTracer& tracer,
                                              const std::vector<Camera::Ray>& rays) const;
  [[nodiscard]] std::size_t bytes() const;
  /// Numbers of blocks of all solids, by their use in the brick tables.
  struct Counts {
    // Stored: blocks that the surface crosses, and their neighbours of which stencils read points
    // (halo).
    std::size_t crossed = 0, halo = 0;
    std::size_t omitted = 0;  // not stored: neither crossed nor read by a stencil
    std::size_t culled = 0;   // crossed by the surface, but irrelevant to the picture
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }

  /// First hits of the rays through pixels with the solids. Meshes, mapped textures and segmented
  /// fields are not included: the caller intersects meshes(), mapped() and segmented().
  /// @param operands  receives the counts of the Bézier operands; may be null
  [[nodiscard]] PixelHits castPixels(const KernelTracer& tracer, const PixelBlock& pixels,
                                     OperandCrossings* operands = nullptr) const;
  /// First hits of rays of any origin with the solids, between the rays' ends. `depth` of the
  /// result is the distance along the ray. A ray that starts in a solid hits where it leaves the
  /// solid.
  [[nodiscard]] PixelHits castRays(const KernelTracer& tracer,
                                   const std::vector<Camera::Ray>& rays) const;
  /// First hits of rays of any origin with the surfaces in Bézier volumes, at most one for each
  /// ray; empty without any.
  [[nodiscard]] BezierHits castBeziersOf(const std::vector<Camera::Ray>& rays) const;
  [[nodiscard]] PixelTraversal startTraversal(const KernelTracer& tracer,
                                              const PixelBlock& pixels) const;
  /// Next hits of the rays that CsgTraversal::resume() has released, or first hits in the first
  /// call. All other rays keep their present hit.
  [[nodiscard]] PixelHits castNext(const KernelTracer& tracer, PixelTraversal& traversal) const;
  /// @return for each pixel the length of the visible ray inside the drawn solids, along the view
  ///         axis, world units
  [[nodiscard]] std::vector<double> thickness(const KernelTracer& tracer,
                                              const PixelBlock& pixels) const;
  /// @return for each ray the share of its light that passes all surfaces within its maxDistance
  [[nodiscard]] std::vector<double> transmittances(const KernelTracer& tracer,
                                                   const std::vector<LightRay>& rays) const;

 private:
  /// True for a Bézier volume that the expression names. @param part  index in beziers()
  [[nodiscard]] bool isOperand(std::size_t part) const {
    return std::find(operands_.begin(), operands_.end(), part) != operands_.end();
  }
  /// Number of operands of csg_: level sets, then Bézier volumes.
  [[nodiscard]] std::size_t operandCount() const { return solids_.size() + operands_.size(); }
  [[nodiscard]] double opacityOf(std::size_t operand) const {
    return operand < solids_.size() ? solids_[operand].opacity
                                    : beziers_[operands_[operand - solids_.size()]].opacity;
  }
  /// Crossings with the Bézier operands of rays of the camera.
  [[nodiscard]] OperandCrossings crossOperands(const KernelTracer& tracer,
                                               const std::vector<Camera::Ray>& rays) const;
  /// Crossings with the Bézier operands of rays of any origin, from their begin to infinity.
  [[nodiscard]] OperandCrossings crossOperandsOf(const std::vector<LightRay>& rays,
                                                 std::size_t first, std::size_t last) const;
  /// Answers the queries about a Bézier operand.
  /// @param next  receives the crossings; null: they are not needed
  /// @param placeOf  position of a root along the ray, in the unit of the walk
  template <typename Place>
  static void answerOperand(CsgTraversal& walk, std::size_t number,
                            const std::vector<std::vector<BezierRoot>>& crossings,
                            PixelTraversal::Crossings* next, const Place& placeOf);
  /// Crossings of all operands before the first answer.
  [[nodiscard]] std::vector<PixelTraversal::Crossings> emptyCrossings(std::size_t rays) const;
  [[nodiscard]] PixelHits castFirst(const KernelTracer& tracer, const PixelBlock& pixels) const;
  // Parts of castRays(), without an expression and with one, for rays without `near`.
  void castFirstOf(const KernelTracer& tracer, const std::vector<LightRay>& rays,
                   PixelHits& result) const;
  void castCsgOf(const KernelTracer& tracer, const std::vector<LightRay>& rays,
                 PixelHits& result) const;
  /// True when a point is inside the drawn shape: the result of the expression, or without one the
  /// union of the solids. @param inside  for each solid: nonzero when the point is inside the solid
  [[nodiscard]] bool isInside(const std::vector<char>& inside) const;
  /// Multiplies `light` of the rays first … last − 1 by the transmittance of the solids.
  void dimBySolids(const KernelTracer& tracer, const std::vector<LightRay>& rays, std::size_t first,
                   std::size_t last, std::vector<double>& light) const;
  void dimByCsg(const KernelTracer& tracer, const std::vector<LightRay>& rays, std::size_t first,
                std::size_t last, std::vector<double>& light) const;

  /// @param isPicture  true: cull blocks that cannot affect the picture; false: keep the blocks for
  /// any camera
  void makeTables(const Scene& scene, const RenderOptions& options, bool isPicture);

  /// Extent of a solid's complete surface. After culling, the brick tables may hold only a part of
  /// it.
  struct Extent {
    std::size_t index;  // index in Scene::solids
    Imath::Box3d cells,
        blocks;  // boxes of the cells and of the blocks that the surface crosses, index space
  };
  std::vector<Extent> extents_;
  Counts counts_;
  std::vector<KernelSolid> solids_;  // sorted by voxel size and id
  /// Uses indices of solids_, and their number plus indices of operands_.
  CsgExpression csg_;
  MeshRays meshes_;
  MappedRays mapped_;
  std::optional<SegmentedPart> segmented_;
  std::vector<BezierPart> beziers_;
  std::vector<std::shared_ptr<const SharedTree>> trees_;  // of beziers_, for the camera
  std::size_t bezierSolid_ = 0;                           // Hit::solid of the first of beziers_
  std::vector<std::size_t> operands_;  // indices in beziers_ of those that the expression names
  Camera camera_;
  std::vector<QuadricPart> quadrics_;
  std::vector<TerrainPart> terrains_;
  std::optional<FieldTraversal> fields_;
  Imath::Box3d bounds_, tableBounds_;
  double near_ = 0, far_ = Camera::kNoDepth;  // visible depth range of the camera, world units
};

template <typename Place>
void KernelScene::answerOperand(CsgTraversal& walk, std::size_t number,
                                const std::vector<std::vector<BezierRoot>>& crossings,
                                PixelTraversal::Crossings* next, const Place& placeOf) {
  for (const CsgTraversal::Query& query : walk.queriesFor(number)) {
    const std::vector<BezierRoot>& roots = crossings[query.ray];
    const auto passing = static_cast<std::size_t>(query.passing);
    if (passing >= roots.size()) {
      walk.answerNone(number, query);
      continue;
    }
    const BezierRoot& root = roots[passing];
    const double place = placeOf(root);
    if (next) {
      next->depth[query.ray] = place;
      next->roots[query.ray] = root;
    }
    walk.answer(number, query, place, root.isEntry);
  }
}

}  // namespace render
