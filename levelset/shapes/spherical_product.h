#pragma once

// Private to the superquadrics: surfaces made of two polar curves, with exact distances.

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <vector>

#include "levelset/geometry/search/point_search.h"
#include "levelset/shapes/superquadric.h"

namespace levelset {

/// Surface of all points s · (r₁(θ) cos θ r₂(φ) cos φ, r₁(θ) sin θ r₂(φ) cos φ, r₂(φ) sin φ) with θ
/// from −π to π and φ from −π/2 to π/2 [Barr81, Gielis03]. It is star-shaped about the origin.
///
/// Distances: samples cover the surface. The closest point lies within their spacing of a sample
/// that is not much farther than the closest one. From each such sample that is closer than its
/// neighbours, Newton's method with differences of second order goes to a minimum. Where it does
/// not descend, as in creases, a search with shrinking steps along θ and φ does; creases lie along
/// these lines.
class SphericalProduct {
 public:
  /// @throws InvalidInput if the curves vary too much
  SphericalProduct(const Superformula& around, const Superformula& upright,
                   const Imath::V3d& scale);

  [[nodiscard]] Imath::V3d at(double theta, double phi) const;
  [[nodiscard]] bool isInside(const Imath::V3d& point) const;
  /// Signed distance, negative inside. Beyond `reach`, a lower bound of its magnitude above it.
  [[nodiscard]] double distance(const Imath::V3d& point, double reach) const;
  /// Bounds and area of the samples.
  [[nodiscard]] const Imath::Box3d& bounds() const { return bounds_; }
  [[nodiscard]] double area() const { return area_; }

 private:
  /// Samples along one of both curves.
  struct Row {
    double angle = 0, cosine = 0, sine = 0;  ///< multiplied by the radius
  };
  [[nodiscard]] static Row rowAt(const Superformula& curve, double angle);
  [[nodiscard]] std::vector<Row> rowsOf(const Superformula& curve, double from, double to,
                                        const Imath::V2d& scale, double spacing) const;
  [[nodiscard]] Imath::V3d product(const Row& around, const Row& upright) const {
    return {scale_.x * around.cosine * upright.cosine, scale_.y * around.sine * upright.cosine,
            scale_.z * upright.sine};
  }
  [[nodiscard]] Imath::V3d sample(std::size_t i, std::size_t j) const {
    return product(around_[i], upright_[j]);
  }
  [[nodiscard]] bool isLocalMinimum(std::size_t i, std::size_t j, const Imath::V3d& point,
                                    double squared) const;
  /// Least distance near the surface point at two angles.
  [[nodiscard]] double descend(const Imath::V3d& point, double theta, double phi) const;

  Superformula aroundCurve_, uprightCurve_;
  Imath::V3d scale_;
  double size_ = 0, spacing_ = 0;
  std::vector<Row> around_, upright_;
  PointSearch samples_;  ///< sample(i, j) has the number i · upright_.size() + j
  Imath::Box3d bounds_;
  double area_ = 0;
};

}  // namespace levelset
