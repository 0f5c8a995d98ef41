// Compares searches of closest points and triangles: the tree with overlapping siblings
// (levelset/geometry/search), Embree's point queries, nanoflann (points) and CGAL's tree of boxes
// (triangles). One thread; the least CPU seconds of three runs.
//
//   points_search_bench [MESH]…     tables on standard output
//
// Queries "near" lie within a thousandth of the longest side from the surface, "far" ones in a box
// twice as long as that of the mesh. Ratios are to nanoflann and to CGAL. Exits 1 when a distance
// differs from theirs by more than rounding (Embree: single precision).

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <embree3/rtcore.h>
#include <fmt/core.h>
#include <malloc.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <memory>
#include <nanoflann.hpp>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "levelset/geometry/search/point_search.h"
#include "levelset/geometry/search/triangle_search.h"
#include "levelset/mesh_files/mesh_file.h"

namespace {

using Imath::V3d;
using levelset::TriMesh;

constexpr std::size_t kQueries = 20000;
constexpr double kAny = std::numeric_limits<double>::infinity();
constexpr std::size_t kNeighbours = 12;

double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double allocated() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

/// Search structure under test. `closest` returns the distance.
struct Search {
  std::function<double(const V3d&)> closest;
  /// Distance of the k-th closest point; empty where there is no such search.
  std::function<double(const V3d&)> neighbours = {};
  double megabytes = 0;
};

/// Device with one thread, and the bytes that it has allocated.
struct Embree {
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene scene = rtcNewScene(device);
  double bytes = 0;
  std::vector<V3d> points;
  TriMesh mesh;
  bool isMesh = false;

  Embree() {
    rtcSetDeviceMemoryMonitorFunction(
        device,
        [](void* self, ssize_t size, bool) {
          static_cast<Embree*>(self)->bytes += static_cast<double>(size);
          return true;
        },
        this);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;
  ~Embree() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  void build(std::size_t count) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(count));
    rtcSetGeometryUserData(geometry, this);
    rtcSetGeometryBoundsFunction(
        geometry,
        [](const RTCBoundsFunctionArguments* arguments) {
          const auto& self = *static_cast<const Embree*>(arguments->geometryUserPtr);
          V3d low(kAny), high(-kAny);
          const auto extend = [&](const V3d& p) {
            for (int axis = 0; axis < 3; ++axis) {
              low[axis] = std::min(low[axis], p[axis]);
              high[axis] = std::max(high[axis], p[axis]);
            }
          };
          if (self.isMesh)
            for (const std::uint32_t v : self.mesh.triangles[arguments->primID])
              extend(self.mesh.positions[v]);
          else
            extend(self.points[arguments->primID]);
          const auto down = [](double x) {
            return std::nextafterf(static_cast<float>(x), -HUGE_VALF);
          };
          const auto up = [](double x) {
            return std::nextafterf(static_cast<float>(x), HUGE_VALF);
          };
          RTCBounds& b = *arguments->bounds_o;
          b.lower_x = down(low.x);
          b.lower_y = down(low.y);
          b.lower_z = down(low.z);
          b.upper_x = up(high.x);
          b.upper_y = up(high.y);
          b.upper_z = up(high.z);
        },
        nullptr);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
  }

  double closest(const V3d& from) const {
    struct State {
      const Embree* self;
      V3d from;
      double squared = kAny;
    } state{this, from};
    RTCPointQuery query{};
    query.x = static_cast<float>(from.x);
    query.y = static_cast<float>(from.y);
    query.z = static_cast<float>(from.z);
    query.radius = HUGE_VALF;
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(
        scene, &query, &context,
        [](RTCPointQueryFunctionArguments* arguments) {
          auto& at = *static_cast<State*>(arguments->userPtr);
          const Embree& self = *at.self;
          V3d p;
          if (self.isMesh) {
            const auto& [a, b, c] = self.mesh.triangles[arguments->primID];
            p = levelset::closestOnTriangle(at.from, self.mesh.positions[a], self.mesh.positions[b],
                                            self.mesh.positions[c])
                    .point;
          } else {
            p = self.points[arguments->primID];
          }
          const double squared = (p - at.from).length2();
          if (!(squared < at.squared)) return false;
          at.squared = squared;
          arguments->query->radius =
              std::nextafterf(static_cast<float>(std::sqrt(squared)), HUGE_VALF);
          return true;
        },
        &state);
    return std::sqrt(state.squared);
  }
};

struct NanoCloud {
  std::vector<V3d> points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<int>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using NanoTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, NanoCloud>, NanoCloud,
                                        3>;

Search overlapOfPoints(const std::vector<V3d>& points) {
  const auto tree = std::make_shared<levelset::PointSearch>(levelset::makePointSearch(points));
  const auto found = std::make_shared<std::vector<levelset::FoundItem>>();
  return {[=](const V3d& from) { return std::sqrt(tree->closest(from, kAny).squared); },
          [=](const V3d& from) {
            tree->closest(from, kNeighbours, *found);
            return std::sqrt(found->back().squared);
          },
          1e-6 * static_cast<double>(tree->memoryUse())};
}

Search embreeOfPoints(const std::vector<V3d>& points) {
  const auto embree = std::make_shared<Embree>();
  embree->points = points;
  embree->build(points.size());
  return {[=](const V3d& from) { return embree->closest(from); }, {}, 1e-6 * embree->bytes};
}

Search nanoflannOfPoints(const std::vector<V3d>& points) {
  const auto cloud = std::make_shared<NanoCloud>(NanoCloud{points});
  const auto tree =
      std::make_shared<NanoTree>(3, *cloud, nanoflann::KDTreeSingleIndexAdaptorParams(8));
  const auto nearest = [=](const V3d& from, std::size_t count) {
    std::array<std::uint32_t, kNeighbours> numbers;
    std::array<double, kNeighbours> squares;
    tree->knnSearch(&from.x, count, numbers.data(), squares.data());
    (void)cloud;
    return std::sqrt(squares[count - 1]);
  };
  return {[=](const V3d& from) { return nearest(from, 1); },
          [=](const V3d& from) { return nearest(from, kNeighbours); }};
}

Search overlapOfTriangles(const TriMesh& mesh) {
  const auto tree = std::make_shared<levelset::TriangleSearch>(levelset::makeTriangleSearch(mesh));
  return {[=](const V3d& from) { return std::sqrt(tree->closest(from, kAny).squared); },
          {},
          1e-6 * static_cast<double>(tree->memoryUse())};
}

Search embreeOfTriangles(const TriMesh& mesh) {
  const auto embree = std::make_shared<Embree>();
  embree->mesh = mesh;
  embree->isMesh = true;
  embree->build(mesh.triangles.size());
  return {[=](const V3d& from) { return embree->closest(from); }, {}, 1e-6 * embree->bytes};
}

Search cgalOfTriangles(const TriMesh& mesh) {
  using Kernel = CGAL::Simple_cartesian<double>;
  using Triangles = std::vector<Kernel::Triangle_3>;
  using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
  const auto point = [](const V3d& p) { return Kernel::Point_3(p.x, p.y, p.z); };
  const auto triangles = std::make_shared<Triangles>();
  for (const auto& [a, b, c] : mesh.triangles)
    triangles->emplace_back(point(mesh.positions[a]), point(mesh.positions[b]),
                            point(mesh.positions[c]));
  const auto tree = std::make_shared<Tree>(triangles->begin(), triangles->end());
  tree->build();
  tree->accelerate_distance_queries();
  return {[=](const V3d& from) {
    (void)triangles;
    return std::sqrt(tree->squared_distance(point(from)));
  }};
}

/// Queries near the surface of a mesh or far from it.
std::vector<V3d> queriesOf(const TriMesh& mesh, bool isFar) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  const Imath::Box3d box = levelset::bounds(mesh);
  const V3d size = box.size();
  const double longest = std::max({size.x, size.y, size.z});
  std::vector<V3d> queries;
  while (queries.size() < kQueries) {
    V3d at;
    for (int axis = 0; axis < 3; ++axis) at[axis] = 2 * unit(random) - 1;
    if (isFar) {
      queries.push_back(box.center() + at * longest);
      continue;
    }
    const auto& [a, b, c] = mesh.triangles[random() % mesh.triangles.size()];
    double u = unit(random), v = unit(random);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    queries.push_back(mesh.positions[a] + (mesh.positions[b] - mesh.positions[a]) * u +
                      (mesh.positions[c] - mesh.positions[a]) * v + at * (1e-3 * longest));
  }
  return queries;
}

struct Figures {
  double build = kAny, near = kAny, far = kAny, neighbours = kAny, megabytes = 0;
};

bool isWrong = false;

/// @param nearDistances, farDistances  expected distances; filled by the first structure
template <class Input, class Make>
Figures measure(const std::string& name, const Input& input, const Make& make,
                const std::vector<V3d>& near, const std::vector<V3d>& far,
                std::vector<double>& nearDistances, std::vector<double>& farDistances) {
  Figures figures;
  const auto time = [&](const std::vector<V3d>& queries, const auto& search,
                        std::vector<double>* expected) {
    std::vector<double> distances;
    distances.reserve(queries.size());
    const double start = cpuSeconds();
    for (const V3d& q : queries) distances.push_back(search(q));
    const double seconds = cpuSeconds() - start;
    if (expected && expected->empty()) *expected = distances;
    const double tolerance = name == "Embree" ? 1e-5 : 1e-12;
    for (std::size_t i = 0; expected && i < distances.size(); ++i)
      if (std::abs(distances[i] - (*expected)[i]) > tolerance * (1 + (*expected)[i])) {
        fmt::print("{}: the distance of query {} is {} instead of {}\n", name, i, distances[i],
                   (*expected)[i]);
        isWrong = true;
        break;
      }
    return seconds;
  };
  for (int run = 0; run < 3; ++run) {
    const double before = allocated(), start = cpuSeconds();
    const Search search = make(input);
    figures.build = std::min(figures.build, cpuSeconds() - start);
    figures.megabytes = search.megabytes > 0 ? search.megabytes : 1e-6 * (allocated() - before);
    figures.near = std::min(figures.near, time(near, search.closest, &nearDistances));
    figures.far = std::min(figures.far, time(far, search.closest, &farDistances));
    if (search.neighbours)
      figures.neighbours = std::min(figures.neighbours, time(near, search.neighbours, nullptr));
  }
  return figures;
}

void tell(const std::string& name, const Figures& f, const Figures& peer) {
  const double perQuery = 1e6 / static_cast<double>(kQueries);
  fmt::print(
      "{:<10} {:>7.3f} s {:>5.2f}  {:>7.2f} us {:>5.2f}  {:>7.2f} us {:>5.2f}  {:>6.1f} MB "
      "{:>5.2f}",
      name, f.build, f.build / peer.build, f.near * perQuery, f.near / peer.near, f.far * perQuery,
      f.far / peer.far, f.megabytes, f.megabytes / peer.megabytes);
  if (std::isfinite(f.neighbours)) fmt::print("  {:>7.2f} us", f.neighbours * perQuery);
  fmt::print("\n");
  std::fflush(stdout);
}

void benchmark(const std::string& name, const TriMesh& mesh) {
  const std::vector<V3d> near = queriesOf(mesh, false), far = queriesOf(mesh, true);
  fmt::print("\n{}: {} vertices, {} triangles\n", name, mesh.positions.size(),
             mesh.triangles.size());
  fmt::print("{:<10} {:>15}  {:>16}  {:>16}  {:>15}  {:>10}\n", "", "build", "near", "far",
             "memory", "12 near");
  std::vector<double> nearDistances, farDistances;
  const auto points = [&](const std::string& what, const auto& make) {
    return measure(what, mesh.positions, make, near, far, nearDistances, farDistances);
  };
  const Figures peer = points("nanoflann", nanoflannOfPoints);
  fmt::print("points\n");
  tell("nanoflann", peer, peer);
  tell("Embree", points("Embree", embreeOfPoints), peer);
  tell("this tree", points("this tree", overlapOfPoints), peer);
  nearDistances.clear();
  farDistances.clear();
  const auto triangles = [&](const std::string& what, const auto& make) {
    return measure(what, mesh, make, near, far, nearDistances, farDistances);
  };
  const Figures cgal = triangles("CGAL", cgalOfTriangles);
  fmt::print("triangles\n");
  tell("CGAL", cgal, cgal);
  tell("Embree", triangles("Embree", embreeOfTriangles), cgal);
  tell("this tree", triangles("this tree", overlapOfTriangles), cgal);
}

/// Plate with round pins, as CAD programs tessellate them: fans and long, thin triangles.
TriMesh plateWithPins() {
  constexpr std::uint32_t kSides = 360;
  constexpr int kPins = 12;
  TriMesh mesh;
  mesh.positions = {V3d(0), V3d(kPins, 0, 0), V3d(kPins, kPins, 0), V3d(0, kPins, 0)};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (int x = 0; x < kPins; ++x)
    for (int y = 0; y < kPins; ++y) {
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      const V3d at(x + 0.5, y + 0.5, 0);
      mesh.positions.push_back(at + V3d(0, 0, 2));
      for (std::uint32_t i = 0; i < kSides; ++i) {
        const double angle = 2 * std::numbers::pi * i / kSides;
        const V3d p = at + V3d(0.3 * std::cos(angle), 0.3 * std::sin(angle), 0);
        mesh.positions.push_back(p);
        mesh.positions.push_back(p + V3d(0, 0, 2));
        const std::uint32_t a = first + 1 + 2 * i, b = first + 1 + 2 * ((i + 1) % kSides);
        mesh.triangles.push_back({a, b, b + 1});
        mesh.triangles.push_back({a, b + 1, a + 1});
        mesh.triangles.push_back({first, a + 1, b + 1});
      }
    }
  return mesh;
}

}  // namespace

int main(int argc, char** argv) try {
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  for (int i = 1; i < argc; ++i) benchmark(argv[i], levelset::readMesh(argv[i]));
  benchmark("plate with pins", plateWithPins());
  return isWrong ? 1 : 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "points_search_bench: {}\n", error.what());
  return 1;
}
