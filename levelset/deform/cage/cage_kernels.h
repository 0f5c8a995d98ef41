#pragma once

#include <Imath/ImathVec.h>

#include <array>

/// Integrals over one triangle of a cage, which are the parts of cage coordinates, with gradients.
/// Internal.
namespace levelset::cage {

/// Triangle of a closed cage, counter-clockwise from outside, with what integrals need.
struct CageTriangle {
  std::array<Imath::V3d, 3> corners;
  Imath::V3d normal;  ///< unit vector, outwards
  double doubleArea;  ///< twice the area
  double diameter;    ///< longest edge
  /// Gradients, in the plane, of the linear functions that are 1 at one corner and 0 at the others.
  std::array<Imath::V3d, 3> slopes;
};

[[nodiscard]] CageTriangle cageTriangle(const Imath::V3d& a, const Imath::V3d& b,
                                        const Imath::V3d& c);

/// Number and its gradient by the position.
struct Sloped {
  double value = 0;
  Imath::V3d slope{0};
};

/// Weights of the mean-value coordinates [Ju05] of the corners of a triangle at x:
/// w_i = ∫ φ_i(y) (y − x)·n / |y − x|⁴ dA, where φ_i is 1 at corner i and 0 at the others.
struct MeanValueWeights {
  /// Distance of x from the plane, positive behind the triangle. Its gradient is −normal.
  double height = 0;
  /// False: `terms` are the weights. True: `terms` are the weights times `height`, which stay
  /// smooth where x passes through the triangle.
  bool isScaled = false;
  std::array<Sloped, 3> terms;
};

/// @pre x does not lie on an edge or a corner
[[nodiscard]] MeanValueWeights meanValueWeights(const CageTriangle& triangle, const Imath::V3d& x);
/// The same by quadrature, never scaled. It is exact to rounding errors unless the height is far
/// smaller than the distance of x from the edges of the triangle, and x lies over its inside.
[[nodiscard]] MeanValueWeights meanValueQuadrature(const CageTriangle& triangle,
                                                   const Imath::V3d& x);

/// Green coordinates [Lipman08] at x: ∫ φ_i ∂G/∂n dA for the corners and −∫ G dA for the normal,
/// where G = −1 / (4π |y − x|).
struct GreenWeights {
  std::array<Sloped, 3> corners;
  Sloped normal;
};

/// A point on the triangle counts as inside. Gradients are infinite on edges.
[[nodiscard]] GreenWeights greenWeights(const CageTriangle& triangle, const Imath::V3d& x);

}  // namespace levelset::cage
