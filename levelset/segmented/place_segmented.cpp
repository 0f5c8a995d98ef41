#include "levelset/segmented/place_segmented.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "levelset/error.h"
#include "levelset/segmented/segmented_data_vdb.h"
#include "levelset/transform/moved_grid_vdb.h"

namespace levelset {

SegmentedField placeSegmented(const SegmentedField& field, const Imath::M44d& matrix) {
  if (!field.shared()) throw InvalidInput("the segmentation is empty; give one with a region");
  const MovedGrid moved = movedGrid(field.indexToWorld(), field.voxelSize(), field.halfWidth(),
                                    matrix, "transform the parts before 'segment'");
  const auto data = std::make_shared<SegmentedData>(*field.shared());
  data->transform = moved.transform;
  if (moved.scale == 1) return SegmentedField(data);
  data->voxelSize = moved.transform->voxelSize()[0];
  data->background = moved.background;
  const auto scaled = [&](float distance, float greatest) {
    return std::min(static_cast<float>(static_cast<double>(distance) * moved.scale), greatest);
  };
  // Rounding must not move a stored distance to the background, which means that none is stored.
  const float below = std::nextafter(moved.background, 0.0f);
  for (float& distance : data->distances) distance = scaled(distance, below);
  for (SegmentedExtra& extra : data->extras)
    extra.distance = scaled(extra.distance, moved.background);
  return SegmentedField(data);
}

}  // namespace levelset
