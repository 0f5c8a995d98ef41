#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "render/bezier/bezier_part.h"
#include "render/camera.h"
#include "render/direct/direct_volume.h"
#include "render/hit.h"
#include "render/images/value_bits.h"
#include "render/quadrics/quadric_part.h"
#include "render/scene/csg_expression.h"
#include "render/scene/mapped_texture.h"
#include "render/segmented/segmented_part.h"
#include "render/terrain/rays/terrain_part.h"
#include "render/volumes/volume_surface.h"

namespace render {

/// The key light of a scene.
struct Light {
  Imath::V3d direction{
      -0.4, 0.7, 0.6};    ///< towards the light, in camera space (x right, y up, z towards the eye)
  double strength = 0.8;  ///< weight of the key light; 0: no key light
  double softness = 0.15;  ///< half angle of the cone of light directions, radians; it sets the
                           ///< width of penumbrae
};

/// A level set or an isosurface of a volume in a scene, with its appearance.
struct Solid {
  levelset::NarrowBand band;
  Imath::C3f colour{0.66f, 0.62f, 0.56f};
  std::uint32_t id = 1;
  std::string name = {};  ///< name of the solid in the CSG expression
  double opacity = 1;     ///< opacity of the surface, for each crossing of a ray, (0, 1]
  /// Storage of the band's values in the kernel's tables. Below 32 bits, the band must be a result
  /// of quantized().
  ValueBits quantization = {};
  /// If not null, this isosurface is drawn and `band` is empty.
  std::shared_ptr<const VolumeSurface> volume = {};

  /// Returns true when there is certainly no surface. @param filter  interpolation of a volume
  [[nodiscard]] bool isEmpty(Filter filter = Filter::Trilinear) const {
    return volume ? volume->isEmpty(filter) : band.isEmpty();
  }
  /// Transform from the grid's index space to world space.
  [[nodiscard]] Imath::M44d indexToWorld() const {
    return volume ? volume->indexToWorld() : band.indexToWorld();
  }
  /// Edge length of a voxel; of a volume, the largest spacing of its grid. World units.
  [[nodiscard]] double voxelSize() const { return volume ? volume->voxelSize() : band.voxelSize(); }
  /// Bounds of the surface, world units.
  [[nodiscard]] Imath::Box3d bounds() const;
};

/// Triangles that are drawn together with the solids. They are lit and cast shadows like solids,
/// but cannot be used in the CSG expression. Shading is flat unless the vertices have normals.
/// Vertex colours (sRGB) replace `colour`.
struct MeshPart {
  std::shared_ptr<const levelset::TriMesh> mesh;
  Imath::C3f colour{0.66f, 0.62f, 0.56f};
  std::uint32_t id = 1;
  std::string name = {};
  double opacity = 1;  ///< opacity of the surface, for each crossing of a ray, (0, 1]
};

/// A volume that is drawn by direct volume rendering, in front of, around and behind the surfaces
/// of a scene. It casts no shadow and receives none.
struct VolumePart {
  DirectVolume volume;
  bool isShaded = true;  ///< colours depend on the gradient and the key light
  std::string name = {};
};

/// A plane below the drawn surfaces that shows only their shadows. Where light is blocked, the
/// picture is black with an opacity of the blocked share; elsewhere it is transparent. The layers
/// other than the colours do not show the plane, and it blocks no light.
struct Ground {
  Imath::V3d point;   ///< a point on the plane, below the middle of the surfaces, world units
  Imath::V3d normal;  ///< unit normal, upwards
  double radius = 0;  ///< shadows are drawn up to this distance from `point`, world units
};

/// Everything that a renderer draws.
struct Scene {
  Camera camera;
  Light key;
  double ambient = 0.32;  ///< weight of the sky light, the fill light and the rim light, all dimmed
                          ///< by ambient occlusion
  std::vector<Solid> solids;
  std::vector<MeshPart> meshes = {};
  /// Textures drawn through maps, beside the solids. renderEmbree() does not draw them.
  std::vector<MappedTexture> mapped = {};
  /// Drawn beside the solids. Not in a blended scene.
  std::optional<SegmentedPart> segmented = {};
  /// Not with a ground, on which the volume would have no shadow.
  std::optional<VolumePart> volumePart = {};
  /// Expression over the solids and the Bézier volumes; empty: each of them is drawn. Bézier
  /// volumes that it does not name are drawn, too.
  CsgExpression csg = {};
  /// K of the smooth minimum in the expression, world units (FieldExpression); 0: sharp edges.
  double softness = 0;
  std::optional<double> morph =
      {};  ///< fraction of the morph from the first solid to the second, [0, 1]; unset: no morph
  std::optional<Ground> ground = {};
  /// Surfaces in Bézier volumes, drawn beside the solids or operands of the expression. Not in a
  /// blended scene.
  std::vector<BezierPart> beziers = {};
  /// Drawn beside the solids. Not in a blended scene.
  std::vector<QuadricPart> quadrics = {};
  /// Drawn beside the solids. Not in a blended scene.
  std::vector<TerrainPart> terrains = {};
  /// True when the scene is drawn as the zero set of one function of all solids' fields: a soft
  /// expression or a morph (render/scene/field_expression.h).
  [[nodiscard]] bool isBlended() const { return softness > 0 || morph; }
  /// True for a Bézier volume that the expression names. In the expression, its number is that of
  /// the solids plus its index. @param bezier  index in `beziers`
  [[nodiscard]] bool isOperand(std::size_t bezier) const {
    return !csg.isEmpty() && csg.uses(solids.size() + bezier);
  }
  /// True when no surface is transparent.
  [[nodiscard]] bool isOpaque() const;
  /// True when a volume is among the solids.
  [[nodiscard]] bool hasVolume() const;
  /// World-space box of the grids of all volumes, of solids and of volumePart; empty without
  /// volumes.
  [[nodiscard]] Imath::Box3d volumeBounds() const;
  /// A world-space box that contains all drawn surfaces; empty when the scene has none.
  [[nodiscard]] Imath::Box3d bounds() const;
  /// Extents of all drawn surfaces: for each direction d an upper bound on p·d over their points p,
  /// world units times the length of d. It is exact, to the interpolation of the grids, unless the
  /// scene has an expression, a morph or a mapped texture (whose shells count). −∞ when the scene
  /// has no surface.
  [[nodiscard]] std::vector<double> extents(const std::vector<Imath::V3d>& directions) const;
};

/// Checks the Bézier volumes that the expression names.
/// @throws levelset::UsageError for a smooth expression
/// @throws levelset::InvalidInput for a volume that is no solid: BezierCaster::refusalAsSolid()
void requireOperands(const Scene& scene);

/// Default camera of a scene: frames its surfaces in a three-quarter view, and the grid of a volume
/// of which it draws no isosurface.
/// @throws as framingCamera() for a box
[[nodiscard]] Camera framingCamera(const Scene& scene, int width, int height, double verticalFov,
                                   const Imath::V3d& up);

/// Plane below the surfaces of a scene, at their lowest point. For a scene with an expression or a
/// morph it may lie lower, see Scene::extents(). @param up  upward direction
/// @pre the scene has a surface; `up` is not zero
[[nodiscard]] Ground groundOf(const Scene& scene, const Imath::V3d& up);

}  // namespace render
