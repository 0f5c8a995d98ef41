#pragma once

#include <cstddef>
#include <memory>

#include "levelset/terrain/height_pyramid.h"
#include "levelset/terrain/sculpt/brush.h"
#include "levelset/terrain/sculpt/ground_edits.h"

namespace levelset {

struct SculptOptions {
  int cells = 64;  ///< cells along a side of a patch of the pyramid, as in PyramidOptions
  /// Bytes for undo and redo. The oldest strokes are dropped beyond it, but not the last one. A
  /// stroke keeps each tile of kEditTile² samples once.
  std::size_t undoMemory = std::size_t{256} << 20;
  const GroundEdits* edits = nullptr;  ///< earlier edits of the field, applied first; may be null
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// A terrain that is changed by brushes, with undo and redo. Its pyramid follows each change: only
/// the parts below the brush are measured again.
class SculptedGround {
 public:
  /// @throws as heightPyramid() and applyEdits()
  explicit SculptedGround(HeightField field, const SculptOptions& options = {});
  ~SculptedGround();
  SculptedGround(const SculptedGround&) = delete;
  SculptedGround& operator=(const SculptedGround&) = delete;

  [[nodiscard]] const HeightField& field() const;
  /// Equals heightPyramid() of field() to the bit.
  [[nodiscard]] const HeightPyramid& pyramid() const;

  /// Begins a stroke: the dabs until the next call are undone together. Removes what could be
  /// redone with the first dab.
  void beginStroke();
  /// Applies a dab to the last stroke.
  /// @return the samples that may have changed
  /// @throws as applyDab(); the ground is unchanged then
  SampleRange apply(const BrushDab& dab);

  [[nodiscard]] bool canUndo() const;
  [[nodiscard]] bool canRedo() const;
  /// Gives all heights the bits that they had before the last stroke.
  /// @return the samples that may have changed; empty if there is no stroke
  SampleRange undo();
  /// Gives all heights the bits that they had before undo().
  SampleRange redo();

  /// Heights of all tiles that strokes and options.edits may have changed.
  [[nodiscard]] GroundEdits edits() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace levelset
