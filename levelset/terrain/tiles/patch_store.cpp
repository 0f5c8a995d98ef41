#include "levelset/terrain/tiles/patch_store.h"

#include <algorithm>
#include <utility>

namespace levelset {
namespace {

class FieldPatchStore final : public PatchStore {
 public:
  FieldPatchStore(std::shared_ptr<const HeightField> field, HeightPyramid pyramid)
      : field_(std::move(field)),
        layout_{.columns = field_->columns,
                .rows = field_->rows,
                .origin = field_->origin,
                .spacing = field_->spacing,
                .coordinateSystem = field_->coordinateSystem,
                .isGeographic = field_->isGeographic,
                .pyramid = std::move(pyramid)} {}

  const GroundLayout& layout() const override { return layout_; }

  void readPatch(int level, int column, int row, std::span<float> heights) const override {
    const std::int64_t cells = layout_.pyramid.cells;
    const auto sampleAt = [&](int patch, std::int64_t n, int samples) {
      return static_cast<int>(std::min<std::int64_t>((patch * cells + n) << level, samples - 1));
    };
    std::size_t n = 0;
    for (std::int64_t j = 0; j <= cells; ++j) {
      const int sampleRow = sampleAt(row, j, field_->rows);
      for (std::int64_t i = 0; i <= cells; ++i)
        heights[n++] = field_->at(sampleAt(column, i, field_->columns), sampleRow);
    }
  }

 private:
  std::shared_ptr<const HeightField> field_;
  GroundLayout layout_;
};

}  // namespace

std::unique_ptr<PatchStore> patchStoreOf(std::shared_ptr<const HeightField> field,
                                         HeightPyramid pyramid) {
  return std::make_unique<FieldPatchStore>(std::move(field), std::move(pyramid));
}

}  // namespace levelset
