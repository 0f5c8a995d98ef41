// The only source of this library that includes CGAL. It is compiled with -frounding-math, apart
// from the others (levelset/CMakeLists.txt).

#include "levelset/points/projection/delaunay.h"

#include "levelset/error.h"

#ifdef LEVELSMITH_HAS_CGAL
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include <utility>
#endif

namespace levelset::points {

#ifdef LEVELSMITH_HAS_CGAL

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Number = std::uint32_t;
using Structure = CGAL::Triangulation_data_structure_3<
    CGAL::Triangulation_vertex_base_with_info_3<Number, Kernel>,
    CGAL::Triangulation_cell_base_with_info_3<Number, Kernel>>;
using Triangulation = CGAL::Delaunay_triangulation_3<Kernel, Structure>;

}  // namespace

bool hasDelaunay() {
  return true;
}

Tetrahedra delaunayTetrahedra(std::span<const Imath::V3d> positions, std::size_t maxMemory,
                              const Progress& progress) {
  using Item = std::pair<Kernel::Point_3, Number>;
  std::vector<Item> points;
  points.reserve(positions.size());
  for (Number i = 0; i < positions.size(); ++i)
    points.emplace_back(Kernel::Point_3(positions[i].x, positions[i].y, positions[i].z), i);
  CGAL::spatial_sort(
      points.begin(), points.end(),
      CGAL::Spatial_sort_traits_adapter_3<Kernel, CGAL::First_of_pair_property_map<Item>>());
  Triangulation triangulation;
  Triangulation::Vertex_handle last;
  std::size_t done = 0;
  for (const auto& [point, number] : points) {
    last = last == Triangulation::Vertex_handle() ? triangulation.insert(point)
                                                  : triangulation.insert(point, last);
    last->info() = number;
    // Points on curves may have a number of tetrahedra that grows with the square of theirs.
    constexpr std::size_t kBlock = 16384;
    constexpr double kBytesPerCell = 200;  // the triangulation, and the result
    if (++done % kBlock != 0) continue;
    requireMemory(kBytesPerCell * static_cast<double>(triangulation.number_of_cells()), maxMemory);
    report(progress, static_cast<double>(done) / static_cast<double>(points.size()));
  }
  Tetrahedra result;
  if (triangulation.dimension() < 3) return result;
  const std::size_t count = triangulation.number_of_finite_cells();
  result.corners.reserve(count);
  result.neighbours.reserve(count);
  Number number = 0;
  for (const auto cell : triangulation.finite_cell_handles()) cell->info() = number++;
  for (const auto cell : triangulation.finite_cell_handles()) {
    auto& corners = result.corners.emplace_back();
    auto& neighbours = result.neighbours.emplace_back();
    for (int i = 0; i < 4; ++i) {
      const auto at = static_cast<std::size_t>(i);
      corners[at] = cell->vertex(i)->info();
      const auto other = cell->neighbor(i);
      neighbours[at] = triangulation.is_infinite(other) ? Tetrahedra::kNone : other->info();
    }
  }
  return result;
}

#else

bool hasDelaunay() {
  return false;
}

Tetrahedra delaunayTetrahedra(std::span<const Imath::V3d>, std::size_t, const Progress&) {
  throw UsageError(
      "this build has no Delaunay triangulation, since CGAL was not found; install CGAL (Debian: "
      "libcgal-dev) and build again, or use 'level-set' and 'mesh'");
}

#endif

}  // namespace levelset::points
