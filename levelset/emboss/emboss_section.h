#pragma once

// For the .cpp files of levelset/emboss only.

#include <Imath/ImathVec.h>

#include <vector>

#include "levelset/emboss/emboss.h"

namespace levelset::embossing {

/// Cross-section of an embossed surface: the graph of the height h(d) in the half plane of points
/// (d, φ). Here d ≥ 0 is the distance from the curve, and φ the distance from the old surface. The
/// graph of EmbossProfile::Flat has a wall at d = width. For d ≥ width the graph is the ray φ = 0.
/// On a plane with a point or a straight segment, (d, φ) are Cartesian coordinates of each section,
/// so distance() is then the exact distance to the new surface.
class EmbossSection {
 public:
  /// @param width   distance at which the height falls to zero, > 0
  /// @param height  largest height, in the unit of the width, any sign but not zero
  EmbossSection(EmbossProfile profile, double width, double height);

  /// Height h(d), of the sign of the largest height; 0 for d ≥ width.
  [[nodiscard]] double height(double d) const;
  /// Signed distance from (d, φ) to the section, negative below it. Returns the bits of φ where the
  /// nearest point lies on the ray φ = 0.
  [[nodiscard]] double distance(double d, double phi) const;

 private:
  [[nodiscard]] double raisedHeight(double d) const;
  [[nodiscard]] double raisedDistance(double d, double phi) const;
  [[nodiscard]] double squaredToArc(const Imath::V2d& p) const;
  [[nodiscard]] bool isCurved() const;
  /// Point of the part with d ≤ width, and its first two derivatives by the parameter.
  struct Jet {
    Imath::V2d point, first, second;
  };
  [[nodiscard]] Jet arc(double t) const;
  [[nodiscard]] double footSquared(const Imath::V2d& p, std::size_t node) const;

  EmbossProfile profile_;
  double width_, raised_, sign_;
  double parameterStep_ = 0;       ///< between two nodes of a curved profile
  std::vector<Imath::V2d> nodes_;  ///< polyline with d ≤ width; inscribed if the profile is curved
};

}  // namespace levelset::embossing
