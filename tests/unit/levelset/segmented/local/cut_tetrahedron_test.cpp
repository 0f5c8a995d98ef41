// Surfaces in a tetrahedron of which some edges are crossed.

#include "levelset/segmented/local/cut_tetrahedron.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <utility>

namespace cut_tetrahedron_test {

using levelset::CutTetrahedron;
using levelset::cutTetrahedron;
using Node = CutTetrahedron::Node;
using Line = std::pair<Node, Node>;

Line lineOf(Node a, Node b) {
  return {std::min(a, b), std::max(a, b)};
}

/// Number of polygons at each line between two nodes.
std::map<Line, int> usesOf(const CutTetrahedron& cut) {
  std::map<Line, int> uses;
  for (const CutTetrahedron::Polygon& polygon : cut.polygons)
    for (std::size_t k = 0; k < polygon.nodes.size(); ++k)
      ++uses[lineOf(polygon.nodes[k], polygon.nodes[(k + 1) % polygon.nodes.size()])];
  return uses;
}

/// Lines that a face needs, whatever the other edges of the tetrahedron: both tetrahedra at the
/// face must draw the same ones.
std::vector<Line> linesOfFace(std::uint32_t crossed, std::uint8_t opposite) {
  std::vector<Node> edges;
  for (Node e = 0; e < 6; ++e) {
    const auto [i, j] = CutTetrahedron::kEdges[e];
    if ((crossed >> e & 1) && i != opposite && j != opposite) edges.push_back(e);
  }
  if (edges.size() == 2) return {lineOf(edges[0], edges[1])};
  std::vector<Line> lines;
  for (const Node e : edges)
    lines.push_back(lineOf(e, static_cast<Node>(CutTetrahedron::kFirstFace + opposite)));
  return lines;
}

TEST(CutTetrahedron, JoinsTheLinesOnItsFacesWithoutGaps) {
  for (std::uint32_t crossed = 0; crossed < 64; ++crossed)
    for (const bool hasCorner : {false, true}) {
      const CutTetrahedron& cut = cutTetrahedron(crossed, hasCorner);
      std::map<Line, int> uses = usesOf(cut);
      for (std::uint8_t opposite = 0; opposite < 4; ++opposite)
        for (const Line& line : linesOfFace(crossed, opposite)) {
          EXPECT_EQ(uses[line], 1) << crossed;
          uses.erase(line);
        }
      for (const CutTetrahedron::Junction& junction : cut.junctions) {
        EXPECT_EQ(uses[lineOf(junction.nodes[0], junction.nodes[1])], 3) << crossed;
        uses.erase(lineOf(junction.nodes[0], junction.nodes[1]));
      }
      for (const auto& rim : cut.rims) {
        EXPECT_EQ(uses[lineOf(rim[0], rim[1])], 1) << crossed;
        uses.erase(lineOf(rim[0], rim[1]));
      }
      for (const auto& [line, count] : uses) EXPECT_EQ(count, 2) << crossed;
    }
}

TEST(CutTetrahedron, HasTheSurfacesOfLabels) {
  constexpr std::array<std::size_t, 5> kPolygons = {0, 0, 1, 3, 12}, kJunctions = {0, 0, 0, 1, 4};
  // Labels of four corners: crossed are the edges between different ones. No rims, and as many
  // junctions as regions allow.
  for (int code = 0; code < 256; ++code) {
    const std::array<int, 4> l = {code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6 & 3};
    std::uint32_t crossed = 0;
    for (std::size_t e = 0; e < 6; ++e)
      if (l[CutTetrahedron::kEdges[e][0]] != l[CutTetrahedron::kEdges[e][1]]) crossed |= 1u << e;
    std::uint32_t seen = 0;
    for (const int label : l) seen |= 1u << label;
    const CutTetrahedron& cut = cutTetrahedron(crossed, false);
    EXPECT_TRUE(cut.rims.empty());
    const auto regions = static_cast<std::size_t>(std::popcount(seen));
    EXPECT_EQ(cut.polygons.size(), kPolygons[regions]);
    EXPECT_EQ(cut.junctions.size(), kJunctions[regions]);
    EXPECT_EQ(cut.isJunctionPoint, regions == 4);
    for (const CutTetrahedron::Polygon& polygon : cut.polygons)
      EXPECT_NE(l[polygon.from], l[polygon.to]);
  }
}

TEST(CutTetrahedron, FacesTheCornerOnTheFarSide) {
  // One crossed edge: a triangle that ends in the two faces at the edge.
  const std::array<std::array<int, 3>, 4> corners = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}}};
  const auto place = [&](Node node) {
    std::array<double, 3> p{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (node < CutTetrahedron::kFirstFace) {
        const auto [i, j] = CutTetrahedron::kEdges[node];
        p[axis] = (corners[i][axis] + corners[j][axis]) / 2.0;
      } else {
        for (std::size_t c = 0; c < 4; ++c)
          if (c != node - std::size_t{CutTetrahedron::kFirstFace})
            p[axis] += corners[c][axis] / 3.0;
      }
    }
    return p;
  };
  for (std::uint32_t e = 0; e < 6; ++e) {
    const CutTetrahedron& cut = cutTetrahedron(1u << e, false);
    ASSERT_EQ(cut.polygons.size(), 1u);
    const CutTetrahedron::Polygon& polygon = cut.polygons[0];
    ASSERT_EQ(polygon.nodes.size(), 3u);
    const auto a = place(polygon.nodes[0]), b = place(polygon.nodes[1]),
               c = place(polygon.nodes[2]);
    double volume = 0;
    for (std::size_t x = 0; x < 3; ++x) {
      const std::size_t y = (x + 1) % 3, z = (x + 2) % 3;
      volume += ((b[y] - a[y]) * (c[z] - a[z]) - (b[z] - a[z]) * (c[y] - a[y])) *
                (corners[polygon.to][x] - corners[polygon.from][x]);
    }
    EXPECT_GT(volume, 0) << e;
  }
}

}  // namespace cut_tetrahedron_test
