#include "levelset/hamilton_jacobi/normal_motion_vdb.h"

#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "levelset/grids/padded_leaf_vdb.h"
#include "levelset/hamilton_jacobi/hamiltonian.h"
#include "levelset/hamilton_jacobi/upwind_derivative.h"

namespace levelset::flow {
namespace {

using NormalBlock = PaddedLeaf<3>;

/// One-sided slopes of φ at a grid point of a block, voxels per voxel.
/// @param unit    factor from world units to voxels
/// @param beyond  stencils that read |φ| of this size or more, world units, are of first order
OneSidedSlopes slopesAt(const NormalBlock& block, const openvdb::Coord& c, double unit,
                        float beyond, int order) {
  constexpr std::ptrdiff_t kSteps[] = {NormalBlock::kStepX, NormalBlock::kStepY, 1};
  const float* const here = block.at(c[0], c[1], c[2]);
  OneSidedSlopes result;
  for (int axis = 0; axis < 3; ++axis) {
    const std::ptrdiff_t step = kSteps[axis];
    std::array<double, 6> up, down;  // towards higher and towards lower coordinates
    for (std::size_t k = 0; k < 6; ++k)
      up[k] = unit * static_cast<double>(here[step * (static_cast<std::ptrdiff_t>(k) - 3)]);
    down[0] = unit * static_cast<double>(here[step * 3]);
    for (std::size_t k = 1; k < 6; ++k) down[k] = up[6 - k];
    bool isInside = true;
    for (std::ptrdiff_t k = -3; k <= 3; ++k)
      isInside = isInside && std::abs(here[step * k]) < beyond;
    result.lower[axis] = upwindDerivative(up, isInside ? order : 1);
    result.upper[axis] = -upwindDerivative(down, isInside ? order : 1);
  }
  return result;
}

/// Computes result = share · start + (1 − share) · (field + dt (G − F |∇field|)) on the active grid
/// points.
void normalStage(const openvdb::FloatGrid& start, const openvdb::FloatGrid& field, double share,
                 double dt, const NormalMotion& motion, int order, openvdb::FloatGrid& result) {
  using LeafNode = openvdb::FloatTree::LeafNodeType;
  std::vector<LeafNode*> leaves;
  result.tree().getNodes(leaves);
  const double unit = 1 / result.voxelSize()[0];
  const float beyond = motion.endsWithJump ? result.background() : HUGE_VALF;
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    const openvdb::Coord origin = leaves[i]->origin();
    const LeafNode *first = start.tree().probeConstLeaf(origin),
                   *second = motion.field.tree().probeConstLeaf(origin);
    const openvdb::FloatGrid::ConstAccessor accessor(field.tree());
    NormalBlock block;
    copyPaddedLeaf(accessor, origin, NormalBlock::kPad, NormalBlock::kPad, block.values.data());
    for (auto it = leaves[i]->beginValueOn(); it; ++it) {
      const openvdb::Coord c = LeafNode::offsetToLocalCoord(it.pos());
      const auto phi = static_cast<double>(*block.at(c[0], c[1], c[2]));
      const NormalTerms terms = motion.terms(phi, static_cast<double>(second->getValue(it.pos())));
      double rate = terms.source;
      if (terms.speed != 0)
        rate -= terms.speed * godunovSlope(slopesAt(block, c, unit, beyond, order), terms.speed);
      it.setValue(static_cast<float>(share * static_cast<double>(first->getValue(it.pos())) +
                                     (1 - share) * (phi + dt * rate)));
    }
  });
}

}  // namespace

openvdb::FloatGrid::Ptr normalStep(const openvdb::FloatGrid& start, const NormalMotion& motion,
                                   const UpwindOrders& orders, double dt) {
  const auto stage = [&](const openvdb::FloatGrid& field, double share) {
    openvdb::FloatGrid::Ptr result = start.deepCopy();
    normalStage(start, field, share, dt, motion, orders.space, *result);
    return result;
  };
  const openvdb::FloatGrid::Ptr one = stage(start, 0);
  if (orders.time == 1) return one;
  if (orders.time == 2) return stage(*one, 0.5);
  const openvdb::FloatGrid::Ptr two = stage(*one, 0.75);
  return stage(*two, 1.0 / 3);
}

}  // namespace levelset::flow
