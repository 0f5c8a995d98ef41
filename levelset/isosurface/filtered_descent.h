#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <optional>

#include "levelset/isosurface/filtered_surface.h"

namespace levelset {

/// Search for a closest point of the zero set of one function, inside the box of the volume. All
/// iterates lie on the surface, and each is nearer than the one before. Coordinates at which the
/// surface leaves the box are fixed, and released where that brings the point nearer.
class FilteredSurface::Descent {
 public:
  Descent(const FilteredSurface& surface, int function, const Vec3d& target)
      : s_(surface),
        function_(function),
        target_(target),
        hasCreases_(factsOf(surface.volume_.filter()).continuity < 1) {}

  /// @param known  closest point of an earlier search, in which this one may end early; or null
  /// @return empty if the search does not reach the surface or ends at `known`
  std::optional<Foot> run(const Vec3d& start, const Foot* known);

 private:
  // Steps of Newton's method: tangential, to the surface, and halvings of a step.
  static constexpr int kMostSteps = 30, kMostReturns = 8, kMostHalvings = 8, kMostReleases = 4;
  static constexpr double kMostStep = 0.75;    // cells
  static constexpr double kConverged = 1e-6;   // voxels; the distance is off by its square
  static constexpr double kOnSurface = 1e-10;  // voxels
  static constexpr double kSamePoint = 0.05;   // voxels
  static constexpr double kAtBorder = 1e-11;   // cells; below it, a step ends by rounding

  struct State {
    Vec3d x;
    std::array<bool, 3> fixed{};
    double f = 0;
    Vec3d g;
    openvdb::Mat3d h;
  };

  void evaluate(State& at) const;
  [[nodiscard]] bool returnToSurface(State& at) const;
  void move(State& at, const Vec3d& step) const;
  [[nodiscard]] Vec3d weighted(const State& at) const {  // metric times the way from the target
    return s_.metric_ * (at.x - target_);
  }
  [[nodiscard]] double squared(const State& at) const {
    const Vec3d d = at.x - target_;
    return d.dot(s_.metric_ * d);
  }
  /// Solves [A g; gᵀ 0] [d; μ] = [−r; −f] on the free coordinates.
  [[nodiscard]] bool solve(const State& at, const openvdb::Mat3d& a, const Vec3d& r, double f,
                           Vec3d& d, double& multiplier) const;
  [[nodiscard]] bool tangentStep(const State& at, Vec3d& step, double& multiplier) const;
  /// Goes to the first nearer point of the surface among those of the step, halved repeatedly.
  /// @param beyond  becomes the gradient of the last point that was tried
  [[nodiscard]] bool advance(State& at, Vec3d step, double& best, Vec3d& beyond) const;
  [[nodiscard]] bool creaseStep(const State& at, const Vec3d& beyond, Vec3d& step) const;
  [[nodiscard]] bool release(State& at, double multiplier) const;
  /// Fixes coordinates on the border of which the step leads outside. @return true if there are any
  [[nodiscard]] bool fixOutward(State& at, const Vec3d& step) const;

  const FilteredSurface& s_;
  int function_;
  Vec3d target_;
  bool hasCreases_;  ///< the gradient jumps
};

}  // namespace levelset
