#pragma once

// Private to render: traced reflection and refraction.

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <vector>

#include "render/camera.h"
#include "render/hit.h"
#include "render/optics/environment_map.h"
#include "render/shading/optics_options.h"
#include "render/shading/shading.h"

namespace render {

/// Rays of any origin through a scene, by one of the renderers.
class SceneRays {
 public:
  virtual ~SceneRays() = default;
  /// First hits, also with transparent surfaces.
  [[nodiscard]] virtual std::vector<Hit> firstHits(const std::vector<Camera::Ray>& rays) const = 0;
  /// For each ray the share of its light that passes all surfaces.
  [[nodiscard]] virtual std::vector<double> transmittances(
      const std::vector<LightRay>& rays) const = 0;
};

/// A surface point on a ray of the camera.
struct SeenPoint {
  Hit hit;
  Imath::V3d direction;          ///< direction of the ray, unit length
  Imath::C3f own{0};             ///< linear colour without reflection and refraction
  int x = 0, y = 0, sample = 0;  ///< pixel, and number of its sample
};

/// Follows light paths from surface points against the light, over mirrors and through clear
/// solids.
///
/// At each surface a path splits into the surface's own colour, a mirrored and a refracted ray. The
/// shares of the three are those of the functions of fresnel.h, and sum to 1. There is no random
/// choice. A path ends at the environment. Behind the last bounce, and when the share of the pixel
/// is below kLeastTransmittance, the path takes the environment without tracing. So no light is
/// lost.
///
/// Solids are clear, and all have one index of refraction. A path counts the solids that it is in.
/// Where solids overlap, it is refracted at the surface of their union only. A transparent surface
/// (Hit::opacity) also lets a share of the path pass straight on.
class LightPaths {
 public:
  /// @param shader  must outlive this object
  /// @param diagonal  diagonal of the bounding box of the surfaces, world units
  /// @throws as EnvironmentMap()
  LightPaths(const Shader& shader, double diagonal, const OpticsOptions& options,
             std::size_t maxMemory);

  /// Linear colours of points: their own, and the light that they reflect and refract.
  [[nodiscard]] std::vector<Imath::C3f> colours(const SceneRays& rays,
                                                const std::vector<SeenPoint>& points) const;

 private:
  struct Path {
    Camera::Ray ray;
    std::size_t point;  // index of the point that it adds light to
    double share;       // part of the point's light
    int bounces;        // number of surfaces behind the point, with that which the ray may hit
    int inside;         // number of solids that the ray is in
  };
  /// Light of a surface towards a ray, as shares of its parts. Their sum is 1.
  struct Split {
    double own, mirror, clear;
    Imath::V3d mirrored, refracted;  // directions of the rays that bring the others
    Imath::V3d facet;                // unit normal of the drawn surface, against the ray
    int inside, insideBehind;        // number of solids in front of the surface and behind it
  };
  using Sums = std::vector<Imath::V3d>;  // colours of the points

  /// @param inside  number of solids that the ray is in
  [[nodiscard]] Split splitAt(const Hit& hit, const Imath::V3d& direction, int inside) const;
  [[nodiscard]] Camera::Ray rayFrom(const Hit& hit, const Imath::V3d& facet,
                                    const Imath::V3d& direction) const;
  /// Adds the mirrored and the refracted ray of a surface.
  /// @param parent  path that hits the surface, with the share of it that the surface receives
  void branch(const Hit& hit, const Split& split, const Path& parent, std::vector<Path>& paths,
              Sums& sums) const;
  /// Adds a path, or the light of the environment if the path is not traced.
  void add(const Path& path, std::vector<Path>& paths, Sums& sums) const;
  /// Follows paths to their next surfaces. @return the paths from there
  [[nodiscard]] std::vector<Path> follow(const SceneRays& rays,
                                         const std::vector<SeenPoint>& points,
                                         const std::vector<Path>& paths, Sums& sums) const;

  const Shader& shader_;
  double diagonal_;
  OpticsOptions options_;
  EnvironmentMap surroundings_;
};

}  // namespace render
