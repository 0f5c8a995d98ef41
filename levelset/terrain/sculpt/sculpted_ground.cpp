#include "levelset/terrain/sculpt/sculpted_ground.h"

#include <algorithm>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/terrain/sculpt/followed_pyramid.h"

namespace levelset {
namespace terrain {

/// Heights of a rectangle: the old ones, or after an undo the new ones.
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

/// Tiles that a stroke changes, each one as it was before the first dab. So a stroke takes at most
/// the memory of the field.
struct Stroke {
  std::map<std::pair<int, int>, HeightChange> tiles;  // by row and column
};

inline std::size_t bytesOf(const Stroke& stroke) {
  std::size_t bytes = 0;
  for (const auto& [place, change] : stroke.tiles)
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

  /// Adds the tiles of a range to a stroke, with their heights, unless they are in `has`.
  void keepTiles(const SampleRange& range, terrain::Stroke& to, const terrain::Stroke& has) const {
    for (int row = range.firstRow / kEditTile; row <= range.lastRow / kEditTile; ++row)
      for (int column = range.firstColumn / kEditTile; column <= range.lastColumn / kEditTile;
           ++column) {
        if (has.tiles.contains({row, column})) continue;
        const SampleRange tile{.firstColumn = column * kEditTile,
                               .firstRow = row * kEditTile,
                               .lastColumn = std::min((column + 1) * kEditTile, field.columns) - 1,
                               .lastRow = std::min((row + 1) * kEditTile, field.rows) - 1};
        to.tiles.try_emplace({row, column}, field, tile);
      }
  }

  /// Exchanges the heights of a stroke.
  SampleRange exchange(terrain::Stroke& stroke) {
    SampleRange changed;
    for (auto& [place, change] : stroke.tiles) {
      change.swapWith(field);
      changed = terrain::united(changed, change.range);
    }
    // Tiles share patches and coarse cells. A compact stroke is measured once, a long one by tile.
    const double box = static_cast<double>(changed.columns()) * changed.rows();
    if (box <= 2.0 * kEditTile * kEditTile * static_cast<double>(stroke.tiles.size()))
      errors->update(field, changed);
    else
      for (const auto& [place, change] : stroke.tiles) errors->update(field, change.range);
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
  std::unique_ptr<terrain::FollowedPyramid> errors;
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
  state_->errors = std::make_unique<terrain::FollowedPyramid>(
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
  const SampleRange reached = dabRange(state_->field, dab);
  if (reached.isEmpty()) return reached;
  const terrain::Stroke none;
  terrain::Stroke kept;
  // Tiles reach beyond the range by less than one tile on each side.
  requireMemory(
      (reached.columns() + 2.0 * kEditTile) * (reached.rows() + 2.0 * kEditTile) * sizeof(float),
      memoryLeft(memoryLimit(state_->maxMemory)));
  state_->keepTiles(reached, kept, state_->startsStroke ? none : state_->done.back());
  const SampleRange range = applyDab(state_->field, dab, state_->maxMemory);
  if (range.isEmpty()) return range;
  if (std::exchange(state_->startsStroke, false)) {
    state_->done.emplace_back();
    state_->undone.clear();
  }
  state_->undoBytes += terrain::bytesOf(kept);
  state_->done.back().tiles.merge(kept.tiles);
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
  return state_->exchange(state_->undone.back());
}

SampleRange SculptedGround::redo() {
  if (!canRedo()) return {};
  state_->startsStroke = true;
  state_->done.push_back(std::move(state_->undone.back()));
  state_->undone.pop_back();
  state_->undoBytes += terrain::bytesOf(state_->done.back());
  return state_->exchange(state_->done.back());
}

GroundEdits SculptedGround::edits() const {
  return state_->changes.edits(state_->field);
}

}  // namespace levelset
