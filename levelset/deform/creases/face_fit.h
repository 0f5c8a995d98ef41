#pragma once

// Internal header of levelset: includes OpenVDB, so include it from .cpp files only.

#include <array>
#include <optional>
#include <vector>

#include "levelset/vdb.h"

namespace levelset {

/// Grid point whose closest point lies on one smooth face of a solid. Index space.
struct FaceSample {
  openvdb::Vec3d position;
  double distance = 0;  ///< signed distance of the face, voxels
  openvdb::Vec3d foot;  ///< estimate of the closest point
};

/// Smooth face of a solid as a height over a plane: a polynomial of degree 2 or 3, whose distances
/// fit those of grid points best. Beside an edge the field has the distances of one face on one
/// side only; the polynomial continues the face to the edge. Index space.
class FaceFit {
 public:
  /// Fits a face by Gauss and Newton's method.
  /// @param origin   near the face; the weight of a sample falls to zero at the distance `reach`
  ///                 of its foot
  /// @param normal   unit vector, outwards
  /// @return empty with too few samples, or where the distances of the samples are not those of
  ///         one smooth face
  [[nodiscard]] static std::optional<FaceFit> make(const openvdb::Vec3d& origin,
                                                   const openvdb::Vec3d& normal, double reach,
                                                   const std::vector<FaceSample>& samples);

  /// Height of a point above the face along the normal of the plane, and its gradient.
  struct Value {
    double height = 0;
    openvdb::Vec3d gradient;
  };
  [[nodiscard]] Value valueAt(const openvdb::Vec3d& point) const;
  /// Moves a point onto the face, along the gradient.
  [[nodiscard]] openvdb::Vec3d projected(openvdb::Vec3d point) const;

 private:
  static constexpr std::size_t kTerms = 10;  ///< 1 x y x² xy y² x³ x²y xy² y³
  /// Height over the plane, and its derivatives.
  struct Height {
    double value = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  };
  [[nodiscard]] static std::array<double, kTerms> termsAt(double x, double y);
  [[nodiscard]] Height heightAt(double x, double y) const;
  [[nodiscard]] double stepOf(const std::vector<FaceSample>& samples,
                              std::vector<std::array<double, 2>>& feet, int terms, double reach,
                              bool& isSolved);

  openvdb::Vec3d origin_, right_, up_, normal_;
  std::array<double, kTerms> coefficients_{};
};

}  // namespace levelset
