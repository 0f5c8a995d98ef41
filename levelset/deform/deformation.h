#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "levelset/deform/control_lattice.h"
#include "levelset/deform/deformation_certificate.h"
#include "levelset/progress.h"

namespace levelset {

/// The part of space for which a deformation is certified: all points within `margin` of a surface,
/// and all points that the surface encloses. Without triangles: the points alone.
struct DeformationDomain {
  const std::vector<Imath::V3d>& points;
  const std::vector<std::array<std::uint32_t, 3>>& triangles;
  double margin = 0;  ///< world units
};

struct CertifyOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Inverse of a deformation that is injective in its domain. Read-only, so threads may share it.
class DeformationInverse {
 public:
  virtual ~DeformationInverse() = default;
  /// Finds the point of the domain that is moved to a position.
  /// @param guess  a point whose image is near the position
  /// @return nullopt: no point of the domain is moved there. A lattice may return a point outside
  ///         its box, where it continues linearly.
  [[nodiscard]] virtual std::optional<Imath::V3d> near(const Imath::V3d& position,
                                                       const Imath::V3d& guess) const = 0;
};

/// Result of the certification of a deformation.
struct CertifiedDeformation {
  FoldCertificate certificate;
  /// Null unless the certificate proves that the map is injective.
  std::shared_ptr<const DeformationInverse> inverse = {};
};

/// A map of space that moves solids, meshes and points. Immutable.
class Deformation {
 public:
  virtual ~Deformation() = default;
  [[nodiscard]] virtual DeformationJet jet(const Imath::V3d& world) const = 0;
  [[nodiscard]] Imath::V3d at(const Imath::V3d& world) const { return jet(world).position; }
  /// Returns true if the map leaves every point in its place.
  [[nodiscard]] virtual bool isIdentity() const = 0;
  /// Bounds of the deformed control points.
  [[nodiscard]] virtual Imath::Box3d bounds() const = 0;
  /// Refuses points where the map is not defined.
  /// @param what  a point in words: "vertex"
  /// @throws InvalidInput
  virtual void requireDefined(const std::vector<Imath::V3d>& points, const char* what) const = 0;
  /// Bounds the Jacobian over a domain. It does not refuse folds, see requireInjective().
  /// @throws ResourceLimit, Cancelled
  [[nodiscard]] virtual CertifiedDeformation certify(const DeformationDomain& domain,
                                                     const CertifyOptions& options = {}) const = 0;
};

/// Limits of a Newton iteration, world units.
struct NewtonInverse {
  double tolerance = 0;    ///< largest residual of a result
  double enough = 0;       ///< residual at which the iteration ends, at most `tolerance`
  double longestMove = 0;  ///< limit of a step

  /// Finds a point that a map moves to a position. Each step is halved until the residual falls.
  /// @param jet  position and derivatives of the map at a point
  /// @return nullopt: the iteration ends at another point, or where the Jacobian is not positive
  template <typename Jet>
  [[nodiscard]] std::optional<Imath::V3d> find(const Jet& jet, const Imath::V3d& position,
                                               Imath::V3d guess) const;
};

/// Returns the step of Newton's method that moves the image by `off`, by Cramer's rule. The slopes
/// of a jet are the columns of the Jacobian.
[[nodiscard]] inline Imath::V3d newtonMove(const DeformationJet& jet, const Imath::V3d& off) {
  return Imath::V3d(off.dot(jet.slopes[1].cross(jet.slopes[2])),
                    off.dot(jet.slopes[2].cross(jet.slopes[0])),
                    off.dot(jet.slopes[0].cross(jet.slopes[1]))) /
         jet.determinant();
}

template <typename Jet>
std::optional<Imath::V3d> NewtonInverse::find(const Jet& jet, const Imath::V3d& position,
                                              Imath::V3d guess) const {
  constexpr int kSteps = 40, kHalvings = 8;
  DeformationJet here = jet(guess);
  Imath::V3d off = position - here.position;
  for (int step = 0; step < kSteps; ++step) {
    if (!(here.determinant() > 0)) return {};
    Imath::V3d move = newtonMove(here, off);
    const double length = move.length();
    if (!std::isfinite(length)) return {};
    if (length > longestMove) move *= longestMove / length;
    bool isNearer = false;
    for (int halving = 0; halving < kHalvings; ++halving, move *= 0.5) {
      const DeformationJet next = jet(guess + move);
      const Imath::V3d left = position - next.position;
      if (!(left.length2() < off.length2())) continue;
      isNearer = true;
      guess += move;
      here = next;
      off = left;
      break;
    }
    // Without a nearer point, the residual is at its rounding error, or there is no root.
    if (!isNearer || off.length() <= enough) break;
  }
  if (off.length() <= tolerance) return guess;
  return {};
}

/// A lattice as a deformation. Its certificate covers the entire box.
class LatticeDeformation final : public Deformation {
 public:
  explicit LatticeDeformation(ControlLattice lattice) : lattice_(std::move(lattice)) {}

  [[nodiscard]] const ControlLattice& lattice() const { return lattice_; }
  [[nodiscard]] DeformationJet jet(const Imath::V3d& world) const override {
    return lattice_.jet(world);
  }
  [[nodiscard]] bool isIdentity() const override { return lattice_.isIdentity(); }
  [[nodiscard]] Imath::Box3d bounds() const override { return lattice_.bounds(); }
  void requireDefined(const std::vector<Imath::V3d>& points, const char* what) const override;
  [[nodiscard]] CertifiedDeformation certify(const DeformationDomain& domain,
                                             const CertifyOptions& options = {}) const override;

 private:
  ControlLattice lattice_;
};

}  // namespace levelset
