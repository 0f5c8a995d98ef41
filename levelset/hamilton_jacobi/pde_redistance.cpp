#include "levelset/hamilton_jacobi/pde_redistance.h"

#include <fmt/core.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Morphology.h>
#include <openvdb/tools/Prune.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "levelset/error.h"
#include "levelset/grids/padded_leaf_vdb.h"
#include "levelset/hamilton_jacobi/normal_motion_vdb.h"
#include "levelset/hamilton_jacobi/pde_steps.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Index;
using PdeLeaf = FloatTree::LeafNodeType;
using PdeBlock = PaddedLeaf<1>;

std::vector<PdeLeaf*> pdeLeaves(FloatGrid& grid) {
  std::vector<PdeLeaf*> leaves;
  grid.tree().getNodes(leaves);
  return leaves;
}

/// Loads a leaf with its neighbours and calls visit(offset, pointer to the value in the block) for
/// each of its grid points.
template <typename Visit>
void forEachPoint(const FloatGrid& grid, const PdeLeaf& leaf, const Visit& visit) {
  const FloatGrid::ConstAccessor accessor(grid.tree());
  PdeBlock block;
  copyPaddedLeaf(accessor, leaf.origin(), 1, 1, block.values.data());
  for (Index n = 0; n < PdeLeaf::SIZE; ++n) {
    const openvdb::Coord c = PdeLeaf::offsetToLocalCoord(n);
    visit(n, block.at(c[0], c[1], c[2]));
  }
}

/// Returns the grid points within `reach` grid points, along each axis, of a change of sign.
openvdb::MaskTree pointsBesideSurface(const FloatGrid& field, int reach) {
  std::vector<const PdeLeaf*> leaves;
  field.tree().getNodes(leaves);
  std::vector<std::unique_ptr<openvdb::MaskTree::LeafNodeType>> marked(leaves.size());
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    auto mask = std::make_unique<openvdb::MaskTree::LeafNodeType>(leaves[i]->origin(), false);
    forEachPoint(field, *leaves[i], [&](Index n, const float* p) {
      for (const int step : {1, PdeBlock::kStepY, PdeBlock::kStepX})
        if ((p[step] < 0) != (*p < 0) || (p[-step] < 0) != (*p < 0)) mask->setValueOn(n);
    });
    if (!mask->isEmpty()) marked[i] = std::move(mask);
  });
  openvdb::MaskTree tree;
  for (auto& leaf : marked)
    if (leaf) tree.addLeaf(leaf.release());
  openvdb::tools::dilateActiveValues(tree, reach, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::IGNORE_TILES);
  return tree;
}

/// Copies the field, and makes exactly the grid points of `domain` active. Those without a value
/// get ± `unknown`. Grid points outside the domain get ± (unknown + growth): |φ| grows by at most
/// `growth` until the end, so that no front enters from there.
FloatGrid::Ptr onDomain(const FloatGrid& field, const openvdb::MaskTree& domain, float unknown,
                        float growth) {
  const FloatGrid::Ptr grid = field.deepCopy();
  openvdb::tools::changeLevelSetBackground(grid->tree(), unknown);
  grid->tree().topologyUnion(domain);
  for (PdeLeaf* leaf : pdeLeaves(*grid)) {
    const auto* wanted = domain.probeConstLeaf(leaf->origin());
    for (auto it = leaf->beginValueOn(); it; ++it)
      if (!wanted || !wanted->isValueOn(it.pos())) it.setValueOff();
  }
  openvdb::tools::changeLevelSetBackground(grid->tree(), unknown + growth);
  openvdb::tools::pruneLevelSet(grid->tree());
  return grid;
}

/// Computes S of φ0 on the active grid points, with central differences.
FloatGrid::Ptr smearedSign(const FloatGrid& field) {
  const FloatGrid::Ptr sign = field.deepCopy();
  const std::vector<PdeLeaf*> leaves = pdeLeaves(*sign);
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    forEachPoint(field, *leaves[i], [&](Index n, const float* p) {
      double sum = 0;  // (h |∇φ0|)²
      for (const int step : {1, PdeBlock::kStepY, PdeBlock::kStepX}) {
        const double rise = (static_cast<double>(p[step]) - static_cast<double>(p[-step])) / 2;
        sum += rise * rise;
      }
      const auto phi = static_cast<double>(*p);
      const double norm = std::sqrt(phi * phi + sum);
      if (leaves[i]->isValueOn(n))
        leaves[i]->setValueOnly(n, norm > 0 ? static_cast<float>(phi / norm) : 0);
    });
  });
  return sign;
}

/// Makes the grid points with |φ| below the background active, and sets all others to ±
/// background.
NarrowBand bandOf(FloatGrid& grid, double halfWidth) {
  const float background = backgroundOf(halfWidth, grid.voxelSize()[0]);
  for (PdeLeaf* leaf : pdeLeaves(grid))
    for (auto it = leaf->beginValueOn(); it; ++it)
      if (!(std::abs(*it) < background)) it.setValueOff();
  openvdb::tools::changeLevelSetBackground(grid.tree(), background);
  openvdb::tools::pruneLevelSet(grid.tree());
  return makeBand(grid.copy());
}

}  // namespace

NarrowBand pdeRedistance(const NarrowBand& field, const PdeRedistanceOptions& options) {
  requireSolid(field);
  const double halfWidth = options.halfWidth.value_or(field.halfWidth());
  if (!std::isfinite(halfWidth) || halfWidth < 1)
    throw UsageError(fmt::format("the half width is {} voxels; give at least 1", halfWidth));
  const flow::UpwindOrders orders{options.order, options.timeOrder};
  flow::requireOrders(orders);

  const int reach = flow::pdeReach(halfWidth);
  const openvdb::MaskTree domain = pointsBesideSurface(vdb(field), reach);
  if (domain.empty())
    throw InvalidInput("the field is empty and has no zero crossing; give a solid with a surface");
  requireMemory(flow::kPdeBytes * static_cast<double>(domain.activeVoxelCount()),
                options.maxMemory);
  const double h = field.voxelSize();
  FloatGrid::Ptr phi =
      onDomain(vdb(field), domain, std::max(backgroundOf(reach + 1, h), vdb(field).background()),
               backgroundOf(halfWidth + flow::kPdeDelay + 1, h));
  const FloatGrid::Ptr sign = smearedSign(*phi);
  const flow::NormalMotion motion{*sign,
                                  [](double, double s) {
                                    return flow::NormalTerms{s, s};
                                  },
                                  true};
  const int steps = flow::pdeSteps(halfWidth);
  for (int n = 0; n < steps; ++n) {
    phi = flow::normalStep(*phi, motion, orders, flow::kPdeStep * h);
    report(options.progress, static_cast<double>(n + 1) / steps);
  }
  return bandOf(*phi, halfWidth);
}

}  // namespace levelset
