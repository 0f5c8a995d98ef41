#include "mapping/distortion/fold_certificate.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "levelset/geometry/exact_predicates.h"
#include "mapping/distortion/fold_tally.h"
#include "mapping/layers/trilinear_volume.h"
#include "mapping/maps/layer_map.h"
#include "mapping/maps/prism_map.h"
#include "mapping/untangle/prism_cells.h"

namespace mapping {
namespace {

using Imath::V3d;

/// True for an even permutation of the axes: the tetrahedra with this order then have a positive
/// volume in texture space.
bool isEvenOrder(int order) {
  const auto& axes = Lattice::kOrders[static_cast<std::size_t>(order)];
  return (axes[0] + 1) % 3 == axes[1];
}

double tripleOf(const Lattice::Corners& c) {
  return (c[1] - c[0]).dot((c[2] - c[0]).cross(c[3] - c[0]));
}

V3d middleOf(const Lattice::Corners& c) {
  return (c[0] + c[1] + c[2] + c[3]) / 4.0;
}

/// Results of the test of one cell of particles.
struct CellVolume {
  double size = 0, folded = 0, undecided = 0;  ///< volumes in texture space
  double typical = 0;                          ///< typical determinant of texture → patch
  bool folds = false;
  FoldPoint least;  ///< point with the least determinant, not yet divided by the median
  std::size_t pieces = 0;
};

FoldCertificate certificateOf(const std::vector<CellVolume>& cells) {
  FoldTally tally;
  for (const CellVolume& cell : cells) {
    if (cell.pieces == 0) continue;
    tally.addVolume(cell.size, cell.folded, cell.undecided);
    tally.addDeterminant(cell.typical, cell.least.jacobian);
    if (cell.folds) tally.addFold(cell.least);
    tally.certificate.pieces += cell.pieces;
  }
  return tally.finish();
}

CellVolume tetrahedronVolumes(const PrismMap& map, const std::array<int, 3>& cell, double hand) {
  CellVolume result;
  result.least.jacobian = std::numeric_limits<double>::infinity();
  const Lattice& lattice = map.lattice();
  for (int order = 0; order < 6; ++order) {
    const Tetrahedron t{cell, order};
    const Lattice::Corners world = lattice.corners(t), texture = lattice.textureCorners(t);
    if (!map.holdsTexture(middleOf(texture))) continue;
    const double size = std::abs(tripleOf(texture)), turn = isEvenOrder(order) ? hand : -hand;
    const int sign = levelset::convert::orient3d(world[0], world[1], world[2], world[3]);
    const double ratio = turn * tripleOf(world) / size;
    result.size += size / 6;
    result.typical += ratio / 6;
    ++result.pieces;
    if (!(turn * sign > 0)) {
      result.folds = true;
      result.folded += size / 6;
    }
    if (ratio < result.least.jacobian) result.least = {middleOf(world), middleOf(texture), ratio};
  }
  return result;
}

}  // namespace

const char* foldVerdictName(FoldVerdict verdict) {
  if (verdict == FoldVerdict::Certified) return "certified";
  return verdict == FoldVerdict::Folds ? "folds" : "undecided";
}

FoldCertificate worstOf(std::span<const FoldCertificate> certificates) {
  FoldCertificate result = certificates.front();
  for (const FoldCertificate& other : certificates.subspan(1)) {
    result.pieces += other.pieces;
    result.foldedShare = std::max(result.foldedShare, other.foldedShare);
    result.undecidedShare = std::max(result.undecidedShare, other.undecidedShare);
    if (other.leastJacobian < result.leastJacobian)
      result.leastJacobian = other.leastJacobian, result.unit = other.unit;
    result.worst.insert(result.worst.end(), other.worst.begin(), other.worst.end());
  }
  keepWorst(result.worst);
  return result;
}

FoldCertificate certifyPrisms(const PrismMap& map, bool isMirrored) {
  const Lattice& lattice = map.lattice();
  std::vector<CellVolume> cells(lattice.cellCount());
  const auto columns = static_cast<std::size_t>(lattice.cells()[0]),
             rows = static_cast<std::size_t>(lattice.cells()[1]);
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t n) {
    cells[n] =
        tetrahedronVolumes(map,
                           {static_cast<int>(n % columns), static_cast<int>(n / columns % rows),
                            static_cast<int>(n / columns / rows)},
                           isMirrored ? -1 : 1);
  });
  return certificateOf(cells);
}

FoldCertificate certifyLayers(const Patch& patch, double embedDepth) {
  const PrismCells prisms(patch, embedDepth);
  const std::vector<V3d> positions = particlePositions(patch);
  std::vector<CellVolume> cells(prisms.size());
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t n) {
    const PrismCell cell = prisms.at(n);
    std::array<V3d, 8> corners;
    double rounding = 0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      corners[corner] = positionOf(cell.corners[corner], positions);
      if (cell.corners[corner].count > 1)
        rounding = std::max(rounding,
                            8 * std::numeric_limits<double>::epsilon() * corners[corner].length());
    }
    const VolumeSign sign = signOfTrilinear(corners, rounding, patch.mirrored ? -1 : 1);
    const V3d sides = cell.box.size();
    const double size = sides.x * sides.y * sides.z;
    CellVolume& result = cells[n];
    result.size = size;
    result.folded = sign.negative * size;
    result.undecided = sign.undecided * size;
    result.folds = sign.folds;
    result.pieces = sign.pieces;
    const V3d uvw = cell.box.min + sides * sign.at;
    result.least = {layerPosition(patch, uvw), uvw, sign.least / size};
    const V3d u = corners[1] + corners[3] + corners[5] + corners[7] - corners[0] - corners[2] -
                  corners[4] - corners[6],
              v = corners[2] + corners[3] + corners[6] + corners[7] - corners[0] - corners[1] -
                  corners[4] - corners[5],
              w = corners[4] + corners[5] + corners[6] + corners[7] - corners[0] - corners[1] -
                  corners[2] - corners[3];
    result.typical = (patch.mirrored ? -1 : 1) * u.dot(v.cross(w)) / (64 * size);
  });
  return certificateOf(cells);
}

}  // namespace mapping
