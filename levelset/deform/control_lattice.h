#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "levelset/deform/bernstein/tensor_bernstein.h"

/// Free-form deformation [Sederberg86]: maps of space that a lattice of control points gives.
namespace levelset {

/// Degree and knots of a lattice along one parameter.
struct LatticeAxis {
  int degree = 1;  ///< 1 to kMostDegree
  /// Knots from 0 to 1, ascending. The first and the last are repeated degree + 1 times (clamped),
  /// an inner knot at most degree times. Their number is that of the control points + degree + 1.
  std::vector<double> knots = {0, 0, 1, 1};

  [[nodiscard]] std::size_t count() const {
    return knots.size() - static_cast<std::size_t>(degree) - 1;
  }
  bool operator==(const LatticeAxis&) const = default;
};

inline constexpr int kMostDegree = 20;
inline constexpr std::size_t kMostControlPoints = 10'000'000;

/// Returns the axis with uniform clamped knots. degree + 1 control points make one Bézier span.
/// @throws InvalidInput for a degree outside [1, kMostDegree], and for degree control points or
///         fewer
[[nodiscard]] LatticeAxis uniformAxis(int degree, std::size_t count);

/// Greville abscissae of an axis, the parameters that belong to its control points.
[[nodiscard]] std::vector<double> grevilleAbscissae(const LatticeAxis& axis);

/// Values of all B-spline basis functions of an axis at a parameter in [0, 1].
[[nodiscard]] std::vector<double> basisAt(const LatticeAxis& axis, double parameter);

/// The numbers of a lattice.
struct LatticeData {
  std::array<LatticeAxis, 3> axes = {};
  /// Affine map from the unit cube of the parameters to world space, which places the box:
  /// world = parameter * boxToWorld, with Imath's row vectors.
  Imath::M44d boxToWorld = {};
  /// Control points, world units; the third index is the fastest.
  std::vector<Imath::V3d> points = {};
  std::vector<double> weights = {};  ///< positive, one for each control point; empty: all are 1
};

/// Volume of the box of a lattice, world units³; negative for a left-handed frame.
[[nodiscard]] double boxVolume(const LatticeData& data);

/// Returns the matrix of an axis-aligned box.
/// @throws InvalidInput for an empty or flat box
[[nodiscard]] Imath::M44d frameOf(const Imath::Box3d& box);

/// Position of a deformed point and derivatives of the deformation along world x, y and z.
struct DeformationJet {
  Imath::V3d position;
  std::array<Imath::V3d, 3> slopes;

  [[nodiscard]] double determinant() const { return slopes[0].dot(slopes[1].cross(slopes[2])); }
};

/// Tensor-product Bézier or B-spline volume, with or without weights, as a map of a box. Immutable
/// and cheap to copy.
///
/// Outside its box the map continues linearly, with the Jacobian at the nearest point of the box.
/// Only the few grid points beside a surface near the faces of the box need that. It is not covered
/// by certifyLattice(), so deformations refuse surfaces that leave the box.
class ControlLattice {
 public:
  /// @throws InvalidInput if counts differ, a number is not finite, a weight is not positive, a
  ///         degree, the knots or the box is not as LatticeAxis and LatticeData state
  explicit ControlLattice(LatticeData data);

  [[nodiscard]] const LatticeData& data() const { return shared_->data; }
  [[nodiscard]] bool isRational() const { return !shared_->data.weights.empty(); }

  /// Deformed position of a point, world coordinates.
  [[nodiscard]] Imath::V3d at(const Imath::V3d& world) const { return jet(world).position; }
  [[nodiscard]] DeformationJet jet(const Imath::V3d& world) const;

  /// Returns true for a point in the box, or outside by at most `tolerance` of its edges.
  [[nodiscard]] bool contains(const Imath::V3d& world, double tolerance = 1e-9) const;
  /// Parameters of a point, in [0, 1]³ inside the box.
  [[nodiscard]] Imath::V3d parameterOf(const Imath::V3d& world) const;
  [[nodiscard]] Imath::V3d worldOf(const Imath::V3d& parameter) const;
  /// Bounds of the control points. The deformed box lies inside.
  [[nodiscard]] Imath::Box3d bounds() const;
  /// Returns true if each control point lies where linear precision puts it, up to some units of
  /// precision, and the weights are equal: the map leaves every point in its place.
  [[nodiscard]] bool isIdentity() const;

 private:
  struct Shared {
    LatticeData data;
    Imath::M44d worldToBox;
    std::vector<double> homogeneous;  ///< n × 3, or n × 4 with weights: w x, w y, w z, w
  };
  std::shared_ptr<const Shared> shared_;
};

/// Returns the lattice of the identity: control points at the Greville abscissae.
[[nodiscard]] ControlLattice identityLattice(const std::array<LatticeAxis, 3>& axes,
                                             const Imath::M44d& boxToWorld);

/// Raises the degree of a Bézier lattice (one span on each axis) along one axis by one. The map
/// stays the same.
/// @throws InvalidInput for a lattice with several spans
[[nodiscard]] ControlLattice elevated(const ControlLattice& lattice, int axis);

/// One polynomial piece of a lattice, in Bernstein form over a box of parameters.
struct BezierPiece {
  Imath::V3d low, high;                      ///< box of parameters
  std::array<TensorBernstein, 3> numerator;  ///< world coordinates, times the weight
  TensorBernstein weight;                    ///< constant 1, of degree 0, without weights
};

/// Number of non-empty spans of an axis.
[[nodiscard]] std::size_t spanCount(const LatticeAxis& axis);

/// The pieces of a lattice, by knot insertion to full multiplicity, evaluated as blossoms.
class BezierPieces {
 public:
  explicit BezierPieces(const ControlLattice& lattice);

  [[nodiscard]] std::size_t size() const {
    return spans_[0].size() * spans_[1].size() * spans_[2].size();
  }
  [[nodiscard]] BezierPiece piece(std::size_t index) const;

 private:
  struct Span {
    std::size_t first = 0;  ///< first control point
    double low = 0, high = 0;
    std::vector<double> matrix;  ///< Bernstein coefficients of the control points, row by row
  };
  ControlLattice lattice_;
  std::array<std::vector<Span>, 3> spans_;
};

}  // namespace levelset
