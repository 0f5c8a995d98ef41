#pragma once

// Connected regions of the grid points of one sign. Includes OpenVDB: for .cpp files only.

#include <cstdint>
#include <vector>

#include "levelset/meshing/cell_surface.h"
#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset {

/// A connected part of the inside (6 neighbours) or of the outside (18 neighbours, as the surface
/// of CellSurface separates them).
struct Region {
  bool inside = false;
  double volume = 0;  ///< voxels³, what lies in its voids left out; region 0 reaches infinity
};

/// A closed connected surface, between two regions.
struct RegionShell {
  std::uint32_t inside = 0, outside = 0;
};

class RegionMap {
 public:
  /// All space: leaves by their voxels, the rest by its tiles. Nothing is made dense.
  /// @param action  for messages
  explicit RegionMap(const openvdb::FloatGrid& grid, const Progress& progress = {},
                     const char* action = "regions");

  static constexpr std::uint32_t kInfinite = 0;  ///< the outside that reaches infinity

  /// In tree order; the first is kInfinite.
  [[nodiscard]] const std::vector<Region>& regions() const { return regions_; }
  [[nodiscard]] const std::vector<RegionShell>& shells() const { return shells_; }
  /// One region a voxel, with the topology of the grid.
  [[nodiscard]] const openvdb::Int32Tree& labels() const { return labels_; }

  /// Calls visit(block origin, shell) for each block and each shell that crosses an edge of it.
  template <typename Visit>
  void forEachShellBlock(Visit&& visit) const {
    for (const auto& [origin, shell] : shellBlocks_) visit(origin, shell);
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
  std::vector<RegionShell> shells_;
  std::vector<std::pair<openvdb::Coord, std::uint32_t>> shellBlocks_;
};

}  // namespace levelset
