#include "levelset/memory/memory_estimate.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress.h"

namespace levelset::eikonal {

void checkMemory(const MemoryEstimate& estimate, std::size_t maxMemory) {
  // Grid points inside the surface never lie outside its box, so only `outside` extends the box.
  const double out = estimate.outside + 1;
  double reached = 1, longest = 0;
  for (int i = 0; i < 3; ++i) {
    double from = estimate.surface.min()[i] - out, to = estimate.surface.max()[i] + out;
    if (from < -kIndexLimit || to > kIndexLimit)
      throw ResourceLimit(
          fmt::format("distances up to {:.4g} voxels exceed the range of 32-bit indices; use a "
                      "smaller distance or larger voxels",
                      out));
    if (estimate.region) {
      from = std::max<double>(from, estimate.region->min()[i]);
      to = std::min<double>(to, estimate.region->max()[i]);
    }
    reached *= std::max(0.0, to - from + 1);
    longest = std::max(longest, static_cast<double>(estimate.surface.dim()[i]));
  }
  // Number of grid points: the smaller of Steiner's formula for a convex body and the volume of the
  // box.
  const double steiner = estimate.area * (std::min(estimate.inside, longest / 2) + out) +
                         2 * M_PI * longest * out * out + 4.0 / 3 * M_PI * out * out * out;
  const double bytes = std::min(reached, steiner) * estimate.bytesPerGridPoint;
  requireMemory(bytes, memoryLimit(maxMemory));
}

}  // namespace levelset::eikonal
