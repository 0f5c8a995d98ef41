#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <limits>
#include <vector>

#include "levelset/deform/control_lattice.h"
#include "levelset/deform/deformation_certificate.h"
#include "levelset/progress.h"

namespace levelset {

struct MotionCertificateOptions {
  double tolerance = 0.05;       ///< width of the bracket over the least Jacobian
  std::size_t mostBoxes = 5000;  ///< limit of the boxes that are halved
  /// Memory of the boxes that are not decided yet, bytes.
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Proof that a moving lattice folds at no time of an interval.
struct MotionCertificate {
  FoldVerdict verdict = FoldVerdict::Undecided;
  /// Bracket of the least Jacobian determinant in the box and in the interval, as FoldCertificate.
  double leastLow = -std::numeric_limits<double>::infinity(),
         leastHigh = std::numeric_limits<double>::infinity();
  Imath::V3d place{0};    ///< point of `leastHigh`, world coordinates before the deformation
  double time = 0;        ///< time of `leastHigh`, in [0, 1] over the interval
  std::size_t boxes = 0;  ///< boxes of parameters and time that were bounded
};

/// Bounds the Jacobian determinant of a lattice whose control points move along Bézier curves in
/// time. The determinant is linear in each of its columns. So on each piece of degree (l, m, n) it
/// is a polynomial in the parameters and time, of degree (3l − 1, 3m − 1, 3n − 1) and three times
/// the degree in time, whose Bernstein coefficients bound it. Boxes are halved along the parameters
/// or time, the one with the least bound first. Lattices with weights stay undecided: their
/// numerators are of too high a degree in time. Overlaps of faces are not tested.
/// @param control  lattices of the control points of the curves, at least two
/// @pre requireSameLattices() accepts the lattices
/// @throws ResourceLimit, Cancelled
[[nodiscard]] MotionCertificate certifyMotion(const std::vector<ControlLattice>& control,
                                              const MotionCertificateOptions& options = {});

}  // namespace levelset
