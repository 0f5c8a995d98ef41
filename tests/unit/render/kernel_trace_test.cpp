// Compares the kernel's first crossings with the judge, which shares no code with it, and across
// instruction sets.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"
#include "render/bricks/brick_pool.h"
#include "render/cpu/cpu_trace.h"
#include "render/embree/embree_renderer.h"
#include "render/kernel/ray_block.h"
#include "tests/support/measured.h"

namespace kernel_trace_test {

using Imath::V3d;
using levelset::NarrowBand;
using render::BrickPool;
using render::HitBlock;
using render::RayBlock;

/// Ray in index space. t is measured from its entry into the bricks' box.
struct IndexRay {
  V3d origin, direction;
};

/// Distance of a ray to its entry into the box of the crossing cells.
struct Way {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
};

Way wayThrough(const BrickPool& pool, const IndexRay& ray) {
  Way way;
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    const double low = pool.origin[i] + pool.low[i], high = pool.origin[i] + pool.high[i];
    if (ray.direction[a] == 0) {
      if (ray.origin[a] < low || ray.origin[a] > high) way.leave = -1;
      continue;
    }
    const double t0 = (low - ray.origin[a]) / ray.direction[a],
                 t1 = (high - ray.origin[a]) / ray.direction[a];
    way.enter = std::max(way.enter, std::min(t0, t1));
    way.leave = std::min(way.leave, std::max(t0, t1));
  }
  return way;
}

/// Distances to the first crossing; infinite if there is none.
std::vector<double> traced(const BrickPool& pool, const std::vector<IndexRay>& rays,
                           render::InstructionSet set, HitBlock* raw = nullptr) {
  RayBlock block(rays.size());
  std::vector<double> base(rays.size());
  for (std::size_t n = 0; n < rays.size(); ++n) {
    const Way way = wayThrough(pool, rays[n]);
    base[n] = way.enter;
    const V3d origin = rays[n].origin + rays[n].direction * way.enter -
                       V3d(pool.origin[0], pool.origin[1], pool.origin[2]);
    const auto direction = [&](int a) {
      const double d = rays[n].direction[a];
      return static_cast<float>(std::abs(d) < 1e-20 ? 0 : d);
    };
    block.ox[n] = static_cast<float>(origin.x);
    block.oy[n] = static_cast<float>(origin.y);
    block.oz[n] = static_cast<float>(origin.z);
    block.dx[n] = direction(0);
    block.dy[n] = direction(1);
    block.dz[n] = direction(2);
    block.ix[n] = render::rayInverse(block.dx[n]);
    block.iy[n] = render::rayInverse(block.dy[n]);
    block.iz[n] = render::rayInverse(block.dz[n]);
    block.start[n] = 0;
    block.end[n] = static_cast<float>(way.leave - way.enter);
  }
  HitBlock hits(block.size);
  render::traceRays(pool, block, hits, set);
  if (raw) *raw = hits;
  std::vector<double> result;
  for (std::size_t n = 0; n < rays.size(); ++n)
    result.push_back(hits.found[n] ? base[n] + static_cast<double>(hits.t[n])
                                   : std::numeric_limits<double>::infinity());
  return result;
}

/// Rays from all around towards the region within `reach` of the origin.
std::vector<IndexRay> views(double reach, std::size_t count) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> even(-1, 1);
  std::vector<IndexRay> rays;
  while (rays.size() < count) {
    const V3d from = V3d(normal(random), normal(random), normal(random)).normalized() * (3 * reach);
    const V3d to = V3d(even(random), even(random), even(random)) * reach;
    rays.push_back({from, (to - from).normalized()});
  }
  return rays;
}

/// Rays through grid points, edges and corners, along the axes and diagonals.
std::vector<IndexRay> latticeRays(int reach) {
  std::vector<IndexRay> rays;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const V3d way(x, y, z);
        if (way == V3d(0)) continue;
        for (int i = -reach; i <= reach; ++i)
          for (int j = -reach; j <= reach; ++j) {
            const V3d at = x ? V3d(0, i, j) : y ? V3d(i, 0, j) : V3d(i, j, 0);
            rays.push_back({at - way * (2.0 * reach), way.normalized()});
          }
      }
  return rays;
}

struct Disagreement {
  std::size_t hits = 0, missed = 0;
  double worst = 0;
};

/// Difference from the judge on the same interpolant, whose distances are exact.
Disagreement disagreementOf(const NarrowBand& solid, const std::vector<IndexRay>& rays) {
  const BrickPool pool = render::makeBricks(solid);
  const std::vector<double> ours = traced(pool, rays, render::instructionSets().back());
  render::Scene scene;
  scene.solids.push_back({.band = solid});
  const render::EmbreeScene judge(scene);
  Disagreement result;
  for (std::size_t n = 0; n < rays.size(); ++n) {
    const render::Hit hit = judge.intersect(rays[n].origin, rays[n].direction);
    result.hits += hit.found;
    if (hit.found != std::isfinite(ours[n]))
      ++result.missed;
    else if (hit.found)
      result.worst = std::max(result.worst, std::abs(ours[n] - hit.distance));
  }
  return result;
}

NarrowBand ball(double radius) {
  return levelset::makeSphere(radius, V3d(0.3, 0.2, 0.1), 1);
}

TEST(KernelTrace, AgreesWithTheJudgeFromAllAround) {
  const auto rays = views(40, 20000);
  const Disagreement off = disagreementOf(ball(40), rays);
  EXPECT_GT(off.hits, 5000u);
  EXPECT_LE(off.missed, 1u);  // a grazing ray
  EXPECT_LE(off.worst, support::measured(7.67e-5));
  // Two linked tori with a crease.
  const NarrowBand rings =
      levelset::unite(levelset::makeTorus(24, 8, V3d(0), V3d(0, 0, 1), 1),
                      levelset::makeTorus(24, 8, V3d(9, 0, 3), V3d(0, 1, 0), 1));
  const Disagreement creased = disagreementOf(rings, rays);
  EXPECT_GT(creased.hits, 5000u);
  EXPECT_LE(creased.missed, 1u);
  EXPECT_LE(creased.worst, support::measured(1.95e-4));
}

TEST(KernelTrace, LosesNoRayOfTheLattice) {
  const Disagreement near = disagreementOf(ball(20), latticeRays(18));
  EXPECT_GT(near.hits, 20000u);
  EXPECT_EQ(near.missed, 0u);
  EXPECT_LE(near.worst, support::measured(2.83e-6));
  // Three times as large, and as far from the table's corner.
  const auto rays = latticeRays(70);
  EXPECT_GT(rays.size(), 500000u);
  const Disagreement off = disagreementOf(ball(60), rays);
  EXPECT_GT(off.hits, 300000u);
  EXPECT_EQ(off.missed, 0u);
  EXPECT_LE(off.worst, support::measured(8.62e-6));
}

TEST(KernelTrace, FindsASheetThinnerThanAVoxel) {
  // 0.6 voxels thick: some rays have both sides within one cell.
  const NarrowBand sheet = levelset::makeBox(V3d(60, 60, 0.6), V3d(0.1, 0.2, 0.1), 1);
  const auto rays = views(20, 5000);
  const Disagreement off = disagreementOf(sheet, rays);
  EXPECT_GT(off.hits, 2000u);
  EXPECT_LE(off.missed, 2u);
}

TEST(KernelTrace, LeavesASolidThatItStartsIn) {
  std::vector<IndexRay> rays = views(40, 2000);
  for (IndexRay& ray : rays) ray.origin = V3d(0.3, 0.2, 0.1) + ray.direction * 7;
  const Disagreement off = disagreementOf(ball(30), rays);
  EXPECT_EQ(off.hits, rays.size());
  EXPECT_EQ(off.missed, 0u);
  EXPECT_LE(off.worst, support::measured(4.03e-6));
}

TEST(KernelTrace, HasTheSameBitsOnEveryInstructionSet) {
  const BrickPool pool = render::makeBricks(ball(40));
  const auto rays = views(45, 4096);
  HitBlock first(0);
  (void)traced(pool, rays, render::InstructionSet::Sse2, &first);
  for (const render::InstructionSet set : render::instructionSets()) {
    HitBlock hits(0);
    (void)traced(pool, rays, set, &hits);
    EXPECT_EQ(hits.found, first.found);
    EXPECT_EQ(std::memcmp(hits.t.data(), first.t.data(), 4 * hits.t.size()), 0);
    EXPECT_EQ(hits.x, first.x);
    EXPECT_EQ(hits.y, first.y);
    EXPECT_EQ(hits.z, first.z);
  }
}

TEST(BrickPool, HoldsTheBlocksThatTheSurfaceCrosses) {
  const NarrowBand solid = ball(40);
  const BrickPool pool = render::makeBricks(solid);
  // Leaves that the surface does not cross are stored only as neighbours of crossed leaves, never
  // as bricks of their own.
  const std::size_t leaves = levelset::vdb(solid).tree().leafCount();
  EXPECT_GT(leaves, pool.brickCount() + 100);
  EXPECT_EQ(pool.brickCount() + pool.haloCount + pool.blocksOmitted, leaves);
  std::size_t crossing = 0, set = 0, full = 0;
  for (const std::uint32_t word : pool.mask)
    set += static_cast<std::size_t>(__builtin_popcount(word));
  for (std::size_t i = 0; i < pool.entry.size(); ++i)
    full += i / BrickPool::kBlocksOfPage % 3 == 0 && pool.entry[i] >= 0;
  EXPECT_EQ(full, pool.brickCount());
  for (std::size_t b = 0; b < pool.brickCount(); ++b)
    for (int cell = 0; cell < 512; ++cell) {
      int inside = 0;
      for (int i = 0; i < 8; ++i) {
        const int x = (cell >> 6) + (i >> 2), y = (cell >> 3 & 7) + (i >> 1 & 1),
                  z = (cell & 7) + (i & 1);
        inside +=
            pool.value[b * BrickPool::kValues + static_cast<std::size_t>((x * 9 + y) * 9 + z)] < 0;
      }
      crossing += inside > 0 && inside < 8;
    }
  EXPECT_EQ(crossing, set);
  EXPECT_EQ(render::makeBricks(NarrowBand()).brickCount(), 0u);
}

TEST(BrickPool, HoldsTheSamplesOfCurvature) {
  // A wall of three voxels across a block's face, so that windows extend over its complete band.
  for (const NarrowBand& solid : {ball(40), levelset::makeBox(V3d(60, 50, 3), V3d(0, 0, 7), 1)}) {
    const BrickPool pool = render::makeBricks(solid);
    const auto& tree = levelset::vdb(solid).tree();
    EXPECT_GT(pool.haloCount, 0u);
    const auto valueAt = [&](int x, int y, int z) {
      const std::size_t page = static_cast<std::size_t>(
          ((x >> 6) * pool.pages[1] + (y >> 6)) * pool.pages[2] + (z >> 6));
      const auto slot = static_cast<std::size_t>(
          pool.page.at(page) + ((x >> 3 & 7) << 6 | (y >> 3 & 7) << 3 | (z >> 3 & 7)));
      const int first = pool.entry.at(slot + BrickPool::kFirstOfEntry),
                strides = pool.entry.at(slot + BrickPool::kStridesOfEntry);
      return pool.value.at(static_cast<std::size_t>(
          first + (x & 7) * (strides >> BrickPool::kStrideShift) +
          (y & 7) * (strides & ((1 << BrickPool::kStrideShift) - 1)) + (z & 7)));
    };
    std::size_t wrong = 0, cells = 0;
    for (int x = pool.low[0]; x < pool.high[0]; ++x)
      for (int y = pool.low[1]; y < pool.high[1]; ++y)
        for (int z = pool.low[2]; z < pool.high[2]; ++z) {
          const auto at = [&](int i, int j, int k) {
            return tree.getValue(openvdb::Coord(pool.origin[0] + x + i, pool.origin[1] + y + j,
                                                pool.origin[2] + z + k));
          };
          int inside = 0;
          for (int i = 0; i < 8; ++i) inside += at(i >> 2, i >> 1 & 1, i & 1) < 0;
          if (inside == 0 || inside == 8) continue;
          ++cells;
          for (int i = -2; i <= 3; ++i)
            for (int j = -2; j <= 3; ++j)
              for (int k = -2; k <= 3; ++k) {
                const auto isOuter = [](int n) { return n == -2 || n == 3; };
                // No stencil uses this sample.
                if (isOuter(i) + isOuter(j) + isOuter(k) > 1) continue;
                wrong += valueAt(x + i, y + j, z + k) != at(i, j, k);
              }
        }
    EXPECT_GT(cells, 2000u);
    EXPECT_EQ(wrong, 0u);
  }
}

}  // namespace kernel_trace_test
