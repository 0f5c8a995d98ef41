#pragma once

// Private to the ray casting of quadrics: the search on the processor.

#include <cstdint>
#include <optional>
#include <span>

#include "render/camera.h"
#include "render/quadrics/quadric_tables.h"

namespace render {

/// Nearest intersection; `slot` is kNoSlot if there is none.
struct NearestQuadric {
  static constexpr std::uint32_t kNoSlot = 0xffffffffU;
  double t = QuadricKernel::kNoRoot;
  std::uint32_t slot = kNoSlot;
  int face = QuadricKernel::kSide;
};

/// True if the processor has vectors of eight floats.
[[nodiscard]] bool hasWideVectors();

/// Finds the nearest intersection of a ray, or any if `any`. The bits of the nearest one do not
/// depend on `isWide`.
/// @param isWide  uses vectors of eight floats. @pre false, or hasWideVectors()
[[nodiscard]] NearestQuadric traceQuadrics(const QuadricTables& tables, const Camera::Ray& ray,
                                           bool any, bool isWide);

/// Largest number of rays that are searched together.
inline constexpr int kBeamRays = 16;

/// Finds the nearest intersections of up to kBeamRays rays, with the bits of traceQuadrics(). Rays
/// that are close to each other take less time.
/// @param nearest  receives an intersection for each ray
/// @return false if the rays were traced one by one
bool traceQuadricBeam(const QuadricTables& tables, std::span<const Camera::Ray> rays, bool isWide,
                      NearestQuadric* nearest);

/// The ray relative to the origin of the tables.
[[nodiscard]] QuadricKernel::QuadricRay relativeRay(const QuadricTables& tables,
                                                    const Camera::Ray& ray);

/// Distance at which a ray enters the sphere around all quadrics, at least its near end; nothing if
/// it misses the sphere.
[[nodiscard]] std::optional<double> startAt(const QuadricTables& tables,
                                            const QuadricKernel::QuadricRay& ray);

}  // namespace render
