// Distances from meshes by the compute shader: those of the processor.

#include "render/gpu/gpu_prisms.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/vdb.h"
#include "tests/support/sigg_meshes.h"

namespace gpu_prisms_test {

using Imath::V3i;
using levelset::TriMesh;
using render::BlockDistances;

/// Units in the last place between two floats of the same sign.
std::int64_t unitsBetween(float a, float b) {
  return std::abs(std::int64_t{std::bit_cast<std::int32_t>(std::abs(a))} -
                  std::int64_t{std::bit_cast<std::int32_t>(std::abs(b))});
}

void expectSameAsProcessor(const TriMesh& mesh, double halfWidth, const char* name) {
  const render::GlContext context;
  const BlockDistances gpu = render::prismDistances(context, mesh, 1, halfWidth);
  const levelset::NarrowBand band = meshToBand(mesh, 1,
                                               {.halfWidth = halfWidth,
                                                .sign = levelset::SignMode::Closed,
                                                .method = levelset::DistanceMethod::Prisms})
                                        .band;
  auto accessor = levelset::vdb(band).getConstAccessor();
  std::size_t active = 0, wrongSigns = 0;
  std::int64_t worst = 0;
  for (std::size_t n = 0; n < gpu.distances.size(); ++n) {
    const auto k = static_cast<int>(n % BlockDistances::kPoints);
    const V3i p = gpu.origins[n / BlockDistances::kPoints] + V3i(k >> 6, k >> 3 & 7, k & 7);
    const openvdb::Coord at(p.x, p.y, p.z);
    if (!accessor.isValueOn(at)) continue;
    ++active;
    const float value = accessor.getValue(at);
    if (value == 0) {
      EXPECT_LT(std::abs(gpu.distances[n]), 1e-6f) << at;
      continue;
    }
    wrongSigns += (gpu.distances[n] < 0) != (value < 0);
    worst = std::max(worst, unitsBetween(gpu.distances[n], value));
  }
  EXPECT_EQ(active, band.activeVoxelCount()) << name;
  EXPECT_EQ(wrongSigns, 0u) << name;
  EXPECT_LE(worst, 2) << name;
}

TriMesh scaled(TriMesh mesh, double factor) {
  for (Imath::V3d& p : mesh.positions) p = p * factor + Imath::V3d(0.31, 0.17, -0.23);
  return mesh;
}

TEST(GpuPrisms, HaveTheDistancesAndSignsOfTheProcessor) {
  expectSameAsProcessor(scaled(support::torusMesh(1, 0.4, 40, 20), 14), 3, "torus");
  expectSameAsProcessor(scaled(support::trefoilTube(0.4, 60, 8), 5), 4, "knot");
  expectSameAsProcessor(scaled(support::seaShell(61, 15), 12), 3, "seashell");
  expectSameAsProcessor(scaled(support::subdividedSphere(3), 8), 6, "sphere");
  // Faces, edges and corners on grid points.
  expectSameAsProcessor(support::boxMesh(Imath::V3d(-6, -5, -4), Imath::V3d(5, 6, 7)), 3.5, "box");
}

TEST(GpuPrisms, RefuseMeshesWithoutAnInside) {
  const render::GlContext context;
  TriMesh open = support::boxMesh(Imath::V3d(-4), Imath::V3d(4));
  open.triangles.pop_back();
  EXPECT_THROW((void)render::prismDistances(context, open, 1, 3), levelset::InvalidInput);
  TriMesh turned = support::boxMesh(Imath::V3d(-4), Imath::V3d(4));
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  EXPECT_THROW((void)render::prismDistances(context, turned, 1, 3), levelset::InvalidInput);
  EXPECT_THROW((void)render::prismDistances(
                   context, support::boxMesh(Imath::V3d(-4), Imath::V3d(4)), 1, 0.5),
               levelset::UsageError);
}

}  // namespace gpu_prisms_test
