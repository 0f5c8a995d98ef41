// Compares surfaces from point clouds: ours beside CGAL's Poisson reconstruction and advancing
// front, and PCL's Poisson reconstruction if the program was built with it.
//
//   point_surfaces_bench SHAPE COUNT NOISE NORMALS VARIANT [METHOD…]
//
// SHAPE    sphere, torus, box, or a mesh file; a file with COUNT 0: its vertices
// NOISE    standard deviation of each coordinate, in fractions of the diagonal of the bounding box
// NORMALS  given, estimated (by `normals`), or flipped (half of them, then estimated)
// VARIANT  blue (noise), uneven (uniform random), hole (a cap is removed)
// METHOD   mls, mpu, rbf, meshless, poisson, front, front-band, pcl-poisson, truth-band; default:
// all
//
// front-band is the advancing front as a level set with our voxels, and truth-band the true mesh:
// what any method loses at this resolution. A mesh of the given vertices has no resolution of its
// own.
//
// Prints a line of CSV for each method: mean and largest distance in point spacings from the result
// to the true surface and back, the mean angle between normals in degrees, the error of the volume,
// Euler characteristic, components, triangles, CPU seconds of the method and of the normals, peak
// memory in MB since the start of the program, and the point spacing in fractions of the diagonal.
// All methods run with the same point spacing; ours uses voxels of half a spacing, or of VOXEL
// spacings if this environment variable is set.

#define CGAL_EIGEN3_ENABLED
#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polyhedron_3.h>
#include <CGAL/poisson_surface_reconstruction.h>
#include <fmt/core.h>
#include <sys/resource.h>

#ifdef LEVELSMITH_HAS_PCL
#include <pcl/point_types.h>
#include <pcl/surface/poisson.h>
#endif

#include <cmath>
#include <ctime>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/geometry/search/triangle_search.h"
#include "levelset/inspect/measure.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/points/field/oriented_points.h"
#include "levelset/points/processing/normals.h"
#include "levelset/points/processing/point_spacing.h"
#include "levelset/points/processing/sample_mesh.h"
#include "levelset/points/surface/points_to_band.h"
#include "levelset/shapes/shapes.h"

namespace {

using Imath::V3d;
using Imath::V3f;
using levelset::PointCloud;
using levelset::TriMesh;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

TriMesh box() {
  TriMesh mesh;
  for (int c = 0; c < 8; ++c)
    mesh.positions.emplace_back(c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TriMesh truthOf(const std::string& shape) {
  constexpr double kVoxel = 0.01;
  if (shape == "sphere") return bandToMesh(levelset::makeSphere(1, V3d(0), kVoxel, {}));
  if (shape == "torus")
    return bandToMesh(levelset::makeTorus(1, 0.4, V3d(0), V3d(0, 0, 1), kVoxel, {}));
  return shape == "box" ? box() : levelset::readMesh(shape);
}

PointCloud vertexCloud(const TriMesh& mesh) {
  std::vector<V3d> sums(mesh.positions.size(), V3d(0));
  for (const auto& t : mesh.triangles) {
    const V3d& a = mesh.positions[t[0]];
    const V3d normal = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
    for (const auto v : t) sums[v] += normal;
  }
  PointCloud cloud;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (!(sums[i].length() > 0)) continue;
    cloud.positions.push_back(mesh.positions[i]);
    cloud.normals.emplace_back(sums[i].normalized());
  }
  return cloud;
}

/// CPU seconds of all threads of the program.
double seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

std::vector<std::pair<Kernel::Point_3, Kernel::Vector_3>> pairsOf(const PointCloud& cloud) {
  std::vector<std::pair<Kernel::Point_3, Kernel::Vector_3>> pairs;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const V3d &p = cloud.positions[i], n(cloud.normals[i]);
    pairs.emplace_back(Kernel::Point_3(p.x, p.y, p.z), Kernel::Vector_3(n.x, n.y, n.z));
  }
  return pairs;
}

TriMesh poisson(const PointCloud& cloud, double spacing) {
  using Pair = std::pair<Kernel::Point_3, Kernel::Vector_3>;
  CGAL::Polyhedron_3<Kernel> surface;
  const auto pairs = pairsOf(cloud);
  // CGAL's example has triangles of up to 30 spacings, and a distance of 0.375 spacings. These
  // criteria give as many triangles as there are points or more.
  constexpr double kAngle = 20, kRadius = 1, kDistance = 0.05;
  if (!CGAL::poisson_surface_reconstruction_delaunay(
          pairs.begin(), pairs.end(), CGAL::First_of_pair_property_map<Pair>(),
          CGAL::Second_of_pair_property_map<Pair>(), surface, spacing, kAngle, kRadius, kDistance))
    return {};
  TriMesh mesh;
  std::map<const void*, std::uint32_t> numbers;
  for (auto v = surface.vertices_begin(); v != surface.vertices_end(); ++v) {
    numbers[&*v] = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.emplace_back(v->point().x(), v->point().y(), v->point().z());
  }
  for (auto f = surface.facets_begin(); f != surface.facets_end(); ++f) {
    auto h = f->halfedge();
    mesh.triangles.push_back({numbers[&*h->vertex()], numbers[&*h->next()->vertex()],
                              numbers[&*h->next()->next()->vertex()]});
  }
  return mesh;
}

TriMesh advancingFront(const PointCloud& cloud) {
  std::vector<Kernel::Point_3> points;
  for (const V3d& p : cloud.positions) points.emplace_back(p.x, p.y, p.z);
  std::vector<std::array<std::size_t, 3>> facets;
  CGAL::advancing_front_surface_reconstruction(points.begin(), points.end(),
                                               std::back_inserter(facets));
  TriMesh mesh;
  mesh.positions = cloud.positions;
  for (const auto& f : facets)
    mesh.triangles.push_back({static_cast<std::uint32_t>(f[0]), static_cast<std::uint32_t>(f[1]),
                              static_cast<std::uint32_t>(f[2])});
  return mesh;
}

#ifdef LEVELSMITH_HAS_PCL
TriMesh pclPoisson(const PointCloud& cloud, double spacing) {
  const auto input = std::make_shared<pcl::PointCloud<pcl::PointNormal>>();
  Imath::Box3d bounds;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    pcl::PointNormal p;
    for (int axis = 0; axis < 3; ++axis) {
      p.data[axis] = static_cast<float>(cloud.positions[i][axis]);
      p.data_n[axis] = cloud.normals[i][axis];
    }
    input->push_back(p);
    bounds.extendBy(cloud.positions[i]);
  }
  pcl::Poisson<pcl::PointNormal> method;
  const V3d size = bounds.size();
  const double side = 1.1 * std::max({size.x, size.y, size.z});
  // Cells of at most half a spacing, as ours.
  method.setDepth(static_cast<int>(std::ceil(std::log2(side / (spacing / 2)))));
  method.setInputCloud(input);
  pcl::PointCloud<pcl::PointNormal> vertices;
  std::vector<pcl::Vertices> polygons;
  method.reconstruct(vertices, polygons);
  TriMesh mesh;
  for (const auto& p : vertices) mesh.positions.emplace_back(p.x, p.y, p.z);
  for (const auto& polygon : polygons)
    for (std::size_t n = 2; n < polygon.vertices.size(); ++n)
      mesh.triangles.push_back({static_cast<std::uint32_t>(polygon.vertices[0]),
                                static_cast<std::uint32_t>(polygon.vertices[n - 1]),
                                static_cast<std::uint32_t>(polygon.vertices[n])});
  return mesh;
}
#endif

/// Returns the surface of a mesh as a level set shows it. The winding number closes its holes.
TriMesh throughBand(const TriMesh& mesh, double voxelSize) {
  return bandToMesh(
      meshToBand(mesh, voxelSize, {.sign = levelset::SignMode::Winding, .acceptSign = true}).band);
}

double volumeOf(const TriMesh& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles)
    volume += mesh.positions[t[0]].dot(mesh.positions[t[1]].cross(mesh.positions[t[2]])) / 6;
  return volume;
}

void turnOutwards(TriMesh& mesh) {
  if (volumeOf(mesh) < 0)
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
}

V3d normalOf(const TriMesh& mesh, std::size_t t) {
  const V3d& a = mesh.positions[mesh.triangles[t][0]];
  return (mesh.positions[mesh.triangles[t][1]] - a)
      .cross(mesh.positions[mesh.triangles[t][2]] - a)
      .normalized();
}

struct Distances {
  double mean = 0, largest = 0, degrees = 0;
};

/// Distances from points on one mesh to the other.
Distances distances(const TriMesh& from, const TriMesh& to) {
  constexpr std::size_t kSamples = 200000;
  const PointCloud samples = levelset::sampleMesh(from, {.count = kSamples, .isBlueNoise = false});
  const levelset::TriangleSearch search = levelset::makeTriangleSearch(to);
  Distances result;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto found =
        search.closest(samples.positions[i], std::numeric_limits<double>::infinity());
    const double distance = std::sqrt(found.squared);
    result.mean += distance / kSamples;
    result.largest = std::max(result.largest, distance);
    const V3d a(samples.normals[i]), b = normalOf(to, found.index);
    // The advancing front may face inwards.
    result.degrees += std::atan2(a.cross(b).length(), std::abs(a.dot(b))) * 180 / M_PI / kSamples;
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 6) {
    fmt::print(stderr, "usage: point_surfaces_bench SHAPE COUNT NOISE NORMALS VARIANT [METHOD…]\n");
    return 2;
  }
  const std::string shape = argv[1], noise = argv[3], normals = argv[4], variant = argv[5];
  const std::size_t count = std::stoul(argv[2]);
  const TriMesh truth = truthOf(shape);
  Imath::Box3d bounds;
  for (const V3d& p : truth.positions) bounds.extendBy(p);
  PointCloud cloud = count == 0 ? vertexCloud(truth)
                                : levelset::sampleMesh(
                                      truth, {.count = count,
                                              .isBlueNoise = variant != "uneven",
                                              .noise = std::stod(noise) * bounds.size().length()});
  if (variant == "hole") {
    std::vector<std::uint32_t> kept;
    const double top = bounds.max.z - 0.1 * bounds.size().z;
    for (std::uint32_t i = 0; i < cloud.size(); ++i)
      if (cloud.positions[i].z < top) kept.push_back(i);
    cloud = selectPoints(cloud, kept);
  }
  // A neighbourhood that is larger than the noise.
  const double deviation =
      std::stod(noise) * bounds.size().length() / levelset::pointSpacing(cloud).median;
  const std::size_t neighbours =
      deviation < 0.1
          ? 0
          : std::min<std::size_t>(200, 16 + static_cast<std::size_t>(300 * deviation * deviation));
  double normalSeconds = 0;
  if (normals == "flipped")
    for (std::size_t i = 0; i < cloud.size(); i += 2) cloud.normals[i] = -cloud.normals[i];
  if (normals != "given") {
    const double start = seconds();
    cloud = levelset::estimateNormals(std::move(cloud),
                                      {.neighbours = std::max(20, static_cast<int>(neighbours))})
                .cloud;
    normalSeconds = seconds() - start;
  }
  const double spacing = levelset::points::orient(cloud).medianSpacing;
  const char* share = std::getenv("VOXEL");
  const double voxelSize = spacing * (share ? std::stod(share) : 0.5);
  // docs/points.md recommends these for noise of 0.2 spacings, and for scans.
  const double lambda = deviation < 0.1 ? 0 : 30;
  const double rbfTolerance = count == 0 ? 0.1 : 0.02;
  const auto ours = [&](levelset::PointMethod method) {
    const bool isRbf = method == levelset::PointMethod::RadialBasis;
    return bandToMesh(pointsToBand(cloud, voxelSize,
                                   {.method = method,
                                    .neighbours = isRbf ? 0 : neighbours,
                                    .tolerance = isRbf ? rbfTolerance : 0.02,
                                    .lambda = isRbf ? lambda : 0,
                                    .acceptUnsupported = true})
                          .band);
  };
  std::vector<std::pair<std::string, std::function<TriMesh()>>> methods{
      {"mls", [&] { return ours(levelset::PointMethod::MovingLeastSquares); }},
      {"mpu", [&] { return ours(levelset::PointMethod::MultilevelPartition); }},
      {"rbf", [&] { return ours(levelset::PointMethod::RadialBasis); }},
      {"meshless", [&] { return ours(levelset::PointMethod::Meshless); }},
      {"poisson", [&] { return poisson(cloud, spacing); }},
      {"front", [&] { return advancingFront(cloud); }},
      {"front-band",
       [&] {
         TriMesh mesh = advancingFront(cloud);
         turnOutwards(mesh);
         return throughBand(mesh, voxelSize);
       }},
#ifdef LEVELSMITH_HAS_PCL
      {"pcl-poisson", [&] { return pclPoisson(cloud, spacing); }},
#endif
      {"truth-band", [&] { return throughBand(truth, voxelSize); }},
  };
  for (const auto& [name, run] : methods) {
    bool isAsked = argc == 6;
    for (int n = 6; n < argc; ++n) isAsked = isAsked || name == argv[n];
    if (!isAsked) continue;
    const double start = seconds();
    TriMesh mesh = run();
    const double taken = seconds() - start;
    fmt::print("{},{},{},{},{},{},", shape.substr(shape.rfind('/') + 1), cloud.size(), noise,
               normals, variant, name);
    if (mesh.isEmpty()) {
      fmt::print("no surface\n");
      continue;
    }
    turnOutwards(mesh);
    const Distances to = distances(mesh, truth), from = distances(truth, mesh);
    const levelset::Measurement measured = levelset::measure(mesh);
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    fmt::print("{:.4f},{:.2f},{:.4f},{:.2f},{:.2f},{:.2e},{},{},{},{:.2f},{:.2f},{},{:.3e}\n",
               to.mean / spacing, to.largest / spacing, from.mean / spacing, from.largest / spacing,
               from.degrees, volumeOf(mesh) / volumeOf(truth) - 1, measured.euler,
               measured.components, mesh.triangles.size(), taken, normalSeconds,
               usage.ru_maxrss / 1024, spacing / bounds.size().length());
    std::fflush(stdout);
  }
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "point_surfaces_bench: {}\n", error.what());
  return 1;
}
