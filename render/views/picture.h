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

// What all renderers' pictures have in common.
namespace render {

/// Colours of what a pixel's rays meet, added up.
struct ColourSum {
  Imath::C3f colour{0};
  double coverage = 0;
  /// @param share  of the ray that ends there: its surface's opacity times what comes so far
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
  mutable std::atomic<std::size_t> beyondBand = 0;  ///< how many hits are

  PictureLayers(Image& image, const RenderOptions& options);
  /// Of pixel `i`, from a hit whose normals are known.
  void setHit(std::size_t i, const Camera& camera, const Hit& hit) const;
  void setCurvature(std::size_t i, const CurvatureSample& sample) const;
  /// Header attributes for what a user should know: ls:warning.
  void addWarnings(Image& image, const Scene& scene) const;
  /// From the sum over `samples`.
  void setColour(std::size_t i, const ColourSum& sum, int samples) const;
};

/// @throws levelset::UsageError for a camera that cannot see, a light that cannot shine, parts that
///         cannot be seen or sample counts out of range; levelset::ResourceLimit for an image too
///         large; levelset::InvalidInput for bands narrower than the filter reaches; for blended
///         scenes also as requireFields(), and levelset::UsageError for filters but the trilinear
///         one and for NanoVDB grids
void requirePicture(const Scene& scene, const RenderOptions& options);

/// @throws levelset::UsageError for an opacity that is not in (0, 1]
void requireOpacity(const Scene& scene);

/// @throws levelset::UsageError for a light that cannot shine
void requireLight(const Scene& scene);

/// @throws levelset::InvalidInput
[[noreturn]] void refuseEmptyScene();

/// ls:grid (name and content hash of each solid), ls:voxelSize, and how layers are made.
[[nodiscard]] std::map<std::string, std::string> sceneAttributes(const Scene& scene,
                                                                 const RenderOptions& options);

/// Software, camera matrices and depths (ls:near, ls:far, if set), what Z is, and ls:extent.
/// @param extent  diagonal of the surfaces' box, world units
void addViewAttributes(Image& image, const Scene& scene, double extent);

}  // namespace render
