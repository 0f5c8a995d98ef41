#pragma once

#include <string>

#include "levelset/operator/options.h"

namespace render {

/// Traced reflection and refraction. The members have the names and meanings of the same options of
/// EffectOptions, which has both from the environment alone.
struct OpticsOptions {
  double reflect = 0;
  double refract = 0;
  double index = 1.5;
  std::string environment = "studio";
  int bounces = 8;

  [[nodiscard]] bool isActive() const { return reflect > 0 || refract > 0; }

  template <class Visitor>
  static void describe(Visitor& visit) {
    using levelset::OptionRange;
    visit("reflect", &OpticsOptions::reflect,
          {.help = "share of light, from 0 to 1, that the surfaces mirror straight on; more at "
                   "grazing angles, by Schlick's formula. The mirrored rays are traced",
           .range = OptionRange::NonNegative});
    visit(
        "refract", &OpticsOptions::refract,
        {.help = "share of the colours, from 0 to 1, that is replaced by the light of clear glass: "
                 "refracted and, by Fresnel's equations, reflected rays are traced",
         .range = OptionRange::NonNegative});
    visit("index", &OpticsOptions::index,
          {.help = "with --refract: index of refraction of the solids",
           .range = OptionRange::Positive});
    visit("environment", &OpticsOptions::environment,
          {.help = "with --reflect or --refract: light that traced rays meet where they leave the "
                   "scene: studio, a room with soft lights, or an EXR of all directions, twice as "
                   "wide as high, with y upwards"});
    visit("bounces", &OpticsOptions::bounces,
          {.help = "with --reflect or --refract: surfaces that a path may meet behind the first "
                   "one; then it meets the environment. 0: only the environment is seen",
           .range = OptionRange::NonNegative});
  }
};

/// @throws levelset::UsageError for shares outside [0, 1], an index below 1, and too many bounces
void validate(const OpticsOptions& options);

}  // namespace render
