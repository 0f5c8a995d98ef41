#pragma once

#include <cstddef>
#include <limits>

#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

/// Connected components of a solid and of the space around it. Inside grid points connect along the
/// grid axes (6 neighbours). Outside grid points also connect across face diagonals (18
/// neighbours). The mesh of bandToMesh() connects grid points by the same rule, so an inside and an
/// outside connection never cross.
namespace levelset {

struct Topology {
  std::size_t components = 0;  ///< number of connected solids
  std::size_t surfaces = 0;    ///< number of connected pieces of the surface
  std::size_t cavities = 0;    ///< number of enclosed voids
};
/// Counts the connected solids, the surface components and the cavities of a band.
[[nodiscard]] Topology topology(const NarrowBand& solid);

/// Keeps the `count` components of largest volume with their cavities and removes the others. Among
/// components of equal volume, the first in tree order stays. Grid points whose nearest surface
/// remains keep their bits.
/// @throws UsageError if `count` is 0
/// @throws InvalidInput if the band is empty
[[nodiscard]] NarrowBand keepLargest(const NarrowBand& solid, std::size_t count,
                                     const Progress& progress = {});

/// Value of `maxVolume` that fills every cavity.
inline constexpr double kAnyVolume = std::numeric_limits<double>::infinity();

/// Fills enclosed cavities. The volume of a cavity excludes a solid inside it. Filling the cavity
/// merges such a solid with the solid around the cavity. An empty band stays empty.
/// @param maxVolume  largest volume to fill, world units³; default: all cavities
/// @throws UsageError if `maxVolume` is negative or not a number
[[nodiscard]] NarrowBand fillCavities(const NarrowBand& solid, double maxVolume = kAnyVolume,
                                      const Progress& progress = {});

struct SliversDropped {
  NarrowBand band;
  std::size_t count = 0;  ///< number of removed slivers
};

/// Removes the thin slivers that rounding leaves in a difference or split where the surface of the
/// cutter (the solid that is subtracted, or that splits) coincides with that of the cut solid. A
/// sliver is a component that is nowhere half a voxel deep and lies within a voxel of the cutter's
/// surface. Grid points whose nearest surface remains keep their bits. If all components are
/// slivers, they stay.
/// @pre both bands are solids; the half width of `cutter` is at least twice the voxel size of
///      `solid`
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
            {.help = "number of connected solids to keep, those of largest volume",
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
    std::optional<double> upTo;  ///< largest volume of a filled cavity, world units³; empty: all

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("up-to", &Options::upTo,
            {.help = "fill only cavities up to this volume, world units cubed; default: all",
             .range = OptionRange::Positive});
    }
  };

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
