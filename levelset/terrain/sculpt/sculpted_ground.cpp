#include "levelset/terrain/sculpt/sculpted_ground.h"

#include <algorithm>
#include <deque>
#include <utility>
#include <vector>

#include "levelset/terrain/sculpt/pyramid_errors.h"

namespace levelset {
namespace terrain {

/// Heights of a rectangle: those before a change, or after it was undone those behind it.
struct HeightChange {
  SampleRange range;
  std::vector<float> heights;

  HeightChange(const HeightField& field, const SampleRange& changed) : range(changed) {
    heights.reserve(static_cast<std::size_t>(range.columns()) *
                    static_cast<std::size_t>(range.rows()));
    for (int row = range.firstRow; row <= range.lastRow; ++row) {
      const auto first =
          field.heights.begin() + static_cast<std::ptrdiff_t>(field.index(range.firstColumn, row));
      heights.insert(heights.end(), first, first + range.columns());
    }
  }

  void swapWith(HeightField& field) {
    auto from = heights.begin();
    for (int row = range.firstRow; row <= range.lastRow; ++row, from += range.columns())
      std::swap_ranges(
          from, from + range.columns(),
          field.heights.begin() + static_cast<std::ptrdiff_t>(field.index(range.firstColumn, row)));
  }
};

using Stroke = std::vector<HeightChange>;

inline std::size_t bytesOf(const Stroke& stroke) {
  std::size_t bytes = 0;
  for (const HeightChange& change : stroke)
    bytes += sizeof change + change.heights.size() * sizeof(float);
  return bytes;
}

inline SampleRange united(const SampleRange& a, const SampleRange& b) {
  if (a.isEmpty()) return b;
  if (b.isEmpty()) return a;
  return {.firstColumn = std::min(a.firstColumn, b.firstColumn),
          .firstRow = std::min(a.firstRow, b.firstRow),
          .lastColumn = std::max(a.lastColumn, b.lastColumn),
          .lastRow = std::max(a.lastRow, b.lastRow)};
}

}  // namespace terrain

struct SculptedGround::State {
  State(HeightField given, const SculptOptions& options)
      : field(std::move(given)),
        changes(field),
        undoMemory(options.undoMemory),
        maxMemory(options.maxMemory) {}

  /// Exchanges the heights of a stroke. @param isForward  the first change goes first
  SampleRange exchange(terrain::Stroke& stroke, bool isForward) {
    if (isForward)
      for (auto change = stroke.begin(); change != stroke.end(); ++change) change->swapWith(field);
    else
      for (auto change = stroke.rbegin(); change != stroke.rend(); ++change)
        change->swapWith(field);
    SampleRange changed;
    for (const terrain::HeightChange& change : stroke) {
      errors->update(field, change.range);
      changed = terrain::united(changed, change.range);
    }
    return changed;
  }

  void limitUndo() {
    while (undoBytes > undoMemory && done.size() > 1) {
      undoBytes -= terrain::bytesOf(done.front());
      done.pop_front();
    }
  }

  HeightField field;
  GroundChanges changes;
  std::size_t undoMemory, maxMemory;
  std::unique_ptr<terrain::PyramidErrors> errors;
  std::deque<terrain::Stroke> done;
  std::vector<terrain::Stroke> undone;  // the last one is redone first
  std::size_t undoBytes = 0;            // of the strokes that are done
  bool startsStroke = true;
};

SculptedGround::SculptedGround(HeightField field, const SculptOptions& options) {
  requireHeights(field);
  state_ = std::make_unique<State>(std::move(field), options);
  if (options.edits) {
    applyEdits(state_->field, *options.edits);
    state_->changes.add(*options.edits);
  }
  state_->errors = std::make_unique<terrain::PyramidErrors>(
      state_->field,
      PyramidOptions{
          .cells = options.cells, .maxMemory = options.maxMemory, .progress = options.progress});
}

SculptedGround::~SculptedGround() = default;

const HeightField& SculptedGround::field() const {
  return state_->field;
}

const HeightPyramid& SculptedGround::pyramid() const {
  return state_->errors->pyramid();
}

void SculptedGround::beginStroke() {
  state_->startsStroke = true;
}

SampleRange SculptedGround::apply(const BrushDab& dab) {
  requireDab(dab);
  const SampleRange range = dabRange(state_->field, dab);
  if (range.isEmpty()) return range;
  terrain::HeightChange change(state_->field, range);
  applyDab(state_->field, dab, state_->maxMemory);
  if (std::exchange(state_->startsStroke, false)) {
    state_->done.emplace_back();
    state_->undone.clear();
  }
  state_->undoBytes += sizeof change + change.heights.size() * sizeof(float);
  state_->done.back().push_back(std::move(change));
  state_->limitUndo();
  state_->changes.add(range);
  state_->errors->update(state_->field, range);
  return range;
}

bool SculptedGround::canUndo() const {
  return !state_->done.empty();
}

bool SculptedGround::canRedo() const {
  return !state_->undone.empty();
}

SampleRange SculptedGround::undo() {
  if (!canUndo()) return {};
  state_->startsStroke = true;
  state_->undone.push_back(std::move(state_->done.back()));
  state_->done.pop_back();
  state_->undoBytes -= terrain::bytesOf(state_->undone.back());
  return state_->exchange(state_->undone.back(), false);
}

SampleRange SculptedGround::redo() {
  if (!canRedo()) return {};
  state_->startsStroke = true;
  state_->done.push_back(std::move(state_->undone.back()));
  state_->undone.pop_back();
  state_->undoBytes += terrain::bytesOf(state_->done.back());
  return state_->exchange(state_->done.back(), true);
}

GroundEdits SculptedGround::edits() const {
  return state_->changes.edits(state_->field);
}

}  // namespace levelset
