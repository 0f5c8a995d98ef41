// Direct volume rendering by the compute shader: equal bits as on the processor, and limits.

#include "render/gpu/gpu_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/volumes/synthetic.h"
#include "render/gpu/device/gl_context.h"
#include "tests/support/volume_scenes.h"

namespace gpu_light_test {

using Imath::C3f;
using Imath::M44d;
using Imath::V3d;
using Imath::V3i;
using levelset::Volume;
using levelset::VolumeType;
using support::sampled;
using namespace render;

const GlContext& context() {
  static const GlContext one;
  return one;
}

/// A GpuLight that frees its objects at the end.
struct Device {
  GpuLight light;
  explicit Device(std::size_t largestTable = context().largestTable())
      : light(context(), largestTable) {}
  ~Device() {
    context().run([&] { light.release(); });
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
};

/// Parts of rays towards random points of a volume: some along its axes, some through its grid
/// points, some that start or end inside, some that miss it.
std::vector<VolumeSegment> segmentsThrough(const Volume& volume, std::size_t count) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  const M44d& map = volume.grid().indexToWorld;
  const V3d last = V3d(volume.size() - V3i(1));
  const double length = volume.grid().bounds().size().length();
  std::vector<VolumeSegment> segments;
  for (std::size_t n = 0; n < count; ++n) {
    V3d target(unit(random), unit(random), unit(random));
    if (n % 11 == 3) target *= 1.7;
    target = target * last;
    V3d away(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
    for (int axis = 0; n % 4 == 1 && axis < 3; ++axis) target[axis] = std::round(target[axis]);
    if (n % 8 == 1) away = V3d(0, n % 16 == 1 ? 1 : 0, n % 16 == 1 ? 0 : -1);
    if (n % 8 == 2) away.x = 0;
    V3d direction;
    map.multDirMatrix(away, direction);
    direction.normalize();
    const double distance = n % 5 == 0 ? 0 : length;
    const double far = n % 7 == 0 ? distance + 0.1 * unit(random) * length : HUGE_VAL;
    segments.push_back({target * map - direction * distance, direction, 0, far});
  }
  return segments;
}

struct Bits {
  std::uint64_t of[4];
  bool operator==(const Bits&) const = default;
};

Bits bitsOf(const VolumeLight& light) {
  const double numbers[4] = {light.colour.x, light.colour.y, light.colour.z, light.transmittance};
  Bits bits{};
  std::memcpy(bits.of, numbers, sizeof bits.of);
  return bits;
}

/// Integrates on both processors, with and without shading, and counts the lit and the ended rays.
void expectEqualBits(const std::string& what, GpuLight& device, const DirectVolume& volume,
                     std::size_t count = 700) {
  const std::vector<VolumeSegment> segments = segmentsThrough(volume.volume(), count);
  VolumeShading shading;
  shading.toLight = V3d(1, 2, 3).normalized();
  for (const VolumeShading* with :
       {static_cast<const VolumeShading*>(nullptr), static_cast<const VolumeShading*>(&shading)}) {
    const std::vector<VolumeLight> found = device.light(volume, segments, with);
    ASSERT_EQ(found.size(), segments.size());
    std::size_t different = 0, lit = 0;
    for (std::size_t n = 0; n < segments.size(); ++n) {
      const auto& [origin, direction, near, far] = segments[n];
      const VolumeLight light = volume.light(origin, direction, near, far, with);
      different += !(bitsOf(light) == bitsOf(found[n]));
      lit += light.transmittance < 0.99;
    }
    EXPECT_EQ(different, 0u) << what << (with ? ", shaded" : "");
    EXPECT_GT(lit, count / 8) << what;
  }
}

/// A transfer function with colours, a gap and peaks over a range of values.
std::vector<TransferPoint> busy(double low, double high) {
  const auto at = [&](double share) { return low + share * (high - low); };
  return {{at(0.1), 0, C3f(1, 0.2f, 0.1f)},       {at(0.25), 0.2, C3f(0.9f, 0.4f, 0.1f)},
          {at(0.4), 0, C3f(0.2f, 0.5f, 0.9f)},    {at(0.5), 0, C3f(0.2f, 0.5f, 0.9f)},
          {at(0.65), 0.1, C3f(0.3f, 0.9f, 0.4f)}, {at(0.8), 0.02, C3f(1)}};
}

double wave(const V3d& p) {
  return 0.8 * std::sin(2.3 * p.x + 0.4) * std::cos(1.7 * p.y) + 0.3 * std::sin(3 * p.z);
}

TEST(GpuLight, HasTheBitsOfTheProcessor) {
  Device device;
  const V3d far(1e6, -2e6, 5e5);
  M44d farMap = support::obliqueMap();
  for (int axis = 0; axis < 3; ++axis) farMap[3][axis] += far[axis];
  const std::vector<std::pair<std::string, Volume>> volumes = {
      {"sheared waves", sampled({V3i(30), support::obliqueMap()}, wave)},
      {"waves far away", sampled({V3i(30), farMap}, [&](const V3d& p) { return wave(p - far); })},
      {"three spacings", sampled({V3i(70, 9, 2), M44d().setScale(V3d(0.1, 0.4, 1))}, wave)},
      {"signal of Marschner and Lobb", levelset::marschnerLobb(41)},
      {"noise", support::noisyBytes(24)},
      // Squares of gradients are one, up to rounding.
      {"ramp", sampled({V3i(30), M44d()}, [](const V3d& p) { return 0.6 * p.x + 0.8 * p.y; })}};
  for (const auto& [what, volume] : volumes)
    expectEqualBits(what, device.light,
                    {VolumeSurface(volume, 0), busy(volume.lowest(), volume.highest())});
}

TEST(GpuLight, HasTheBitsOfTheProcessorForAllTypesOfNumbers) {
  Device device;
  const auto stored = [](auto number, VolumeType type, double slope) {
    using Number = decltype(number);
    // An odd number of points, so that the last word of the texture is not full.
    const V3i size(19, 17, 21);
    const auto numbers = std::make_shared<std::vector<Number>>();
    const double middle = std::is_unsigned_v<Number> ? 100 : 0;
    for (int k = 0; k < size.z; ++k)
      for (int j = 0; j < size.y; ++j)
        for (int i = 0; i < size.x; ++i)
          numbers->push_back(static_cast<Number>(middle + 90 * wave(V3d(i, j, k) * 0.15)));
    return Volume({size, M44d().setScale(V3d(0.5))}, type, {slope, 3.25},
                  {numbers, reinterpret_cast<const char*>(numbers->data())});
  };
  const std::vector<std::pair<std::string, Volume>> volumes = {
      {"u8", stored(std::uint8_t(), VolumeType::U8, 0.5)},
      {"i8, falling", stored(std::int8_t(), VolumeType::I8, -0.1)},
      {"u16", stored(std::uint16_t(), VolumeType::U16, 1e-3)},
      {"i16", stored(std::int16_t(), VolumeType::I16, 7)},
      {"f32", stored(float(), VolumeType::F32, 1)}};
  for (const auto& [what, volume] : volumes)
    expectEqualBits(what, device.light,
                    {VolumeSurface(volume, 0), busy(volume.lowest(), volume.highest())});
  std::vector<float> tiny;
  for (int n = 0; n < 9 * 9 * 9; ++n)
    tiny.push_back(static_cast<float>((n * 37 % 101 - 50) * 1e-41));
  const Volume small({V3i(9), M44d()}, std::move(tiny));
  expectEqualBits("floats below the least normal number", device.light,
                  {VolumeSurface(small, 0), busy(-4e-40, 4e-40)});
}

TEST(GpuLight, HasTheBitsOfTheProcessorWhereRaysNeedManySteps) {
  Device device;
  // Peaks that are far thinner than the values of a cell: up to 4096 pieces in each of 25 cells.
  const Volume steep = sampled({V3i(16), M44d()}, [](const V3d& p) {
    return 500 * std::sin(1.1 * p.x) * std::cos(1.7 * p.y + 0.3 * p.z);
  });
  std::vector<TransferPoint> peaks;
  for (int n = 0; n < 60; ++n) {
    const double at = 10.0 * (n - 30);
    const float tone = static_cast<float>(n % 7) / 7;
    peaks.push_back({at - 0.01, 0, C3f(tone, 1 - tone, 0.5f)});
    peaks.push_back({at, 0.9, C3f(1, tone, 0.2f)});
    peaks.push_back({at + 0.01, 0, C3f(0.3f)});
  }
  expectEqualBits("thin peaks", device.light, {VolumeSurface(steep, 0), peaks}, 64);
  // Depths far above those of a piece.
  expectEqualBits("opaque", device.light,
                  {VolumeSurface(steep, 0), {{-2, 0}, {0, 1 - 1e-15, C3f(0.3f, 0.2f, 1)}}}, 200);
}

TEST(GpuLight, FollowsChangesOfTheTransferFunction) {
  Device device;
  const VolumeSurface surface(levelset::sphereVolume(20, 0.6), 0);
  const std::vector<VolumeSegment> segments = {{V3d(3, 0.1, 0.2), V3d(-1, 0, 0), 0, HUGE_VAL},
                                               {V3d(3, 5, 0.2), V3d(-1, 0, 0), 0, HUGE_VAL}};
  const DirectVolume thin(surface, {{0, 0.1}}), dense(surface, {{0, 0.3}}),
      nothing(surface, {{0, 0}});
  const double thinLight = device.light.light(thin, segments, nullptr)[0].transmittance,
               denseLight = device.light.light(dense, segments, nullptr)[0].transmittance;
  EXPECT_LT(denseLight, thinLight);
  EXPECT_EQ(device.light.light(nothing, segments, nullptr)[0].transmittance, 1);
  const std::vector<VolumeLight> again = device.light.light(thin, segments, nullptr);
  EXPECT_EQ(again[0].transmittance, thinLight);
  EXPECT_EQ(again[1].transmittance, 1);
  EXPECT_TRUE(device.light.light(thin, {}, nullptr).empty());
}

TEST(GpuLight, RefusesWhatTheShaderDoesNotSupport) {
  const VolumeSurface surface(levelset::sphereVolume(20, 0.6), 0);
  const std::vector<VolumeSegment> segments = {{V3d(3, 0.1, 0.2), V3d(-1, 0, 0), 0, HUGE_VAL}};
  Device device;
  std::vector<TransferPoint> points;
  for (std::size_t n = 0; n <= GpuLight::kMostPoints; ++n)
    points.push_back({static_cast<double>(n), 0.1});
  EXPECT_THROW((void)device.light.light({surface, points}, segments, nullptr),
               levelset::ResourceLimit);
  points.pop_back();
  EXPECT_NO_THROW((void)device.light.light({surface, points}, segments, nullptr));
  Device narrow(10000);
  EXPECT_THROW((void)narrow.light.light({surface, {{0, 0.1}}}, segments, nullptr),
               levelset::ResourceLimit);
}

}  // namespace gpu_light_test
