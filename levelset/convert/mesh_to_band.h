#pragma once

#include <cstddef>
#include <functional>
#include <string>

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
  Auto,    ///< Closed when every edge has two faces and no self-intersection is found, else Winding
  Closed,  ///< closed input; inside by parity or orientation of the crossings along grid lines
  Winding  ///< inside where the generalised winding number exceeds 1/2 [Jacobson13, Barill18]
};
enum class Nesting {
  Parity,      ///< nested components alternate between solid and cavity, whatever their orientation
  Orientation  ///< nested components are solid or cavity by their orientation
};

/// Evidence for the sign of the distances: properties of the mesh and the method used.
struct SignCertificate {
  bool closed = false;                    ///< every edge has exactly two faces
  std::size_t boundaryEdges = 0;          ///< edges with one face
  std::size_t nonManifoldEdges = 0;       ///< edges with three or more faces
  std::ptrdiff_t selfIntersections = -1;  ///< pairs of triangles; -1: not searched
  SignMode method = SignMode::Auto;       ///< method used: Closed or Winding
  bool flipped = false;                   ///< true when a mesh that faced inwards was reversed
  double ambiguousShare = 0;  ///< share of voxels next to the zero set with |w − 0.5| < 0.25; 1 if
                              ///< there is no such voxel
  std::size_t droppedTriangles = 0;  ///< triangles without area and exact duplicates
};

struct MeshToBandOptions {
  double halfWidth = 3;  ///< voxels, at least 1
  SignMode sign = SignMode::Auto;
  Nesting nesting = Nesting::Parity;    ///< used with SignMode::Closed only
  bool acceptSign = false;              ///< accept an ambiguous sign, or a mesh without an inside
  bool searchSelfIntersections = true;  ///< false: Auto assumes that the mesh has none
  /// Region of interest. Distances outside it are omitted, as cropped() does, unless the mesh has
  /// holes. The certificate covers the complete mesh, except for the ambiguous share.
  RegionOfInterest roi = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
  /// Receives the complete certificate, also when the mesh is then refused.
  std::function<void(const SignCertificate&)> onCertificate = {};
};

/// Limit of SignCertificate::ambiguousShare. Above it the sign is considered a guess.
inline constexpr double kAmbiguousLimit = 1e-3;

/// Summary of the certificate in one line of text.
[[nodiscard]] std::string describe(const SignCertificate& certificate);

struct MeshToBandResult {
  NarrowBand band;
  SignCertificate certificate;
};

/// Computes the signed distance of a triangle mesh on the voxels of a narrow band.
/// @param mesh  finite coordinates; any set of triangles under Winding
/// @param voxelSize  world units, positive and finite; grid points lie at its integer multiples
/// @return all voxels whose centres lie within halfWidth of the mesh, with exact distances
/// @throws UsageError for a voxel size or half width out of range
/// @throws InvalidInput when the mesh is open under Closed or its sign is ambiguous; when the voxel
///         is larger than the object, or the coordinates are coarser than voxel/8
/// @throws ResourceLimit when the memory does not suffice or an index exceeds 32 bits
[[nodiscard]] MeshToBandResult meshToBand(const TriMesh& mesh, double voxelSize,
                                          const MeshToBandOptions& options = {});

/// Checks the voxel size against the size of the object. This check of meshToBand needs no mesh.
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
    double halfWidth = 3;  ///< voxels
    SignMode sign = SignMode::Auto;
    Nesting nesting = Nesting::Parity;
    bool acceptsSign = false;
    bool skipsIntersectionTest = false;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("voxel", &Options::voxel, {});
      visit("half-width", &Options::halfWidth, kNewHalfWidth);
      visit(
          "sign", &Options::sign,
          {{"auto", SignMode::Auto}, {"closed", SignMode::Closed}, {"winding", SignMode::Winding}},
          {.help = "how inside is distinguished from outside"});
      visit("nested", &Options::nesting,
            {{"parity", Nesting::Parity}, {"orientation", Nesting::Orientation}},
            {.help = "under 'closed': nested surfaces alternate, or follow their orientation"});
      visit("accept-sign", &Options::acceptsSign,
            {.help = "accept a sign that is a guess, or distances without an inside",
             .formerName = "sign-anyway"});
      visit("skip-intersection-test", &Options::skipsIntersectionTest,
            {.help = "under 'auto': do not search self-intersections", .formerName = "trust-mesh"});
    }
  };

  static double longestSide(const Options& options, Plans operands);
  static NarrowBand run(const TriMesh& mesh, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
