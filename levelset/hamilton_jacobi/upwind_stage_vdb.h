#pragma once

// Internal header of levelset: public headers must not include it.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "levelset/grids/padded_leaf_vdb.h"
#include "levelset/hamilton_jacobi/upwind_derivative.h"
#include "levelset/vdb.h"

/// Steps of explicit schemes for φ_t + H = 0 on the active grid points of a band.
namespace levelset::flow {

/// A leaf block with the grid points that the upwind differences read.
using StencilBlock = PaddedLeaf<3>;
using BandLeaf = openvdb::FloatTree::LeafNodeType;
using BandAccessor = openvdb::FloatGrid::ConstAccessor;

inline std::vector<BandLeaf*> leavesOf(openvdb::FloatTree& tree) {
  std::vector<BandLeaf*> leaves;
  tree.getNodes(leaves);
  return leaves;
}

inline std::vector<const BandLeaf*> leavesOf(const openvdb::FloatTree& tree) {
  std::vector<const BandLeaf*> leaves;
  tree.getNodes(leaves);
  return leaves;
}

/// Copies the values around the leaf block that begins at `origin`.
inline StencilBlock stencilBlock(const BandAccessor& accessor, const openvdb::Coord& origin) {
  StencilBlock block;
  block.fill([&](const openvdb::Coord& step) {
    return blockValues(accessor, origin.offsetBy(8 * step.x(), 8 * step.y(), 8 * step.z()));
  });
  return block;
}

/// Returns the position of a grid point of a leaf, index space.
inline Imath::V3d positionOf(const BandLeaf& leaf, openvdb::Index offset) {
  return toImath(leaf.offsetToGlobalCoord(offset).asVec3d());
}

/// Returns the longest allowed step, units of time: the minimum of `limit`, a function of an index
/// position, over the active grid points.
template <typename Limit>
double longestStep(openvdb::FloatGrid& grid, const Limit& limit) {
  const std::vector<BandLeaf*> leaves = leavesOf(grid.tree());
  std::vector<double> least(leaves.size(), HUGE_VAL);
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    for (auto it = leaves[i]->cbeginValueOn(); it; ++it)
      least[i] = std::min(least[i], limit(positionOf(*leaves[i], it.pos())));
  });
  double result = HUGE_VAL;
  for (const double value : least) result = std::min(result, value);
  return result;
}

/// Returns a one-sided derivative of φ along an axis, voxels per voxel.
/// @param at         address of the grid point in a StencilBlock
/// @param axis       0, 1 or 2
/// @param side       −1: the flow comes from lower coordinates; 1: from higher ones
/// @param voxelSize  unit of the values of φ
inline double oneSidedSlope(const float* at, int axis, int side, double voxelSize, int order) {
  constexpr std::array<int, 3> kSteps = {StencilBlock::kStepX, StencilBlock::kStepY, 1};
  std::array<double, 6> values;
  for (int k = 0; k < 6; ++k)
    values[static_cast<std::size_t>(k)] =
        static_cast<double>(at[side * (3 - k) * kSteps[static_cast<std::size_t>(axis)]]) /
        voxelSize;
  return -side * upwindDerivative(values, order);
}

/// Computes result = share · start + (1 − share) · (field − dt H) on the active grid points. Clamps
/// the result inside ± background.
/// @param hamiltonianIn  (const StencilBlock&, const BandLeaf&, const BandAccessor&), with the
///                       values of `field` around a leaf: returns the function H of the offset of a
///                       grid point in the leaf, voxels per unit of time
template <typename HamiltonianIn>
void eulerStage(const openvdb::FloatGrid& start, const openvdb::FloatGrid& field, double share,
                double dt, const HamiltonianIn& hamiltonianIn, openvdb::FloatGrid& result) {
  const std::vector<BandLeaf*> leaves = leavesOf(result.tree());
  const double h = result.voxelSize()[0], background = static_cast<double>(result.background());
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    const BandAccessor accessor(field.tree());
    const openvdb::Coord origin = leaves[i]->origin();
    const BandLeaf* first = start.tree().probeConstLeaf(origin);
    const StencilBlock block = stencilBlock(accessor, origin);
    const auto hamiltonian = hamiltonianIn(block, *leaves[i], accessor);
    for (auto it = leaves[i]->beginValueOn(); it; ++it) {
      const openvdb::Coord c = BandLeaf::offsetToLocalCoord(it.pos());
      const double moved =
          static_cast<double>(*block.at(c[0], c[1], c[2])) - dt * hamiltonian(it.pos()) * h;
      const double value =
          share * static_cast<double>(first->getValue(it.pos())) + (1 - share) * moved;
      it.setValue(
          static_cast<float>(std::clamp(value, -background + 1e-6 * h, background - 1e-6 * h)));
    }
  });
}

/// Computes a step between two times: an Euler step, or a TVD Runge-Kutta step of second or third
/// order [Shu88].
/// @param hamiltonianAt  returns the function `hamiltonianIn` of eulerStage() at a time
template <typename HamiltonianAt>
openvdb::FloatGrid::Ptr rungeKuttaStep(const openvdb::FloatGrid& start, int order, double from,
                                       double to, const HamiltonianAt& hamiltonianAt) {
  const double dt = to - from;
  const auto stage = [&](const openvdb::FloatGrid& field, double share, double time) {
    openvdb::FloatGrid::Ptr result = start.deepCopy();
    eulerStage(start, field, share, dt, hamiltonianAt(time), *result);
    return result;
  };
  const openvdb::FloatGrid::Ptr one = stage(start, 0, from);
  if (order == 1) return one;
  if (order == 2) return stage(*one, 0.5, to);
  const openvdb::FloatGrid::Ptr two = stage(*one, 0.75, to);
  return stage(*two, 1.0 / 3, from + dt / 2);
}

}  // namespace levelset::flow
