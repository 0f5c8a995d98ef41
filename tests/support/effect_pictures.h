#pragma once

#include <functional>
#include <limits>
#include <optional>

#include "render/camera.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/views/picture.h"

/// Pictures of surfaces with closed forms, with the layers of 'render'.
namespace support {

/// Point of a surface on a ray.
struct SurfacePoint {
  Imath::V3d position, normal;
};

/// Draws a surface by its intersections with rays, in a light grey.
/// @param extent  diagonal of the scene, for the header, world units
inline render::Image pictureOf(
    const render::Camera& camera,
    const std::function<std::optional<SurfacePoint>(const render::Camera::Ray&)>& surface,
    double extent) {
  render::Image image(camera.width, camera.height);
  for (const char* name : {"R", "G", "B", "A", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z"})
    image.addChannel(name);
  image.addChannel("Z", std::numeric_limits<float>::infinity());
  std::size_t i = 0;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x, ++i) {
      const std::optional<SurfacePoint> found = surface(camera.ray(x + 0.5, y + 0.5));
      if (!found) continue;
      image.channels["Z"][i] =
          static_cast<float>((found->position - camera.from).dot(camera.axis()));
      const char* axes[3] = {"X", "Y", "Z"};
      for (int a = 0; a < 3; ++a) {
        image.channels[std::string("N.") + axes[a]][i] = static_cast<float>(found->normal[a]);
        image.channels[std::string("P.") + axes[a]][i] = static_cast<float>(found->position[a]);
      }
      for (const char* name : {"R", "G", "B"}) image.channels[name][i] = 0.5f;
      image.channels["A"][i] = 1;
    }
  render::Scene scene;
  scene.camera = camera;
  render::addViewAttributes(image, scene, extent);
  return image;
}

/// Intersection of a ray with a plane.
inline std::optional<SurfacePoint> onPlane(const render::Camera::Ray& ray, const Imath::V3d& point,
                                           const Imath::V3d& normal) {
  const double slope = ray.direction.dot(normal);
  if (!(slope < 0)) return {};
  const double t = (point - ray.origin).dot(normal) / slope;
  if (!(t > 0)) return {};
  return SurfacePoint{ray.origin + ray.direction * t, normal};
}

/// First intersection of a ray with a ball.
inline std::optional<SurfacePoint> onBall(const render::Camera::Ray& ray, const Imath::V3d& middle,
                                          double radius) {
  const Imath::V3d offset = ray.origin - middle;
  const double b = offset.dot(ray.direction), c = offset.length2() - radius * radius;
  if (!(b * b >= c)) return {};
  const double t = -b - std::sqrt(b * b - c);
  if (!(t > 0)) return {};
  const Imath::V3d position = ray.origin + ray.direction * t;
  return SurfacePoint{position, (position - middle) / radius};
}

/// Orthographic camera that looks along −z, with pixels of one world unit.
inline render::Camera straightCamera(int width, int height) {
  render::Camera camera;
  camera.from = {0, 0, 100};
  camera.to = {0, 0, 0};
  camera.width = width;
  camera.height = height;
  camera.orthoHeight = height;
  return camera;
}

}  // namespace support
