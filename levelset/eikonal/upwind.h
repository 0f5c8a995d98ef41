#pragma once

// Internal header of levelset: public headers must not include it.

#include <algorithm>
#include <cmath>
#include <limits>

namespace levelset::eikonal {

/// Time of a grid point that no front has reached. Also the slowness where the front cannot pass.
inline constexpr float kFar = 1e30f;

/// Contribution of one axis to |∇T|² at a grid point with the unknown time u: weight · (u − value)²
/// is the squared derivative. T₁ and T₂ are the times of the next two grid points on the upwind
/// side. First order: value T₁, weight 1. Second order: value (4 T₁ − T₂) / 3, weight 9/4.
struct UpwindTerm {
  double value = 0;
  double weight = 1;
};

/// Upwind contributions, at most one for each axis.
struct UpwindTerms {
  UpwindTerm term[3];
  int count = 0;
  double latest = -std::numeric_limits<double>::max();  ///< latest T₁ (UpwindTerm) of all axes
  bool hasFirst = false, hasSecond = false;  ///< terms of first or second order are present
  double known = 0;  ///< sum of the known squared derivatives along axes without a term

  /// Adds a first-order term.
  /// @param near  time T₁ of the upwind neighbour
  /// @param missed  known error of the difference, see StraightTime::missed(); 0: no correction
  void addFirst(double near, double missed = 0) {
    add(near - missed, 1, near);
    hasFirst = true;
  }
  void addSecond(double near, double beyond, double missed = 0) {
    add((4 * near - beyond - 2 * missed) / 3, 2.25, near);
    hasSecond = true;
  }

 private:
  void add(double value, double weight, double near) {
    // Keeps the terms sorted by value: solveUpwind() drops the latest ones first.
    int i = count++;
    for (; i > 0 && term[i - 1].value > value; --i) term[i] = term[i - 1];
    term[i] = {value, weight};
    latest = std::max(latest, near);
  }
};

/// Solves Σ weight (u − value)² = slowness² − terms.known for the arrival time u, with the slowness
/// in time per voxel. Leaves out axes whose values are later than the time from the earlier axes
/// [Sethian99, Zhao05].
[[nodiscard]] inline double solveUpwind(const UpwindTerms& terms, double slowness) {
  const double base = terms.term[0].value,
               square = std::max(0.0, slowness * slowness - terms.known);
  // An axis counts if its value is earlier than the time from the axes with earlier values alone.
  // Then the sum of weight (u − value)² over these axes, with u at its value, is below slowness².
  // The sum rises from value to value, so the search runs from the last axis.
  int count = terms.count;
  for (; count > 1; --count) {
    double sum = 0;
    for (int i = 0; i < count - 1; ++i) {
      const double d = terms.term[count - 1].value - terms.term[i].value;
      sum += terms.term[i].weight * d * d;
    }
    if (sum < square) break;
  }
  if (count == 1) return base + std::sqrt(square / terms.term[0].weight);
  double a = terms.term[0].weight, b = 0, c = -square;
  for (int i = 1; i < count; ++i) {
    const double v = terms.term[i].value - base, w = terms.term[i].weight;
    a += w;
    b += w * v;
    c += w * v * v;
  }
  return base + (b + std::sqrt(std::max(0.0, b * b - a * c))) / a;
}

}  // namespace levelset::eikonal
