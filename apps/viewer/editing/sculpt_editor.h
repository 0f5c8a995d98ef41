#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/viewer/editing/picture_marks.h"
#include "apps/viewer/model/model.h"
#include "levelset/terrain/sculpt/sculpted_ground.h"
#include "render/camera.h"

namespace viewer {

enum class Brush { Raise, Lower, Smooth, Flatten, Noise, Erode };
inline constexpr std::array<Brush, 6> kBrushes = {Brush::Raise,   Brush::Lower, Brush::Smooth,
                                                  Brush::Flatten, Brush::Noise, Brush::Erode};
[[nodiscard]] const char* brushName(Brush brush);

/// What a press of the left button does.
struct BrushChoice {
  Brush brush = Brush::Raise;
  double radius = 0;   ///< world units
  double height = 0;   ///< Raise, Lower and Noise: change by each dab in the middle, world units
  double share = 0.5;  ///< Smooth, Flatten and Erode: strength of each dab, 0 to 1
};

/// First point at which a ray meets the triangles of a ground, to a millionth of a cell. Triangles
/// with a missing corner are not met. Ridges that the ray cuts for less than half a cell may be
/// missed.
[[nodiscard]] std::optional<Imath::V3d> groundUnder(const levelset::HeightField& field,
                                                    const render::Camera::Ray& ray);

/// Returns why the ground of a model cannot be sculpted; empty if it can.
[[nodiscard]] std::string whyNoSculpting(const Model& model);

/// Changes the heights of a terrain with the mouse. Positions in the picture are in pixels.
class SculptEditor {
 public:
  /// @param edits  earlier edits of the terrain; may be null
  /// @pre whyNoSculpting() is empty
  /// @throws as levelset::SculptedGround
  explicit SculptEditor(const std::shared_ptr<const Model>& model,
                        const levelset::GroundEdits* edits = nullptr);

  [[nodiscard]] const BrushChoice& choice() const { return choice_; }
  /// Numbers out of range become the nearest valid ones: radii of one and a half spacings or more.
  void setChoice(const BrushChoice& choice);

  /// The left button was pressed. On the ground: begins a stroke with a dab. Elsewhere the press is
  /// left to the camera, and false is returned.
  /// @throws as levelset::SculptedGround::apply()
  [[nodiscard]] bool press(const Imath::V2d& place, const render::Camera& camera);
  /// The pointer was moved. During a stroke there is a dab at each quarter of the radius.
  /// @return true when heights have changed
  bool moveTo(const Imath::V2d& place, const render::Camera& camera);
  void release() { isDragging_ = false; }
  [[nodiscard]] bool isDragging() const { return isDragging_; }

  // Both return true when heights have changed.
  bool undo();
  bool redo();
  [[nodiscard]] bool canUndo() const { return ground_.canUndo(); }
  [[nodiscard]] bool canRedo() const { return ground_.canRedo(); }
  /// Heights have changed since noteSaved().
  [[nodiscard]] bool hasUnsaved() const { return hasUnsaved_; }
  void noteSaved() { hasUnsaved_ = false; }

  [[nodiscard]] const levelset::HeightField& field() const { return ground_.field(); }
  /// All changes, also the earlier ones.
  [[nodiscard]] levelset::GroundEdits edits() const { return ground_.edits(); }
  /// The actions 'sculpt' of all strokes, joined by '!'. They make the same bits, after the earlier
  /// edits. Empty without a stroke.
  [[nodiscard]] std::string actions() const;
  /// Model of the ground as it is now.
  [[nodiscard]] std::shared_ptr<const Model> model() const;

  /// Circle of the brush on the ground below the pointer; empty beside the ground.
  [[nodiscard]] std::vector<PictureStroke> strokes(const render::Camera& camera) const;

 private:
  struct Stroke {
    BrushChoice choice;
    std::vector<Imath::V2d> places;
  };
  void dabAt(const Imath::V2d& place);

  std::shared_ptr<const Model> base_;
  levelset::SculptedGround ground_;
  BrushChoice choice_;
  std::vector<Stroke> done_, undone_;
  bool isDragging_ = false, hasUnsaved_ = false;
  std::optional<Imath::V3d> pointer_;  // point of the ground below the pointer
};

}  // namespace viewer
