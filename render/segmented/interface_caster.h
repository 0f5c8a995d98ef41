#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"

namespace render {

struct InterfaceStart;
struct InterfaceTables;

/// Part of a ray through a segmented field.
struct InterfaceRay {
  Imath::V3d origin, direction;  ///< world space; unit length
  double near = 0, far = 0;      ///< distances in world units; `far` may be infinite
  /// Region at `near`, if it is known, as behind an earlier crossing.
  std::optional<levelset::RegionLabel> label = {};
};

/// Crossing of a ray with the interface between two regions, or with a sheet.
struct InterfaceHit {
  bool found = false;
  double distance = 0;                            ///< along the ray, world units
  levelset::RegionLabel front = levelset::kVoid,  ///< region that the ray leaves
      behind = levelset::kVoid;                   ///< region that it enters; the same at a sheet
  /// Unit normals, towards `front`: of the interface as drawn, and of the smooth interface that the
  /// grid samples. At a sheet: of the triangle, and of the smooth sheet.
  Imath::V3d facetNormal{0}, normal{0};
};

/// A segmented field prepared for ray casting. A position belongs to the region that
/// levelset::SegmentedSampler::label() names: that with the least of the trilinearly interpolated
/// distances. A surface is seen where the label changes, unless both regions are hidden. The void
/// is always hidden.
///
/// The kernel (render/shaders/interfaces.glsl) steps through the cells whose corners have several
/// labels. There the distances are cubics along the ray. It isolates the first zero of each
/// difference by the Bernstein coefficients, in double precision. So a hit is certainly the first,
/// and exact to a few roundings of double precision. It reads the compact blocks of the field, and
/// a table that finds them; blocks and groups of 8³ blocks of one label are skipped.
///
/// Sheets are seen in all regions, hidden or not. They are the triangles of
/// levelset::segmentedToMesh(), which the kernel tests in lists by cell. A ray sees a sheet only
/// where it is in the region of the sheet, so no sheet sticks out of its region, and a border
/// continues each sheet up to the interpolated interface (render/segmented/sheet_surface.h). A
/// field without sheets has no such lists.
///
/// The class has value semantics. Copies share the data. All methods may run concurrently.
class InterfaceCaster {
 public:
  /// @param hidden  labels of regions that are transparent, so that interfaces inside them show
  /// @pre the field is not empty
  /// @throws levelset::ResourceLimit when the tables exceed `maxBytes`
  explicit InterfaceCaster(const levelset::SegmentedField& field,
                           const std::vector<levelset::RegionLabel>& hidden = {},
                           std::size_t maxBytes = levelset::kNoMemoryLimit);

  [[nodiscard]] const levelset::SegmentedField& field() const { return field_; }
  [[nodiscard]] bool isShown(levelset::RegionLabel label) const;
  /// Bounds of the drawn interfaces and sheets, world units; empty when there are none.
  [[nodiscard]] const Imath::Box3d& bounds() const { return bounds_; }
  /// Extents of the drawn interfaces and sheets: for each direction the largest p·direction over
  /// the crossings p of edges of the grid and the vertices p of sheets, world units; −∞ without
  /// any.
  [[nodiscard]] std::vector<double> extents(const std::vector<Imath::V3d>& directions) const;
  /// Memory of the tables beside the field, bytes.
  [[nodiscard]] std::size_t bytes() const;
  /// Number of cells whose corners have several labels. The kernel searches no others but those
  /// with sheets.
  [[nodiscard]] std::size_t mixedCellCount() const;
  [[nodiscard]] std::size_t sheetTriangleCount() const;

  /// First crossing of a ray with a surface.
  [[nodiscard]] InterfaceHit firstHit(const InterfaceRay& ray) const;
  /// Returns true if the ray crosses a surface. Cheaper than firstHit(), without normals.
  [[nodiscard]] bool isOccluded(const InterfaceRay& ray) const;
  /// The ray behind a crossing, for the next one.
  [[nodiscard]] static InterfaceRay behind(const InterfaceRay& ray, const InterfaceHit& hit);

  /// Data for the back ends of the kernel. Copies of this object share them.
  [[nodiscard]] const std::shared_ptr<const InterfaceTables>& tables() const { return tables_; }
  /// A ray for the kernel.
  [[nodiscard]] InterfaceStart start(const InterfaceRay& ray) const;
  /// Hit of a crossing that the kernel found.
  /// @param facet, smooth  gradients by the coordinates of the grid
  [[nodiscard]] InterfaceHit hitOf(const InterfaceRay& ray, double distance, int front, int behind,
                                   const Imath::V3d& facet, const Imath::V3d& smooth) const;

 private:
  levelset::SegmentedField field_;
  std::shared_ptr<const InterfaceTables> tables_;
  Imath::Box3d bounds_;
};

}  // namespace render
