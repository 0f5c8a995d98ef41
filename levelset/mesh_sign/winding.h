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

/// A triangle with a multiplicity.
struct WeightedTriangle {
  std::array<Imath::V3d, 3> corners;
  double weight = 1;
};

/// Winding number of a set of triangles. Far clusters enter by their dipole and its first moment
/// [Barill18]. Each cluster has an error bound, so that a value meets the requested tolerance.
class WindingField {
 public:
  WindingField() = default;
  explicit WindingField(std::vector<WeightedTriangle> triangles);

  [[nodiscard]] bool isEmpty() const { return triangles_.empty(); }
  /// Exact value, by direct summation in tree order.
  [[nodiscard]] double exact(const Imath::V3d& point) const;
  /// Value within `tolerance` of the exact one.
  [[nodiscard]] double within(double tolerance, const Imath::V3d& point) const;
  /// Bound on the magnitude of the winding number at all points of the ball. Infinite near the
  /// triangles.
  [[nodiscard]] double bound(const Imath::V3d& centre, double radius) const;

 private:
  struct Node {
    Imath::V3d centre;                 // area-weighted mean
    Imath::V3d dipole;                 // Σ area · normal
    std::array<Imath::V3d, 3> moment;  // row k: Σ area · normal · (y − centre)ₖ
    double area = 0, spread = 0;       // Σ |area|, Σ |area| · max |y − centre|²
    double radius = 0;
    std::size_t begin = 0, end = 0;
    std::size_t right = 0;  // the left child follows its parent; 0 for a leaf
  };
  void build(std::size_t begin, std::size_t end);
  [[nodiscard]] Node summarise(std::size_t begin, std::size_t end) const;
  [[nodiscard]] double far(const Node& node, const Imath::V3d& point) const;

  std::vector<WeightedTriangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace levelset::convert
