#pragma once

// Connected regions of the grid points of one sign. Includes OpenVDB: for .cpp files only.

#include <cstdint>
#include <vector>

#include "levelset/meshing/cells/cell_surface.h"
#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset {

/// A connected component of the inside (6 neighbours) or of the outside (18 neighbours).
/// CellSurface builds the surface between two such components.
struct Region {
  bool inside = false;
  /// Volume without the regions enclosed in it, voxels³. Invalid for the unbounded outside
  /// region.
  double volume = 0;
};

/// A surface component, which separates two regions.
struct RegionSurface {
  std::uint32_t inside = 0, outside = 0;  ///< region indices
};

/// Connected regions of a grid, and the surfaces between them.
class RegionMap {
 public:
  /// Computes the region of each voxel in a leaf and of each tile. Does not expand tiles.
  explicit RegionMap(const openvdb::FloatGrid& grid, const Progress& progress = {});

  static constexpr std::uint32_t kInfinite = 0;  ///< index of the unbounded outside region

  /// Regions in tree order; the first is kInfinite.
  [[nodiscard]] const std::vector<Region>& regions() const { return regions_; }
  /// Surface components between the regions.
  [[nodiscard]] const std::vector<RegionSurface>& surfaces() const { return surfaces_; }
  /// Tree with the topology of the grid. Its values are the region indices of voxels and tiles.
  [[nodiscard]] const openvdb::Int32Tree& labels() const { return labels_; }

  /// Calls visit(block origin, index into surfaces()) for each surface component that crosses a
  /// grid edge in a block. May visit a pair more than once.
  template <typename Visit>
  void forEachSurfaceBlock(Visit&& visit) const {
    for (const auto& [origin, surface] : surfaceBlocks_) visit(origin, surface);
  }

 private:
  class Linker;
  void labelLeaves(const openvdb::FloatGrid& grid, Linker& linker);
  void labelTiles(const openvdb::FloatGrid& grid, Linker& linker);
  void joinLeaves(const openvdb::FloatGrid& grid, Linker& linker) const;
  void joinTiles(const openvdb::FloatGrid& grid, Linker& linker) const;
  void joinDiagonals(const CellSurface& surface, Linker& linker) const;
  void numberRegions(const openvdb::FloatGrid& grid, Linker& linker);
  void findSurfaceComponents(const CellSurface& surface);

  openvdb::Int32Tree labels_;
  std::vector<Region> regions_;
  std::vector<RegionSurface> surfaces_;
  std::vector<std::pair<openvdb::Coord, std::uint32_t>> surfaceBlocks_;
};

}  // namespace levelset
