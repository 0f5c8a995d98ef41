// Ray casting of spheres and cylinders beside Embree's own primitives, in one run: time of the
// build, rays a second of CPU time on one thread, memory. Then scenes of the published sizes
// [Sigg06]. Usage: quadrics_bench [COUNT …]; without counts 10^4, 10^5 and 10^6, then the published
// scenes.
#include <embree3/rtcore.h>
#include <fmt/core.h>
#include <sys/resource.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "render/quadrics/quadric_caster.h"
#include "tests/support/quadric_scenes.h"

namespace {

using Imath::V3d;
using render::Ball;
using render::Camera;
using render::QuadricCaster;
using render::QuadricModel;
using render::Stick;

double cpuSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double wallSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::size_t residentBytes() {
  long pages = 0, resident = 0;
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (file) {
    if (std::fscanf(file, "%ld %ld", &pages, &resident) != 2) resident = 0;
    std::fclose(file);
  }
  return static_cast<std::size_t>(resident) * 4096;
}

/// Spheres, or cylinders, in Embree.
struct Peer {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  std::size_t bytes = 0;

  Peer() {
    rtcSetDeviceMemoryMonitorFunction(
        device,
        [](void* data, ssize_t bytes_, bool) {
          auto& sum = static_cast<Peer*>(data)->bytes;
          sum = static_cast<std::size_t>(static_cast<ssize_t>(sum) + bytes_);
          return true;
        },
        this);
  }
  ~Peer() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  void add(RTCGeometry geometry) {
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  void add(const std::vector<Ball>& balls) {
    if (balls.empty()) return;
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    auto* to = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 4 * sizeof(float), balls.size()));
    for (const Ball& ball : balls) {
      for (int c = 0; c < 3; ++c) *to++ = static_cast<float>(ball.centre[c]);
      *to++ = ball.radius;
    }
    add(geometry);
  }
  void add(const std::vector<Stick>& sticks) {
    if (sticks.empty()) return;
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_CONE_LINEAR_CURVE);
    auto* to = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                           RTC_FORMAT_FLOAT4, 4 * sizeof(float),
                                                           2 * sticks.size()));
    auto* index = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, sizeof(unsigned), sticks.size()));
    for (std::size_t n = 0; n < sticks.size(); ++n) {
      for (const V3d& end : {sticks[n].a, sticks[n].b}) {
        for (int c = 0; c < 3; ++c) *to++ = static_cast<float>(end[c]);
        *to++ = sticks[n].radius;
      }
      index[n] = static_cast<unsigned>(2 * n);
    }
    add(geometry);
  }
  void build() { rtcCommitScene(scene); }
};

/// Rays of a picture in squares of four by four pixels.
std::vector<Camera::Ray> raysOf(const Camera& camera) {
  std::vector<Camera::Ray> rays;
  for (int top = 0; top < camera.height; top += 4)
    for (int left = 0; left < camera.width; left += 4)
      for (int y = top; y < top + 4; ++y)
        for (int x = left; x < left + 4; ++x) rays.push_back(camera.ray(x + 0.5, y + 0.5));
  return rays;
}

Camera cameraAt(double distance, int width, int height) {
  Camera camera;
  camera.from = V3d(0.5, 0.35, 0.8).normalized() * distance;
  camera.width = width;
  camera.height = height;
  return camera;
}

RTCRayHit embreeRay(const Camera::Ray& ray) {
  RTCRayHit r{};
  r.ray.org_x = static_cast<float>(ray.origin.x);
  r.ray.org_y = static_cast<float>(ray.origin.y);
  r.ray.org_z = static_cast<float>(ray.origin.z);
  r.ray.dir_x = static_cast<float>(ray.direction.x);
  r.ray.dir_y = static_cast<float>(ray.direction.y);
  r.ray.dir_z = static_cast<float>(ray.direction.z);
  r.ray.tfar = static_cast<float>(std::min(ray.far, 1e30));
  r.ray.mask = ~0U;
  r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return r;
}

struct Casting {
  double seconds = 1e300;  // least CPU time of the repetitions
  std::size_t hits = 0;
};

template <typename Cast>
Casting bestOf(int repetitions, const Cast& cast) {
  Casting result;
  for (int n = 0; n < repetitions; ++n) {
    const double start = cpuSeconds();
    result.hits = cast();
    result.seconds = std::min(result.seconds, cpuSeconds() - start);
  }
  return result;
}

template <int width>
std::size_t castPackets(RTCScene scene, std::span<const Camera::Ray> rays) {
  using Packet = std::conditional_t<width == 8, RTCRayHit8, RTCRayHit16>;
  std::size_t hits = 0;
  alignas(64) int valid[width];
  std::fill(valid, valid + width, -1);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  for (std::size_t first = 0; first + width <= rays.size(); first += width) {
    alignas(64) Packet packet;
    for (int n = 0; n < width; ++n) {
      const RTCRayHit one = embreeRay(rays[first + static_cast<std::size_t>(n)]);
      packet.ray.org_x[n] = one.ray.org_x;
      packet.ray.org_y[n] = one.ray.org_y;
      packet.ray.org_z[n] = one.ray.org_z;
      packet.ray.tnear[n] = 0;
      packet.ray.dir_x[n] = one.ray.dir_x;
      packet.ray.dir_y[n] = one.ray.dir_y;
      packet.ray.dir_z[n] = one.ray.dir_z;
      packet.ray.time[n] = 0;
      packet.ray.tfar[n] = one.ray.tfar;
      packet.ray.mask[n] = ~0U;
      packet.ray.flags[n] = 0;
      packet.hit.geomID[n] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][n] = RTC_INVALID_GEOMETRY_ID;
    }
    if constexpr (width == 8)
      rtcIntersect8(valid, scene, &context, &packet);
    else
      rtcIntersect16(valid, scene, &context, &packet);
    for (int n = 0; n < width; ++n) hits += packet.hit.geomID[n] != RTC_INVALID_GEOMETRY_ID;
  }
  return hits;
}

std::size_t castSingle(RTCScene scene, std::span<const Camera::Ray> rays, bool occlusion) {
  std::size_t hits = 0;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (const Camera::Ray& ray : rays) {
    RTCRayHit one = embreeRay(ray);
    if (occlusion) {
      rtcOccluded1(scene, &context, &one.ray);
      hits += one.ray.tfar < 0;
    } else {
      rtcIntersect1(scene, &context, &one);
      hits += one.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
  }
  return hits;
}

std::size_t castOwn(const QuadricCaster& caster, std::span<const Camera::Ray> rays,
                    bool occlusion) {
  std::size_t hits = 0;
  for (const Camera::Ray& ray : rays)
    hits += occlusion ? caster.isOccluded(ray) : caster.firstHit(ray).found;
  return hits;
}

/// First hits in blocks of rays, as of a picture.
std::size_t castBlocks(const QuadricCaster& caster, std::span<const Camera::Ray> rays) {
  constexpr std::size_t kBlock = 1024;
  std::size_t hits = 0;
  for (std::size_t first = 0; first < rays.size(); first += kBlock)
    for (const render::QuadricHit& hit :
         caster.firstHits(rays.subspan(first, std::min(kBlock, rays.size() - first))))
      hits += hit.found;
  return hits;
}

/// Casts parts of the rays on all threads.
template <typename Cast>
std::size_t onAllThreads(std::span<const Camera::Ray> rays, const Cast& cast) {
  constexpr std::size_t kPart = 1u << 14;
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, rays.size() / kPart + 1), std::size_t{0},
      [&](const auto& parts, std::size_t hits) {
        for (std::size_t n = parts.begin(); n < parts.end(); ++n)
          hits += cast(rays.subspan(n * kPart, std::min(kPart, rays.size() - n * kPart)));
        return hits;
      },
      std::plus<>());
}

/// Rays from the hits of a picture into random directions, as for the light of the sky.
std::vector<Camera::Ray> skyRays(const QuadricCaster& caster,
                                 const std::vector<Camera::Ray>& views) {
  quadric_scenes::Numbers numbers(9);
  std::vector<Camera::Ray> rays;
  for (const Camera::Ray& view : views) {
    const render::QuadricHit hit = caster.firstHit(view);
    if (!hit.found) continue;
    V3d d = numbers.unit();
    if (d.dot(hit.normal) < 0) d = -d;
    rays.push_back({view.origin + view.direction * hit.distance + hit.normal * 1e-5, d, 0, 4});
  }
  return rays;
}

void report(const std::string& name, std::size_t count, std::size_t rays, const Casting& own,
            const Casting& peer) {
  const double million = 1e-6 * static_cast<double>(rays);
  fmt::print("  {:<28} {:>9} {:>9.2f} {:>9.2f} {:>6.2f}   {} and {} hits\n", name, count,
             million / own.seconds, million / peer.seconds, peer.seconds / own.seconds, own.hits,
             peer.hits);
}

void compare(const char* name, const QuadricModel& model) {
  const std::size_t before = residentBytes();
  double wall = wallSeconds(), cpu = cpuSeconds();
  const QuadricCaster caster(model);
  const double ownWall = wallSeconds() - wall, ownCpu = cpuSeconds() - cpu;
  const std::size_t own = residentBytes() - before;
  Peer peer;
  peer.add(model.balls);
  peer.add(model.sticks);
  wall = wallSeconds(), cpu = cpuSeconds();
  peer.build();
  const double peerWall = wallSeconds() - wall, peerCpu = cpuSeconds() - cpu;
  const std::size_t count = model.size();
  fmt::print(
      "{} {}: build {:.3f} s (CPU {:.3f} s), Embree {:.3f} s (CPU {:.3f} s); {:.1f} bytes each "
      "({:.0f} MB "
      "resident), Embree {:.1f}\n",
      count, name, ownWall, ownCpu, peerWall, peerCpu,
      static_cast<double>(caster.bytes()) / static_cast<double>(count),
      static_cast<double>(own) * 1e-6,
      static_cast<double>(peer.bytes) / static_cast<double>(count));
  const std::vector<Camera::Ray> views = raysOf(cameraAt(4.2, 1024, 768)),
                                 near = raysOf(cameraAt(0.4, 1024, 768));
  const std::vector<Camera::Ray> sky = skyRays(caster, views);
  constexpr int kRepetitions = 3;
  const RTCScene scene = peer.scene;
  const auto firstHits = [&](const std::string& what, const std::vector<Camera::Ray>& rays,
                             bool isParallel) {
    const auto time = [&](const auto& cast) {
      return bestOf(kRepetitions,
                    [&] { return isParallel ? onAllThreads(rays, cast) : cast(rays); });
    };
    using Rays = std::span<const Camera::Ray>;
    const Casting mine = time([&](Rays part) { return castOwn(caster, part, false); }),
                  blocks = time([&](Rays part) { return castBlocks(caster, part); }),
                  single = time([&](Rays part) { return castSingle(scene, part, false); }),
                  eight = time([&](Rays part) { return castPackets<8>(scene, part); }),
                  sixteen = time([&](Rays part) { return castPackets<16>(scene, part); });
    report(what + ", single rays", count, rays.size(), mine, single);
    const Casting& packets = eight.seconds < sixteen.seconds ? eight : sixteen;
    report(what + ", best", count, rays.size(), blocks.seconds < mine.seconds ? blocks : mine,
           packets.seconds < single.seconds ? packets : single);
  };
  firstHits("whole", views, false);
  firstHits("within", near, false);
  firstHits("whole, all threads", views, true);
  report("light of the sky", count, sky.size(),
         bestOf(kRepetitions, [&] { return castOwn(caster, sky, true); }),
         bestOf(kRepetitions, [&] { return castSingle(scene, sky, true); }));
}

void compareAt(std::size_t count) {
  quadric_scenes::Numbers numbers(31);
  compare("spheres", {quadric_scenes::ballsInCube(count, numbers), {}, {}});
  compare("cylinders", {{}, quadric_scenes::sticksInCube(count, numbers), {}});
}

/// A picture with the rays to a light, on all threads: the sizes of [Sigg06, table 7.3].
void published(const char* name, std::size_t balls, std::size_t sticks) {
  quadric_scenes::Numbers numbers(32);
  compare(name, {quadric_scenes::ballsInCube(balls, numbers),
                 sticks > 0 ? quadric_scenes::sticksInCube(sticks, numbers) : std::vector<Stick>(),
                 {}});
}

}  // namespace

int main(int argc, char** argv) {
  fmt::print(
      "million rays a second of CPU time on one thread; the peer is the fastest of Embree's "
      "single rays and packets\n"
      "  {:<28} {:>9} {:>9} {:>9} {:>6}\n",
      "rays", "count", "own", "Embree", "ratio");
  if (argc > 1) {
    for (int n = 1; n < argc; ++n) compareAt(std::strtoull(argv[n], nullptr, 10));
    return 0;
  }
  for (const std::size_t count : {10'000U, 100'000U, 1'000'000U}) compareAt(count);
  published("99k spheres and 198k cylinders", 99'000, 198'000);
  published("52k spheres", 52'000, 0);
  published("15k spheres", 15'000, 0);
  published("1712 spheres", 1712, 0);
  return 0;
}
