#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "render/hit.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

// Common parts of the pictures of all renderers.
namespace render {

/// Accumulated colour of the rays of a pixel.
struct ColourSum {
  Imath::C3f colour{0};
  double coverage = 0;
  /// Adds a surface. @param share  part of the ray that ends there: opacity times remaining
  /// transmittance
  void add(const Imath::C3f& seen, double share) {
    colour += seen * static_cast<float>(share);
    coverage += share;
  }
};

/// The layers of a picture, as plain pointers for the tiles.
struct PictureLayers {
  float *r, *g, *b, *a, *z;
  float *n[3], *p[3];
  float* curvature[4] = {};
  float* thickness = nullptr;
  std::uint32_t* id;
  mutable std::atomic<std::size_t> beyondBand = 0;  ///< number of hits with Hit::isBeyondBand

  PictureLayers(Image& image, const RenderOptions& options);
  /// Writes the data layers of pixel `i` from a hit with known normals.
  void setHit(std::size_t i, const Camera& camera, const Hit& hit) const;
  void setCurvature(std::size_t i, const CurvatureSample& sample) const;
  /// Adds the header attribute ls:warning when the user should know of a limitation.
  void addWarnings(Image& image, const Scene& scene) const;
  /// Writes the colour of pixel `i` from the sum over `samples` rays.
  void setColour(std::size_t i, const ColourSum& sum, int samples) const;
};

/// Checks a scene and its options before a picture is drawn.
/// @throws levelset::UsageError for an invalid camera or light, opacities outside (0, 1], or sample
///         counts out of range; for blended scenes also for a filter that is not trilinear, and for
///         NanoVDB grids
/// @throws levelset::InvalidInput for bands that are narrower than the filter's stencil
/// @throws levelset::ResourceLimit for an image that is too large
/// @throws as requireFields() for blended scenes
void requirePicture(const Scene& scene, const RenderOptions& options);

/// Checks all opacities. @throws levelset::UsageError for an opacity outside (0, 1]
void requireOpacity(const Scene& scene);

/// Checks the key light. @throws levelset::UsageError for an invalid light
void requireLight(const Scene& scene);

/// Reports that a scene has no surface. @throws levelset::InvalidInput always
[[noreturn]] void refuseEmptyScene();

/// Header attributes of a scene: ls:grid (name and content hash of each solid), ls:voxelSize, and
/// the parameters of the layers.
[[nodiscard]] std::map<std::string, std::string> sceneAttributes(const Scene& scene,
                                                                 const RenderOptions& options);

/// Adds header attributes of the view: software, camera matrices, depths (ls:near and ls:far, if
/// set), the meaning of Z, and ls:extent.
/// @param extent  diagonal of the bounding box of the surfaces, world units
void addViewAttributes(Image& image, const Scene& scene, double extent);

}  // namespace render
