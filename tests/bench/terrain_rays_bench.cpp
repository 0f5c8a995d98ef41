// Ray casting of a rough ground beside Embree's triangles of the same ground, in one run: CPU time
// of the build, memory, and rays a second of CPU time on one thread, for rays of a picture and for
// occlusion rays of its hits. Usage: terrain_rays_bench SAMPLES …; a negative number leaves out
// Embree. A number is that of the samples along each side.
#include <embree3/rtcore.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "render/terrain/rays/terrain_caster.h"
#include "tests/support/terrain_rays.h"

namespace {

using Imath::V3d;
using levelset::HeightField;
using render::Camera;
using render::TerrainCaster;
using render::TerrainHit;

double cpuSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The triangles of a ground in Embree.
struct Peer {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  std::size_t bytes = 0;

  explicit Peer(const HeightField& field) {
    rtcSetDeviceMemoryMonitorFunction(
        device,
        [](void* data, ssize_t more, bool) {
          auto& sum = static_cast<Peer*>(data)->bytes;
          sum = static_cast<std::size_t>(static_cast<ssize_t>(sum) + more);
          return true;
        },
        this);
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* corner = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, field.heights.size()));
    for (int row = 0; row < field.rows; ++row)
      for (int column = 0; column < field.columns; ++column) {
        const V3d p = field.point(column, row);
        for (int c = 0; c < 3; ++c) *corner++ = static_cast<float>(p[c]);
      }
    const auto cells =
        static_cast<std::size_t>(field.columns - 1) * static_cast<std::size_t>(field.rows - 1);
    auto* index = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, 2 * cells));
    for (int row = 0; row + 1 < field.rows; ++row)
      for (int column = 0; column + 1 < field.columns; ++column) {
        const auto at = [&](int right, int up) {
          return static_cast<std::uint32_t>(field.index(column + right, row + up));
        };
        for (const std::uint32_t number :
             {at(0, 0), at(1, 0), at(1, 1), at(0, 0), at(1, 1), at(0, 1)})
          *index++ = number;
      }
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
  }
  ~Peer() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  [[nodiscard]] static RTCRay rayOf(const Camera::Ray& ray) {
    RTCRay r{};
    r.org_x = static_cast<float>(ray.origin.x);
    r.org_y = static_cast<float>(ray.origin.y);
    r.org_z = static_cast<float>(ray.origin.z);
    r.dir_x = static_cast<float>(ray.direction.x);
    r.dir_y = static_cast<float>(ray.direction.y);
    r.dir_z = static_cast<float>(ray.direction.z);
    r.tfar = static_cast<float>(std::min(ray.far, 1e30));
    r.mask = ~0U;
    return r;
  }
  [[nodiscard]] double firstHit(const Camera::Ray& ray) const {
    RTCRayHit found{};
    found.ray = rayOf(ray);
    found.hit.geomID = found.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &found);
    return found.hit.geomID == RTC_INVALID_GEOMETRY_ID ? HUGE_VAL
                                                       : static_cast<double>(found.ray.tfar);
  }
  [[nodiscard]] bool isOccluded(const Camera::Ray& ray) const {
    RTCRay asked = rayOf(ray);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, &asked);
    return asked.tfar < 0;
  }
};

/// Least CPU time of three repetitions, seconds.
template <typename Job>
double secondsOf(const Job& job) {
  double least = HUGE_VAL;
  for (int n = 0; n < 3; ++n) {
    const double start = cpuSeconds();
    job();
    least = std::min(least, cpuSeconds() - start);
  }
  return least;
}

void report(const char* name, double build, double bytes, double samples, double first,
            double occlusion, std::size_t rays, std::size_t shadows) {
  fmt::print(
      "  {:<10} build {:7.2f} CPU s, {:7.1f} bytes a sample, {:6.2f} M rays/s of the picture, "
      "{:6.2f} M occlusion rays/s\n",
      name, build, bytes / samples, 1e-6 * static_cast<double>(rays) / first,
      1e-6 * static_cast<double>(shadows) / occlusion);
}

void compare(int size, bool hasPeer) {
  const auto field = terrain_rays::shared(terrain_rays::roughGround(size, size, 1));
  const double samples = static_cast<double>(field->heights.size());
  fmt::print("{}x{} samples\n", size, size);
  double start = cpuSeconds();
  const TerrainCaster caster(field);
  const double build = cpuSeconds() - start;
  // An oblique view that shows the whole ground.
  Camera camera = terrain_rays::cameraAt(caster.bounds(), V3d(1, -1.3, 0.6), 2, 512);
  std::vector<Camera::Ray> rays;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) rays.push_back(camera.ray(x + 0.5, y + 0.5));
  std::vector<TerrainHit> hits;
  const double first = secondsOf([&] { hits = caster.firstHits(rays); });
  // Rays from the hits to the sky.
  terrain_rays::Numbers numbers(1);
  std::vector<Camera::Ray> shadows;
  for (std::size_t n = 0; n < rays.size(); ++n) {
    if (!hits[n].found) continue;
    V3d direction = hits[n].normal + numbers.unit() * 0.999;
    const V3d at = rays[n].origin + rays[n].direction * hits[n].distance;
    shadows.push_back({at + hits[n].normal * 0.05, direction.normalized(), 0,
                       0.25 * caster.bounds().size().length()});
  }
  std::size_t blocked = 0;
  const double occlusion = secondsOf([&] {
    blocked = 0;
    for (const Camera::Ray& ray : shadows) blocked += caster.isOccluded(ray);
  });
  report("Levelsmith", build, static_cast<double>(caster.bytes()), samples, first, occlusion,
         rays.size(), shadows.size());
  std::fflush(stdout);
  if (!hasPeer) return;
  start = cpuSeconds();
  const Peer peer(*field);
  const double peerBuild = cpuSeconds() - start;
  std::size_t unlike = 0, peerBlocked = 0;
  const double peerFirst = secondsOf([&] {
    unlike = 0;
    for (std::size_t n = 0; n < rays.size(); ++n)
      unlike += std::isfinite(peer.firstHit(rays[n])) != hits[n].found;
  });
  const double peerOcclusion = secondsOf([&] {
    peerBlocked = 0;
    for (const Camera::Ray& ray : shadows) peerBlocked += peer.isOccluded(ray);
  });
  report("Embree", peerBuild, static_cast<double>(peer.bytes), samples, peerFirst, peerOcclusion,
         rays.size(), shadows.size());
  fmt::print("  {} of {} rays hit by one only; occlusion rays blocked: {} and {} of {}\n", unlike,
             rays.size(), blocked, peerBlocked, shadows.size());
}

}  // namespace

int main(int argc, char** argv) {
  for (int n = 1; n < argc; ++n) {
    const int size = std::atoi(argv[n]);
    if (std::abs(size) < 2) {
      fmt::print(stderr, "usage: terrain_rays_bench SAMPLES …\n");
      return 2;
    }
    compare(std::abs(size), size > 0);
  }
}
