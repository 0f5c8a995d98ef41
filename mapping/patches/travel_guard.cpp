#include "mapping/patches/travel_guard.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "levelset/geometry/disjoint_sets.h"

namespace mapping {
namespace {

using Imath::V3d;
using GuardCell = std::array<std::int64_t, 3>;

struct Entry {
  GuardCell cell;
  std::size_t particle;
  bool operator<(const Entry& other) const { return cell < other.cell; }
};

/// Share of a step after which the centres of two particles have come as close as `diameter`; 1 if
/// they stay further apart or do not approach. `apart` is their offset, `relative` its change over
/// the step.
double contact(const V3d& apart, const V3d& relative, double diameter) {
  const double approach = apart.dot(relative);
  if (approach >= 0) return 1;
  // Particles that start this close are one particle stored twice, for example where the first and
  // last column of a grid coincide.
  if (apart.length2() < 0.25 * diameter * diameter) return 1;
  const double over = apart.length2() - diameter * diameter;
  if (over <= 0) return 0;
  const double speed = relative.length2();
  const double root = approach * approach - speed * over;
  if (root < 0) return 1;
  return std::min(1.0, over / (std::sqrt(root) - approach));
}

/// Calls meet(i, j) for all pairs of particles that may touch within the step, in a fixed order.
template <typename Meet>
void forEachNear(std::span<const V3d> positions, std::span<const V3d> moves, double diameter,
                 const Meet& meet) {
  // Motion that all particles share does not change their distances.
  V3d mean(0);
  for (const V3d& move : moves) mean += move / static_cast<double>(moves.size());
  double farthest = 0;
  for (const V3d& move : moves) farthest = std::max(farthest, (move - mean).length());
  const double edge = diameter + 2 * farthest;
  std::vector<Entry> entries(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (std::size_t a = 0; a < 3; ++a)
      entries[i].cell[a] =
          static_cast<std::int64_t>(std::floor(positions[i][static_cast<int>(a)] / edge));
    entries[i].particle = i;
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.particle < b.particle;
  });
  for (auto a = entries.begin(); a != entries.end(); ++a) {
    for (auto b = a + 1; b != entries.end() && b->cell == a->cell; ++b)
      meet(a->particle, b->particle);
    // The 13 of the 26 neighbouring cells that follow this cell in the order, so that each pair of
    // cells is visited once.
    for (int n = 14; n < 27; ++n) {
      const GuardCell cell = {a->cell[0] + n / 9 - 1, a->cell[1] + n / 3 % 3 - 1,
                              a->cell[2] + n % 3 - 1};
      for (auto b = std::lower_bound(a, entries.end(), Entry{cell, 0});
           b != entries.end() && b->cell == cell; ++b)
        meet(a->particle, b->particle);
    }
  }
}

/// Replaces the moves of the particles of each set by their mean.
void moveTogether(levelset::DisjointSets& sets, std::span<V3d> moves) {
  struct Sum {
    V3d moves = V3d(0);
    double count = 0;
  };
  std::vector<Sum> sums(moves.size());
  for (std::uint32_t i = 0; i < moves.size(); ++i) {
    Sum& sum = sums[sets.find(i)];
    sum.moves += moves[i];
    ++sum.count;
  }
  for (std::uint32_t i = 0; i < moves.size(); ++i)
    if (const Sum& sum = sums[sets.find(i)]; sum.count > 1) moves[i] = sum.moves / sum.count;
}

}  // namespace

void TravelGuard::limit(std::span<const V3d> positions, std::span<V3d> moves) {
  if (!(diameter_ > 0)) return;
  // After contact two particles move side by side: the approaching component is removed from both,
  // averaged over all contacts of a particle. This may push them into other particles, so it is
  // repeated for kRounds rounds. Particles that still touch are joined into sets that move as one
  // body. Each further round joins at least two sets, so the loop ends.
  constexpr int kRounds = 12;
  std::vector<V3d> corrections(positions.size());
  std::vector<double> contacts(positions.size());
  levelset::DisjointSets crowds(positions.size());
  for (int round = 0;; ++round) {
    std::fill(corrections.begin(), corrections.end(), V3d(0));
    std::fill(contacts.begin(), contacts.end(), 0);
    bool isFree = true;
    forEachNear(positions, moves, diameter_, [&](std::size_t i, std::size_t j) {
      const V3d apart = positions[j] - positions[i], relative = moves[j] - moves[i];
      const double t = contact(apart, relative, diameter_);
      if (t == 1) return;
      isFree = false;
      isSlowed_[i] = isSlowed_[j] = 1;
      if (round >= kRounds) {
        crowds.join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
        return;
      }
      const V3d normal = (apart + relative * t).normalized();
      const V3d back = normal * (0.5 * (1 - t) * relative.dot(normal));
      corrections[i] += back;
      corrections[j] -= back;
      ++contacts[i];
      ++contacts[j];
    });
    if (isFree) return;
    if (round >= kRounds) {
      moveTogether(crowds, moves);
    } else {
      for (std::size_t i = 0; i < moves.size(); ++i)
        if (contacts[i] > 0) moves[i] += corrections[i] / contacts[i];
    }
  }
}

}  // namespace mapping
