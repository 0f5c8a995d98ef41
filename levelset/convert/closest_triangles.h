#pragma once

#include <optional>

#include "levelset/fields/grid.h"
#include "levelset/mesh.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct ClosestTrianglesOptions {
  double halfWidth = 3;  ///< largest distance from the mesh, voxels, at least 1
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct ClosestTriangles {
  /// Index of the closest triangle, as a number; kNoTriangle at other voxels.
  FieldGrid triangle;
  /// Vector from the grid point to its closest point on the mesh, world units. Its length is the
  /// distance. Zero at other voxels.
  FieldGrid vector;
  static constexpr float kNoTriangle = -1;
};

/// Computes the closest triangle and the vector to the closest point for each grid point within
/// `halfWidth` voxels of a mesh, by scan conversion of prisms [Sigg06, 4.2]. Where several
/// triangles are equally close, for example at a common edge, the result is one of them, the same
/// for any number of threads.
/// @param mesh  any set of triangles with finite coordinates, and fewer than 2²⁴ triangles, the
///              number of integers that a float represents
/// @param voxelSize  world units, positive and finite; grid points lie at its integer multiples
/// @return two grids with the same active voxels
/// @throws UsageError for a voxel size or half width out of range
/// @throws InvalidInput for a mesh that meshToBand() refuses because of its coordinates or size
/// @throws ResourceLimit, Cancelled
[[nodiscard]] ClosestTriangles closestTriangles(const TriMesh& mesh, double voxelSize,
                                                const ClosestTrianglesOptions& options = {});

/// The operator `closest-triangle`.
struct ClosestTriangleOperator {
  static const OperatorText text;
  enum class Result { Index, Vector };

  struct Options {
    VoxelSize voxel;
    double halfWidth = 3;  ///< half width of the result, voxels
    Result result = Result::Index;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("voxel", &Options::voxel, {});
      visit("half-width", &Options::halfWidth, kNewHalfWidth);
      visit(
          "result", &Options::result, {{"index", Result::Index}, {"vector", Result::Vector}},
          {.help = "index: number of the closest triangle, from 0; vector: from the grid point to "
                   "its closest point, in world units"});
    }
  };

  static bool makesField(const Options&) { return true; }
  static double longestSide(const Options& options, Plans operands);
  static FieldGrid run(const TriMesh& mesh, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
