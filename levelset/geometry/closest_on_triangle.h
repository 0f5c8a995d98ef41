#pragma once

namespace levelset {

/// Closest point on a triangle and the feature (corner, edge or interior) that contains it.
template <typename Vector>
struct TriangleFoot {
  Vector point{0};
  int part = 6;  ///< 0 to 2: corner; 3 to 5: edge from corner part − 3 to the next; 6: interior
};

/// Finds the closest point by the Voronoi regions of the corners, edges and interior [Ericson05,
/// 5.1.5]. For a triangle without area, returns a point on an edge or a corner.
template <typename Vector>
[[nodiscard]] TriangleFoot<Vector> closestOnTriangle(const Vector& p, const Vector& a,
                                                     const Vector& b, const Vector& c) {
  const Vector ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {a, 0};
  const Vector bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {b, 1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    if (!(d1 > d3)) return {a, 0};
    return {Vector(a + ab * (d1 / (d1 - d3))), 3};
  }
  const Vector cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {c, 2};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    if (!(d2 > d6)) return {a, 0};
    return {Vector(a + ac * (d2 / (d2 - d6))), 5};
  }
  const double va = d3 * d6 - d5 * d4, e4 = d4 - d3, e5 = d5 - d6;
  if (va <= 0 && e4 >= 0 && e5 >= 0) {
    if (!(e4 + e5 > 0)) return {b, 1};
    return {Vector(b + (c - b) * (e4 / (e4 + e5))), 4};
  }
  const double sum = va + vb + vc;
  return {Vector(a + ab * (vb / sum) + ac * (vc / sum)), 6};
}

}  // namespace levelset
