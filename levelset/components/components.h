#pragma once

#include <cstddef>
#include <limits>

#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

/// Connected components of a solid and of the space around it. Inside grid points connect along the
/// grid axes (6 neighbours). Outside grid points also connect across face diagonals (18
/// neighbours). The mesh of bandToMesh() separates them in the same way, so inside and outside
/// never cross.
namespace levelset {

struct Topology {
  std::size_t components = 0;  ///< connected solids
  std::size_t surfaces = 0;    ///< surface components
  std::size_t cavities = 0;    ///< enclosed voids
};
/// Counts the connected components of a solid, of its surface and of its cavities.
[[nodiscard]] Topology topology(const NarrowBand& solid);

/// Keeps the `count` components of largest volume with their cavities and removes the others. Among
/// components of equal volume, the first in tree order stays. Grid points that are not nearest to a
/// removed surface keep their bits.
/// @throws UsageError if `count` is 0
/// @throws InvalidInput if the band is empty
[[nodiscard]] NarrowBand keepLargest(const NarrowBand& solid, std::size_t count,
                                     const Progress& progress = {});

/// Volume that exceeds every cavity.
inline constexpr double kAnyVolume = std::numeric_limits<double>::infinity();

/// Fills enclosed cavities. A solid inside a cavity does not count for its volume and disappears
/// when the cavity is filled. An empty band stays empty.
/// @param maxVolume  largest volume to fill, world units³; default: all cavities
/// @throws UsageError if `maxVolume` is negative or not a number
[[nodiscard]] NarrowBand fillCavities(const NarrowBand& solid, double maxVolume = kAnyVolume,
                                      const Progress& progress = {});

struct SliversDropped {
  NarrowBand band;
  std::size_t count = 0;  ///< number of removed slivers
};

/// Removes the thin slivers that rounding leaves where the surface of the cutter coincides with
/// that of the cut solid. A sliver is a component that is nowhere half a voxel deep and lies within
/// a voxel of the cutter's surface. Other components keep their bits, as with keepLargest(). If all
/// components are slivers, they stay.
/// @pre both are solids, and the band of `cutter` is at least two voxels of `solid` wide
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
