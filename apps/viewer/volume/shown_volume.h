#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "levelset/volumes/histogram.h"
#include "render/direct/direct_volume.h"
#include "render/filter.h"
#include "render/scene/scene.h"
#include "render/volumes/volume_surface.h"

namespace viewer {

/// A volume that the viewer shows, with the histogram of its values.
struct ShownVolume {
  render::VolumeSurface surface;  ///< isosurface of the first suggested isovalue
  levelset::VolumeHistogram histogram;
};

/// Prepares a volume for the viewer. Numbers in a mapped file are copied.
/// @throws levelset::Cancelled
[[nodiscard]] ShownVolume shownVolume(levelset::Volume volume,
                                      const levelset::Progress& progress = {});

/// Isosurface of a volume in a view. A change of it needs new rays.
struct IsosurfaceView {
  bool isShown = true;
  double isovalue = 0;
  render::VolumeInside inside = render::VolumeInside::Above;
  render::Filter filter = render::Filter::Trilinear;
  bool operator==(const IsosurfaceView&) const = default;
};

/// Light of a volume in a view. A change of it needs new rays.
struct LightView {
  std::vector<render::TransferPoint> transfer = {};  ///< empty: the volume has no light of its own
  bool isShaded = true;                              ///< colours depend on the gradient
  bool operator==(const LightView&) const = default;
};

/// Slices through a volume, parallel to the planes of its grid. They show the trilinear
/// interpolant as shades of grey.
struct SliceView {
  /// For each axis i, j, k of the grid: position of the slice across it, grid index; unset: none.
  std::array<std::optional<double>, 3> at = {};
  double black = 0, white = 1;  ///< values shown as black and as white
  bool operator==(const SliceView&) const = default;
  [[nodiscard]] bool isEmpty() const { return !at[0] && !at[1] && !at[2]; }
};

/// Isosurface and slices that are shown first: the first suggested isovalue, no slices, and greys
/// that cover all values but half a percent at both ends.
[[nodiscard]] IsosurfaceView firstIsosurface(const ShownVolume& volume);
[[nodiscard]] SliceView firstSlices(const ShownVolume& volume);

/// The volume with a transfer function. @pre the view has a transfer function
[[nodiscard]] render::DirectVolume directVolume(const ShownVolume& volume, const LightView& view);

/// Replaces the solids of a scene by the isosurface of a view, or by nothing if it is not shown.
void placeIsosurface(const ShownVolume& volume, const IsosurfaceView& view, render::Scene& scene);

/// Parses the positions of slices, for example "i=90,k=60.5".
/// @throws levelset::UsageError for any other text
[[nodiscard]] std::array<std::optional<double>, 3> parseSlices(const std::string& text);

/// Operator that makes a solid of the isosurface, for example "isosurface 40 --filter cubic-c1".
[[nodiscard]] std::string isosurfaceText(const IsosurfaceView& view);
/// Options of `render` that draw the light, and the isosurface if it is shown.
/// @pre the light has a transfer function
[[nodiscard]] std::string lightText(const LightView& view, const IsosurfaceView& isosurface);

}  // namespace viewer
