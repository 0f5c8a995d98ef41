// Ray casting of segmented fields by the compute shader: equal bits as on the processor, and
// limits.

#include "render/gpu/gpu_interfaces.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "render/gpu/device/gl_context.h"
#include "tests/support/segmented_scenes.h"

namespace gpu_interfaces_test {

using Imath::V3d;
using namespace render;

const GlContext& context() {
  static const GlContext one;
  return one;
}

/// A GpuInterfaces that frees its objects at the end.
struct Device {
  GpuInterfaces interfaces;
  explicit Device(std::size_t largestTable = context().largestTable())
      : interfaces(context(), largestTable) {}
  ~Device() {
    context().run([&] { interfaces.release(); });
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
};

bool haveSameBits(const V3d& a, const V3d& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

TEST(GpuInterfaces, HasTheBitsOfTheProcessor) {
  Device device;
  for (const support::SegmentedScene& scene : support::segmentedScenes()) {
    const InterfaceCaster caster(scene.field, scene.hidden);
    std::vector<InterfaceRay> rays;
    for (const Camera& camera : support::segmentedViews(24, 18)) {
      const std::vector<InterfaceRay> more = support::raysOf(camera);
      rays.insert(rays.end(), more.begin(), more.end());
    }
    // Rays behind the first crossings, which know their regions.
    const std::size_t count = rays.size();
    for (std::size_t n = 0; n < count; ++n) {
      const InterfaceHit hit = caster.firstHit(rays[n]);
      if (hit.found) rays.push_back(InterfaceCaster::behind(rays[n], hit));
    }
    const std::vector<InterfaceHit> hits = device.interfaces.firstHits(caster, rays, true),
                                    shadows = device.interfaces.firstHits(caster, rays, false);
    ASSERT_EQ(hits.size(), rays.size());
    std::size_t found = 0, unlike = 0;
    for (std::size_t n = 0; n < rays.size(); ++n) {
      const InterfaceHit expected = caster.firstHit(rays[n]);
      found += expected.found;
      unlike += hits[n].found != expected.found || shadows[n].found != expected.found;
      if (!expected.found) continue;
      unlike += std::memcmp(&hits[n].distance, &expected.distance, sizeof(double)) != 0 ||
                hits[n].front != expected.front || hits[n].behind != expected.behind ||
                !haveSameBits(hits[n].normal, expected.normal) ||
                !haveSameBits(hits[n].facetNormal, expected.facetNormal);
    }
    EXPECT_GT(found, 400u) << scene.name;
    EXPECT_EQ(unlike, 0u) << scene.name;
  }
}

TEST(GpuInterfaces, RefusesFieldsThatDoNotFit) {
  Device device(1000);
  const InterfaceCaster caster(support::nestedBalls(1, 0.5, 0.1));
  const std::vector<InterfaceRay> rays = support::raysOf(support::segmentedViews(8, 6)[0]);
  try {
    (void)device.interfaces.firstHits(caster, rays, true);
    ADD_FAILURE() << "no refusal";
  } catch (const levelset::ResourceLimit& error) {
    EXPECT_NE(std::string(error.what()).find("draw with --renderer cpu"), std::string::npos);
  }
}

}  // namespace gpu_interfaces_test
