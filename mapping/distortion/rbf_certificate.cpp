#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/rbf/rbf_taylor.h"
#include "mapping/distortion/distortion.h"
#include "mapping/distortion/fold_certificate.h"
#include "mapping/distortion/fold_tally.h"
#include "mapping/maps/cell_tree.h"
#include "mapping/maps/dual_basis.h"
#include "mapping/maps/layer_map.h"
#include "mapping/rbf/rbf_map.h"
#include "mapping/untangle/prism_cells.h"

namespace mapping {
namespace {

using Imath::Box3d;
using Imath::M33d;
using Imath::V3d;
using levelset::rbf::RbfCube;
using levelset::rbf::RbfCubes;
using levelset::rbf::RbfParticle;
using levelset::rbf::TaylorPolynomial;

// Largest error of the far particles' contribution to the map's slopes: kProofTolerance for a
// certificate, kSlopeTolerance for samples. A map that preserves lengths has slopes of 1.
constexpr double kProofTolerance = 1e-2;
constexpr double kSlopeTolerance = 1e-5;
// Added to the bounds on the map's slopes and values, for rounding errors.
constexpr double kProofRounding = 1e-9;
// Largest number of cubes tested within one cube of the size of a particle's cell. The second limit
// applies if the first leaves cubes undecided and no fold was found.
constexpr std::size_t kFewCubes = 80, kMostCubes = 800;
// Half edge length, in mean particle spacings, of cubes that are not halved further.
constexpr double kSmallestCube = 1.0 / 32;

V3d rowOf(const M33d& m, int k) {
  return {m[k][0], m[k][1], m[k][2]};
}

/// Second derivatives xx, yy, zz, xy, xz, yz of the map, each a vector with the components u, v and
/// w.
using Curvature = std::array<V3d, 6>;

/// Change of the map's slopes, due to the second derivatives `h`, from the middle of a cube to the
/// point at offset `s`. The columns are the derivatives along x, y and z.
std::array<V3d, 3> changeAt(const Curvature& h, const V3d& s) {
  return {h[0] * s.x + h[3] * s.y + h[4] * s.z, h[3] * s.x + h[1] * s.y + h[5] * s.z,
          h[4] * s.x + h[5] * s.y + h[2] * s.z};
}

/// Slopes, second derivatives and value of a smooth map in the middle of a cube, and bounds on the
/// change of its slopes.
struct CubeSlopes {
  M33d slopes;
  Curvature curvature{};
  V3d value{0};
  V3d rowStray{0};      ///< bound on the change of each row of the slopes
  double relative = 0;  ///< bound of |slopes⁻¹ (slopes at a point of the cube) − 1|
  double determinant = 0;
};

/// Approximation of the unit vector from a near particle to the points of a ball, and the bound on
/// its error.
struct KinkBound {
  /// Terms of the approximation. Curved: the vector's value and derivative in the middle of the
  /// ball. Straight: its value in the middle. Any: none, so it is zero.
  enum class Kind { Curved, Straight, Any } kind = Kind::Any;
  double error = 1;
};

/// @param ratio  radius of the ball divided by the distance of the ball's middle from the particle
KinkBound kinkBound(double ratio) {
  // The factor of ratioⁿ in the Taylor series of the unit vector is at most √((n + 1) / n). Without
  // value and derivative, the series begins with n = 2.
  constexpr double kCurved = 0.45, kStraight = 0.86, kSecond = 1.2247448713915890;
  if (ratio < kCurved) return {KinkBound::Kind::Curved, kSecond * ratio * ratio / (1 - ratio)};
  if (ratio < kStraight) return {KinkBound::Kind::Straight, 2 * std::sin(0.5 * std::asin(ratio))};
  return {};
}

V3d applyColumns(const std::array<V3d, 3>& columns, const V3d& x) {
  return columns[0] * x.x + columns[1] * x.y + columns[2] * x.z;
}

CubeSlopes slopesIn(const RbfCubes& cubes, const RbfCube& cube) {
  CubeSlopes result;
  const TaylorPolynomial& far = cube.far;
  result.value = far[0];
  for (int k = 0; k < 3; ++k)
    for (std::size_t axis = 0; axis < 3; ++axis)
      result.slopes[k][static_cast<int>(axis)] = far[1 + axis][k];
  // Terms 4 to 9 of the polynomial are xx, xy, xz, yy, yz, zz.
  result.curvature = {far[4] * 2.0, far[7] * 2.0, far[9] * 2.0, far[5], far[6], far[8]};
  const double radius = cube.radius();
  for (const std::uint32_t i : cube.near) {
    const RbfParticle& particle = cubes.particles()[i];
    const V3d offset = cube.center - particle.position;
    const double distance = offset.length();
    result.value += particle.weight * distance;
    if (!(distance > 0)) continue;
    const KinkBound bound = kinkBound(radius / distance);
    if (bound.kind == KinkBound::Kind::Any) continue;
    const V3d n = offset / distance;
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis) result.slopes[k][axis] += particle.weight[k] * n[axis];
    if (bound.kind != KinkBound::Kind::Curved) continue;
    const V3d weight = particle.weight / distance;
    result.curvature[0] += weight * (1 - n.x * n.x);
    result.curvature[1] += weight * (1 - n.y * n.y);
    result.curvature[2] += weight * (1 - n.z * n.z);
    result.curvature[3] -= weight * (n.x * n.y);
    result.curvature[4] -= weight * (n.x * n.z);
    result.curvature[5] -= weight * (n.y * n.z);
  }
  return result;
}

/// Bounds the change of the slopes in the cube: for each row, and relative to the slopes in the
/// middle of the cube. For the relative bound, each change is multiplied by the inverse of the
/// middle's slopes before its norm is taken.
void boundSlopes(const RbfCubes& cubes, const RbfCube& cube, CubeSlopes& at) {
  at.determinant = at.slopes.determinant();
  const std::array<V3d, 3> inverse =
      dualBasis(rowOf(at.slopes, 0), rowOf(at.slopes, 1), rowOf(at.slopes, 2));
  double norm = 0;
  for (const V3d& column : inverse) norm += column.length2();
  norm = std::sqrt(norm);
  double stray = cube.slopeError * norm;
  for (int k = 0; k < 3; ++k) at.rowStray[k] = cube.slopeError;
  for (const std::uint32_t i : cube.near) {
    const RbfParticle& particle = cubes.particles()[i];
    const double distance = (cube.center - particle.position).length();
    const KinkBound bound = distance > 0 ? kinkBound(cube.radius() / distance) : KinkBound{};
    stray += applyColumns(inverse, particle.weight).length() * bound.error;
    for (int k = 0; k < 3; ++k) at.rowStray[k] += std::abs(particle.weight[k]) * bound.error;
  }
  // The polynomial's terms of degree 3 and more change the slopes by at most the sum of the terms'
  // largest slopes.
  for (std::size_t n = 10; n < TaylorPolynomial::kTerms; ++n) {
    const auto& p = TaylorPolynomial::powers()[n];
    const double power = std::pow(cube.half, p.total() - 1);
    const double slope = power * std::sqrt(static_cast<double>(p.x * p.x + p.y * p.y + p.z * p.z));
    stray += applyColumns(inverse, cube.far[n]).length() * slope;
    for (int k = 0; k < 3; ++k) at.rowStray[k] += std::abs(cube.far[n][k]) * slope;
  }
  // The second derivatives change the slopes linearly. The norm of a linear function is largest at
  // a corner of the cube, and equal at opposite corners.
  double bend = 0;
  V3d rowBend(0);
  for (int corner = 0; corner < 4; ++corner) {
    const V3d s(corner & 1 ? cube.half : -cube.half, corner & 2 ? cube.half : -cube.half,
                cube.half);
    double squares = 0;
    V3d rows(0);
    for (const V3d& column : changeAt(at.curvature, s)) {
      squares += applyColumns(inverse, column).length2();
      rows += column * column;
    }
    bend = std::max(bend, std::sqrt(squares));
    for (int k = 0; k < 3; ++k) rowBend[k] = std::max(rowBend[k], std::sqrt(rows[k]));
  }
  at.rowStray += rowBend;
  at.relative = stray + bend + kProofRounding;
  if (!std::isfinite(at.relative)) at.relative = HUGE_VAL;
}

/// Inputs of the certificate that all cubes share.
struct ProofScene {
  const RbfMap& map;
  const RbfCubes& cubes;
  const CellTree& tree;
  V3d origin, sizes;
  Box3d wanted;  ///< range of u, v and w that the texture covers
  /// hand: sign of the determinant where the map does not fold. smallest: half edge length, world
  /// units, of cubes that are not halved further.
  double hand, smallest;

  /// True if cells of the particles extend into the cube of half edge `half` around the centre of
  /// `cube`.
  [[nodiscard]] bool isInPatch(const RbfCube& cube, double half) const {
    const V3d middle = cube.center + origin;
    return tree.visit({middle - V3d(half), middle + V3d(half)},
                      [](const std::array<int, 3>&) { return true; });
  }
  [[nodiscard]] bool reachesTexture(const RbfCube& cube, const CubeSlopes& at) const {
    for (int k = 0; k < 3; ++k) {
      const V3d row = rowOf(at.slopes, k);
      const double extent = (std::abs(row.x) + std::abs(row.y) + std::abs(row.z)) * cube.half +
                            at.rowStray[k] * cube.radius() + cube.valueError + kProofRounding;
      if (at.value[k] + extent < wanted.min[k] * sizes[k]) return false;
      if (at.value[k] - extent > wanted.max[k] * sizes[k]) return false;
    }
    return true;
  }
};

/// Results of the test of one starting cube, which has about the size of a particle's cell.
struct CubeProof {
  double size = 0, folded = 0, undecided = 0;
  std::vector<double> determinants;
  double least = std::numeric_limits<double>::infinity();
  bool folds = false;
  FoldPoint worst;
  std::size_t pieces = 0;
};

/// True if the middle of a cube is in the patch and maps into the texture.
bool isCenterWanted(const ProofScene& scene, const RbfCube& cube, const CubeSlopes& at) {
  return scene.wanted.intersects(at.value / scene.sizes) && scene.isInPatch(cube, 0);
}

/// Evaluates the determinant in the middle of a cube and adds it to `proof`.
/// @pre isCenterWanted
void lookAtCenter(const ProofScene& scene, const RbfCube& cube, const CubeSlopes& at,
                  CubeProof& proof) {
  const V3d uvw = at.value / scene.sizes;
  const V3d place = cube.center + scene.origin;
  const double volume = scene.hand * scene.sizes.x * scene.sizes.y * scene.sizes.z;
  double determinant = scene.hand * scene.cubes.slopes(cube, cube.center).determinant();
  // The exact map decides, so that the polynomial's error cannot yield a false fold.
  if (!(determinant > 0)) determinant = volume * scene.map.jacobian(place).determinant();
  if (determinant > 0) proof.determinants.push_back(determinant);
  if (!(determinant < proof.least)) return;
  proof.least = determinant;
  if (determinant > 0) return;
  proof.folds = true;
  proof.worst = {place, uvw, determinant};
}

CubeProof proveCube(const ProofScene& scene, const RbfCube& start, std::size_t mostCubes) {
  CubeProof proof;
  std::vector<RbfCube> queue = {start};
  for (std::size_t n = 0; n < queue.size(); ++n) {
    const RbfCube cube = std::move(queue[n]);
    if (!scene.isInPatch(cube, cube.half)) continue;
    CubeSlopes at = slopesIn(scene.cubes, cube);
    boundSlopes(scene.cubes, cube, at);
    if (!scene.reachesTexture(cube, at)) continue;
    ++proof.pieces;
    // A cube across the border of the texture may be inverted only outside it. So an inverted cube
    // counts as a fold only if its middle is in the texture.
    const bool isWanted = isCenterWanted(scene, cube, at);
    const bool isPositive = scene.hand * at.determinant > 0;
    const bool isDecided = at.relative < 1 && (isPositive || isWanted);
    const bool canHalve = cube.half > scene.smallest && queue.size() + 8 <= mostCubes;
    if (!isDecided && canHalve) {
      for (int bits = 0; bits < 8; ++bits) queue.push_back(scene.cubes.octant(cube, bits));
      continue;
    }
    if (isWanted) lookAtCenter(scene, cube, at, proof);
    const double volume = 8 * cube.half * cube.half * cube.half;
    proof.size += volume;
    if (!isDecided)
      proof.undecided += volume;
    else if (!isPositive)
      proof.folded += volume;
  }
  return proof;
}

/// Cubes of about the size of a particle's cell that cover the patch.
std::vector<RbfCube> startingCubes(const ProofScene& scene, const Box3d& box, double spacing) {
  const V3d sides = box.size();
  const double half = 0.5 * std::max({sides.x, sides.y, sides.z}) * (1 + 1e-9);
  std::vector<RbfCube> cubes = {scene.cubes.root(box.center() - scene.origin, half)};
  while (cubes.front().half > spacing) {
    std::vector<std::array<RbfCube, 8>> parts(cubes.size());
    tbb::parallel_for(std::size_t{0}, cubes.size(), [&](std::size_t n) {
      for (int bits = 0; bits < 8; ++bits) {
        RbfCube& part = parts[n][static_cast<std::size_t>(bits)];
        part.half = cubes[n].half / 2;
        part.center = cubes[n].center;
        for (int axis = 0; axis < 3; ++axis)
          part.center[axis] += bits >> axis & 1 ? part.half : -part.half;
        if (scene.isInPatch(part, part.half))
          part = scene.cubes.octant(cubes[n], bits);
        else
          part.half = 0;
      }
    });
    std::vector<RbfCube> next;
    for (auto& eight : parts)
      for (RbfCube& part : eight)
        if (part.half > 0) next.push_back(std::move(part));
    cubes.swap(next);
    if (cubes.empty()) break;
  }
  return cubes;
}

Box3d worldBoxOf(const Lattice& lattice) {
  Box3d box;
  const auto cells = lattice.cells();
  for (int k = 0; k < cells[2]; ++k)
    for (int j = 0; j < cells[1]; ++j)
      for (int i = 0; i < cells[0]; ++i) box.extendBy(lattice.worldBox({i, j, k}));
  return box;
}

/// Distributes the samples to octants until each has few samples or few near particles, and
/// evaluates the map at the samples there.
/// @param chosen  indices of the samples in the cube
void fillWithin(const RbfCubes& cubes, const V3d& origin, const V3d& sizes, const RbfCube& cube,
                std::vector<std::uint32_t> chosen, std::vector<MapSample>& samples) {
  constexpr std::size_t kFewSamples = 16;
  if (chosen.empty()) return;
  if (chosen.size() > kFewSamples && cube.near.size() > kFewSamples) {
    std::array<std::vector<std::uint32_t>, 8> parts;
    for (const std::uint32_t n : chosen) {
      const V3d offset = samples[n].position - origin - cube.center;
      parts[(offset.x > 0 ? 1u : 0u) + (offset.y > 0 ? 2u : 0u) + (offset.z > 0 ? 4u : 0u)]
          .push_back(n);
    }
    tbb::parallel_for(0, 8, [&](int bits) {
      auto& part = parts[static_cast<std::size_t>(bits)];
      if (!part.empty())
        fillWithin(cubes, origin, sizes, cubes.octant(cube, bits), std::move(part), samples);
    });
    return;
  }
  for (const std::uint32_t n : chosen) {
    samples[n].uvw = cubes.value(cube, samples[n].position - origin) / sizes;
    M33d slopes = cubes.slopes(cube, samples[n].position - origin);
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis) slopes[k][axis] /= sizes[k];
    samples[n].jacobian = slopes;
  }
}

}  // namespace

FoldCertificate certifyRbf(const RbfMap& map, const Patch& patch, double embedDepth) {
  if (map.kernel() != RbfKernel::Biharmonic) {
    FoldCertificate nothing;
    nothing.undecidedShare = 1;
    nothing.leastJacobian = std::numeric_limits<double>::quiet_NaN();
    return nothing;
  }
  const V3d sizes = meanExtents(patch);
  const RbfCubes cubes(map.function(), sizes, kProofTolerance);
  const Lattice lattice(patch, {.embedDepth = embedDepth, .rim = 0});
  const CellTree tree(lattice);
  const ProofScene scene{
      map,
      cubes,
      tree,
      map.function().origin(),
      sizes,
      {V3d(0, 0, -std::max(0.0, embedDepth)), V3d(1, 1, 1 + std::max(0.0, -embedDepth))},
      patch.mirrored ? -1.0 : 1.0,
      kSmallestCube * map.meanSpacing()};
  const std::vector<RbfCube> starts = startingCubes(scene, worldBoxOf(lattice), map.meanSpacing());
  std::vector<CubeProof> proofs(starts.size());
  tbb::parallel_for(std::size_t{0}, starts.size(),
                    [&](std::size_t n) { proofs[n] = proveCube(scene, starts[n], kFewCubes); });
  if (std::none_of(proofs.begin(), proofs.end(), [](const CubeProof& p) { return p.folds; }))
    tbb::parallel_for(std::size_t{0}, starts.size(), [&](std::size_t n) {
      if (proofs[n].undecided > 0) proofs[n] = proveCube(scene, starts[n], kMostCubes);
    });
  FoldTally tally;
  for (const CubeProof& proof : proofs) {
    tally.addVolume(proof.size, proof.folded, proof.undecided);
    for (const double determinant : proof.determinants)
      tally.addDeterminant(determinant, proof.least);
    tally.addDeterminant(0, proof.least);
    if (proof.folds) tally.addFold(proof.worst);
    tally.certificate.pieces += proof.pieces;
  }
  FoldCertificate certificate = tally.finish();
  certificate.unit /= sizes.x * sizes.y * sizes.z;
  return certificate;
}

void evaluateRbf(const RbfMap& map, const Patch& patch, std::vector<MapSample>& samples) {
  if (samples.empty()) return;
  const V3d sizes = meanExtents(patch);
  const RbfCubes cubes(map.function(), sizes, kSlopeTolerance);
  Box3d box;
  for (const MapSample& sample : samples) box.extendBy(sample.position);
  const V3d sides = box.size();
  std::vector<std::uint32_t> all(samples.size());
  for (std::size_t n = 0; n < all.size(); ++n) all[n] = static_cast<std::uint32_t>(n);
  const RbfCube root = cubes.root(box.center() - map.function().origin(),
                                  0.5 * std::max({sides.x, sides.y, sides.z}) * (1 + 1e-9));
  fillWithin(cubes, map.function().origin(), sizes, root, std::move(all), samples);
}

std::vector<MapSample> sampleRbf(const RbfMap& map, const Patch& patch, double embedDepth) {
  constexpr std::size_t kManyParticles = 4000;
  if (map.size() < kManyParticles || map.kernel() != RbfKernel::Biharmonic)
    return sampleMap(map, patch, embedDepth);
  const std::vector<V3d> places = samplePoints(patch, embedDepth);
  std::vector<MapSample> samples(places.size());
  for (std::size_t n = 0; n < places.size(); ++n)
    samples[n].position = layerPosition(patch, places[n]);
  evaluateRbf(map, patch, samples);
  for (std::size_t n = 0; n < places.size(); ++n) samples[n].uvw = places[n];
  return samples;
}

}  // namespace mapping
