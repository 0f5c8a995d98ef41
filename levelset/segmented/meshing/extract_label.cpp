#include "levelset/segmented/meshing/extract_label.h"

#include <fmt/core.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/grids/grid_queries_vdb.h"
#include "levelset/segmented/meshing/segmented_to_mesh.h"
#include "levelset/segmented/segmented_data_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using RegionLeaf = openvdb::FloatTree::LeafNodeType;

/// Scales a band on voxels of size 1 to the grid of the field, and takes the signs from the labels.
NarrowBand onGridOf(const SegmentedData& data, RegionLabel region, NarrowBand band,
                    double halfWidth) {
  openvdb::FloatGrid& grid = editVdb(band);
  const float background = backgroundOf(halfWidth, data.voxelSize);
  requireBackground(background, data.voxelSize);
  openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid.tree());
  leaves.foreach ([&](RegionLeaf& leaf, std::size_t) {
    SegmentedReader reader(data);
    for (openvdb::Index n = 0; n < RegionLeaf::SIZE; ++n) {
      const bool isInside = reader.label(leaf.offsetToGlobalCoord(n)) == region;
      const auto distance =
          static_cast<float>(std::abs(static_cast<double>(leaf.getValue(n))) * data.voxelSize);
      if (leaf.isValueOn(n) && distance < background) {
        // A grid point on an interface belongs to one of its sides.
        leaf.setValueOnly(
            n, isInside ? -std::max(distance, std::numeric_limits<float>::min()) : distance);
      } else {
        leaf.setValueOff(n, isInside ? -background : background);
      }
    }
  });
  auto tile = grid.tree().beginValueOff();
  tile.setMaxDepth(openvdb::FloatTree::DEPTH - 2);
  for (; tile; ++tile) tile.setValue(std::copysign(background, *tile));
  grid.tree().root().setBackground(background, /*updateChildNodes=*/false);
  pruneOneSided(grid.tree());
  grid.setTransform(data.transform->copy());
  return band;
}

}  // namespace

NarrowBand extractLabel(const SegmentedField& field, RegionLabel region,
                        const ExtractLabelOptions& options) {
  if (region == kVoid)
    throw UsageError("label 0 is the void, which has no bounds; give a label from 1 to 65535");
  if (!(options.halfWidth >= 1) || !std::isfinite(options.halfWidth))
    throw UsageError(
        fmt::format("the half width is {} voxels; give at least 1", options.halfWidth));
  const std::vector<RegionLabel> labels = field.labels();
  if (field.isEmpty() || !std::binary_search(labels.begin(), labels.end(), region)) {
    throw NoSurface(
        fmt::format("no grid point has the label {}; give a label of the field", region));
  }
  const SegmentedData& data = *field.shared();
  TriMesh surface = regionSurface(
      field, region,
      {.maxMemory = options.maxMemory, .progress = subProgress(options.progress, 0, 0.3)});
  for (Imath::V3d& p : surface.positions) p = toImath(data.transform->worldToIndex(toVdb(p)));
  // Regions may touch themselves along edges.
  MeshToBandOptions toBand;
  toBand.halfWidth = options.halfWidth;
  toBand.searchSelfIntersections = false;
  toBand.acceptSign = true;
  toBand.maxMemory = options.maxMemory;
  toBand.progress = subProgress(options.progress, 0.3, 1);
  return onGridOf(data, region, meshToBand(surface, 1, toBand).band, options.halfWidth);
}

}  // namespace levelset
