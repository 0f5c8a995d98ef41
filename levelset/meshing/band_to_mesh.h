#pragma once

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct BandToMeshOptions {
  double adaptivity = 0;  ///< [0, 1]: how far flat parts may be coarsened; 0 is uniform
  bool sharp =
      false;  ///< keep the edges and corners that the field implies [Ju02]; not with adaptivity
  bool openSurface = false;  ///< take open surfaces too, with walls where they are cut off
  Progress progress = {};
};

/// The zero set as a triangle mesh that faces outwards: closed and 2-manifold for a band whose zero
/// set is closed.
/// @return vertices on the zero set of the trilinear interpolant to second order in the voxel size
/// @throws InvalidInput if the band is empty, or an open surface; UsageError for options out of
/// range
[[nodiscard]] TriMesh bandToMesh(const NarrowBand& band, const BandToMeshOptions& options = {});

/// The operator `mesh` of a band.
struct MeshOperator {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, kTriangleError, 0, "shapes"};

  struct Options {
    double adaptivity = 0;
    bool sharp = false;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit(
          "adaptivity", &Options::adaptivity,
          {.help = "0 to 1: how far flat parts are coarsened", .range = OptionRange::NonNegative});
      visit("sharp", &Options::sharp,
            {.help = "keep the edges and corners that the field implies"});
    }
  };

  static void check(const Options& options, const GivenOptions& given);
  static TriMesh run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static RegionOfInterest regionOfInterest(const Options& options, const OperatorPlans& plans,
                                           std::size_t operand, const RegionOfInterest& ofResult);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
