#include "levelset/meshing/cells/cell_surface.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "tests/support/bands.h"

namespace cell_surface_test {

using namespace levelset;
using openvdb::Coord;
using openvdb::Vec3d;

/// The triangles in each cell of a surface, by their corners in index space, and the number of its
/// polygons.
struct CellContent {
  std::vector<std::array<Vec3d, 3>> triangles;
  std::size_t polygons = 0;
  bool operator==(const CellContent&) const = default;
};
using Contents = std::map<Coord, CellContent>;

Contents contentsOf(const CellSurface& surface) {
  const IndexMesh mesh = marchCells(surface);
  Contents contents;
  std::size_t triangle = 0, polygons = 0;
  for (const SurfaceBlock& block : surface.blocks()) {
    surface.forEachCell(block, [&](int x, int y, int z, unsigned pattern) {
      CellContent& content = contents[block.origin.offsetBy(x, y, z)];
      content.polygons = cellTable()[pattern].cycleCount;
      polygons += content.polygons;
      for (unsigned t = 0; t < cellTable()[pattern].triangleCount; ++t) {
        const auto& [a, b, c] = mesh.triangles.at(triangle++);
        content.triangles.push_back(
            {mesh.positions.at(a), mesh.positions.at(b), mesh.positions.at(c)});
      }
    });
  }
  EXPECT_EQ(triangle, surface.triangleCount());
  EXPECT_EQ(polygons, surface.cycleCount());
  return contents;
}

/// The part of a whole surface that lies in the given cells.
Contents within(const Contents& whole, const openvdb::MaskTree& cells) {
  Contents part;
  for (const auto& [cell, content] : whole)
    if (cells.isValueOn(cell)) part.emplace(cell, content);
  return part;
}

/// A part of the cells around the surface, and cells far from it.
openvdb::MaskTree someCells(const Contents& whole, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> chance(0, 1);
  openvdb::MaskTree cells;
  for (const auto& entry : whole)
    if (chance(random) < share) cells.setValueOn(entry.first);
  for (const int far : {-900, 0, 900}) cells.setValueOn(Coord(far, 3, 5));
  return cells;
}

openvdb::FloatGrid::ConstPtr ball() {
  const auto distance = [](const Imath::V3d& p) {
    return (p - Imath::V3d(0.3, -0.2, 0.1)).length() - 11.4;
  };
  const NarrowBand band =
      support::sampleBand(distance, {Imath::V3d(-12, -12, -12), Imath::V3d(13, 12, 12)}, 1);
  return vdb(band).deepCopy();
}

/// A grid without leaves: the surface lies between tiles.
openvdb::FloatGrid::ConstPtr tiles() {
  const auto grid = openvdb::FloatGrid::create(1.0f);
  grid->tree().addTile(1, Coord(0), -0.5f, true);
  grid->tree().addTile(1, Coord(-8, 8, 8), -2.0f, true);
  return grid;
}

TEST(CellSurface, APartHasTheTrianglesOfTheWholeInItsCells) {
  for (const auto& grid : {ball(), tiles()}) {
    const Contents whole = contentsOf(CellSurface(*grid));
    ASSERT_GT(whole.size(), 100u);
    for (const double share : {0.01, 0.3, 1.0}) {
      SCOPED_TRACE(share);
      const openvdb::MaskTree cells = someCells(whole, share, 5);
      const Contents part = contentsOf(CellSurface(*grid, &cells));
      EXPECT_GT(part.size(), 0u);
      EXPECT_TRUE(part == within(whole, cells));
    }
  }
}

TEST(CellSurface, APartNumbersTheEdgesOfItsCellsOnly) {
  const auto grid = ball();
  const CellSurface all(*grid);
  const Contents whole = contentsOf(all);
  openvdb::MaskTree cells;
  cells.setValueOn(whole.begin()->first);
  const CellSurface part(*grid, &cells);
  EXPECT_EQ(part.triangleCount(), whole.begin()->second.triangles.size());
  EXPECT_LE(part.blocks().size(), 8u);
  EXPECT_LT(part.vertexCount(), all.vertexCount());
}

TEST(CellSurface, NoCellsGiveAnEmptySurface) {
  const auto grid = ball();
  const openvdb::MaskTree none;
  const CellSurface part(*grid, &none);
  EXPECT_TRUE(part.blocks().empty());
  EXPECT_EQ(part.vertexCount(), 0u);
  EXPECT_TRUE(marchCells(part).triangles.empty());
}

}  // namespace cell_surface_test
