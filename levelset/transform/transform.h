#pragma once

#include <Imath/ImathMatrix.h>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

/// Transforms a solid exactly, by changing its grid transform. A uniform scale also scales the
/// distances.
/// @param matrix  rotation, uniform scale, translation; world' = world * matrix, with Imath's row
///                vectors
/// @throws UsageError if the matrix is not affine and invertible
/// @throws InvalidInput if the matrix shears, mirrors or scales unevenly (use bake()), or if the
///         solid is empty or too far from the origin for its voxels
[[nodiscard]] NarrowBand transform(NarrowBand solid, const Imath::M44d& matrix);

struct BakeOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Transforms a solid by any invertible affine matrix. Resamples the solid on the axis-aligned grid
/// of `voxelSize` and re-distances it.
/// @param voxelSize  voxel size of the result, world units
/// @throws UsageError if the matrix is not affine and invertible
/// @throws further errors as resample()
[[nodiscard]] NarrowBand bake(const NarrowBand& solid, const Imath::M44d& matrix, double voxelSize,
                              const BakeOptions& options = {});

/// Transforms the vertices of a mesh. A mirroring matrix also reverses the triangles. Normals
/// transform by the inverse transpose and stay unit vectors. TriMesh::spacing (the rounding error)
/// of the result is that of the original coordinates, scaled. Files store the new coordinates in
/// double precision.
/// @throws UsageError if the matrix is not affine and invertible
/// @throws InvalidInput if attributes do not fit the vertices, or a coordinate exceeds 1e100
[[nodiscard]] TriMesh transform(TriMesh mesh, const Imath::M44d& matrix);

/// The operator `transform`.
struct TransformOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::OfOperands;
  static constexpr double partTolerance = kDistanceTolerance;  // voxels; without `bake` 0
  static constexpr int distancePasses = 2;
  static constexpr ErrorModel errorModel{2, 0.65, 0, "resample-chain"};

  struct Options {
    std::optional<Imath::M44d> matrix;    ///< matrix for row vectors, translation in the last row
    std::optional<Imath::V3d> translate;  ///< displacement, world units
    std::vector<double> rotate;  ///< degrees: one angle about `axis`, or about x, then y, then z
    Imath::V3d axis = Imath::V3d(0, 0, 1);
    std::vector<double> scale;         ///< scale factors: one, or three for x, y and z
    std::optional<int> mirror;         ///< axis normal to the mirror plane, 0 to 2: x, y, z
    Imath::V3d about = Imath::V3d(0);  ///< fixed point of mirror, scale and rotate, world units
    bool bake = false;
    std::optional<double> voxel;  ///< voxel size of the baked grid, world units

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("matrix", &Options::matrix,
            {.help = "matrix for row vectors, with the translation in the last row"});
      visit("translate", &Options::translate, {.help = "displacement, world units"});
      visit("rotate", &Options::rotate,
            {.help = "angle about --axis, or three angles about x, then y, then z; degrees"});
      visit(
          "axis", &Options::axis,
          {.help = "direction of the axis of a single --rotate angle; it passes through --about"});
      visit("scale", &Options::scale,
            {.help = "scale factor, or three factors for x, y and z",
             .range = OptionRange::Positive});
      visit("mirror", &Options::mirror, {{"x", 0}, {"y", 1}, {"z", 2}},
            {.help = "axis normal to the mirror plane, which passes through --about"});
      visit("about", &Options::about,
            {.help = "fixed point of --mirror, --scale and --rotate, world units"});
      visit("bake", &Options::bake,
            {.help = "resample the result on an axis-aligned uniform grid"});
      visit("voxel", &Options::voxel,
            {.help = "voxel size of the baked grid; default: that of the operand",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive,
             .allowsVoxels = false});
    }
  };

  /// Combines the options into one matrix. Their order is matrix, mirror, scale, rotate, translate.
  /// @throws UsageError for an axis without direction, and for a singular matrix
  [[nodiscard]] static Imath::M44d matrixOf(const Options& options);
  static void check(const Options& options, const GivenOptions& given);
  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static TriMesh run(const TriMesh& mesh, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static RegionOfInterest regionOfInterest(const Options& options, const OperatorPlans& plans,
                                           std::size_t operand, const RegionOfInterest& ofResult);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
