// Ray casting of segmented fields beside the published slices [Yamazaki03]: times, artefacts, and a
// picture of both.
//
//   segmented_view_bench [PICTURE.png]
//
// Prints lines of CSV, of CPU seconds of one thread. With a name it only draws a picture: slices
// with nearest fetch, slices with linear fetch, and exact rays.

#include <fmt/core.h>
#include <sys/resource.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/csg/csg.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_tracer.h"
#include "render/images/image.h"
#include "render/kernel/kernel_scene.h"
#include "render/segmented/interface_caster.h"
#include "render/segmented/segmented_part.h"
#include "render/segmented/slab_renderer.h"

namespace {

using namespace levelset;
using namespace render;
using Imath::V3d;
using Imath::V3i;

double cpuSeconds() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

/// Least CPU time of three runs.
double secondsOf(const std::function<void()>& work) {
  double least = 1e300;
  for (int run = 0; run < 3; ++run) {
    const double start = cpuSeconds();
    work();
    least = std::min(least, cpuSeconds() - start);
  }
  return least;
}

/// Samples of a field on n³ points of its own grid around the origin. One thread, one sampler.
PackedDistances packedOf(const SegmentedField& field, int n) {
  const double voxel = field.voxelSize();
  const SegmentedSampler sampler(field);
  return packDistances(V3i(n), V3d(-(n / 2) * voxel), voxel, field.halfWidth(), [&](const V3d& p) {
    return RegionSample{sampler.label(p), sampler.distance(p)};
  });
}

Camera viewOf(int pixels) {
  return {.from = {2.6, 1.7, 3.1}, .orthoHeight = 2.4, .width = pixels, .height = pixels};
}

std::vector<InterfaceRay> raysOf(const Camera& camera) {
  std::vector<InterfaceRay> rays;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
      rays.push_back({ray.origin, ray.direction, ray.near, ray.far});
    }
  return rays;
}

SegmentedField fieldOf(const std::vector<NarrowBand>& solids, std::vector<RegionLabel> labels) {
  return segmentSolids(solids, {.labels = std::move(labels)}).field;
}

/// Ball of region 3 in a shell of region 1, with a ball of region 2 that reaches out of both.
std::vector<NarrowBand> shells(int n) {
  const double voxel = 2.3 / n;
  return {makeSphere(1, V3d(0), voxel), makeSphere(0.7, V3d(0.1, 0.1, 0.2), voxel),
          makeSphere(0.4, V3d(0.45, 0.35, 0.6), voxel)};
}

SegmentedField shellScene(int n) {
  return fieldOf(shells(n), {1, 2, 3});
}

/// Seconds of the first hits of one isosurface, the outer surface of the shells.
double isosurfaceSeconds(int n, const Camera& camera) {
  const std::vector<NarrowBand> solids = shells(n);
  Scene scene;
  scene.camera = camera;
  scene.solids.push_back({.band = unite(unite(solids[0], solids[1]), solids[2])});
  const KernelScene surface(scene);
  constexpr int kRows = 16;
  return secondsOf([&] {
    for (int top = 0; top < camera.height; top += kRows) {
      PixelBlock pixels(static_cast<std::size_t>(kRows * camera.width));
      for (std::size_t k = 0; k < pixels.size(); ++k) {
        pixels.x[k] =
            static_cast<float>(static_cast<int>(k) % camera.width + 0.5 - 0.5 * camera.width);
        pixels.y[k] = static_cast<float>(top + static_cast<int>(k) / camera.width + 0.5 -
                                         0.5 * camera.height);
      }
      (void)surface.castPixels(CpuTracer(), pixels);
    }
  });
}

/// Region 3 and region 1 without region 2 between them and the void.
SegmentedField filmScene(int n) {
  const double voxel = 2.3 / n;
  return fieldOf({makeSphere(1, V3d(0), voxel), makeSphere(0.5, V3d(0.45, 0.3, 0.5), voxel)},
                 {2, 3});
}

void printTable() {
  constexpr int kPixels = 256;
  const Camera camera = viewOf(kPixels);
  fmt::print(
      "grid,slices,slabs_ms,slabs_us_per_slice,exact_ms,exact_million_rays_per_s,isosurface_ms\n");
  for (const int n : {128, 256}) {
    const SegmentedField field = shellScene(n);
    const PackedDistances packed = packedOf(field, n);
    const InterfaceCaster caster(field);
    const std::vector<InterfaceRay> rays = raysOf(camera);
    std::size_t hits = 0;
    const double exact = secondsOf([&] {
      for (const InterfaceRay& ray : rays) hits += caster.firstHit(ray).found;
    });
    const double isosurface = isosurfaceSeconds(n, camera);
    for (const int slices : {32, 64, 128, 256}) {
      const double slabs =
          secondsOf([&] { (void)renderSlabs(packed, camera, {.slices = slices}); });
      fmt::print("{},{},{:.1f},{:.1f},{:.1f},{:.2f},{:.1f}\n", n, slices, 1e3 * slabs,
                 1e6 * slabs / slices, 1e3 * exact, 1e-6 * double(rays.size()) / exact,
                 1e3 * isosurface);
    }
    if (hits == 0) fmt::print("no ray hits\n");
  }
}

void printTriangles() {
  const Camera camera = viewOf(256);
  fmt::print("source_triangles,slabs_ms,exact_ms,field_seconds\n");
  for (const double edge : {0.12, 0.012}) {
    const TriMesh mesh = bandToMesh(makeSphere(1, V3d(0), edge));
    SegmentedField field;
    const double preparation =
        secondsOf([&] { field = fieldOf({meshToBand(mesh, 2.3 / 128).band}, {1}); });
    const PackedDistances packed = packedOf(field, 128);
    const InterfaceCaster caster(field);
    const std::vector<InterfaceRay> rays = raysOf(camera);
    const double slabs = secondsOf([&] { (void)renderSlabs(packed, camera, {.slices = 128}); });
    const double exact = secondsOf([&] {
      for (const InterfaceRay& ray : rays) (void)caster.firstHit(ray);
    });
    fmt::print("{},{:.1f},{:.1f},{:.2f}\n", mesh.triangles.size(), 1e3 * slabs, 1e3 * exact,
               preparation);
  }
}

void printArtefacts() {
  struct Way {
    const char* name;
    SlabOptions options;
  };
  constexpr int kPoints = 128;
  const double voxel = 2.3 / kPoints;
  const Camera camera = viewOf(256);
  fmt::print(
      "scene,fetch,width,hits,missed,extra,films,other_labels,depth_median_voxels,depth_99,depth_"
      "max\n");
  for (const bool isFilm : {true, false}) {
    const SegmentedField field = isFilm ? filmScene(kPoints) : shellScene(kPoints);
    const PackedDistances packed = packedOf(field, kPoints);
    const InterfaceCaster caster(field);
    const std::vector<InterfaceRay> rays = raysOf(camera);
    std::vector<InterfaceHit> exact;
    for (const InterfaceRay& ray : rays) exact.push_back(caster.firstHit(ray));
    // Slices at distances of about a voxel. Nearest samples are up to √3 voxels farther apart.
    const int slices = static_cast<int>(std::sqrt(3.0) * kPoints);
    const double far = 1 + std::sqrt(3.0);
    for (const Way& way :
         {Way{"nearest", {.slices = slices}}, Way{"nearest", {.slices = slices, .width = far}},
          Way{"linear", {.slices = slices, .fetch = SlabFetch::Linear}},
          Way{"linear", {.slices = slices, .fetch = SlabFetch::Linear, .width = far}},
          Way{"label-aware", {.slices = slices, .fetch = SlabFetch::LabelAware}}}) {
      const SlabPicture picture = renderSlabs(packed, camera, way.options);
      std::size_t hits = 0, missed = 0, extra = 0, films = 0, others = 0;
      std::vector<double> errors;
      for (std::size_t n = 0; n < rays.size(); ++n) {
        const bool isSeen = picture.front[n] >= 0;
        hits += exact[n].found;
        missed += exact[n].found && !isSeen;
        extra += !exact[n].found && isSeen;
        if (!exact[n].found || !isSeen) continue;
        const bool isOther =
            picture.behind[n] != exact[n].behind || picture.front[n] != exact[n].front;
        // A region that the field does not have.
        const bool isFalse = isFilm && (picture.behind[n] == 1 || picture.front[n] == 1);
        films += isFalse;
        others += isOther && !isFalse;
        errors.push_back(std::abs(picture.distance[n] - exact[n].distance) / voxel);
      }
      std::sort(errors.begin(), errors.end());
      const auto at = [&](double share) {
        return errors[static_cast<std::size_t>(share * double(errors.size() - 1))];
      };
      fmt::print("{},{},{:.2f},{},{},{},{},{},{:.3f},{:.3f},{:.3f}\n",
                 isFilm ? "without region 1" : "shells", way.name, way.options.width, hits, missed,
                 extra, films, others, at(0.5), at(0.99), at(1));
    }
  }
}

/// Lights a depth picture by its own slopes, in the colours of the regions behind.
void drawPanel(Image& image, int left, const Camera& camera, const std::vector<double>& depths,
               const std::vector<int>& regions) {
  const double pixel = camera.pixelSteps().right.length();
  const auto depthAt = [&](int x, int y) {
    return depths[static_cast<std::size_t>(y * camera.width + x)];
  };
  for (int y = 1; y + 1 < camera.height; ++y)
    for (int x = 1; x + 1 < camera.width; ++x) {
      const int region = regions[static_cast<std::size_t>(y * camera.width + x)];
      if (region <= 0) continue;
      const double dx = (depthAt(x + 1, y) - depthAt(x - 1, y)) / (2 * pixel),
                   dy = (depthAt(x, y + 1) - depthAt(x, y - 1)) / (2 * pixel);
      const V3d normal = std::isfinite(dx + dy) ? V3d(dx, dy, 1).normalized() : V3d(0, 0, 1);
      const double light =
          0.25 + 0.75 * std::max(0.0, normal.dot(V3d(-0.4, -0.5, 0.77).normalized()));
      const Imath::C3f colour =
          regionColour(static_cast<RegionLabel>(region)) * static_cast<float>(light);
      const auto n = static_cast<std::size_t>(y * image.width + left + x);
      image.channels["R"][n] = colour.x;
      image.channels["G"][n] = colour.y;
      image.channels["B"][n] = colour.z;
      image.channels["A"][n] = 1;
    }
}

void drawPicture(const std::string& file) {
  constexpr int kPixels = 300, kPoints = 64;
  const SegmentedField field = filmScene(kPoints);
  const PackedDistances packed = packedOf(field, kPoints);
  const Camera camera = viewOf(kPixels);
  Image image(3 * kPixels, kPixels);
  for (const char* name : {"R", "G", "B", "A"}) (void)image.addChannel(name);
  int left = 0;
  for (const SlabFetch fetch : {SlabFetch::Nearest, SlabFetch::Linear}) {
    const SlabPicture slabs =
        renderSlabs(packed, camera, {.slices = 110, .fetch = fetch, .width = 1 + std::sqrt(3.0)});
    drawPanel(image, left, camera, slabs.distance, {slabs.behind.begin(), slabs.behind.end()});
    left += kPixels;
  }
  const InterfaceCaster caster(field);
  std::vector<double> depths;
  std::vector<int> regions;
  for (const InterfaceRay& ray : raysOf(camera)) {
    const InterfaceHit hit = caster.firstHit(ray);
    depths.push_back(hit.found ? hit.distance : std::numeric_limits<double>::infinity());
    regions.push_back(hit.found ? hit.behind : 0);
  }
  drawPanel(image, left, camera, depths, regions);
  writeImage(file, image);
}

}  // namespace

int main(int argc, char** argv) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  if (argc > 1) {
    drawPicture(argv[1]);
    return 0;
  }
  printTable();
  printTriangles();
  printArtefacts();
}
