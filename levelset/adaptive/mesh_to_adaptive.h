#pragma once

#include "levelset/adaptive/build_adaptive.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/mesh.h"

namespace levelset {

struct MeshToAdaptiveOptions {
  double tolerance = 0;  ///< largest error, world units
  /// Distance from the surface up to which the tolerance holds, world units; 0: 2 % of the diagonal
  /// of the bounding box.
  double halfWidth = 0;
  bool isTricubic = false;  ///< as in AdaptiveOptions
  SignMode sign = SignMode::Auto;
  Nesting nesting = Nesting::Parity;    ///< used with SignMode::Closed only
  bool acceptSign = false;              ///< accept an ambiguous sign
  bool searchSelfIntersections = true;  ///< false: Auto assumes no self-intersections
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct MeshToAdaptiveResult {
  AdaptiveField field;
  SignCertificate certificate;  ///< ambiguousShare: of the tested points near the surface
  AdaptiveReport report;
};

/// Samples the exact signed distance of a mesh on an octree, within a tolerance.
/// @throws UsageError, InvalidInput, ResourceLimit as buildAdaptive() and meshToBand()
[[nodiscard]] MeshToAdaptiveResult meshToAdaptive(const TriMesh& mesh,
                                                  const MeshToAdaptiveOptions& options);

}  // namespace levelset
