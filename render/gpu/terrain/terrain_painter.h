#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/camera.h"
#include "render/gpu/device/no_opengl.h"
#include "render/terrain/terrain_detail.h"

namespace render {

/// Colour and light of a drawn terrain.
struct TerrainPaint {
  Imath::C3f colour{0.55f, 0.5f, 0.42f};      ///< reflected share of light, linear
  Imath::V3d towardsLight{-0.5, -0.35, 0.8};  ///< direction, any length above 0
};

/// Picture of a terrain. Rows run from the top.
struct TerrainPicture {
  int width = 0, height = 0;  ///< pixels
  std::vector<std::uint8_t>
      colours;  ///< red, green, blue, alpha; alpha is 0 without ground, or 255
  /// For each pixel the unit normal, which points upwards, and the depth along the view axis, world
  /// units. Without ground, the depth is infinite.
  std::vector<Imath::V4f> surfaces;
};

/// Draws terrains as triangles with OpenGL, without a display. The heights of patches stay in the
/// memory of the device between pictures. Positions are relative to the eye, so that terrains far
/// from the origin are drawn as well as others.
class TerrainPainter {
 public:
  TerrainPainter() = default;
  TerrainPainter(const TerrainPainter&) = delete;
  TerrainPainter& operator=(const TerrainPainter&) = delete;
  virtual ~TerrainPainter() = default;

  /// @param selection  of the terrain that the painter was made for
  /// @throws levelset::UsageError for the reasons of validate(), and a light without a direction
  /// @throws levelset::ResourceLimit for a picture that OpenGL does not support
  [[nodiscard]] virtual TerrainPicture draw(const TerrainSelection& selection, const Camera& camera,
                                            const TerrainPaint& paint = {}) = 0;

  /// Figures of the last picture.
  struct Cost {
    std::size_t triangles = 0;
    std::size_t uploads = 0;  ///< patches whose heights were sent to the device
    std::size_t calls = 0;    ///< draw calls; more than one if the patches exceed the memory
  };
  [[nodiscard]] virtual Cost cost() const = 0;
};

/// Opens an OpenGL 4.5 context that draws a terrain.
/// @param layout    grid of the terrain; it outlives the painter
/// @param maxBytes  limit on the heights in the device's memory, bytes
/// @throws NoOpenGl when OpenGL 4.5 is missing
/// @throws levelset::UsageError for a limit below the heights of one patch
[[nodiscard]] std::unique_ptr<TerrainPainter> makeTerrainPainter(
    const levelset::GroundLayout& layout, std::size_t maxBytes = std::size_t{256} << 20);

}  // namespace render
