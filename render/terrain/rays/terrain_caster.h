#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "levelset/progress.h"
#include "levelset/terrain/height_field.h"
#include "render/camera.h"

namespace render {

struct TerrainTables;

/// Options of TerrainCaster.
struct TerrainOptions {
  Imath::M44d transform = {};  ///< from the positions of the field to the world; affine
  /// True: normals for shading follow from central differences of the heights. False: they are
  /// those of the triangles.
  bool isSmooth = true;
  /// Box in the positions of the field. Its ground is left out, for a solid that replaces it: each
  /// cell that lies in the box together with all neighbours. So the ground around the hole is drawn
  /// for at least one cell beside the walls of the solid.
  std::optional<Imath::Box3d> outside = {};
  /// Limit on the memory of the pyramid, bytes.
  std::size_t maxBytes = levelset::kNoMemoryLimit;
};

/// First intersection of a ray with the ground.
struct TerrainHit {
  bool found = false;
  double distance = 0;  ///< along the ray, world units
  /// Unit normals on the upper side, for shading and of the triangle.
  Imath::V3d normal{0}, facetNormal{0};
  double height = 0;  ///< in the field
  int column = 0;     ///< place of the cell
  int halfRow = 0;    ///< twice the row of the cell, plus 1 for its upper triangle
};

/// The ground of a height field, prepared for ray casting: the triangles of levelset::HeightField,
/// with a pyramid of lowest and highest heights. Both sides are hit. Triangles with a missing
/// corner are holes.
///
/// Intersections are computed in double precision in the coordinates of the grid, where the corners
/// of the triangles have no rounding errors (render/shaders/exact/height_rays.glsl). No ray passes
/// between two triangles with a common edge. The result is the nearest intersection, whatever the
/// order of the tests. Distances have an error of about 1e-15 times the distance of the ray's start
/// from the farthest corner of the ground.
///
/// The class has value semantics. Copies share the data. All methods may run concurrently.
class TerrainCaster {
 public:
  /// @param field  shared, not copied
  /// @throws levelset::InvalidInput as levelset::requireHeights() and levelset::requireLengths(),
  /// for
  ///         less than 2x2 samples, for a transform that is not affine or not invertible, and for
  ///         ground in `outside` beyond the heights of the box
  /// @throws levelset::ResourceLimit if the pyramid needs more than `maxBytes`
  explicit TerrainCaster(std::shared_ptr<const levelset::HeightField> field,
                         const TerrainOptions& options = {});

  [[nodiscard]] const levelset::HeightField& field() const;
  [[nodiscard]] const TerrainOptions& options() const { return options_; }
  /// World-space box of the known samples; empty if there are none.
  [[nodiscard]] const Imath::Box3d& bounds() const { return bounds_; }
  /// For each direction the largest p·direction over the known samples p, world units; −∞ if there
  /// are none.
  [[nodiscard]] std::vector<double> extents(const std::vector<Imath::V3d>& directions) const;
  /// Memory of the heights and of the pyramid, bytes: 4 and 8/3 for each sample of a large square
  /// field.
  [[nodiscard]] std::size_t bytes() const;

  /// First intersection of a ray between its ends. The direction may have any length; distances
  /// count in it.
  [[nodiscard]] TerrainHit firstHit(const Camera::Ray& ray) const;
  /// First intersections of rays, with the bits of firstHit().
  [[nodiscard]] std::vector<TerrainHit> firstHits(std::span<const Camera::Ray> rays) const;
  /// Returns true if a ray meets the ground between its ends. Cheaper than firstHit().
  [[nodiscard]] bool isOccluded(const Camera::Ray& ray) const;
  /// Hit at a distance that a kernel found. @param column, halfRow  as TerrainHit
  [[nodiscard]] TerrainHit hitAt(const Camera::Ray& ray, double distance, int column,
                                 int halfRow) const;

  /// Data for the back ends of the kernel.
  [[nodiscard]] const std::shared_ptr<const TerrainTables>& tables() const { return tables_; }

 private:
  std::shared_ptr<const TerrainTables> tables_;
  TerrainOptions options_;
  Imath::Box3d bounds_;
};

}  // namespace render
