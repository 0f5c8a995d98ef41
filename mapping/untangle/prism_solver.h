#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/untangle/prism_elements.h"

namespace mapping {

/// What holds a particle.
enum class ParticleHold : char {
  Free,
  Slides,  ///< on the base's surface
  Fixed
};

/// Lets particles find the least of a sum over elements: L-BFGS on the surface's tangents,
/// preconditioned with the Laplacian of the elements [Nocedal06; Claici17], each step projected
/// onto the surface and taken only when the energy has fallen by enough. The same bits for any
/// number of threads.
class PrismSolver {
 public:
  using Density = std::function<ElementEnergy(const ElementSlopes&)>;

  /// @param positions  of all particles; those that slide are on the surface
  PrismSolver(const levelset::NarrowBand& base, const PrismElements& elements,
              std::vector<ParticleHold> holds, std::vector<Imath::V3d> positions);
  ~PrismSolver();

  /// @return iterations taken; fewer than asked where nothing is left to gain
  std::size_t minimise(const Density& density, std::size_t mostIterations);

  [[nodiscard]] const std::vector<Imath::V3d>& positions() const { return positions_; }
  [[nodiscard]] double energy(const Density& density) const;
  [[nodiscard]] double leastDeterminant() const;

 private:
  using Vectors = std::vector<Imath::V3d>;
  struct Preconditioner;
  struct Memory;

  double energyAt(const Density& density, const Vectors& positions,
                  std::vector<ElementSlopes>* stress) const;
  /// Derivatives along which particles may move.
  [[nodiscard]] Vectors gradientOf(const std::vector<ElementSlopes>& stress) const;
  void makeTangent(Vectors& vectors) const;
  void updateNormals();
  /// False where the surface cannot be followed.
  bool moved(const Vectors& direction, double step, Vectors& result) const;
  [[nodiscard]] Vectors preconditioned(Vectors vectors) const;

  const levelset::NarrowBand& base_;
  const PrismElements& elements_;
  std::vector<ParticleHold> holds_;
  Vectors positions_, normals_;
  double spacing_ = 0;  ///< of particles, for the length of steps
  std::unique_ptr<Preconditioner> preconditioner_;
};

}  // namespace mapping
