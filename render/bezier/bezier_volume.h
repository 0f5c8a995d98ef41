#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "levelset/deform/control_lattice.h"
#include "render/bezier/trims/trim_region.h"

/// Implicit surfaces in trivariate Bézier and B-spline volumes [Liu14]. A volume maps the unit cube
/// of its parameters to positions and to a number, the attribute. The surface consists of the
/// positions of all parameters whose attribute is the isovalue. Maps may fold, and edges or faces
/// of the cube may collapse.
namespace render {

/// Region of the plane (u, v) to which patches of one surface are cut, and the box of a patch in
/// it.
struct PatchTrim {
  std::shared_ptr<const TrimRegion> region;
  Imath::Box2d box{Imath::V2d(0), Imath::V2d(1)};

  /// Point of the plane. @param parameter  in the unit cube of the patch
  [[nodiscard]] Imath::V2d pointAt(const Imath::V3d& parameter) const {
    const Imath::V2d size = box.size();
    return {box.min.x + size.x * parameter.x, box.min.y + size.y * parameter.y};
  }
  [[nodiscard]] bool keeps(const Imath::V3d& parameter) const {
    return region->contains(pointAt(parameter));
  }
};

/// Rational trivariate Bézier patch with positions and attributes. Control points are ordered as
/// in levelset::TensorBernstein: the third index is the fastest.
struct BezierPatch {
  std::array<int, 3> degree = {1, 1, 1};  ///< 1 to levelset::kMostDegree
  std::vector<Imath::V3d> points = {};    ///< positions of the control points, world units
  /// Numbers of the control points, for each attribute.
  std::vector<std::vector<double>> attributes = {};
  std::vector<double> weights = {};            ///< positive; empty: all are 1
  std::shared_ptr<const PatchTrim> trim = {};  ///< null: all of the surface is kept

  [[nodiscard]] std::size_t controlPointCount() const {
    return static_cast<std::size_t>(degree[0] + 1) * static_cast<std::size_t>(degree[1] + 1) *
           static_cast<std::size_t>(degree[2] + 1);
  }
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(i) * static_cast<std::size_t>(degree[1] + 1) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(degree[2] + 1) +
           static_cast<std::size_t>(k);
  }
};

/// Position of a patch at a parameter, by the de Casteljau algorithm.
[[nodiscard]] Imath::V3d positionAt(const BezierPatch& patch, const Imath::V3d& parameter);
/// An attribute of a patch at a parameter, by the de Casteljau algorithm.
[[nodiscard]] double attributeAt(const BezierPatch& patch, std::size_t attribute,
                                 const Imath::V3d& parameter);

/// For each attribute of a patch at a parameter: 1 where it is below the isovalue, else 0.
[[nodiscard]] std::vector<char> insideAt(const BezierPatch& patch, double isovalue,
                                         const Imath::V3d& parameter);

/// Raises the degree along one axis by one. Positions and attributes stay the same.
/// @throws levelset::InvalidInput at the largest degree
[[nodiscard]] BezierPatch elevated(const BezierPatch& patch, int axis);

/// Parametric surface as a patch: both layers along w are the control points of the surface, and
/// the attribute is the isovalue at w = 1/3. Halvings never meet this w, so each node has one child
/// with the surface. Normals are ∂p/∂u × ∂p/∂v.
/// @param points  (degreeU + 1)(degreeV + 1) control points, v fastest
[[nodiscard]] BezierPatch surfacePatch(int degreeU, int degreeV,
                                       const std::vector<Imath::V3d>& points,
                                       const std::vector<double>& weights = {},
                                       double isovalue = 0);

/// B-spline volume with positions and attributes; its members are those of BezierPatch.
struct SplineVolume {
  std::array<levelset::LatticeAxis, 3> axes = {};
  std::vector<Imath::V3d> points = {};
  std::vector<std::vector<double>> attributes = {};
  std::vector<double> weights = {};
};

/// Converts a B-spline volume to one Bézier patch for each span, by knot insertion.
/// @throws levelset::InvalidInput as levelset::ControlLattice, and if the counts of points and
///         numbers of an attribute differ
[[nodiscard]] std::vector<BezierPatch> bezierPatches(const SplineVolume& volume);
/// Cuts patches of one spline surface.
/// @param patches  those of bezierPatches(), in their order
/// @param domain   box of the parameters of the surface in the plane of the loops
void trimPatches(const SplineVolume& volume, const std::shared_ptr<const TrimRegion>& region,
                 std::vector<BezierPatch>& patches,
                 const Imath::Box2d& domain = {Imath::V2d(0), Imath::V2d(1)});

/// Patches that together are one object. A point is inside an attribute where the attribute is
/// below the isovalue. The object is the inside of the only attribute, or an expression of several.
/// Expressions are evaluated at parameters, so edges stay sharp when the map deforms.
struct BezierVolume {
  std::vector<BezierPatch> patches = {};
  double isovalue = 0;
  /// Expression in postfix notation, as CsgExpression::postfix(): numbers of attributes, −1 for the
  /// union, −2 for the intersection, −3 for the difference. Empty: the first attribute.
  std::vector<int> expression = {};

  /// Number of attributes of each patch.
  [[nodiscard]] std::size_t attributeCount() const {
    return patches.empty() ? 0 : patches.front().attributes.size();
  }

  /// Box of the control points, which contains the surface. Empty without patches.
  [[nodiscard]] Imath::Box3d bounds() const;
  /// Memory of the control points, bytes.
  [[nodiscard]] std::size_t bytes() const;
};

/// Checks a volume.
/// @throws levelset::InvalidInput for degrees outside [1, levelset::kMostDegree], wrong counts,
///         numbers that are not finite or above 1e30, weights outside [1e-6, 1e6], several
///         attributes without an expression, and a wrong expression
void requireBezierVolume(const BezierVolume& volume);

/// Sides of a root of one attribute in an object with an expression.
enum class SurfaceSide {
  None,    ///< the root is not on the surface of the object
  Same,    ///< the object is inside where the attribute is inside
  Flipped  ///< the object is inside where the attribute is outside, as of a subtracted one
};
/// Finds the side by the values of the other attributes. @param inside  for each attribute: nonzero
/// where the root is inside; that of `attribute` is not read
[[nodiscard]] SurfaceSide sideOf(const std::vector<int>& expression, std::size_t attribute,
                                 std::vector<char> inside);

}  // namespace render
