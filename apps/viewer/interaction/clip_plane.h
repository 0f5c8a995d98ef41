#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/viewer/model/model.h"
#include "render/camera.h"
#include "render/images/image.h"
#include "render/scene/scene.h"

namespace viewer {

/// A clip plane through the solids, perpendicular to an axis of world space or to the view axis.
struct ClipPlane {
  enum class Across { X, Y, Z, View };
  Across across = Across::X;
  /// Position of the plane, world units: its coordinate on the axis. For View: its distance from
  /// the centre of the box of the solids, towards the eye.
  double offset = 0;
  bool operator==(const ClipPlane&) const = default;
};

/// Parses "x=0.1", "y=…", "z=…" or "view=…". @throws levelset::UsageError for any other text
[[nodiscard]] ClipPlane parseClipPlane(const std::string& text);

/// A clip plane in world space.
struct PlacedPlane {
  Imath::V3d point, normal;  ///< a point of the plane, world units; unit normal, towards the eye
};
/// Converts a clip plane to world space for a camera. @param bounds  box of the solids, world
/// units, not empty
[[nodiscard]] PlacedPlane placed(const ClipPlane& clip, const render::Camera& camera,
                                 const Imath::Box3d& bounds);

/// A scene clipped by a plane: a large box between the plane and the eye is subtracted from the
/// solids. The faces of the box are flat, so a few large voxels represent them exactly.
class ClippedScene {
 public:
  /// @param bounds  box of the solids, world units, not empty
  /// @param across  axis of all planes that at() will be called with
  ClippedScene(const render::Scene& scene, const Imath::Box3d& bounds, ClipPlane::Across across);
  /// Moves the subtracted box to the front of `plane` and returns the clipped scene. The plane must
  /// be perpendicular to the axis `across` of the constructor.
  [[nodiscard]] const render::Scene& at(const PlacedPlane& plane);

 private:
  render::Scene scene_;
  levelset::NarrowBand box_;  // subtracted box in its initial position, above the plane z = 0
};

/// Paints φ on the plane over the picture of the surfaces behind the plane: blue inside and brown
/// outside, up to the largest half width of the bands. Contours of φ one voxel apart are drawn
/// where they are at least three pixels apart in the picture; the contour φ = 0 is black.
/// @param colours  red, green, blue and alpha of each pixel of the image, a byte each
void paintPhi(const render::Image& image, const render::Camera& camera, const PlacedPlane& plane,
              const render::Scene& scene, std::vector<std::uint8_t>& colours);

/// Combines the values φ of all solids at a point to φ of the drawn shape, world units. Returns
/// infinity without solids, and for expressions with Bézier volumes, which have no φ.
/// @param values  φ of each solid at the point, world units
[[nodiscard]] double scenePhi(const render::Scene& scene, const std::vector<double>& values);

}  // namespace viewer
