#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace levelset {

/// Reconstruction filter: the function between the grid points of a volume.
enum class VolumeFilter {
  Box,        ///< value of the nearest grid point
  Trilinear,  ///< trilinear interpolation in each cell of eight grid points
  Tricubic,   ///< cubic convolution, also called Catmull-Rom spline, along each axis [Keys81]
  BSpline,    ///< cubic B-spline with the samples as coefficients [Sigg05]
  BSplineQi,  ///< cubic B-spline with the coefficients f − ∇²f/6 [Sigg05], ∇² by seven samples
  WindowedSinc,    ///< sinc under a raised cosine of radius 3 [MarschnerLobb94], weights of sum one
  SuperQuadratic,  ///< quadratic super spline on the type-6 partition [Kalbe11]
  CubicC1,         ///< cubic C¹ spline on the type-6 partition [Kalbe11]
  BccQuadratic     ///< quadratic C¹ spline Q₂ on truncated octahedra [Kalbe11]
};

/// All filters, in the order of the enumeration.
inline constexpr std::array kVolumeFilters = {VolumeFilter::Box,
                                              VolumeFilter::Trilinear,
                                              VolumeFilter::Tricubic,
                                              VolumeFilter::BSpline,
                                              VolumeFilter::BSplineQi,
                                              VolumeFilter::WindowedSinc,
                                              VolumeFilter::SuperQuadratic,
                                              VolumeFilter::CubicC1,
                                              VolumeFilter::BccQuadratic};

/// Facts about a filter, for smooth data with the grid spacing h.
struct VolumeFilterFacts {
  std::string_view name;  ///< as options write it, for example "bspline-qi"
  /// Derivatives up to this order are continuous everywhere; −1: not even the value.
  int continuity;
  int reproduced;  ///< polynomials up to this total degree are returned unchanged
  /// Orders of the errors of values, gradients and second derivatives: O(hᵒʳᵈᵉʳ). Zero: the error
  /// does not vanish.
  int valueOrder, gradientOrder, hessianOrder;
  bool interpolates;  ///< true: the value at a grid point is the sample
  int support;        ///< samples along each axis on which a value depends, at most
};

[[nodiscard]] const VolumeFilterFacts& factsOf(VolumeFilter filter);

/// Finds a filter by its name. @return empty if no filter has the name
[[nodiscard]] std::optional<VolumeFilter> volumeFilterNamed(std::string_view name);

}  // namespace levelset
