#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "apps/viewer/editing/patch_design.h"
#include "apps/viewer/editing/picture_marks.h"
#include "apps/viewer/model/model.h"
#include "render/camera.h"

namespace viewer {

/// Makes and edits the outline of a patch with the mouse. Positions in the picture are in pixels.
/// All points lie on φ = 0 of the model's solid, where the ray through the pointer meets it.
class PatchEditor {
 public:
  /// @param base  model with one solid, see whyNoPatch()
  explicit PatchEditor(std::shared_ptr<const Model> base, PatchDesign design = {});

  /// The left button was pressed. On a corner or side point: takes hold of it. On the surface with
  /// fewer than four corners: adds a corner. On a side: adds a point to it. Otherwise the press is
  /// left to the camera, and false is returned.
  [[nodiscard]] bool press(const Imath::V2d& place, const render::Camera& camera);
  /// Moves the point that is held. It stays where it is while the pointer is beside the surface.
  /// @return true when the design has changed
  bool moveTo(const Imath::V2d& place, const render::Camera& camera);
  /// Lets go. Brings four new corners into anticlockwise order.
  void release();
  [[nodiscard]] bool isDragging() const { return isDragging_; }
  /// Removes the point that was held last. Removing a corner also removes all points on sides.
  /// @return true when the design has changed
  bool removeSelected();

  /// Newest geodesics of the sides, which press() and strokes() use.
  void setSides(const PatchPaths& sides) { sides_ = sides; }

  [[nodiscard]] const PatchDesign& design() const { return design_; }
  /// Changes texture, columns and relief. @param changed  its corners and sides are ignored
  void setTexture(const PatchDesign& changed);

  /// Lines of the sides. A line behind the surface lies on a part that faces away.
  [[nodiscard]] std::vector<PictureStroke> strokes(const render::Camera& camera) const;
  /// Corners, and points of the sides.
  [[nodiscard]] std::vector<PictureMark> marks(const render::Camera& camera) const;

 private:
  /// A corner, or a point of a side.
  struct Handle {
    std::optional<std::size_t> side;  // empty: a corner
    std::size_t index = 0;
    bool operator==(const Handle&) const = default;
  };
  [[nodiscard]] std::vector<Handle> handles() const;
  [[nodiscard]] const Imath::V3d& pointOf(const Handle& handle) const;
  [[nodiscard]] bool facesAway(const Imath::V3d& point, const render::Camera& camera) const;
  [[nodiscard]] std::optional<Imath::V3d> surfaceAt(const Imath::V2d& place,
                                                    const render::Camera& camera) const;
  [[nodiscard]] std::optional<Handle> handleAt(const Imath::V2d& place,
                                               const render::Camera& camera) const;
  [[nodiscard]] std::optional<Handle> addToSide(const Imath::V2d& place,
                                                const render::Camera& camera);

  std::shared_ptr<const Model> base_;
  PatchDesign design_;
  PatchPaths sides_;
  std::optional<Handle> selected_;
  bool isDragging_ = false;
  Imath::V2d grip_{0, 0};  // from the pointer to the point that is held, pixels
};

}  // namespace viewer
