#include "levelset/volumes/filters/volume_filter.h"

namespace levelset {
namespace {

constexpr std::array<VolumeFilterFacts, kVolumeFilters.size()> kFacts = {{
    // name, continuity, reproduced, three orders, interpolates, support
    {"box", -1, 0, 1, 0, 0, true, 1},
    {"trilinear", 0, 1, 2, 1, 0, true, 2},
    {"tricubic", 1, 2, 3, 2, 1, true, 4},
    {"bspline", 2, 1, 2, 2, 2, false, 4},
    {"bspline-qi", 2, 3, 4, 3, 2, false, 6},
    // The alternating sums of six weights under a raised cosine are zero, which keeps linear
    // functions.
    {"windowed-sinc", 2, 1, 2, 1, 0, true, 6},
    {"super-quadratic", 0, 1, 2, 2, 1, false, 3},
    {"cubic-c1", 1, 1, 2, 2, 1, false, 3},
    {"bcc-quadratic", 1, 1, 2, 2, 1, false, 4},
}};

}  // namespace

const VolumeFilterFacts& factsOf(VolumeFilter filter) {
  return kFacts[static_cast<std::size_t>(filter)];
}

std::optional<VolumeFilter> volumeFilterNamed(std::string_view name) {
  for (const VolumeFilter filter : kVolumeFilters)
    if (factsOf(filter).name == name) return filter;
  return {};
}

}  // namespace levelset
