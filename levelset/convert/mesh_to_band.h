#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "levelset/mesh.h"
#include "levelset/mesh_sign/mesh_queries.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "levelset/region_of_interest.h"

/// Exact signed distances of a triangle mesh on the voxels of a band.
namespace levelset {

enum class SignMode {
  Auto,    ///< Closed when every edge has two faces and no self-intersection is found, else Winding
  Closed,  ///< watertight input; inside by parity or orientation of the crossings along grid lines
  Winding  ///< inside where the generalised winding number passes 1/2 [Jacobson13, Barill18]
};
enum class Nesting {
  Parity,      ///< nested shells alternate, whatever way they face
  Orientation  ///< nested shells follow the way they face
};

/// Why the sign may be trusted, or not.
struct SignCertificate {
  bool closed = false;                    ///< every edge has exactly two faces
  std::size_t boundaryEdges = 0;          ///< edges with one face
  std::size_t nonManifoldEdges = 0;       ///< edges with three or more faces
  std::ptrdiff_t selfIntersections = -1;  ///< pairs of triangles; -1: not searched
  SignMode method = SignMode::Auto;       ///< Closed or Winding: what was used
  bool flipped = false;                   ///< a soup that faced inwards was turned
  double ambiguousShare = 0;  ///< of voxels next to the zero set, |w − 0.5| < 0.25; 1 if none is
  std::size_t droppedTriangles = 0;  ///< without area, or repeated exactly
};

struct MeshToBandOptions {
  double halfWidth = 3;  ///< voxels, at least 1
  SignMode sign = SignMode::Auto;
  Nesting nesting = Nesting::Parity;    ///< read under Closed only
  bool signAnyway = false;              ///< accept a sign that is a guess, or no inside
  bool searchSelfIntersections = true;  ///< when false, Auto trusts the mesh to have none
  /// Distances are made only there, as cropped() leaves them, unless the mesh has holes. The
  /// certificate tells of the whole mesh, but for the ambiguous share.
  RegionOfInterest roi = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
  /// Told the certificate once it is whole, also when the mesh is refused after it.
  std::function<void(const SignCertificate&)> certified = {};
};

/// A larger SignCertificate::ambiguousShare makes the sign a guess.
inline constexpr double kAmbiguousLimit = 1e-3;

/// The certificate as one line for people.
[[nodiscard]] std::string describe(const SignCertificate& certificate);

struct MeshToBandResult {
  NarrowBand band;
  SignCertificate certificate;
};

/// @param mesh       finite coordinates; any soup under Winding
/// @param voxelSize  world units, positive and finite; grid points sit at its integer multiples
/// @return every voxel whose centre lies within halfWidth of the mesh, at its exact distance
/// @throws UsageError for a voxel size or half width out of range; InvalidInput when the mesh
/// cannot
///         be used as asked (open under Closed, ambiguous sign, voxel larger than the object,
///         coordinates coarser than voxel/8); ResourceLimit for memory or an index beyond 32 bits
[[nodiscard]] MeshToBandResult meshToBand(const TriMesh& mesh, double voxelSize,
                                          const MeshToBandOptions& options = {});

/// The part of it that can be told before there is a mesh.
/// @param action  begins the message
/// @throws InvalidInput for a voxel larger than the object
void checkVoxelSize(double voxelSize, double longestSide, const char* action = "level-set");

}  // namespace levelset
