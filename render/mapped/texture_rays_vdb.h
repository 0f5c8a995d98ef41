#pragma once

// Private to mapped textures: intersects straight lines with a texture in its own space.

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <optional>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/vdb.h"
#include "render/embree/judge_blocks_vdb.h"
#include "render/shading/surface_shape.h"

namespace render {

/// The cells of a band that its surface crosses, found by position.
class TextureRays {
 public:
  explicit TextureRays(const levelset::NarrowBand& band);

  /// Reads values of the band; one for each thread.
  using Reader = openvdb::tree::ValueAccessor<const openvdb::FloatTree, false>;
  [[nodiscard]] Reader reader() const { return Reader(levelset::vdb(band_).tree()); }

  [[nodiscard]] Imath::V3d toIndex(const Imath::V3d& texture) const {
    return texture * worldToIndex_;
  }
  /// True if the trilinear interpolant is negative at a point in index space.
  [[nodiscard]] static bool isInside(const Reader& reader, const Imath::V3d& index);
  /// First sign change of the interpolant along a segment in index space, as a share of the segment
  /// in [near, 1]. It may miss a sign change at an end of the segment that is within rounding; the
  /// sides of both ends show it.
  [[nodiscard]] std::optional<double> firstCrossing(const Imath::V3d& from, const Imath::V3d& to,
                                                    double near) const;
  /// Derivatives of φ at a point in index space.
  [[nodiscard]] SurfaceShape shapeAt(const Imath::V3d& index) const;
  /// Derivatives of index coordinates with respect to the texture's world coordinates, for row
  /// vectors.
  [[nodiscard]] const Imath::M33d& indexSlopes() const { return indexSlopes_; }
  [[nodiscard]] bool isEmpty() const { return blocks_.empty(); }
  [[nodiscard]] std::size_t bytes() const { return blocks_.size() * sizeof(SurfaceBlock); }

 private:
  [[nodiscard]] const SurfaceBlock* blockAt(const openvdb::Coord& origin) const;

  levelset::NarrowBand band_;  // keeps the tree alive
  Imath::M44d worldToIndex_;
  Imath::M33d indexSlopes_;
  std::vector<SurfaceBlock> blocks_;  // sorted by origin
};

}  // namespace render
