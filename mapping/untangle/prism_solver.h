#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/untangle/prism_elements.h"

namespace mapping {

/// Constraint on the motion of a particle.
enum class ParticleHold : char {
  Free,
  Slides,  ///< moves on the base's surface
  Fixed
};

/// Moves particles to minimise an energy summed over elements. The method is L-BFGS in the tangent
/// planes of the surface, preconditioned with the Laplacian of the elements [Nocedal06; Claici17].
/// After each step, sliding particles are projected onto the surface. A step is accepted only if
/// the energy decreases enough. The result has the same bits for any number of threads.
class PrismSolver {
 public:
  using Density = std::function<ElementEnergy(const ElementSlopes&)>;

  /// @param positions  positions of all particles; particles with ParticleHold::Slides lie on the
  ///         surface
  PrismSolver(const levelset::NarrowBand& base, const PrismElements& elements,
              std::vector<ParticleHold> holds, std::vector<Imath::V3d> positions);
  ~PrismSolver();

  /// Minimises the energy, starting from the current positions.
  /// @return number of iterations; fewer than `mostIterations` when the energy hardly decreases any
  ///         more
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
  /// Gradient of the energy, projected onto the directions in which particles may move.
  [[nodiscard]] Vectors gradientOf(const std::vector<ElementSlopes>& stress) const;
  void makeTangent(Vectors& vectors) const;
  void updateNormals();
  /// Computes the positions of all particles after a step. Returns false when a sliding particle
  /// cannot be projected onto the surface.
  bool moved(const Vectors& direction, double step, Vectors& result) const;
  [[nodiscard]] Vectors preconditioned(Vectors vectors) const;

  const levelset::NarrowBand& base_;
  const PrismElements& elements_;
  std::vector<ParticleHold> holds_;
  Vectors positions_, normals_;
  double spacing_ = 0;  ///< mean particle spacing in the rest shape, the unit for step lengths
  std::unique_ptr<Preconditioner> preconditioner_;
};

}  // namespace mapping
