#pragma once

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct BandToMeshOptions {
  double adaptivity = 0;  ///< [0, 1]: tolerance of coarsening, voxels; 0 keeps the uniform mesh
  /// Keeps the edges and corners that the field implies [Ju02]; excludes adaptivity.
  bool sharp = false;
  bool openSurface = false;  ///< accepts open surfaces, closed with walls at their cut
  Progress progress = {};
};

/// Converts the zero set to a triangle mesh that faces outwards. The mesh is closed and 2-manifold
/// when the zero set is closed.
/// @return vertices on the zero set of the trilinear interpolant to second order in the voxel size
/// @throws InvalidInput if the band is empty, or an open surface
/// @throws UsageError for options out of range
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
