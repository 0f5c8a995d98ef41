#pragma once

#include <optional>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct BandToMeshOptions {
  /// Tolerance of the coarsening of flat parts, voxels, in [0, 1]; 0 keeps the uniform mesh of
  /// marching cubes.
  double adaptivity = 0;
  /// Reconstructs the edges and corners that the field implies [Ju02]. Not possible together with
  /// an adaptivity above 0.
  bool sharp = false;
  /// Accepts the band of an open surface. Its mesh is closed by walls where the band was cut off.
  bool openSurface = false;
  Progress progress = {};
};

/// Converts the zero set to a triangle mesh that faces outwards. The mesh is closed and 2-manifold
/// when the zero set is closed.
/// @return mesh in world coordinates; the vertices lie on the zero set of the trilinear interpolant
///         up to second order in the voxel size
/// @throws InvalidInput if the band is empty or has no zero crossing, or is an open surface without
///         `openSurface`
/// @throws UsageError if `adaptivity` is outside [0, 1], or above 0 together with `sharp`
[[nodiscard]] TriMesh bandToMesh(const NarrowBand& band, const BandToMeshOptions& options = {});

enum class MeshMethod {
  MarchingCubes,  ///< the mesh of bandToMesh()
  Dual,           ///< the mesh of bandToMesh() with `sharp`
  Extended,       ///< the mesh of bandToExtendedMesh()
  AdvancingFront  ///< the mesh of bandToFrontMesh()
};

/// The operator `mesh` for bands.
struct MeshOperator {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, kTriangleError, 0, "shapes"};

  struct Options {
    double adaptivity = 0;
    bool sharp = false;
    MeshMethod method = MeshMethod::MarchingCubes;
    /// Mesh from which the band was computed, for MeshMethod::Extended; null: none.
    const TriMesh* original = nullptr;
    /// Largest target length of the edges of MeshMethod::AdvancingFront, world units; empty: 16
    /// voxels.
    std::optional<double> edgeLength = {};
    /// Angle between the normals at the ends of its edges, degrees.
    double angleDegrees = 20;

    [[nodiscard]] bool isUniform() const {
      return method == MeshMethod::MarchingCubes && !sharp && adaptivity <= 0;
    }

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("adaptivity", &Options::adaptivity,
            {.help = "tolerance of the coarsening of flat parts, 0 to 1 voxel; 0: none",
             .range = OptionRange::NonNegative});
      visit(
          "sharp", &Options::sharp,
          {.help = "reconstruct the sharp edges and corners that the distances imply; the same as "
                   "--method dual"});
      visit("method", &Options::method,
            {{"marching-cubes", MeshMethod::MarchingCubes},
             {"dual", MeshMethod::Dual},
             {"extended", MeshMethod::Extended},
             {"advancing-front", MeshMethod::AdvancingFront}},
            {.help = "marching cubes; a dual mesh with sharp edges; extended marching cubes, which "
                     "adds vertices on sharp edges; or an advancing front, which makes nearly "
                     "equilateral triangles"});
      visit("edge-length", &Options::edgeLength,
            {.help = "largest target length of edges, for --method advancing-front; edges reach "
                     "about twice the target; default: 16 voxels",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive});
      visit(
          "angle", &Options::angleDegrees,
          {.help =
               "angle between the normals at the ends of an edge, in degrees, at most 57, for "
               "--method advancing-front: edges are shorter where the surface bends more; with 20 "
               "degrees a sphere loses 4 to 5 % of its volume",
           .range = OptionRange::Positive});
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
