#pragma once

// Private to the GPU renderer: ray casting of Bézier volumes by compute shaders.

#include <Imath/ImathVec.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "render/bezier/shared_tree.h"
#include "render/gpu/device/gl_context.h"

namespace render {

/// Work of calls of GpuBeziers::rootsOn().
struct GpuBezierCounts {
  std::size_t splits = 0;     ///< nodes that were split into eight
  std::size_t solutions = 0;  ///< pairs of a ray and a node that were tested by Newton's method
  std::size_t parts = 0;      ///< parts in which nodes were split, for want of memory
  /// Rays that the processor answered: those that gave up, those whose nodes did not fit, and all
  /// rays of volumes with a coordinate or an attribute of a magnitude below 1e-30 or above 1e40.
  std::size_t onProcessor = 0;
  std::size_t peakBytes = 0;  ///< memory of the device
};

/// The subdivision of shared trees in an OpenGL context, level by level [Liu14]. The processor
/// makes the shared nodes, and joins the roots. Roots have the bits of SharedTree::rootsOn(), if
/// the driver rounds sums, products and quotients of doubles as IEEE 754 requires, and errs by at
/// most one unit in the last place of square roots. An exception are rays that give up on the
/// processor only, as it visits nodes in another order.
class GpuBeziers {
 public:
  static constexpr std::size_t kMostBytes = std::size_t{256} << 20;

  /// @param context  must outlive this object
  /// @param mostBytes  limit of the memory of the device. Lists that are too long are processed in
  /// parts. The processor answers for rays whose nodes do not fit at all.
  explicit GpuBeziers(const GlContext& context, std::size_t mostBytes = kMostBytes);
  ~GpuBeziers();
  GpuBeziers(const GpuBeziers&) = delete;
  GpuBeziers& operator=(const GpuBeziers&) = delete;
  /// Frees all objects in the context. Runs in a job of GlContext::run().
  void release();

  /// Roots of rays through screen positions, as SharedTree::rootsOn().
  /// @throws levelset::ResourceLimit when the driver rejects the shaders, or lacks memory
  [[nodiscard]] SharedTree::Roots rootsOn(const SharedTree& tree,
                                          const std::vector<Imath::V2d>& screens,
                                          TreeCounts* counts = nullptr);
  /// Sums over the calls of rootsOn() that have ended.
  [[nodiscard]] const GpuBezierCounts& counts() const;

 private:
  class Device;
  std::unique_ptr<Device> device_;
};

}  // namespace render
