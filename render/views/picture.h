#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "render/direct/direct_volume.h"
#include "render/hit.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

// Code that all renderers share: layers, checks and header attributes of a picture.
namespace render {

/// Sum of the colours that the sample rays of a pixel see.
struct ColourSum {
  Imath::C3f colour{0};
  double coverage = 0;  ///< sum of the weights `share` of all added colours
  /// Adds the colour of a surface that a ray hits. @param share  weight of the colour: the
  /// surface's opacity times the transmittance of the surfaces in front of it
  void add(const Imath::C3f& seen, double share) {
    colour += seen * static_cast<float>(share);
    coverage += share;
  }
  /// Adds the light of a volume. @param share  transmittance of all that is in front of it
  void add(const VolumeLight& light, double share) {
    colour += Imath::C3f(light.colour * share);
    coverage += share * (1 - light.transmittance);
  }
};

/// Pointers to the pixels of a picture's layers, so that tiles can be written in parallel. Null:
/// the picture has no such layer.
struct PictureLayers {
  float *r, *g, *b, *a, *z;
  float *n[3], *p[3];
  float* curvature[4] = {};
  float* direction[2][3] = {};  ///< first and second principal direction
  float* thickness = nullptr;
  float* light[2] = {};   ///< shares of sky light and key light
  float* volume[4] = {};  ///< light of the volume in front of the first surface, and its opacity
  std::uint32_t* id;
  mutable std::atomic<std::size_t> beyondBand =
      0;  ///< number of pixels whose hit has Hit::isBeyondBand
  mutable std::atomic<std::size_t> singular =
      0;  ///< number of pixels whose hit has Hit::isSingular
  /// TreeCounts::overruns of all rays of the camera in Bézier volumes.
  mutable std::atomic<std::size_t> overruns = 0;
  /// Number of rays that show that a Bézier operand is open (SolidCrossings).
  mutable std::atomic<std::size_t> open = 0;

  PictureLayers(Image& image, const Scene& scene, const RenderOptions& options);
  /// Writes depth, normal, position and id of pixel `i`. @pre the normals of the hit are set
  void setHit(std::size_t i, const Camera& camera, const Hit& hit) const;
  /// Writes the curvatures and the principal directions of pixel `i`, of the layers that the
  /// picture has. @pre the normals of the hit are set
  void setCurvature(std::size_t i, const Hit& hit) const;
  /// @pre the picture has the layers of the light
  void setLight(std::size_t i, double sky, double key) const;
  /// @pre the picture has the layers of a volume
  void setVolume(std::size_t i, const VolumeLight& lit) const;
  /// Adds the header attribute ls:warning if rays gave up in a Bézier volume, and if pixels show a
  /// blended surface outside the band of a solid that contributes to it. It contains both warnings.
  void addWarnings(Image& image, const Scene& scene) const;
  /// Writes the colour of pixel `i` from the sum over `samples` rays.
  void setColour(std::size_t i, const ColourSum& sum, int samples) const;
};

/// Checks a scene and its options before a picture is drawn.
/// @throws levelset::UsageError for an invalid camera, light, opacity, sample count or style
///         option. Also for options that exclude each other: NanoVDB grids, a blended scene or
///         mapped textures with a filter other than trilinear, NanoVDB grids with a blended scene,
///         bspline-qi with quantized values, and thickness with mapped textures
/// @throws levelset::InvalidInput for bands that are narrower than the filter's stencil
/// @throws levelset::ResourceLimit for an image above the memory limit of the options, or above
///         kMaxPixels
/// @throws as requireFields() for blended scenes
void requirePicture(const Scene& scene, const RenderOptions& options);

/// Checks the opacities of all solids and meshes. @throws levelset::UsageError for an opacity
/// outside (0, 1]
void requireOpacity(const Scene& scene);

/// Checks the key light. @throws levelset::UsageError for an invalid light
void requireLight(const Scene& scene);

/// Throws the error for a scene without a surface. @throws levelset::InvalidInput always
[[noreturn]] void refuseEmptyScene();

/// Header attributes of a scene: ls:grid (name and content hash of each solid), ls:voxelSize, and
/// the options that determine the layers.
[[nodiscard]] std::map<std::string, std::string> sceneAttributes(const Scene& scene,
                                                                 const RenderOptions& options);

/// Completes the colours of a picture after all pixels are painted: draws Style::CurvatureLines.
/// Other styles do not change. @param diagonal  of the bounding box of the surfaces, world units
void finishColours(Image& image, const Scene& scene, const RenderOptions& options, double diagonal);

/// Adds header attributes of the view: software, camera matrices, depths (ls:near and ls:far, if
/// set), the meaning of Z, and ls:extent.
/// @param extent  diagonal of the bounding box of the surfaces, world units
void addViewAttributes(Image& image, const Scene& scene, double extent);

}  // namespace render
