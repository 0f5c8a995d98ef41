#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <functional>

/// Numerical Hamiltonians of φ_t + F|∇φ| = 0 from the one-sided slopes of φ.
namespace levelset::flow {

/// One-sided slopes of φ on the three axes: `lower` from the side of lower coordinates.
struct OneSidedSlopes {
  Imath::V3d lower, upper;
};

/// Returns |∇φ| by Godunov's scheme for a speed of the sign of `speed` [Rouy92, Osher91].
[[nodiscard]] double godunovSlope(const OneSidedSlopes& slopes, double speed);

/// A Hamiltonian H(∇φ) = F(∇φ / |∇φ|) |∇φ|.
using Hamiltonian = std::function<double(const Imath::V3d& gradient)>;

/// Value of a numerical Hamiltonian, and the speeds |∂H/∂φ_x|, … that limit the time step.
struct NumericalHamiltonian {
  double value = 0;
  Imath::V3d speeds = Imath::V3d(0);
};

/// Computes the numerical Hamiltonian of a speed that depends on the normal. On each axis it takes
/// the upwind slope if the characteristics have one direction at both slopes. Otherwise it takes
/// the mean slope and the local Lax-Friedrichs dissipation [Osher91].
[[nodiscard]] NumericalHamiltonian upwindHamiltonian(const OneSidedSlopes& slopes,
                                                     const Hamiltonian& hamiltonian);

}  // namespace levelset::flow
