#pragma once

// Private to the ray casting of quadrics: their numbers in memory, and trees of boxes.

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/quadrics/quadric.h"
#include "render/quadrics/quadric_kernel.h"

namespace render {

/// Number of primitives that are tested together.
inline constexpr std::size_t kQuadricLanes = 8;

/// Node of a tree with eight children. Lower and upper faces of their boxes along x, y and z; an
/// absent child has an empty box.
struct alignas(32) QuadricNode {
  static constexpr std::uint32_t kLeaf = 0x80000000U;
  float planes[6][kQuadricLanes];
  /// Number of a node, or of a block of primitives with kLeaf.
  std::uint32_t child[kQuadricLanes];
};

/// Eight spheres; the numbers of an empty place are NaN.
struct alignas(32) BallBlock {
  float x[kQuadricLanes], y[kQuadricLanes], z[kQuadricLanes], radius[kQuadricLanes];
};

/// Eight cylinders; the numbers of an empty place are NaN.
struct alignas(32) StickBlock {
  float a[3][kQuadricLanes], b[3][kQuadricLanes], radius[kQuadricLanes];
};

/// Numbers of a general quadric, relative to the origin of the tables.
struct StoredQuadric {
  float position[3] = {}, axes[9] = {};
  double inverse[9] = {};  ///< rows of the inverse of the matrix whose columns are the axes
  float low = -1, high = 1;
  std::uint8_t kind = 0, isCapped = 0;
};

/// Positions are stored in single precision, relative to the middle of all quadrics. The
/// intersections with the stored numbers are exact to the rounding of double precision.
///
/// A slot is the place of a primitive: those of the blocks of spheres, of the blocks of cylinders,
/// and of the general quadrics follow each other. Some slots of blocks are empty.
struct QuadricTables {
  Imath::V3d origin{0};
  double reach = 0;      ///< bound on the distance of the primitives from the origin
  double blockSize = 0;  ///< mean length of the edges of the boxes around blocks
  std::vector<BallBlock> balls;
  std::vector<StickBlock> sticks;
  std::vector<StoredQuadric> quadrics;
  std::vector<std::uint32_t> colours;  ///< by slot
  std::array<std::vector<QuadricNode>, 3> trees;
  std::size_t count = 0;  ///< without the empty slots

  [[nodiscard]] std::size_t firstStick() const { return kQuadricLanes * balls.size(); }
  [[nodiscard]] std::size_t firstQuadric() const {
    return firstStick() + kQuadricLanes * sticks.size();
  }
  [[nodiscard]] std::size_t slotCount() const { return firstQuadric() + quadrics.size(); }
  [[nodiscard]] std::size_t bytes() const;
  /// Rounding error of positions in single precision, by which tests in single precision enlarge
  /// the primitives.
  [[nodiscard]] double pad() const { return 2e-6 * reach; }

  /// First intersection of a ray with the sphere, cylinder or general quadric of a slot.
  /// @tparam kind  0, 1 or 2
  template <int kind>
  [[nodiscard]] QuadricKernel::QuadricRoot rootOf(std::size_t slot,
                                                  const QuadricKernel::QuadricRay& ray) const;
  /// First intersection of a ray with the primitive of a slot.
  [[nodiscard]] QuadricKernel::QuadricRoot rootIn(std::size_t slot,
                                                  const QuadricKernel::QuadricRay& ray) const;
  /// Outward unit normal. @param at  position relative to the origin
  [[nodiscard]] Imath::V3d normalAt(std::size_t slot, int face, const Imath::V3d& at) const;
};

[[nodiscard]] QuadricKernel::QuadricShape shapeOf(const StoredQuadric& quadric);

template <int kind>
QuadricKernel::QuadricRoot QuadricTables::rootOf(std::size_t slot,
                                                 const QuadricKernel::QuadricRay& ray) const {
  QuadricKernel kernel;
  const std::size_t lane = slot % kQuadricLanes;
  const auto number = [](float x) { return static_cast<double>(x); };
  if constexpr (kind == 0) {
    const BallBlock& block = balls[slot / kQuadricLanes];
    return {kernel.ballRoot(ray, number(block.x[lane]), number(block.y[lane]),
                            number(block.z[lane]), number(block.radius[lane])),
            QuadricKernel::kSide};
  } else if constexpr (kind == 1) {
    const StickBlock& block = sticks[(slot - firstStick()) / kQuadricLanes];
    return kernel.stickRoot(ray, number(block.a[0][lane]), number(block.a[1][lane]),
                            number(block.a[2][lane]), number(block.b[0][lane]),
                            number(block.b[1][lane]), number(block.b[2][lane]),
                            number(block.radius[lane]));
  } else {
    return kernel.quadricRoot(ray, shapeOf(quadrics[slot - firstQuadric()]));
  }
}

/// Stores a checked model and builds the trees. The result does not depend on the number of
/// threads.
/// @throws levelset::ResourceLimit if that needs more than `maxBytes`
[[nodiscard]] QuadricTables makeQuadricTables(const QuadricModel& model, std::size_t maxBytes);

/// The primitive of a slot in world space. Its position is exact in double precision up to the
/// rounding of the sum with the origin.
[[nodiscard]] Ball ballIn(const QuadricTables& tables, std::size_t slot);
[[nodiscard]] Stick stickIn(const QuadricTables& tables, std::size_t slot);
[[nodiscard]] Quadric quadricIn(const QuadricTables& tables, std::size_t slot);

/// Calls use(primitive) with each primitive of the slots from begin to end: a Ball, a Stick or a
/// Quadric in world space.
template <typename Use>
void forEachStored(const QuadricTables& tables, std::size_t begin, std::size_t end,
                   const Use& use) {
  for (std::size_t slot = begin; slot < end; ++slot) {
    if (slot < tables.firstStick()) {
      if (const Ball ball = ballIn(tables, slot); ball.radius > 0) use(ball);
    } else if (slot < tables.firstQuadric()) {
      if (const Stick stick = stickIn(tables, slot); stick.radius > 0) use(stick);
    } else {
      use(quadricIn(tables, slot));
    }
  }
}

}  // namespace render
