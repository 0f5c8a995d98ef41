#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <vector>

namespace mapping {

/// Keeps moving particles from colliding. Each particle is a small sphere, and the guard computes
/// the time at which two spheres first touch on the straight paths of one step. So none passes
/// through another, however long the step is [Brodersen07 §8.2].
class TravelGuard {
 public:
  /// @param diameter  diameter of the spheres, world units; particles that start closer than half
  ///         of it count as one particle
  TravelGuard(double diameter, std::size_t particles) : diameter_(diameter), isSlowed_(particles) {}

  /// Limits the moves of one step. For particles that would touch, the components that bring them
  /// closer after the contact are removed, so that they move on side by side. If that does not
  /// suffice, the particles that touch each other move as one body.
  void limit(std::span<const Imath::V3d> positions, std::span<Imath::V3d> moves);

  /// True for particles whose move was ever changed.
  [[nodiscard]] const std::vector<char>& slowed() const { return isSlowed_; }

 private:
  double diameter_;
  std::vector<char> isSlowed_;
};

}  // namespace mapping
