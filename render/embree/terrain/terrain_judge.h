#pragma once

// Private to render/embree.

#include <Imath/ImathVec.h>

#include <memory>

#include "render/camera.h"
#include "render/terrain/rays/terrain_caster.h"

namespace render {

struct JudgedGround {
  bool found = false;
  double distance = 0;  ///< along the ray, world units
  /// Unit normals on the upper side, for shading and of the triangle.
  Imath::V3d normal{0}, facetNormal{0};
  double height = 0;  ///< in the field
};

/// The judge of terrains: Embree finds the blocks of cells whose boxes a ray meets, and each
/// triangle of a block is intersected in extended precision in world space. It reads the heights of
/// the field, and shares no code with the kernel. Methods may run concurrently.
class TerrainJudge {
 public:
  /// @throws levelset::ResourceLimit when Embree cannot allocate memory
  explicit TerrainJudge(const TerrainCaster& terrain);
  ~TerrainJudge();
  TerrainJudge(TerrainJudge&&) noexcept;
  TerrainJudge& operator=(TerrainJudge&&) noexcept;

  /// First intersection of a ray between its ends.
  [[nodiscard]] JudgedGround firstHit(const Camera::Ray& ray) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace render
