#include "render/shading/optics_options.h"

#include <fmt/core.h>

#include <cmath>
#include <utility>

#include "levelset/error.h"

namespace render {
namespace {

constexpr int kMostBounces = 64;

}  // namespace

void validate(const OpticsOptions& options) {
  for (const auto& [name, share] :
       {std::pair("reflect", options.reflect), {"refract", options.refract}})
    if (!(share >= 0 && share <= 1))
      throw levelset::UsageError(
          fmt::format("--{} {} is out of range; give a number from 0 to 1", name, share));
  if (!(options.index >= 1) || !std::isfinite(options.index))
    throw levelset::UsageError(fmt::format(
        "--index {} is less than that of a vacuum, or not finite; give 1 or more", options.index));
  if (options.bounces < 0 || options.bounces > kMostBounces)
    throw levelset::UsageError(
        fmt::format("--bounces {} is out of range; give 0 to {}", options.bounces, kMostBounces));
}

}  // namespace render
