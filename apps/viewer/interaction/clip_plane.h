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

/// A plane across an axis, or across the view, through the solids.
struct ClipPlane {
  enum class Across { X, Y, Z, View };
  Across across = Across::X;
  /// World units: the coordinate; across the view, how far before the middle of the solids.
  double offset = 0;
  bool operator==(const ClipPlane&) const = default;
};

/// "x=0.1", "y=…", "z=…" or "view=…". @throws levelset::UsageError
[[nodiscard]] ClipPlane parseClipPlane(const std::string& text);

/// Where the plane is, from one side.
struct PlacedPlane {
  Imath::V3d point, normal;  ///< normal of unit length, towards the eye
};
/// @param bounds  of the solids, not empty
[[nodiscard]] PlacedPlane placed(const ClipPlane& clip, const render::Camera& camera,
                                 const Imath::Box3d& bounds);

/// A scene without what lies before a plane: one more solid, a box, is taken off the others. Its
/// faces are flat, so that a few large voxels tell them exactly.
class ClippedScene {
 public:
  /// @param bounds  of the solids, not empty
  ClippedScene(const render::Scene& scene, const Imath::Box3d& bounds, ClipPlane::Across across);
  /// With the box before that plane, which is across as told.
  [[nodiscard]] const render::Scene& at(const PlacedPlane& plane);

 private:
  render::Scene scene_;
  levelset::NarrowBand box_;  // what is taken off begins in the plane z = 0 and lies above
};

/// Paints the level set on the plane over what lies behind it: blue inside and brown outside as far
/// as the bands reach, a line at each whole voxel where they are far enough apart, a black one
/// at zero.
/// @param colours  four bytes for each pixel of the image
void paintPhi(const render::Image& image, const render::Camera& camera, const PlacedPlane& plane,
              const render::Scene& scene, std::vector<std::uint8_t>& colours);

/// φ of what a scene draws, world units; infinite without
/// solids. @param values  of those
[[nodiscard]] double scenePhi(const render::Scene& scene, const std::vector<double>& values);

}  // namespace viewer
