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

/// A clip plane through the solids, perpendicular to an axis or to the view.
struct ClipPlane {
  enum class Across { X, Y, Z, View };
  Across across = Across::X;
  /// Position, world units: the coordinate along the axis; for View, the distance in front of the
  /// centre of the solids.
  double offset = 0;
  bool operator==(const ClipPlane&) const = default;
};

/// Parses "x=0.1", "y=…", "z=…" or "view=…". @throws levelset::UsageError
[[nodiscard]] ClipPlane parseClipPlane(const std::string& text);

/// A clip plane in world space, with its side.
struct PlacedPlane {
  Imath::V3d point, normal;  ///< unit normal, towards the eye
};
/// Places the plane for a camera. @param bounds  box of the solids, not empty
[[nodiscard]] PlacedPlane placed(const ClipPlane& clip, const render::Camera& camera,
                                 const Imath::Box3d& bounds);

/// A scene clipped by a plane: a large box in front of the plane is subtracted from the solids. Its
/// faces are flat, so a few large voxels represent them exactly.
class ClippedScene {
 public:
  /// @param bounds  box of the solids, not empty
  ClippedScene(const render::Scene& scene, const Imath::Box3d& bounds, ClipPlane::Across across);
  /// Returns the scene with the box in front of `plane`, which must be of the given kind.
  [[nodiscard]] const render::Scene& at(const PlacedPlane& plane);

 private:
  render::Scene scene_;
  levelset::NarrowBand box_;  // subtracted box; it begins at the plane z = 0 and lies above it
};

/// Paints φ on the plane over the surfaces behind it: blue inside and brown outside, up to the end
/// of the bands. Contours at each integer number of voxels are drawn where they are far enough
/// apart; the zero contour is black.
/// @param colours  four bytes for each pixel of the image
void paintPhi(const render::Image& image, const render::Camera& camera, const PlacedPlane& plane,
              const render::Scene& scene, std::vector<std::uint8_t>& colours);

/// Combines φ of the solids to φ of the drawn shape, world units; infinite without solids.
/// @param values  φ of the solids
[[nodiscard]] double scenePhi(const render::Scene& scene, const std::vector<double>& values);

}  // namespace viewer
