#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cstdint>
#include <vector>

namespace levelset {

/// Surfaces in a tetrahedron of which some edges are crossed. They are joined from face to face: a
/// face with one crossed edge holds a point of a rim, one with three a point of a junction.
struct CutTetrahedron {
  /// Node: 0 to 5 on an edge (01, 02, 03, 12, 13, 23), 6 to 9 on the face opposite to corner
  /// node − 6, 10 inside.
  using Node = std::uint8_t;
  static constexpr Node kFirstFace = 6, kInside = 10;
  static constexpr std::array<std::array<std::uint8_t, 2>, 6> kEdges = {
      {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

  struct Polygon {
    std::vector<Node> nodes;  ///< 3 to 5; seen from `to` they run counter-clockwise
    std::uint8_t from, to;    ///< corners on the two sides
  };
  struct Junction {
    std::array<Node, 2> nodes;
    std::uint8_t face;  ///< opposite to this corner: the face whose three corners lie around it
  };

  std::vector<Polygon> polygons;
  std::vector<Junction> junctions;
  std::vector<std::array<Node, 2>> rims;  ///< sides of polygons where a sheet ends
  std::array<bool, 4> hasFaceNode{};      ///< by opposite corner
  bool hasInside = false;
  bool isJunctionPoint = false;  ///< three junction curves or more meet inside
};

/// Number of crossed edges of a face, from the bits of its edges.
[[nodiscard]] constexpr bool holdsFaceNode(std::uint32_t crossedEdges) {
  return crossedEdges == 1 || crossedEdges == 3;
}

/// Looks up how a tetrahedron is cut.
/// @param crossed  bit n: edge n is crossed
/// @param hasCorner  a rim bends inside, so that its sheet gets a node there
[[nodiscard]] const CutTetrahedron& cutTetrahedron(std::uint32_t crossed, bool hasCorner);

}  // namespace levelset
