#include "mapping/untangle/untangle.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/error.h"
#include "mapping/layers/trilinear_volume.h"
#include "mapping/surface/surface_field.h"
#include "mapping/untangle/prism_cells.h"
#include "mapping/untangle/prism_elements.h"
#include "mapping/untangle/prism_solver.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;

void checkInput(const NarrowBand& base, const Patch& patch, const UntangleOptions& options) {
  if (patch.layers.size() < 2 || !(patch.height > 0)) {
    throw InvalidInput("the patch has no layers of particles; build it with `patch`");
  }
  if (!std::isfinite(options.embedDepth)) {
    throw levelset::UsageError(
        fmt::format("the embedding depth is {}; give a length with --embed", options.embedDepth));
  }
  if (options.proportions) {
    const V3d& p = *options.proportions;
    const double volume = p.x * p.y * p.z;
    if (!(p.x > 0 && p.y > 0 && p.z > 0 && volume > 0) || !std::isfinite(volume)) {
      throw levelset::UsageError(fmt::format(
          "the proportions are {} × {} × {}; give three positive lengths", p.x, p.y, p.z));
    }
  }
  for (const ParticleLayer& layer : patch.layers)
    for (const V3d& p : layer.positions)
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
        throw InvalidInput(fmt::format(
            "the particle at ({}, {}, {}) is not finite; build the patch again", p.x, p.y, p.z));
      }
  const SurfaceField field(base);
  for (const V3d& p : patch.layers.front().positions) {
    const double distance = std::abs(field.value(p)) / base.voxelSize();
    if (!(distance <= 1)) {
      throw InvalidInput(
          fmt::format("the patch does not lie on the base: at ({:.6g}, {:.6g}, {:.6g}) the "
                      "surface is at least {:.3g} voxels away; build the patch on this base",
                      p.x, p.y, p.z, distance));
    }
  }
  levelset::requireMemory(PrismElements::estimateBytes(patch), options.maxMemory);
}

/// Constraints of all particles. Particles above the layer at w = 0 are free. Particles of that
/// layer slide; those on its sides are fixed unless `freeSides`.
std::vector<ParticleHold> holdsOf(const Patch& patch, bool freeSides) {
  std::vector<ParticleHold> holds;
  for (std::size_t k = 0; k < patch.layers.size(); ++k) {
    const ParticleLayer& layer = patch.layers[k];
    for (std::size_t j = 0; j < layer.rows; ++j)
      for (std::size_t i = 0; i < layer.columns; ++i) {
        const bool isSide = i == 0 || j == 0 || i + 1 == layer.columns || j + 1 == layer.rows;
        holds.push_back(k > 0                  ? ParticleHold::Free
                        : isSide && !freeSides ? ParticleHold::Fixed
                                               : ParticleHold::Slides);
      }
  }
  return holds;
}

/// Moves the rim so that the displacement continues linearly beyond the border: 2 × the border
/// particle's displacement minus that of the particle inside it.
void moveRim(const ParticleLayer& old, ParticleLayer& layer) {
  const auto columns = static_cast<int>(layer.columns), rows = static_cast<int>(layer.rows);
  const auto moved = [&](int i, int j) { return layer.beyond(i, j) - old.beyond(i, j); };
  const auto follow = [&](int i, int j) {
    const int a = std::clamp(i, 0, columns - 1), b = std::clamp(j, 0, rows - 1);
    layer.rim[layer.rimIndex(i, j)] += moved(a, b) * 2.0 - moved(2 * a - i, 2 * b - j);
  };
  for (int i = -1; i <= columns; ++i)
    for (const int j : {-1, rows}) follow(i, j);
  for (int j = 0; j < rows; ++j)
    for (const int i : {-1, columns}) follow(i, j);
}

Patch withPositions(const NarrowBand& base, const Patch& patch, const std::vector<V3d>& positions) {
  Patch result = patch;
  auto from = positions.begin();
  const SurfaceField field(base);
  for (std::size_t k = 0; k < result.layers.size(); ++k) {
    ParticleLayer& layer = result.layers[k];
    const auto to = from + static_cast<std::ptrdiff_t>(layer.positions.size());
    layer.positions.assign(from, to);
    from = to;
    if (!layer.hasRim()) continue;
    moveRim(patch.layers[k], layer);
    if (k > 0) continue;
    for (std::size_t n = 0; n < layer.rim.size(); ++n) {
      V3d p = layer.rim[n];
      if (p != patch.layers[k].rim[n] && field.project(p, 0)) layer.rim[n] = p;
    }
  }
  const std::size_t columns = result.layers.front().columns, rows = result.layers.front().rows;
  const ParticleLayer& surface = result.layers.front();
  result.corners = {surface.at(0, 0), surface.at(columns - 1, 0), surface.at(columns - 1, rows - 1),
                    surface.at(0, rows - 1)};
  result.spacing = meanSpacing(result);
  return result;
}

double farthest(const std::vector<V3d>& a, const std::vector<V3d>& b) {
  double most = 0;
  for (std::size_t n = 0; n < a.size(); ++n) most = std::max(most, (a[n] - b[n]).length());
  return most;
}

std::array<V3d, 8> cornersOfCell(const PrismCell& cell, const std::vector<V3d>& positions) {
  std::array<V3d, 8> corners;
  for (std::size_t n = 0; n < 8; ++n) corners[n] = positionOf(cell.corners[n], positions);
  return corners;
}

/// Number of elements of a cell; the elements are stored cell by cell.
constexpr std::size_t kElementsPerCell = 14;

FoldCount foldsAt(const Patch& patch, const PrismElements& elements, double embedDepth,
                  const std::vector<V3d>& positions) {
  const PrismCells cells(patch, embedDepth);
  std::vector<char> folds(cells.size());
  std::vector<double> least(cells.size());
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t n) {
    least[n] = std::numeric_limits<double>::infinity();
    for (std::size_t e = n * kElementsPerCell; e < (n + 1) * kElementsPerCell; ++e)
      least[n] = std::min(least[n], determinantOf(elements.slopes(e, positions)));
    folds[n] = !(least[n] > 0);
    if (folds[n]) return;
    const VolumeSign sign =
        signOfTrilinear(cornersOfCell(cells.at(n), positions), 0, patch.mirrored ? -1 : 1);
    folds[n] = sign.folds || sign.undecided > 0;
  });
  FoldCount result;
  result.cells = cells.size();
  result.leastJacobian = *std::min_element(least.begin(), least.end());
  for (const char isFolded : folds) result.folded += isFolded ? 1 : 0;
  return result;
}

// Largest number of iterations that minimise the symmetric Dirichlet energy after all folds are
// removed.
constexpr std::size_t kSettling = 100;

/// Minimises the foldover energy with smaller and smaller ε until no element is inverted
/// [Garanzha21, §3]. Then continues with a small ε until no trilinear cell folds at points between
/// its elements either.
/// @return number of iterations
std::size_t removeFolds(PrismSolver& solver, const UntangleOptions& options,
                        const std::function<bool()>& isDone) {
  constexpr std::size_t kRound = 20;  // iterations for each value of ε
  constexpr double kSlowest = 0.2;  // least relative progress per round assumed in the update of ε
  constexpr int kMostStuck = 10;    // rounds without progress before the search ends
  double epsilon = 1, last = -std::numeric_limits<double>::infinity();
  std::size_t iterations = 0;
  int stuck = 0;
  while (iterations < options.mostIterations && stuck < kMostStuck) {
    levelset::report(options.progress,
                     static_cast<double>(iterations) / static_cast<double>(options.mostIterations));
    const auto density = [epsilon](const ElementSlopes& f) { return foldoverEnergy(f, epsilon); };
    const double energy = solver.energy(density);
    const std::size_t taken = solver.minimise(density, kRound);
    iterations += std::max<std::size_t>(taken, 1);
    const double least = solver.leastDeterminant();
    if (least > 0 && isDone()) break;
    const double sigma = std::max(kSlowest, 1 - solver.energy(density) / energy);
    const double chi = 0.5 * (least + std::hypot(epsilon, least));
    const double mu = (1 - sigma) * chi;
    constexpr double kLeastEpsilon = 1e-6;
    epsilon = least < mu ? 2 * std::sqrt(mu * (mu - least)) : kLeastEpsilon;
    epsilon = std::clamp(epsilon, kLeastEpsilon, 1e3);
    stuck = least > last + 0.01 * std::abs(last) ? 0 : stuck + 1;
    last = std::max(last, least);
  }
  return iterations;
}

/// Mean length of the sides along u at w = 0, the same along v, and the height of the patch, world
/// units.
V3d sideLengths(const Patch& patch) {
  const ParticleLayer& layer = patch.layers.front();
  double u = 0, v = 0;
  for (const std::size_t j : {std::size_t{0}, layer.rows - 1})
    for (std::size_t i = 1; i < layer.columns; ++i)
      u += 0.5 * (layer.at(i, j) - layer.at(i - 1, j)).length();
  for (const std::size_t i : {std::size_t{0}, layer.columns - 1})
    for (std::size_t j = 1; j < layer.rows; ++j)
      v += 0.5 * (layer.at(i, j) - layer.at(i, j - 1)).length();
  return {u, v, patch.height};
}

/// Symmetric Dirichlet energy of an element whose rest shape is `scale` times as large.
ElementEnergy scaledDirichlet(ElementSlopes slopes, double scale) {
  for (V3d& column : slopes) column /= scale;
  ElementEnergy energy = symmetricDirichlet(slopes);
  for (V3d& column : energy.stress) column /= scale;
  return energy;
}

/// Scale of the rest shape for which the symmetric Dirichlet energy is least. F is the matrix of an
/// element's slopes. |F|² is proportional to the inverse square of the scale, |F⁻¹|² to its square.
double bestRestScale(const PrismElements& elements, const std::vector<V3d>& positions) {
  double stretch = 0, squeeze = 0;
  for (std::size_t e = 0; e < elements.size(); ++e) {
    const ElementSlopes f = elements.slopes(e, positions);
    const double squares = f[0].length2() + f[1].length2() + f[2].length2();
    stretch += elements.weight(e) * squares;
    squeeze += elements.weight(e) * (symmetricDirichlet(f).value - squares);
  }
  return std::sqrt(std::sqrt(stretch / squeeze));
}

ElementDistortion distortionAt(const PrismElements& elements, const std::vector<V3d>& positions) {
  ElementDistortion result;
  const double scale = bestRestScale(elements, positions);
  std::vector<double> values(elements.size());
  for (std::size_t e = 0; e < values.size(); ++e) {
    values[e] = scaledDirichlet(elements.slopes(e, positions), scale).value;
    result.mean += elements.weight(e) * values[e];
  }
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  result.median = at(0.5);
  result.percent99 = at(0.99);
  result.most = values.back();
  return result;
}

}  // namespace

FoldCount countFolds(const Patch& patch, double embedDepth) {
  const PrismElements elements(patch, meanExtents(patch), embedDepth);
  return foldsAt(patch, elements, embedDepth, particlePositions(patch));
}

Untangling untangle(const NarrowBand& base, const Patch& patch, const UntangleOptions& options) {
  checkInput(base, patch, options);
  const PrismElements elements(patch, options.proportions.value_or(meanExtents(patch)),
                               options.embedDepth);
  const std::vector<V3d> start = particlePositions(patch);
  Untangling result;
  result.before = result.after = foldsAt(patch, elements, options.embedDepth, start);
  result.patch = patch;
  if (result.isUntangled()) return result;
  PrismSolver solver(base, elements, holdsOf(patch, options.freeSides), start);
  const auto isDone = [&] {
    return foldsAt(patch, elements, options.embedDepth, solver.positions()).folded == 0;
  };
  result.iterations = removeFolds(solver, options, isDone);
  std::vector<V3d> found = solver.positions();
  FoldCount after = foldsAt(patch, elements, options.embedDepth, found);
  if (after.folded == 0) {
    // Cells that barely avoid folding are too flat for an RBF map, which smooths by λ. So the
    // distortion is minimised too.
    result.iterations += solver.minimise(symmetricDirichlet, kSettling);
    const FoldCount settled = foldsAt(patch, elements, options.embedDepth, solver.positions());
    if (settled.folded == 0) after = settled, found = solver.positions();
  }
  if (after.folded >= result.before.folded) return result;
  result.after = after;
  result.farthestMove = farthest(found, start);
  result.patch = withPositions(base, patch, found);
  return result;
}

DistortionGain minimiseDistortion(const NarrowBand& base, const Patch& patch,
                                  const UntangleOptions& options) {
  checkInput(base, patch, options);
  const PrismElements elements(patch, options.proportions.value_or(sideLengths(patch)),
                               options.embedDepth);
  const std::vector<V3d> start = particlePositions(patch);
  const FoldCount folds = foldsAt(patch, elements, options.embedDepth, start);
  if (folds.folded > 0) {
    throw InvalidInput(fmt::format(
        "the patch folds in {} of {} cells of its particles; untangle it first (--untangle)",
        folds.folded, folds.cells));
  }
  DistortionGain result;
  result.before = distortionAt(elements, start);
  PrismSolver solver(base, elements, holdsOf(patch, options.freeSides), start);
  std::vector<V3d> found = start;
  constexpr std::size_t kRound = 20;
  while (result.iterations < options.mostIterations) {
    levelset::report(options.progress, static_cast<double>(result.iterations) /
                                           static_cast<double>(options.mostIterations));
    const std::size_t wanted = std::min(kRound, options.mostIterations - result.iterations);
    const double scale = bestRestScale(elements, found);
    const auto density = [scale](const ElementSlopes& f) { return scaledDirichlet(f, scale); };
    const double energy = solver.energy(density);
    const std::size_t taken = solver.minimise(density, wanted);
    result.iterations += taken;
    // The energy forbids folds at the corners of cells; folds between corners are very rare.
    if (foldsAt(patch, elements, options.embedDepth, solver.positions()).folded > 0) break;
    found = solver.positions();
    constexpr double kLeastGain = 1e-7;  // least relative decrease of the energy in a round
    if (energy - solver.energy(density) < kLeastGain * energy) break;
  }
  result.after = distortionAt(elements, found);
  result.farthestMove = farthest(found, start);
  result.patch = result.farthestMove > 0 ? withPositions(base, patch, found) : patch;
  return result;
}

}  // namespace mapping
