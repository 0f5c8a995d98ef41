#pragma once

#include <array>

namespace levelset::flow {

/// Spatial orders of upwindDerivative().
inline constexpr int kUpwindOrders[] = {1, 2, 3, 5};

/// Orders of an upwind scheme.
struct UpwindOrders {
  int space = 5;  ///< 1, 2, 3 or 5, see upwindDerivative()
  int time = 3;   ///< 1: Euler; 2 and 3: TVD Runge-Kutta [Shu88]
};

/// @throws UsageError for orders that do not exist
void requireOrders(const UpwindOrders& orders);

/// Derivative at a grid point from one-sided differences, per grid spacing.
/// @param values  values of the function: the grid point itself is values[3]; values[0 … 2] lie
///                behind it, where the flow comes from, and values[4] and values[5] ahead of it
/// @param order   1: the backward difference; 2 and 3: HJ-ENO, which adds the smaller of two higher
///                differences [Osher91]; 5: HJ-WENO [Jiang00]
/// @return the derivative in the direction from values[0] to values[5]
/// @pre `order` is one of kUpwindOrders
[[nodiscard]] double upwindDerivative(const std::array<double, 6>& values, int order);

}  // namespace levelset::flow
