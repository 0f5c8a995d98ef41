#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// Signed solid angle of the triangle as seen from `point`, as a fraction of the full sphere.
/// Positive when the back side is visible [vanOosterom83]. A closed mesh that faces outwards sums
/// to 1 inside.
[[nodiscard]] double solidAngle(const Imath::V3d& a, const Imath::V3d& b, const Imath::V3d& c,
                                const Imath::V3d& point);

/// A triangle whose solid angle counts `weight` times, an integer below 2²⁴.
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
  explicit WindingField(const std::vector<WeightedTriangle>& triangles);
  /// Reads the corners of the triangles from the mesh, which must outlive the field.
  explicit WindingField(const LocalMesh& mesh);
  WindingField(WindingField&&) = default;
  WindingField& operator=(WindingField&&) = default;
  WindingField(const WindingField&) = delete;  // points_ may refer to own_
  WindingField& operator=(const WindingField&) = delete;
  ~WindingField() = default;

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
    double radius = 0;                 // distance from the centre to the farthest corner
    std::uint32_t begin = 0, end = 0;  // range of triangles_
    std::uint32_t right = 0;  // right child, 0 for a leaf; the left child follows its parent
  };
  /// A triangle by the indices of its corners in points_.
  struct Member {
    Triangle corners;
    float weight;
  };
  void buildAll();
  void build(std::size_t begin, std::size_t end);
  [[nodiscard]] WeightedTriangle triangle(std::size_t i) const;
  [[nodiscard]] Node summarise(std::size_t begin, std::size_t end) const;
  [[nodiscard]] double far(const Node& node, const Imath::V3d& point) const;

  std::vector<Imath::V3d> own_;  // corners, unless a mesh holds them
  std::span<const Imath::V3d> points_;
  std::vector<Member> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace levelset::convert
