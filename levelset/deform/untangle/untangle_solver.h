#pragma once

#include <Imath/ImathVec.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "levelset/deform/deformation.h"
#include "levelset/deform/untangle/untangle_deformation.h"

namespace levelset::untangle {

/// Jacobian determinant at a point, and its gradient by the control points.
struct DeterminantSlope {
  double value = 0;
  std::vector<std::pair<std::uint32_t, Imath::V3d>> slopes = {};
};

/// A deformation with control points that can be moved. Internal.
class ControlledMap {
 public:
  virtual ~ControlledMap() = default;
  [[nodiscard]] virtual std::vector<Imath::V3d> controls() const = 0;
  /// Control points of the identity.
  [[nodiscard]] virtual std::vector<Imath::V3d> identity() const = 0;
  virtual void move(const std::vector<Imath::V3d>& controls) = 0;
  [[nodiscard]] virtual DeterminantSlope determinantAt(const Imath::V3d& world) const = 0;
  [[nodiscard]] virtual FoldCertificate certificate(const CertifyOptions& options) const = 0;
  /// Number of control points that move a point, at most.
  [[nodiscard]] virtual std::size_t slopesPerPoint() const = 0;
  /// Points where the determinant is tested first.
  [[nodiscard]] virtual std::vector<Imath::V3d> testPoints() const = 0;
  /// Further test points where a certificate failed.
  [[nodiscard]] virtual std::vector<Imath::V3d> testPointsAround(const Imath::V3d& place) const = 0;
};

/// Moves the control points until the certificate proves that the map is injective.
/// @throws InvalidInput if it overlaps itself without a fold
/// @throws ResourceLimit, Cancelled
[[nodiscard]] UntangleReport removeFolds(ControlledMap& map, const UntangleOptions& options);

}  // namespace levelset::untangle
