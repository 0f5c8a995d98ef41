#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <vector>

namespace mapping {

/// Keeps particles that travel from running into each other: small spheres about them, and the time
/// at which two first touch on their straight ways of one step, so that none passes through another
/// however long the step is [Brodersen07 §8.2].
class TravelGuard {
 public:
  /// @param diameter  of the spheres, world units; particles that begin closer than half of it are
  ///        taken for one
  TravelGuard(double diameter, std::size_t particles) : diameter_(diameter), isSlowed_(particles) {}

  /// Takes from the moves of those that would touch what would bring them closer from there on:
  /// they go on side by side. Where that is not enough, a crowd moves as one.
  void limit(std::span<const Imath::V3d> places, std::span<Imath::V3d> moves);

  /// Was its move ever changed?
  [[nodiscard]] const std::vector<char>& slowed() const { return isSlowed_; }

 private:
  double diameter_;
  std::vector<char> isSlowed_;
};

}  // namespace mapping
