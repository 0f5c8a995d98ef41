// Shared subdivision trees beside other ways to draw the same surfaces: Embree with triangles that
// lie within a tenth of a pixel, and Bézier clipping [Nishita90] with and without pre-subdivision.
// And a large set of rational volumes. CPU time of the process, in one run.
// Usage: bezier_peers_bench [SIZE [embree | clipping | blade]]
#include <embree3/rtcore.h>
#include <fmt/core.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "tests/bench/bezier_clipping.h"
#include "tests/bench/bezier_workloads.h"

namespace {

using namespace bezier_workloads;
using render::BezierPatch;

// === Surfaces

/// Bicubic patches of a closed tube about a curve, as a periodic uniform B-spline.
void addTube(BezierVolume& volume, const std::vector<V3d>& axis, const std::vector<double>& radius,
             int around) {
  const auto count = static_cast<int>(axis.size());
  const auto control = [&](int i, int j) {
    const auto n = static_cast<std::size_t>(std::clamp(i, 0, count - 1));
    const V3d along =
        (axis[std::min(n + 1, axis.size() - 1)] - axis[n > 0 ? n - 1 : 0]).normalized();
    const V3d side =
        along.cross(std::abs(along.x) < 0.8 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized();
    const double angle = 2 * std::numbers::pi * j / around;
    const double bump = 1 + 0.08 * std::sin(3 * angle + static_cast<double>(i));
    return axis[n] +
           (side * std::cos(angle) + along.cross(side) * std::sin(angle)) * (radius[n] * bump);
  };
  // Bézier points of a span from four control points, along one axis.
  const auto bezier = [](const std::array<V3d, 4>& p) -> std::array<V3d, 4> {
    return {(p[0] + p[1] * 4.0 + p[2]) / 6.0, (p[1] * 2.0 + p[2]) / 3.0, (p[1] + p[2] * 2.0) / 3.0,
            (p[1] + p[2] * 4.0 + p[3]) / 6.0};
  };
  for (int i = -1; i < count; ++i)
    for (int j = 0; j < around; ++j) {
      std::array<std::array<V3d, 4>, 4> rows;
      for (int a = 0; a < 4; ++a) {
        std::array<V3d, 4> line;
        for (int b = 0; b < 4; ++b)
          line[static_cast<std::size_t>(b)] = control(i + a - 1, j + b - 1);
        rows[static_cast<std::size_t>(a)] = bezier(line);
      }
      std::vector<V3d> points(16);
      for (std::size_t b = 0; b < 4; ++b) {
        const std::array<V3d, 4> column = bezier({rows[0][b], rows[1][b], rows[2][b], rows[3][b]});
        for (std::size_t a = 0; a < 4; ++a) points[4 * a + b] = column[a];
      }
      volume.patches.push_back(render::surfacePatch(3, 3, points));
    }
}

/// A figure of tubes, with about as many bicubic patches as the published monster, 1494.
BezierVolume figure() {
  BezierVolume volume;
  const auto limb = [&](const V3d& from, const V3d& to, const V3d& sag, double first, double last,
                        int count, int around) {
    std::vector<V3d> axis;
    std::vector<double> radius;
    for (int n = 0; n < count; ++n) {
      const double t = n / (count - 1.0);
      axis.push_back(from + (to - from) * t + sag * (4 * t * (1 - t)));
      const double end = std::min(1.0, 6 * std::min(t, 1 - t) + 0.05);
      radius.push_back((first + (last - first) * t) * std::sqrt(end));
    }
    addTube(volume, axis, radius, around);
  };
  limb({0, 0, -1}, {0, 0, 1}, {0, 0.1, 0}, 0.55, 0.7, 19, 20);
  limb({0, 0, 1}, {0, -0.2, 1.9}, {0, 0.05, 0}, 0.35, 0.45, 11, 18);
  for (const double side : {-1.0, 1.0}) {
    limb({0.5 * side, 0, 0.8}, {1.5 * side, -0.6, 0.2}, {0.2 * side, 0, 0.2}, 0.25, 0.14, 15, 14);
    limb({0.3 * side, 0, -0.8}, {0.6 * side, 0.1, -2.4}, {0.1 * side, -0.2, 0}, 0.32, 0.16, 15, 14);
  }
  return volume;
}

/// A twisted blade of rational patches of degree 2. The attribute is the magnitude of a velocity.
/// @param count  patches along the span, the chord and the thickness
BezierVolume blade(const std::array<int, 3>& count) {
  BezierVolume volume;
  const auto position = [](double s, double c, double t) {
    const double angle = 1.1 * s, chord = 1 - 0.6 * s;
    const double x = chord * (c - 0.4), y = (t - 0.5) * (0.1 + 0.5 * c * (1 - c)) * chord;
    return V3d(x * std::cos(angle) - y * std::sin(angle), x * std::sin(angle) + y * std::cos(angle),
               5 * s);
  };
  const auto speed = [](double s, double c, double t) {
    const double layer = 1.2 - (2 * t - 1) * (2 * t - 1);  // slower at both faces
    const V3d v(layer * (1 + 0.3 * std::sin(3 * c) * (0.5 + s)), 0.3 * std::cos(7 * s) * (t - 0.5),
                0.2 * std::sin(9 * s + 4 * c));
    return v.length();
  };
  for (int i = 0; i < count[0]; ++i)
    for (int j = 0; j < count[1]; ++j)
      for (int k = 0; k < count[2]; ++k) {
        BezierPatch patch;
        patch.degree = {2, 2, 2};
        patch.attributes.resize(1);
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < 3; ++b)
            for (int c = 0; c < 3; ++c) {
              const double s = (2 * i + a) / (2.0 * count[0]), x = (2 * j + b) / (2.0 * count[1]),
                           t = (2 * k + c) / (2.0 * count[2]);
              patch.points.push_back(position(s, x, t));
              patch.attributes[0].push_back(speed(s, x, t));
              patch.weights.push_back(1 + 0.05 * (a == 1) + 0.03 * (b == 1) + 0.02 * (c == 1));
            }
        volume.patches.push_back(std::move(patch));
      }
  return volume;
}

// === Triangles

struct Triangles {
  std::vector<float> positions;  ///< relative to `origin`
  std::vector<std::uint32_t> corners;
  V3d origin{0};

  std::uint32_t add(const V3d& p) {
    for (int c = 0; c < 3; ++c) positions.push_back(static_cast<float>(p[c] - origin[c]));
    return static_cast<std::uint32_t>(positions.size() / 3 - 1);
  }
};

/// Width of a pixel at a depth, world units.
double pixelAt(const Camera& camera, double depth) {
  return render::BezierView(camera).step.x * depth;
}

/// Largest second difference of the control points of a surface along one axis, times the degrees:
/// a bound of the second derivative.
double bendOf(const BezierPatch& patch, int axis) {
  const int u = patch.degree[0], v = patch.degree[1], degree = axis == 0 ? u : v;
  double most = 0;
  for (int i = 0; i <= u - (axis == 0 ? 2 : 0); ++i)
    for (int j = 0; j <= v - (axis == 1 ? 2 : 0); ++j) {
      const auto at = [&](int n) {
        return patch.points[patch.index(axis == 0 ? i + n : i, axis == 1 ? j + n : j, 0)];
      };
      most = std::max(most, (at(0) - at(1) * 2.0 + at(2)).length());
    }
  return degree * (degree - 1) * most;
}

double mixedBendOf(const BezierPatch& patch) {
  double most = 0;
  for (int i = 0; i < patch.degree[0]; ++i)
    for (int j = 0; j < patch.degree[1]; ++j) {
      const auto at = [&](int a, int b) { return patch.points[patch.index(i + a, j + b, 0)]; };
      most = std::max(most, (at(1, 1) - at(1, 0) - at(0, 1) + at(0, 0)).length());
    }
  return patch.degree[0] * patch.degree[1] * most;
}

/// Triangles of parametric surfaces within `pixels` of a pixel. The distance of a triangle with
/// legs du and dv from its surface is at most (du² |S_uu| + 2 du dv |S_uv| + dv² |S_vv|) / 8.
Triangles tessellate(const BezierVolume& volume, const Camera& camera, double pixels) {
  Triangles result;
  result.origin = volume.bounds().center();
  for (const BezierPatch& patch : volume.patches) {
    double nearest = 1e300;
    for (const V3d& p : patch.points)
      nearest = std::min(nearest, (p - camera.from).dot(camera.axis()));
    const double tolerance = pixels * pixelAt(camera, nearest);
    const double bound = bendOf(patch, 0) + 2 * mixedBendOf(patch) + bendOf(patch, 1);
    const int n = std::max(1, static_cast<int>(std::ceil(std::sqrt(bound / (8 * tolerance)))));
    const auto first = static_cast<std::uint32_t>(result.positions.size() / 3);
    // One row of points after the other, by cuts of the control net.
    std::vector<std::array<double, 3>> net;
    for (std::size_t k = 0; k < patch.points.size(); k += 2)
      net.push_back({patch.points[k].x, patch.points[k].y, patch.points[k].z});
    for (int i = 0; i <= n; ++i) {
      std::vector<std::array<double, 3>> row = net;
      if (i > 0) bezier_clipping::cut(row, patch.degree[0], patch.degree[1], 0, 1.0 * i / n, 1.0);
      row.resize(static_cast<std::size_t>(patch.degree[1] + 1));
      for (int j = 0; j <= n; ++j) {
        std::vector<std::array<double, 3>> line = row;
        if (j > 0) bezier_clipping::cutLine(line.data(), patch.degree[1] + 1, 1, 1.0 * j / n, 1.0);
        result.add({line[0][0], line[0][1], line[0][2]});
      }
    }
    const auto side = static_cast<std::uint32_t>(n + 1);
    for (std::uint32_t i = 0; i + 1 < side; ++i)
      for (std::uint32_t j = 0; j + 1 < side; ++j) {
        const std::uint32_t a = first + i * side + j, b = a + 1, c = a + side, d = c + 1;
        for (const std::uint32_t corner : {a, c, b, b, c, d}) result.corners.push_back(corner);
      }
  }
  return result;
}

/// Triangles of the isosurface in volumes by marching tetrahedra in the parameters. The crossings
/// of the edges of a grid are those of the exact attribute, by the rule of false position.
/// @param cells  of each patch along its parameters
Triangles extract(const BezierVolume& volume, const std::array<int, 3>& cells, const V3d& origin) {
  constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
      {{0, 1, 3, 7}, {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 6, 7}}};
  Triangles result;
  result.origin = origin;
  const int sideV = cells[1] + 1, sideW = cells[2] + 1, nodes = (cells[0] + 1) * sideV * sideW;
  for (const BezierPatch& patch : volume.patches) {
    const auto parameter = [&](int node) {
      return V3d(node / (sideV * sideW), node / sideW % sideV, node % sideW) /
             V3d(cells[0], cells[1], cells[2]);
    };
    std::vector<double> values(static_cast<std::size_t>(nodes));
    for (int node = 0; node < nodes; ++node)
      values[static_cast<std::size_t>(node)] =
          attributeAt(patch, 0, parameter(node)) - volume.isovalue;
    std::map<std::pair<int, int>, std::uint32_t> crossings;
    const auto crossing = [&](int a, int b) {
      const auto [low, high] = std::minmax(a, b);
      const auto [entry, isNew] = crossings.try_emplace({low, high}, 0);
      if (!isNew) return entry->second;
      const V3d from = parameter(low), to = parameter(high);
      double left = 0, right = 1, atLeft = values[static_cast<std::size_t>(low)],
             atRight = values[static_cast<std::size_t>(high)], t = 0.5;
      for (int step = 0; step < 3; ++step) {
        t = (left * atRight - right * atLeft) / (atRight - atLeft);
        const double value = attributeAt(patch, 0, from + (to - from) * t) - volume.isovalue;
        ((value < 0) == (atLeft < 0) ? left : right) = t;
        ((value < 0) == (atLeft < 0) ? atLeft : atRight) = value;
      }
      entry->second = result.add(positionAt(patch, from + (to - from) * t));
      return entry->second;
    };
    for (int i = 0; i < cells[0]; ++i)
      for (int j = 0; j < cells[1]; ++j)
        for (int k = 0; k < cells[2]; ++k)
          for (const auto& tetrahedron : kTetrahedra) {
            std::vector<int> in, out;
            for (const int c : tetrahedron) {
              const int node = ((i + (c & 1)) * sideV + j + (c >> 1 & 1)) * sideW + k + (c >> 2);
              (values[static_cast<std::size_t>(node)] < 0 ? in : out).push_back(node);
            }
            if (in.empty() || out.empty()) continue;
            std::vector<std::uint32_t> ring;
            if (in.size() == 2)
              ring = {crossing(in[0], out[0]), crossing(in[0], out[1]), crossing(in[1], out[1]),
                      crossing(in[1], out[0])};
            else
              for (const int a : in)
                for (const int b : out) ring.push_back(crossing(a, b));
            for (std::size_t m = 1; m + 1 < ring.size(); ++m)
              for (const std::uint32_t corner : {ring[0], ring[m], ring[m + 1]})
                result.corners.push_back(corner);
          }
  }
  return result;
}

/// Memory that Embree holds, bytes.
std::atomic<long long> embreeBytes = 0;

/// Embree's tree of triangles, in single precision.
class EmbreeTriangles {
 public:
  explicit EmbreeTriangles(const Triangles& triangles) : origin_(triangles.origin) {
    device_ = rtcNewDevice(nullptr);
    rtcSetDeviceMemoryMonitorFunction(
        device_,
        [](void*, ssize_t bytes, bool) {
          embreeBytes += bytes;
          return true;
        },
        nullptr);
    scene_ = rtcNewScene(device_);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             12, triangles.positions.size() / 3);
    std::copy(triangles.positions.begin(), triangles.positions.end(),
              static_cast<float*>(vertices));
    void* corners = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            12, triangles.corners.size() / 3);
    std::copy(triangles.corners.begin(), triangles.corners.end(),
              static_cast<std::uint32_t*>(corners));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~EmbreeTriangles() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeTriangles(const EmbreeTriangles&) = delete;
  EmbreeTriangles& operator=(const EmbreeTriangles&) = delete;

  /// Depths of all pixels; infinite without a hit.
  [[nodiscard]] std::vector<double> depths(const Camera& camera) const {
    std::vector<double> result;
    const V3d axis = camera.axis();
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit hit{};
        const V3d from = ray.origin - origin_;
        hit.ray.org_x = static_cast<float>(from.x);
        hit.ray.org_y = static_cast<float>(from.y);
        hit.ray.org_z = static_cast<float>(from.z);
        hit.ray.dir_x = static_cast<float>(ray.direction.x);
        hit.ray.dir_y = static_cast<float>(ray.direction.y);
        hit.ray.dir_z = static_cast<float>(ray.direction.z);
        hit.ray.tfar = INFINITY;
        hit.ray.mask = 0xffffffffU;
        hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene_, &context, &hit);
        result.push_back(hit.hit.geomID == RTC_INVALID_GEOMETRY_ID
                             ? INFINITY
                             : static_cast<double>(hit.ray.tfar) * ray.direction.dot(axis));
      }
    return result;
  }

 private:
  V3d origin_;
  RTCDevice device_;
  RTCScene scene_;
};

/// Pixels that only one of two pictures hits, and the differences of depths, in pixel widths.
struct Difference {
  std::size_t oneOnly = 0;
  std::vector<double> offs;  ///< in ascending order

  Difference(const BezierPicture& picture, const std::vector<double>& depths,
             const Camera& camera) {
    for (std::size_t n = 0; n < depths.size(); ++n) {
      const render::BezierRoot* root = picture.nearest(n);
      if ((root != nullptr) != std::isfinite(depths[n])) {
        ++oneOnly;
        continue;
      }
      if (!root) continue;
      offs.push_back(std::abs(root->depth - depths[n]) / pixelAt(camera, root->depth));
    }
    std::sort(offs.begin(), offs.end());
  }
  [[nodiscard]] double quantile(double share) const {
    return offs[static_cast<std::size_t>(share * static_cast<double>(offs.size() - 1))];
  }
};

void embree(int size) {
  constexpr double kPixels = 0.1;
  fmt::print("\nEmbree with triangles within {} pixels, {}x{}\n", kPixels, size, size);
  fmt::print("{:<10} {:>9} {:>9} {:>10} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8} {:>10}\n", "data",
             "shared s", "nodes MB", "triangles", "make s", "build s", "trace s", "all s",
             "Embree MB", "one only", "depth 95 %");
  struct Case {
    const char* name;
    BezierVolume volume;
    double share;
    bool isSurface;
  };
  std::vector<Case> cases = {{"cylinder", bezier_scenes::bentCylinder(), 0.681, false},
                             {"figure", figure(), 0.4, true}};
  if (BezierVolume surfaces = teapot(); !surfaces.patches.empty())
    cases.push_back({"teapot", std::move(surfaces), 0.682, true});
  for (const Case& c : cases) {
    const Camera camera = fittedCamera(c.volume, size, size, c.share);
    const Timed shared = timed(c.volume, camera, kShared);
    const double begin = cpuSeconds();
    Triangles triangles;
    if (c.isSurface) {
      triangles = tessellate(c.volume, camera, kPixels);
    } else {
      // Half of the tolerance for the sagitta of the section of radius 0.8, whose spans are 0.4
      // wide, and half for that of the bend of radius 2.8, whose spans are 1.2 radians long.
      const double nearest = (c.volume.bounds().center() - camera.from).length() - 1.5,
                   tolerance = 0.5 * kPixels * pixelAt(camera, nearest);
      const auto cellsOf = [&](double span, double radius) {
        return static_cast<int>(std::ceil(span / std::sqrt(8 * radius * tolerance)));
      };
      const int across = cellsOf(0.4 * std::sqrt(2.0), 0.8), along = cellsOf(1.2 * 2.8, 2.8);
      triangles = extract(c.volume, {across, across, along}, c.volume.bounds().center());
    }
    const double made = cpuSeconds();
    embreeBytes = 0;
    const EmbreeTriangles tree(triangles);
    const double built = cpuSeconds();
    const std::vector<double> depths = tree.depths(camera);
    const double traced = cpuSeconds();
    const Difference off(shared.picture, depths, camera);
    fmt::print(
        "{:<10} {:>9.3f} {:>9.2f} {:>10} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f} {:>9.1f} {:>8} "
        "{:>7.3f} px\n",
        c.name, shared.seconds, static_cast<double>(shared.picture.counts.peakBytes) / 1e6,
        triangles.corners.size() / 3, made - begin, built - made, traced - built, traced - begin,
        static_cast<double>(embreeBytes) / 1e6, off.oneOnly, off.quantile(0.95));
  }
}

void clipping(int size) {
  fmt::print("\nafter uniform splits, {}x{}\n", size, size);
  fmt::print("{:<10} {:>7} {:>9} {:>9} {:>9} {:>11} {:>13} {:>9} {:>12}\n", "data", "levels",
             "patches", "shared s", "basic s", "clipping s", "clip / shared", "one only",
             "largest off");
  struct Case {
    const char* name;
    BezierVolume volume;
    double share;
    int levels;
  };
  std::vector<Case> cases;
  if (BezierVolume surfaces = teapot(); !surfaces.patches.empty())
    cases.push_back({"teapot", std::move(surfaces), 0.682, 4});
  cases.push_back({"figure", figure(), 0.4, 2});
  for (const Case& c : cases) {
    const Camera camera = fittedCamera(c.volume, size, size, c.share);
    const Timed shared = timed(c.volume, camera, kShared);
    for (int levels = 0; levels <= c.levels; ++levels) {
      TreeOptions options = kBasic;
      options.uniformLevels = levels;
      const double basic = timed(c.volume, camera, options).seconds;
      const double begin = cpuSeconds();
      bezier_clipping::Clipping clip(c.volume, camera, levels);
      const std::vector<double> depths = clip.depths(camera);
      const double seconds = cpuSeconds() - begin;
      const Difference off(shared.picture, depths, camera);
      fmt::print("{:<10} {:>7} {:>9} {:>9.3f} {:>9.3f} {:>11.3f} {:>13.1f} {:>9} {:>9.1e} px\n",
                 c.name, levels, clip.size(), shared.seconds, basic, seconds,
                 seconds / shared.seconds, off.oneOnly, off.quantile(1));
    }
  }
}

double peakMegabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

void largeSet(int size) {
  fmt::print("\nblade of rational patches of degree 2, {}x{}\n", size, size);
  fmt::print("{:>9} {:>9} {:>9} {:>11} {:>9} {:>9} {:>9} {:>9}\n", "patches", "isovalue",
             "points MB", "4 floats MB", "peak MB", "cover %", "shared s", "nodes MB");
  for (const std::array<int, 3>& count : {std::array<int, 3>{50, 50, 5}, {200, 200, 20}}) {
    BezierVolume volume = blade(count);
    Camera camera = cameraOf(volume, size, size, 1);
    camera.from = camera.to + V3d(0.9, -1.6, 0.3);
    for (const double isovalue : {0.6, 0.9, 1.2}) {
      volume.isovalue = isovalue;
      const Timed run = timed(volume, camera, kShared);
      fmt::print("{:>9} {:>9} {:>9.0f} {:>11.0f} {:>9.0f} {:>9.1f} {:>9.2f} {:>9.1f}\n",
                 volume.patches.size(), isovalue, static_cast<double>(volume.bytes()) / 1e6,
                 16e-6 * 27 * static_cast<double>(volume.patches.size()), peakMegabytes(),
                 coverOf(run.picture), run.seconds,
                 static_cast<double>(run.picture.counts.peakBytes) / 1e6);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int size = argc > 1 ? std::atoi(argv[1]) : 512;
  const std::string only = argc > 2 ? argv[2] : "";
  if (only.empty() || only == "embree") embree(size);
  if (only.empty() || only == "clipping") clipping(size);
  if (only.empty() || only == "blade") largeSet(size);
}
