#pragma once

#include <array>
#include <cstdint>

/// Surface inside one cell of the grid, for each of the 256 patterns of signs at its corners.
///
/// Corner = dx·4 + dy·2 + dz. Edge = axis·4 + k, where k's two bits are the offsets along the axes
/// axis+1 (high) and axis+2 (low), modulo 3.
/// The table is computed when it is first used. On each face of a cell, one segment cuts off every
/// run of adjacent inside corners, so inside corners that share only a diagonal stay apart. Both
/// cells at a face have the same segments. Hence the surface is closed, and the polygons around
/// each of its vertices form one ring. The inside is connected along grid edges, the outside also
/// across the diagonals of faces.
namespace levelset {

struct CellCase {
  std::uint8_t cycleCount = 0;  ///< number of closed polygons
  std::array<std::uint8_t, 4> cycleLength = {};
  /// Edges of all polygons, one after the other, counter-clockwise seen from outside.
  std::array<std::uint8_t, 12> cycleEdges = {};
  /// Index of the polygon with a vertex on the edge; −1: the edge is not crossed.
  std::array<std::int8_t, 12> cycleOfEdge = {};
  std::uint8_t triangleCount = 0;
  /// Triangles of the polygons; each corner is the number of the edge on which it lies.
  std::array<std::array<std::uint8_t, 3>, 8> triangles = {};
};

/// Returns the surface of a cell by its pattern. Bit c of the pattern is set when corner c is
/// inside.
[[nodiscard]] const std::array<CellCase, 256>& cellTable();

[[nodiscard]] constexpr int cornerOf(int dx, int dy, int dz) {
  return dx * 4 + dy * 2 + dz;
}
[[nodiscard]] constexpr int edgeAxis(int edge) {
  return edge >> 2;
}
/// Returns the offset of the edge's lower end from the cell's lowest corner.
[[nodiscard]] constexpr std::array<int, 3> edgeOffset(int edge) {
  std::array<int, 3> offset = {};
  const int axis = edge >> 2;
  offset[static_cast<std::size_t>((axis + 1) % 3)] = (edge >> 1) & 1;
  offset[static_cast<std::size_t>((axis + 2) % 3)] = edge & 1;
  return offset;
}

}  // namespace levelset
