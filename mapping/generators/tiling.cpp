#include "mapping/generators/tiling.h"

namespace mapping {

using Imath::V3d;

TileBox tileBox(const Tiling& tiling, const Imath::V2d& period, double low, double high,
                const V3d& center) {
  const V3d half(tiling.columns * period.x / 2, tiling.rows * period.y / 2, (high - low) / 2);
  const V3d beyond(tiling.overlap, tiling.overlap, 0);
  return {{center - half, center + half}, {center - half - beyond, center + half + beyond}};
}

}  // namespace mapping
