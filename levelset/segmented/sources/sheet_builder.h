#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "levelset/segmented/local/sheet_data.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/segmented/sources/grid_crossings.h"
#include "levelset/segmented/sources/sheet_features.h"

namespace levelset {

/// Two surfaces less than a voxel apart, along a line of the grid.
struct NarrowGap {
  std::uint16_t label = 0;  ///< region between them, or of one side where no grid point lies there
  bool isLost = false;      ///< no grid point lies between them, so they became one surface
  double thickness = 0;     ///< voxels, along the normal of one of them
  Imath::V3d position = Imath::V3d(0);  ///< voxels
};

/// Collects narrow gaps by label.
/// @param voxelSize  world units
[[nodiscard]] std::vector<ThinPart> thinPartsOf(const std::vector<NarrowGap>& gaps,
                                                double voxelSize);

/// Chooses the edges of the grid that count as crossed, and places rims and junctions on faces.
class SheetBuilder {
 public:
  using LabelAt = std::function<std::uint16_t(const Imath::V3i&)>;
  /// Returns true if grid points on both sides of a triangle belong to this region, or none lie
  /// there; false if the triangle crosses others.
  using IsInside = std::function<bool(std::uint32_t triangle, std::uint16_t label)>;

  /// @param points  vertices, voxels
  /// @param crossings  as from findGridCrossings(), all of the mesh
  SheetBuilder(const std::vector<Imath::V3d>& points,
               const std::vector<std::array<std::uint32_t, 3>>& triangles,
               const GridSimplices& simplices, const std::vector<GridCrossing>& crossings,
               const SheetFeatures& features, LabelAt labelAt, IsInside isInside);

  /// @param origins  of all blocks of the field, by x, y, z
  [[nodiscard]] std::shared_ptr<const SheetData> run(const std::vector<Imath::V3i>& origins);
  /// Finds surfaces less than a voxel apart that are nearly parallel.
  [[nodiscard]] std::vector<NarrowGap> narrowGaps() const;

 private:
  struct CrossedEdge {
    GridSimplices::Key key;
    double position;
    bool isMultiple;  ///< several surfaces cross it
  };
  struct PlacedPoint {
    GridSimplices::Key key;
    Imath::V3d offset;  ///< from the grid point
  };

  void chooseEdges();
  [[nodiscard]] bool isBetweenSheets(std::size_t first, std::size_t last,
                                     std::uint16_t label) const;
  [[nodiscard]] bool isBlocked(const Imath::V3i& at, std::uint32_t step) const;
  [[nodiscard]] bool areConnectedNearby(const Imath::V3i& at, std::uint32_t step) const;
  [[nodiscard]] const CrossedEdge* find(const Imath::V3i& at, std::uint32_t step) const;
  void placeEdges();
  void placeFaces();
  void placeEnds();
  void placeCorners();
  [[nodiscard]] std::uint32_t crossedEdges(const Imath::V3i& cell, std::size_t tetrahedron) const;
  [[nodiscard]] std::vector<Imath::V3d> pointsOfFaces(const Imath::V3i& cell,
                                                      std::size_t tetrahedron) const;

  const std::vector<Imath::V3d>& points_;
  const std::vector<std::array<std::uint32_t, 3>>& triangles_;
  const GridSimplices& simplices_;
  const std::vector<GridCrossing>& crossings_;
  const SheetFeatures& features_;
  LabelAt labelAt_;
  IsInside isInside_;
  std::vector<CrossedEdge> edges_;
  std::vector<GridSimplices::Key> junctionFaces_;  ///< with three crossed edges
  std::vector<PlacedPoint> faces_;                 ///< points on faces, ascending
  std::vector<PlacedPoint> placed_;
  std::vector<std::uint16_t> owners_;
};

}  // namespace levelset
