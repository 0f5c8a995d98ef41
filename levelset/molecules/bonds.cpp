#include "levelset/molecules/bonds.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "levelset/error.h"
#include "levelset/progress_gate.h"

namespace levelset {
namespace {

using Imath::V3d;

constexpr double kLeastBond = 0.4;       // Å
constexpr double kBondTolerance = 0.45;  // Å, beyond the sum of the covalent radii
// More atoms than this within a few ångström are no molecule. The search would be slow.
constexpr std::size_t kMostNeighbours = 20'000;
constexpr std::size_t kBlock = 4096;  // atoms of a task
constexpr std::array kIons = {2, 3, 10, 11, 18, 19, 20, 37, 38, 55, 56};

/// Bond radius of an atom, Å; negative for elements that have no bond by distance.
double bondRadius(int element) {
  if (std::find(kIons.begin(), kIons.end(), element) != kIons.end()) return -1;
  return covalentRadius(element);
}

/// Atoms by the cells of a grid, in a table of hash values.
class AtomGrid {
 public:
  using Cell = std::array<std::int32_t, 3>;

  AtomGrid(const std::vector<Atom>& atoms, double cell)
      : cell_(cell), mask_(std::bit_ceil(atoms.size() + 1) - 1), first_(mask_ + 2, 0) {
    cells_.reserve(atoms.size());
    for (const Atom& atom : atoms) cells_.push_back(cellOf(atom.position));
    for (const Cell& c : cells_) ++first_[slot(c) + 1];
    for (std::size_t n = 1; n < first_.size(); ++n) first_[n] += first_[n - 1];
    items_.resize(atoms.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t n = 0; n < atoms.size(); ++n) items_[next[slot(cells_[n])]++] = n;
  }

  /// Calls back with each atom in the cells around that of an atom, and with the atom itself.
  template <class Callback>
  void near(std::uint32_t atom, const Callback& callback) const {
    const Cell at = cells_[atom];
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j)
        for (int k = -1; k <= 1; ++k) {
          const Cell cell{at[0] + i, at[1] + j, at[2] + k};
          const std::size_t s = slot(cell);
          for (std::uint32_t n = first_[s]; n < first_[s + 1]; ++n)
            if (cells_[items_[n]] == cell) callback(items_[n]);
        }
  }

 private:
  [[nodiscard]] Cell cellOf(const V3d& p) const {
    Cell cell;
    for (int c = 0; c < 3; ++c)
      cell[static_cast<std::size_t>(c)] =
          static_cast<std::int32_t>(std::clamp(std::floor(p[c] / cell_), -2e9, 2e9));
    return cell;
  }
  [[nodiscard]] std::size_t slot(const Cell& cell) const {
    std::uint64_t mixed = 0;
    for (const std::int32_t c : cell) {
      mixed = (mixed + static_cast<std::uint32_t>(c)) * 0x9e3779b97f4a7c15ULL;
      mixed ^= mixed >> 29;
    }
    return mixed & mask_;
  }

  double cell_;
  std::size_t mask_;
  std::vector<Cell> cells_;  ///< cells of the atoms
  std::vector<std::uint32_t> first_, items_;
};

struct NearPair {
  Bond bond;
  double distance = 0;
};

/// Pairs of atoms that are near enough for a bond.
std::vector<NearPair> nearPairs(const std::vector<Atom>& atoms, const BondOptions& options) {
  std::vector<double> radii;
  double largest = 0;
  radii.reserve(atoms.size());
  for (const Atom& atom : atoms) {
    const V3d& p = atom.position;
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      throw InvalidInput("an atom has no finite position; repair the molecule");
    radii.push_back(bondRadius(atom.element));
    largest = std::max(largest, radii.back());
  }
  const AtomGrid grid(atoms, 2 * largest + kBondTolerance + 1e-9);
  std::vector<std::vector<NearPair>> blocks((atoms.size() + kBlock - 1) / kBlock);
  ProgressGate gate(options.progress, blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t block) {
    const std::size_t end = std::min(atoms.size(), (block + 1) * kBlock);
    for (std::size_t n = block * kBlock; n < end; ++n) {
      if (radii[n] < 0) continue;
      const auto begin = static_cast<std::ptrdiff_t>(blocks[block].size());
      std::size_t count = 0;
      grid.near(static_cast<std::uint32_t>(n), [&](std::uint32_t other) {
        ++count;
        if (other <= n || radii[other] < 0) return;
        const Atom &a = atoms[n], &b = atoms[other];
        if (a.alternate && b.alternate && a.alternate != b.alternate) return;
        const double distance = (a.position - b.position).length();
        if (distance < kLeastBond || distance > radii[n] + radii[other] + kBondTolerance) return;
        blocks[block].push_back({{static_cast<std::uint32_t>(n), other}, distance});
      });
      if (count > kMostNeighbours)
        throw InvalidInput(fmt::format(
            "over {} atoms lie within a few ångström of {:.6g},{:.6g},{:.6g}, so bonds have no "
            "meaning; check that the coordinates are in ångström",
            kMostNeighbours, atoms[n].position.x, atoms[n].position.y, atoms[n].position.z));
      std::sort(blocks[block].begin() + begin, blocks[block].end(),
                [](const NearPair& a, const NearPair& b) { return a.bond < b.bond; });
    }
    gate.advance(1);
  });
  std::vector<NearPair> pairs;
  for (auto& block : blocks) {
    pairs.insert(pairs.end(), block.begin(), block.end());
    block = {};
  }
  return pairs;
}

/// Removes all bonds by distance of a hydrogen atom but the shortest one, and that as well if the
/// file gives a bond.
void limitHydrogens(const Molecule& molecule, std::vector<NearPair>& pairs) {
  const auto isHydrogen = [&](std::uint32_t atom) { return molecule.atoms[atom].element == 1; };
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::vector<std::uint32_t> nearest(molecule.atoms.size(), kNone);  // index of a pair
  for (std::uint32_t n = 0; n < pairs.size(); ++n)
    for (const std::uint32_t atom : {pairs[n].bond.first, pairs[n].bond.second})
      if (isHydrogen(atom) &&
          (nearest[atom] == kNone || pairs[n].distance < pairs[nearest[atom]].distance))
        nearest[atom] = n;
  for (const Bond& bond : molecule.bonds)
    for (const std::uint32_t atom : {bond.first, bond.second}) nearest[atom] = kNone;
  std::size_t kept = 0;
  for (std::uint32_t n = 0; n < pairs.size(); ++n) {
    const auto [first, second] = pairs[n].bond;
    if ((isHydrogen(first) && nearest[first] != n) || (isHydrogen(second) && nearest[second] != n))
      continue;
    pairs[kept++] = pairs[n];
  }
  pairs.resize(kept);
}

}  // namespace

std::vector<Bond> moleculeBonds(const Molecule& molecule, const BondOptions& options) {
  if (!options.isByDistance) return molecule.bonds;
  std::vector<NearPair> pairs = nearPairs(molecule.atoms, options);
  limitHydrogens(molecule, pairs);
  std::vector<Bond> found, bonds;
  found.reserve(pairs.size());
  for (const NearPair& pair : pairs) found.push_back(pair.bond);
  bonds.reserve(found.size() + molecule.bonds.size());
  std::set_union(found.begin(), found.end(), molecule.bonds.begin(), molecule.bonds.end(),
                 std::back_inserter(bonds));
  return bonds;
}

}  // namespace levelset
