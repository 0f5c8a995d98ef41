#pragma once

#include <memory>

#include "levelset/progress.h"
#include "render/image.h"
#include "render/scene.h"

/// The judge: first zero of the trilinear interpolant along each ray, solved in double precision on
/// OpenVDB's own tree; Embree only finds the leaf blocks. It may be slow, it may not be wrong.
namespace render {

struct EmbreeOptions {
  int samples = 4;            ///< per pixel, colour only; data layers come from the pixel centre
  int ambientSamples = 16;    ///< per colour sample; 0: none
  int shadowSamples = 4;      ///< 0: none
  bool curvature = true;      ///< layers curvature.mean .gauss .k1 .k2
  levelset::Progress progress = {};
};

/// @return layers R G B A Z N.X N.Y N.Z P.X P.Y P.Z curvature.* id, as the command line names them
/// @throws levelset::UsageError for a camera that cannot see; levelset::ResourceLimit for an image too large
[[nodiscard]] Image renderEmbree(const Scene& scene, const EmbreeOptions& options = {});

struct Hit {
  bool found = false;
  double distance = 0;        ///< along the unit direction
  Imath::V3d position, normal;
  std::uint32_t id = 0;
};

/// The scene made ready for rays.
class EmbreeScene {
 public:
  explicit EmbreeScene(const Scene& scene);
  ~EmbreeScene();
  EmbreeScene(EmbreeScene&&) noexcept;
  /// First hit beyond `near`. A ray that starts inside hits where it leaves.
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction, double near = 0,
                              double far = 1e300) const;
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                double far) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace render
