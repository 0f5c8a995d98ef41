#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "apps/viewer/editing/deform_design.h"
#include "apps/viewer/editing/edit_history.h"
#include "apps/viewer/editing/picture_marks.h"
#include "render/camera.h"

namespace viewer {

/// Way from a point to a picture position, in the plane through the point that faces the camera,
/// or along an axis.
/// @param point  world units; @param place  pixels
/// @param axis  0, 1 or 2: the point of the line along world x, y or z that is nearest to the ray
/// through `place`; empty: in the plane
/// @return world units; empty where the line points at the eye, or the plane is behind it
[[nodiscard]] std::optional<Imath::V3d> dragOffset(const Imath::V3d& point, const Imath::V2d& place,
                                                   const render::Camera& camera,
                                                   const std::optional<int>& axis);

/// Moves control points with the mouse. Positions in the picture are in pixels.
class DeformEditor {
 public:
  explicit DeformEditor(const DeformDesign& design);

  /// The left button was pressed. On a control point: selects it and takes hold of all selected
  /// ones. Elsewhere the press is left to the camera, and false is returned.
  /// @param isAdding  true: adds the point to the selection or removes it, and other points stay
  /// selected
  [[nodiscard]] bool press(const Imath::V2d& place, const render::Camera& camera,
                           bool isAdding = false);
  /// Moves the points that are held. @return true when they have moved
  bool moveTo(const Imath::V2d& place, const render::Camera& camera);
  /// Lets go.
  void release();
  [[nodiscard]] bool isDragging() const { return isDragging_; }

  /// World axis along which points move; empty: in the plane that faces the camera.
  [[nodiscard]] std::optional<int> axis() const { return axis_; }
  void setAxis(const std::optional<int>& axis) { axis_ = axis; }

  // Changes of the design return true when it has changed.
  bool undo();
  bool redo();
  /// Moves all selected points back to rest, or all points if none is selected.
  bool reset();
  [[nodiscard]] bool canUndo() const { return history_.canUndo(); }
  [[nodiscard]] bool canRedo() const { return history_.canRedo(); }

  void selectNone();
  void selectAll();
  /// Adds the layer across a lattice axis of each selected point.
  void selectLayer(int axis) { design_.growAlongLayer(axis, isSelected_); }
  [[nodiscard]] std::size_t selectedCount() const;

  [[nodiscard]] const DeformDesign& design() const { return design_; }

  /// Lines of the control net, and its points.
  [[nodiscard]] std::vector<PictureStroke> strokes(const render::Camera& camera) const;
  [[nodiscard]] std::vector<PictureMark> marks(const render::Camera& camera) const;

 private:
  using Points = std::vector<Imath::V3d>;
  [[nodiscard]] std::optional<std::size_t> pointAt(const Imath::V2d& place,
                                                   const render::Camera& camera) const;
  bool take(Points points);

  DeformDesign design_;
  std::vector<std::array<std::size_t, 2>> net_;
  std::vector<char> isSelected_;
  EditHistory<Points> history_;
  std::optional<int> axis_;
  bool isDragging_ = false;
  std::size_t held_ = 0;   // point under the pointer
  Points start_;           // control points when the drag began
  Imath::V2d grip_{0, 0};  // from the pointer to the point that is held, pixels
};

}  // namespace viewer
