#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <vector>

namespace levelset::convert {

/// Signed solid angle of the triangle as seen from `point`, as a fraction of the full sphere.
/// Positive when the back side is visible [vanOosterom83]. A closed mesh that faces outwards sums
/// to 1 inside.
[[nodiscard]] double solidAngle(const Imath::V3d& a, const Imath::V3d& b, const Imath::V3d& c,
                                const Imath::V3d& point);

/// A triangle whose solid angle counts `weight` times.
struct WeightedTriangle {
  std::array<Imath::V3d, 3> corners;
  double weight = 1;
};

/// Winding number of a set of triangles. A tree groups the triangles into clusters. Far clusters
/// enter by their dipole and its first moment [Barill18]. Each cluster has an error bound, so that
/// a value meets the requested tolerance.
class WindingField {
 public:
  WindingField() = default;
  explicit WindingField(std::vector<WeightedTriangle> triangles);

  [[nodiscard]] bool isEmpty() const { return triangles_.empty(); }
  /// Winding number at `point`, by direct summation over all triangles.
  [[nodiscard]] double exact(const Imath::V3d& point) const;
  /// Winding number at `point`, with an error of at most `tolerance`.
  [[nodiscard]] double within(double tolerance, const Imath::V3d& point) const;
  /// Bound on the magnitude of the winding number at all points of the ball around `centre`.
  /// Infinite near the triangles.
  [[nodiscard]] double bound(const Imath::V3d& centre, double radius) const;

 private:
  struct Node {
    Imath::V3d centre;                 // area-weighted mean of the triangles' centroids
    Imath::V3d dipole;                 // Σ area · normal
    std::array<Imath::V3d, 3> moment;  // row k: Σ area · normal · (centroid − centre)ₖ
    // Σ |area|, and Σ |area| · max |corner − centre|²
    double area = 0, spread = 0;
    double radius = 0;               // distance from the centre to the farthest corner
    std::size_t begin = 0, end = 0;  // range of triangles_
    std::size_t right = 0;           // right child, 0 for a leaf; the left child follows its parent
  };
  void build(std::size_t begin, std::size_t end);
  [[nodiscard]] Node summarise(std::size_t begin, std::size_t end) const;
  [[nodiscard]] double far(const Node& node, const Imath::V3d& point) const;

  std::vector<WeightedTriangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace levelset::convert
