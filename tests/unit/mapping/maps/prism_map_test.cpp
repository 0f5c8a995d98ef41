#include "mapping/maps/prism_map.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "mapping/distortion/distortion.h"
#include "tests/support/formula_patches.h"
#include "tests/support/measured.h"

namespace prism_map_test {

using Imath::V3d;
using mapping::Distortion;
using mapping::GridBlock;
using mapping::Lattice;
using mapping::LatticeBorder;
using mapping::Patch;
using mapping::PrismMap;
using mapping::Tetrahedron;

/// Position on a third of a cylinder of radius 2.
V3d onCylinder(const V3d& uvw) {
  const double angle = 2.1 * (uvw.x - 0.5), r = 2 + uvw.z;
  return {r * std::sin(angle), 3 * uvw.y, r * std::cos(angle)};
}

double volumeOf(const Lattice::Corners& c) {
  return (c[1] - c[0]).dot((c[2] - c[0]).cross(c[3] - c[0])) / 6;
}

template <typename Visit>
void forEachTetrahedron(const Lattice& lattice, const Visit& visit) {
  for (int k = 0; k < lattice.cells()[2]; ++k)
    for (int j = 0; j < lattice.cells()[1]; ++j)
      for (int i = 0; i < lattice.cells()[0]; ++i)
        for (int order = 0; order < 6; ++order) visit(Tetrahedron{{i, j, k}, order});
}

TEST(Lattice, NeighboursShareTheFaceBetweenThem) {
  const Lattice lattice(support::patchAt(onCylinder, 4, 3, 3), {.embedDepth = 0.2, .rim = 0.1});
  std::size_t outside = 0;
  forEachTetrahedron(lattice, [&](const Tetrahedron& t) {
    const Lattice::Corners own = lattice.corners(t);
    for (int corner = 0; corner < 4; ++corner) {
      Tetrahedron beyond = t;
      if (!lattice.cross(beyond, corner)) {
        ++outside;
        continue;
      }
      const Lattice::Corners other = lattice.corners(beyond);
      int shared = 0;
      for (int a = 0; a < 4; ++a)
        if (a != corner)
          shared += static_cast<int>(
              std::count(other.begin(), other.end(), own[static_cast<std::size_t>(a)]));
      ASSERT_EQ(shared, 3);
      ASSERT_EQ(std::count(other.begin(), other.end(), own[static_cast<std::size_t>(corner)]), 0);
    }
  });
  // Two triangles for each outer face of a cell.
  const auto& n = lattice.cells();
  EXPECT_EQ(outside, static_cast<std::size_t>(4 * (n[0] * n[1] + n[1] * n[2] + n[2] * n[0])));
}

TEST(Lattice, TetrahedraFillTheirCells) {
  const auto bent = [](const V3d& t) {
    return V3d(4 * t.x + 0.3 * t.y, 3 * t.y, t.z * (1 + 0.2 * t.x));
  };
  const Lattice lattice(support::patchAt(bent, 5, 4, 3), {});
  double world = 0, texture = 0;
  forEachTetrahedron(lattice, [&](const Tetrahedron& t) {
    world += std::abs(volumeOf(lattice.corners(t)));
    texture += std::abs(volumeOf(lattice.textureCorners(t)));
    // Equal orientation on both sides: the map does not fold.
    ASSERT_GT(volumeOf(lattice.corners(t)) * volumeOf(lattice.textureCorners(t)), 0);
  });
  EXPECT_NEAR(texture, 1, support::doubleRounding(20));
  EXPECT_NEAR(world, 4 * 3 * 1.1, support::doubleRounding(40));
}

TEST(Lattice, RefinesLayersOfFewerParticles) {
  Patch patch = support::patchAt(onCylinder, 17, 9, 3);
  const Patch coarse = support::patchAt(onCylinder, 9, 5, 3);
  patch.layers[1] = coarse.layers[1];
  const Lattice lattice(patch, {});
  EXPECT_EQ(lattice.nodeCount(), 17u * 9 * 3);
  // Particles are on the cylinder to third order. Chords would be off by 0.02.
  double worst = 0;
  forEachTetrahedron(lattice, [&](const Tetrahedron& t) {
    const Lattice::Corners world = lattice.corners(t), texture = lattice.textureCorners(t);
    for (std::size_t i = 0; i < 4; ++i)
      worst = std::max(worst, (world[i] - onCylinder(texture[i])).length());
  });
  EXPECT_LE(worst, support::measured(0.00282, 0.003));
}

TEST(PrismMap, MapsInBothDirections) {
  const PrismMap map(support::patchAt(onCylinder, 9, 7, 4), {.embedDepth = 0.2, .rim = 0.3});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 2000; ++i) {
    const V3d uvw(1.2 * unit(random) - 0.1, 1.2 * unit(random) - 0.1, 1.4 * unit(random) - 0.15);
    const V3d x = map.toPatch(uvw);
    EXPECT_LE((map(x) - uvw).length(), support::doubleRounding(8));
  }
  EXPECT_TRUE(std::isnan(map.toPatch(V3d(0.5, 0.5, 1.4)).x));
  EXPECT_TRUE(std::isnan(map(V3d(0, 0, 0)).x));
  EXPECT_TRUE(std::isnan(map.jacobian(V3d(0, 0, 0))[0][0]));
}

TEST(PrismMap, FollowsTheCylinder) {
  // u, v and w are accurate to half a per cent of the height. The chords of 64 cells are off by
  // 3e-4.
  const PrismMap map(support::patchAt(onCylinder, 65, 33, 6), {.embedDepth = 0.1, .rim = 0.1});
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 500; ++i) {
    const V3d uvw(unit(random), unit(random), unit(random)), found = map(onCylinder(uvw));
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k], uvw[k], support::measured(4e-4));
  }
}

/// Compares all leaf blocks below a block with the map at single points. NaN is permitted only
/// where the map has NaN too.
/// @param bounds  bounds of the blocks that contain the position
void expectLeaves(const PrismMap& map, const GridBlock& block, const mapping::BlockMap& at,
                  std::vector<Imath::Box3d> bounds, std::size_t& tests, std::size_t& inside) {
  bounds.push_back(at.imageBounds());
  if (block.edge > GridBlock::kLeafEdge) {
    for (int bits = 0; bits < 8; ++bits)
      expectLeaves(map, block.octant(bits), *at.octant(bits), bounds, tests, inside);
    return;
  }
  std::array<V3d, 512> values;
  const std::size_t made = at.evaluate(values);
  std::size_t here = 0;
  for (std::size_t n = 0; n < 512; ++n) {
    const V3d x = block.origin + block.row(0) * static_cast<double>(n / 64) +
                  block.row(1) * static_cast<double>(n / 8 % 8) +
                  block.row(2) * static_cast<double>(n % 8);
    const V3d exact = map(x);
    ASSERT_EQ(std::isnan(values[n].x), std::isnan(exact.x));
    if (std::isnan(exact.x)) continue;
    ++here;
    ASSERT_LE((values[n] - exact).length(), support::doubleRounding(2.5));
    for (const Imath::Box3d& box : bounds) ASSERT_TRUE(box.intersects(values[n]));
  }
  if (here == 512) tests += made, inside += here;
  EXPECT_TRUE(here == 512 || !at.isTotal());
}

TEST(PrismMap, FindsBlocksInsideIt) {
  const PrismMap map(support::patchAt(onCylinder, 40, 40, 9), {.embedDepth = 0.2, .rim = 0.1});
  GridBlock block{V3d(-0.1, 1.4, 2.4), Imath::M33d(), 16};
  for (int i = 0; i < 3; ++i) block.rows[i][i] = 0.01;
  EXPECT_TRUE(map.restrictTo(block, 0)->isTotal());
  block.origin.z = 1.7;
  EXPECT_FALSE(map.restrictTo(block, 0)->isTotal());
}

TEST(PrismMap, BlocksAgreeWithPoints) {
  for (const std::size_t columns : {4u, 40u}) {
    const PrismMap map(support::patchAt(onCylinder, columns, columns, 5),
                       {.embedDepth = 0.2, .rim = 0.1});
    GridBlock block{V3d(-1.9, -0.2, 0.7), Imath::M33d(), 64};
    for (int i = 0; i < 3; ++i) block.rows[i][i] = 0.06;
    block.rows[0][1] = 0.01;
    std::size_t tests = 0, inside = 0;
    expectLeaves(map, block, *map.restrictTo(block, 0), {}, tests, inside);
    EXPECT_GT(inside, 10000u);
    // The published 2.8 tests per point are for boxes. Walking from cell to cell needs fewer.
    EXPECT_LE(static_cast<double>(tests) / static_cast<double>(inside),
              support::measured(2.46, 2.8))
        << columns;
  }
}

TEST(PrismMap, PrefersInnerCellsToOuterOnesThatOverlapThem) {
  // A ring with a gap of 0.5 rad. The outer cells of each end reach into the other end.
  const auto onOpenRing = [](const V3d& uvw) {
    const double angle = (2 * M_PI - 0.5) * (uvw.x - 0.5), r = 2 + uvw.z;
    return V3d(r * std::sin(angle), 3 * uvw.y, r * std::cos(angle));
  };
  const PrismMap map(support::patchAt(onOpenRing, 41, 4, 3), {.embedDepth = 0.1, .rim = 2});
  const Lattice& lattice = map.lattice();
  const auto isInOuterCell = [&](const V3d& x) {
    bool found = false;
    forEachTetrahedron(lattice, [&](const Tetrahedron& t) {
      if (found || !lattice.isOutermost(t.cell)) return;
      const std::array<double, 4> shares = mapping::barycentric(lattice.corners(t), x);
      found = std::all_of(shares.begin(), shares.end(), [](double share) { return share > 0; });
    });
    return found;
  };
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> share(0.01, 0.99);
  Imath::M33d rows;
  for (int i = 0; i < 3; ++i) rows[i][i] = 0.02;
  int overlapped = 0;
  double off = 0;
  for (int n = 0; n < 2000; ++n) {
    const V3d uvw(share(random), share(random), share(random)), x = map.toPatch(uvw);
    if (n < 200 && isInOuterCell(x)) ++overlapped;
    // The walk of the block begins at any of its corners, so x is the first point or the last.
    std::array<V3d, 512> block;
    const bool isFirst = n % 2 == 0;
    const V3d origin = isFirst ? x : x - V3d(7 * 0.02);
    (void)map.restrictTo({origin, rows, GridBlock::kLeafEdge}, 0)->evaluate(block);
    off = std::max({off, (map(x) - uvw).length(), (block[isFirst ? 0 : 511] - uvw).length()});
  }
  EXPECT_GE(overlapped, 10);
  EXPECT_LE(off, support::doubleRounding(8));
}

TEST(PrismMap, ReportsEveryFoldedTetrahedron) {
  const Patch sound = support::patchAt(onCylinder, 9, 9, 4);
  const Distortion distortion =
      mapping::surveyDistortion(PrismMap(sound, {.embedDepth = 0.1, .rim = 0.1}).samples(), V3d(1));
  EXPECT_EQ(distortion.folded, 0u);
  EXPECT_EQ(distortion.samples, 6u * 8 * 8 * 4);
  EXPECT_GT(distortion.jacobian.least, 0.5);
  EXPECT_NEAR(distortion.stretch.most, 2.1 * 3, support::measured(0.0167));  // along u at the top

  Patch turned = sound;
  std::swap(turned.layers[2].positions[40], turned.layers[2].positions[42]);
  const Distortion folds = mapping::surveyDistortion(
      PrismMap(turned, {.embedDepth = 0.1, .rim = 0.1}).samples(), V3d(1));
  EXPECT_GT(folds.folded, 3u);
  EXPECT_LT(folds.folded, 100u);
  EXPECT_LT(folds.jacobian.least, 0);
  EXPECT_LE((folds.foldUvw - V3d(4.0 / 8, 4.0 / 8, 2.0 / 3)).length(), support::measured(0.208));

  // An intentionally mirrored patch is no fold.
  const Patch mirrored = support::patchAt(
      [](const V3d& t) {
        return onCylinder({1 - t.x, t.y, t.z});
      },
      9, 9, 4);
  const PrismMap map(mirrored, {.embedDepth = 0.1, .rim = 0.1});
  EXPECT_EQ(mapping::surveyDistortion(map.samples(), V3d(1), true).folded, 0u);
  EXPECT_GT(mapping::surveyDistortion(map.samples(), V3d(1)).folded, 0u);
}

}  // namespace prism_map_test
