#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "levelset/convert/distance_method.h"
#include "levelset/mesh.h"
#include "levelset/mesh_sign/mesh_queries.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"
#include "levelset/region_of_interest.h"

/// Exact signed distances of a triangle mesh on the voxels of a band.
namespace levelset {

enum class SignMode {
  Auto,    ///< selects Closed if every edge has two faces and no triangles intersect, else Winding
  Closed,  ///< requires a closed mesh; inside by parity or orientation of crossings with grid lines
  Winding  ///< inside where the generalised winding number exceeds 1/2 [Jacobson13, Barill18]
};
enum class Nesting {
  Parity,      ///< nested components alternate between solid and cavity, whatever their orientation
  Orientation  ///< nested components are solid or cavity by their orientation
};

/// Sign certificate: properties of the mesh and the method that decided inside and outside.
struct SignCertificate {
  bool closed = false;                    ///< every edge has exactly two faces
  std::size_t boundaryEdges = 0;          ///< edges with one face
  std::size_t nonManifoldEdges = 0;       ///< edges with three or more faces
  std::ptrdiff_t selfIntersections = -1;  ///< pairs of intersecting triangles; -1: not searched
  SignMode method = SignMode::Auto;       ///< method used: Closed or Winding
  bool flipped = false;  ///< true when the mesh faces inwards and counts as reversed

  /// Fraction of the voxels next to the zero set with an ambiguous winding number w,
  /// |w − 0.5| < 0.25. 1 if no voxel is next to the zero set.
  double ambiguousShare = 0;
  std::size_t droppedTriangles = 0;  ///< triangles without area and exact duplicates
};

struct MeshToBandOptions {
  double halfWidth = 3;  ///< half width of the band, voxels, at least 1
  SignMode sign = SignMode::Auto;
  Nesting nesting = Nesting::Parity;    ///< used with SignMode::Closed only
  bool acceptSign = false;              ///< accept an ambiguous sign, or a mesh without an inside
  bool searchSelfIntersections = true;  ///< false: Auto assumes no self-intersections
  DistanceMethod method = DistanceMethod::Blocks;
  /// Region of interest. Distances outside it are not computed, unless the mesh has holes: then the
  /// region is ignored. The certificate describes the complete mesh, except for ambiguousShare.
  RegionOfInterest roi = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
  /// Called when the mesh is not read any more, before most of the work. The caller may then delete
  /// it to save memory.
  std::function<void()> onMeshRead = {};
  /// Called with the complete certificate, even if meshToBand then throws because of it.
  std::function<void(const SignCertificate&)> onCertificate = {};
};

/// Limit of SignCertificate::ambiguousShare. Above it meshToBand refuses the mesh, unless the
/// option acceptSign is set.
inline constexpr double kAmbiguousLimit = 1e-3;

/// Returns a summary of the certificate in one line of text.
[[nodiscard]] std::string describe(const SignCertificate& certificate);

struct MeshToBandResult {
  NarrowBand band;
  SignCertificate certificate;
};

/// Computes the signed distance of a triangle mesh on the voxels of a narrow band.
/// @param mesh  finite coordinates; with SignMode::Winding any set of triangles
/// @param voxelSize  world units, positive and finite; grid points lie at its integer multiples
/// @return band in which the active voxels are all grid points within halfWidth of the mesh, with
///         exact distances
/// @throws UsageError for a voxel size or half width out of range
/// @throws InvalidInput when the mesh is open with SignMode::Closed or its sign is ambiguous; when
///         the voxel is larger than the object, or the spacing of representable coordinates exceeds
///         voxel/8
/// @throws ResourceLimit when the memory does not suffice or an index exceeds 32 bits
[[nodiscard]] MeshToBandResult meshToBand(const TriMesh& mesh, double voxelSize,
                                          const MeshToBandOptions& options = {});

/// Checks the voxel size against the longest side of the bounding box of the object, both in world
/// units. meshToBand() performs this check too.
/// @throws InvalidInput for a voxel larger than the object
void checkVoxelSize(double voxelSize, double longestSide);

/// The operator `level-set`.
struct LevelSetOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::One;
  static constexpr bool makesPart = true;
  static constexpr ErrorModel errorModel{1, 0.7, kCreaseError, "mesh-round-trip"};

  struct Options {
    VoxelSize voxel;
    double halfWidth = 3;  ///< half width of the band, voxels
    SignMode sign = SignMode::Auto;
    Nesting nesting = Nesting::Parity;
    bool acceptsSign = false;
    bool skipsIntersectionTest = false;
    DistanceMethod method = DistanceMethod::Blocks;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("voxel", &Options::voxel, {});
      visit("half-width", &Options::halfWidth, kNewHalfWidth);
      visit(
          "sign", &Options::sign,
          {{"auto", SignMode::Auto}, {"closed", SignMode::Closed}, {"winding", SignMode::Winding}},
          {.help = "method that distinguishes inside from outside: closed, for closed meshes; "
                   "winding, by the generalised winding number; auto chooses one of the two"});
      visit("nested", &Options::nesting,
            {{"parity", Nesting::Parity}, {"orientation", Nesting::Orientation}},
            {.help = "with --sign closed: nested surfaces alternate between solid and void, or "
                     "follow their orientation"});
      visit("accept-sign", &Options::acceptsSign,
            {.help = "accept a mesh whose inside is ambiguous, or that has no inside",
             .formerName = "sign-anyway"});
      visit("skip-intersection-test", &Options::skipsIntersectionTest,
            {.help = "with --sign auto: assume that the mesh has no self-intersections",
             .formerName = "trust-mesh"});
      visit("method", &Options::method,
            {{"blocks", DistanceMethod::Blocks}, {"prism", DistanceMethod::Prisms}},
            {.help = "algorithm of the distances: blocks, which excludes triangles by spheres for "
                     "each block of grid points; prism, which scans a prism around each triangle. "
                     "The distances are the same"});
    }
  };

  static double longestSide(const Options& options, Plans operands);
  static NarrowBand run(const TriMesh& mesh, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
