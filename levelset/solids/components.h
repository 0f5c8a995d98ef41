#pragma once

#include <cstddef>
#include <limits>

#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

/// Connected parts of a solid and of the space around it. Grid points are connected along the edges
/// of the grid (6 neighbours) inside, and also across the diagonals of its faces (18 neighbours)
/// outside, as the mesh of bandToMesh separates them, so that a solid and its surroundings never
/// cross.
namespace levelset {

struct Topology {
  std::size_t components = 0;  ///< solids
  std::size_t shells = 0;      ///< surfaces
  std::size_t cavities = 0;    ///< enclosed voids
};
[[nodiscard]] Topology topology(const NarrowBand& solid);

/// Keeps the `count` solids of largest volume with their cavities, drops the others. Of equal ones,
/// those that come first in the tree stay. Grid points that are not nearest to a dropped surface
/// keep their bits.
/// @throws UsageError for count = 0; InvalidInput if the band is empty
[[nodiscard]] NarrowBand keepLargest(const NarrowBand& solid, std::size_t count,
                                     const Progress& progress = {});

/// More than any void has.
inline constexpr double kAnyVolume = std::numeric_limits<double>::infinity();

/// Fills enclosed voids up to `maxVolume` world units³ (default: all). What floats in a void is not
/// part of its volume, and is swallowed when it is filled; an empty band stays empty.
/// @throws UsageError if `maxVolume` is negative or not a number
[[nodiscard]] NarrowBand fillCavities(const NarrowBand& solid, double maxVolume = kAnyVolume,
                                      const Progress& progress = {});

struct SliversDropped {
  NarrowBand band;
  std::size_t count = 0;
};

/// Drops the skins that a cut leaves where the cutter ends in the surface of what it cuts, and
/// rounding decides: solids that go nowhere half a voxel deep and lie within a voxel of the
/// cutter's surface. Others keep their bits, as with keepLargest(); where nothing else is left they
/// stay.
/// @pre both are solids, and `cutter` has a band of two voxels of `solid` at least
[[nodiscard]] SliversDropped dropSlivers(const NarrowBand& solid, const NarrowBand& cutter,
                                         const Progress& progress = {});

/// The operator `keep`.
struct KeepOperator {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, 0, 0, "shapes"};

  struct Options {
    std::size_t largest = 1;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("largest", &Options::largest,
            {.help = "number of solids to keep, by volume",
             .range = OptionRange::Positive,
             .required = true});
    }
  };

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

/// The operator `fill-cavities`.
struct FillCavitiesOperator {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, 0, 0, "shapes"};

  struct Options {
    std::optional<double> upTo;  ///< world units³

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("up-to", &Options::upTo,
            {.help = "only voids up to this volume, world units cubed",
             .range = OptionRange::Positive});
    }
  };

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
