#include "levelset/terrain/tiles/level_strip.h"

#include <algorithm>

#include "levelset/terrain/height_field.h"

namespace levelset::terrain {

LevelStrip::LevelStrip(int level, int columns, int rows, int cells)
    : level_(level),
      columns_(columns),
      rows_(rows),
      cells_(cells),
      width_(((columns - 2) >> level) + 2),
      height_(((rows - 2) >> level) + 2),
      heights_(static_cast<std::size_t>(width_) *
               static_cast<std::size_t>(std::min(cells + 1, height_))),
      known_(static_cast<std::size_t>(cells) + 1) {}

bool LevelStrip::has(int row) const {
  return (row >> level_) << level_ == row || row == rows_ - 1;
}

int LevelStrip::patchHeight() const {
  return std::min(cells_ + 1, height_ - patchRow_ * cells_);
}

int LevelStrip::patchWidth(int column) const {
  return std::min(cells_ + 1, width_ - column * cells_);
}

bool LevelStrip::take(int row, std::span<const float> heights, bool isNorthFirst) {
  const int number = row == rows_ - 1 ? height_ - 1 : row >> level_;
  if (patchRow_ < 0) patchRow_ = isNorthFirst ? (height_ - 2) / cells_ : 0;
  const int place = number - patchRow_ * cells_;
  known_[static_cast<std::size_t>(place)] = !heights.empty();
  if (!heights.empty()) {
    hasData_ = true;
    const std::span<float> to = rowAt(place);
    for (std::int64_t i = 0; i < width_; ++i)
      to[static_cast<std::size_t>(i)] =
          heights[static_cast<std::size_t>(std::min<std::int64_t>(i << level_, columns_ - 1))];
  }
  return place == (isNorthFirst ? 0 : patchHeight() - 1);
}

void LevelStrip::copyPatch(int column, std::vector<float>& heights) const {
  const auto across = static_cast<std::size_t>(patchWidth(column));
  const auto begin = heights_.begin() + static_cast<std::ptrdiff_t>(column) * cells_;
  heights.assign(across * static_cast<std::size_t>(patchHeight()), kMissingHeight);
  for (int j = 0; j < patchHeight(); ++j)
    if (known_[static_cast<std::size_t>(j)])
      std::copy_n(begin + static_cast<std::ptrdiff_t>(j) * width_, across,
                  heights.begin() + static_cast<std::ptrdiff_t>(across) * j);
}

void LevelStrip::advance(bool isNorthFirst) {
  // The border becomes the other end of the next row of patches.
  const int from = isNorthFirst ? 0 : cells_, to = isNorthFirst ? cells_ : 0;
  patchRow_ += isNorthFirst ? -1 : 1;
  if (patchRow_ < 0 || patchRow_ * cells_ >= height_ - 1) return;  // was the last one
  const bool isKnown = known_[static_cast<std::size_t>(from)];
  if (isKnown) {
    const std::span<float> border = rowAt(from);
    std::copy(border.begin(), border.end(), rowAt(to).begin());
  }
  std::fill(known_.begin(), known_.end(), 0);
  known_[static_cast<std::size_t>(to)] = isKnown;
  hasData_ = isKnown;
}

}  // namespace levelset::terrain
