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
#include "render/camera.h"
#include "render/images/value_bits.h"
#include "render/scene/csg_expression.h"

namespace render {

struct Light {
  Imath::V3d direction{-0.4, 0.7,
                       0.6};  ///< towards the light, in camera space (x right, y up, z to the eye)
  double strength = 0.8;
  double softness = 0.15;  ///< half angle of the light, radians: penumbrae
};

struct Solid {
  levelset::NarrowBand band;
  Imath::C3f colour{0.66f, 0.62f, 0.56f};
  std::uint32_t id = 1;
  std::string name = {};        ///< for the expression
  double opacity = 1;           ///< of each of its surfaces that a ray meets, (0, 1]
  ValueBits quantization = {};  ///< of the kernel's tables; the band has these values (quantized())
};

/// Triangles beside the solids: drawn, lit and lighted through like them, of no use to the
/// expression. Flat unless the vertices have normals; of their colours (sRGB) if they have some.
struct MeshPart {
  std::shared_ptr<const levelset::TriMesh> mesh;
  Imath::C3f colour{0.66f, 0.62f, 0.56f};
  std::uint32_t id = 1;
  std::string name = {};
  double opacity = 1;  ///< as of a Solid
};

/// What lets less light through than this is as good as opaque.
inline constexpr double kLeastTransmittance = 1.0 / 512;

struct Scene {
  Camera camera;
  Light key;
  double ambient = 0.32;  ///< weight of the ambient term, dimmed by occlusion
  std::vector<Solid> solids;
  std::vector<MeshPart> meshes = {};
  CsgExpression csg = {};  ///< what is drawn of the solids; empty: each of them
  double softness = 0;     ///< of the expression: K of the smooth minimum, world units; 0: none
  std::optional<double> morph = {};  ///< set: on the way from the one solid to the other, [0, 1]
  /// Is the zero set of one function of all fields drawn (render/scene/field_expression.h)?
  [[nodiscard]] bool isBlended() const { return softness > 0 || morph; }
  /// Is nothing seen through?
  [[nodiscard]] bool isOpaque() const;
  /// A box that holds what is drawn; empty where nothing can be.
  [[nodiscard]] Imath::Box3d bounds() const;
};

}  // namespace render
