#include "levelset/meshing/front_mesh.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/geometry/search/point_search.h"
#include "levelset/geometry/surface_components.h"
#include "levelset/grids/sample.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/meshing/front/advancing_front.h"
#include "levelset/meshing/front/edge_lengths.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using Imath::V3d;

/// Longest edges by default, voxels.
constexpr double kLongest = 16;
/// Scales of the edge lengths for the tries of a component whose front does not close.
constexpr double kScales[] = {1, 0.7};
constexpr std::uint32_t kUnnumbered = 0xffffffffu;

/// One component of the mesh of marching cubes.
struct Component {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> vertices;
  ComponentFigures figures;
  std::vector<std::uint32_t> starts;  ///< some vertices with large edge lengths, the largest first
  double expected = 0;                ///< number of triangles of the new mesh
  // Parts of area and volume that chords of the edge lengths cut off.
  double chordArea = 0, chordVolume = 0;
};

/// Returns vertices where a front may start: the one with the largest edge length, then some with
/// nearly as large ones.
std::vector<std::uint32_t> startsOf(const std::vector<std::uint32_t>& vertices,
                                    const std::vector<double>& lengths) {
  constexpr std::size_t kStarts = 8;
  const auto isShorter = [&](std::uint32_t v, std::uint32_t w) { return lengths[v] < lengths[w]; };
  const std::uint32_t first = *std::max_element(vertices.begin(), vertices.end(), isShorter);
  std::vector<std::uint32_t> large;
  for (const std::uint32_t v : vertices)
    if (lengths[v] >= 0.9 * lengths[first]) large.push_back(v);
  std::vector<std::uint32_t> starts = {first};
  for (std::size_t i = 1; i < kStarts; ++i) starts.push_back(large[i * large.size() / kStarts]);
  return starts;
}

std::vector<Component> componentsOf(const TriMesh& mesh, const EdgeLengths& edges) {
  const std::vector<double>& lengths = edges.lengths;
  const SurfaceComponents found = findSurfaceComponents(mesh.positions, mesh.triangles);
  std::vector<Component> components(found.figures.size());
  for (std::size_t i = 0; i < components.size(); ++i) components[i].figures = found.figures[i];
  for (std::uint32_t v = 0; v < mesh.positions.size(); ++v)
    if (const std::uint32_t i = found.componentOfVertex[v]; i != SurfaceComponents::kNoComponent)
      components[i].vertices.push_back(v);
  for (Component& component : components) component.starts = startsOf(component.vertices, lengths);
  const double shape = std::sqrt(3.0) / 4;
  for (const auto& t : mesh.triangles) {
    Component& component = components[found.componentOfVertex[t[0]]];
    component.triangles.push_back(t);
    double length = 0, curvature = 0;
    for (const std::uint32_t v : t) {
      length += lengths[v] / 3;
      curvature += edges.curvatures[v] / 3;
    }
    const V3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    const double area = (b - a).cross(c - a).length() / 2;
    component.expected += area / (shape * length * length);
    // On a sphere: a chord is length² · curvature / 8 below its arc.
    component.chordVolume += area * curvature * length * length / 8;
    component.chordArea += area * curvature * curvature * length * length / 4;
  }
  return components;
}

/// Vertices of a component, with their edge lengths, for searches.
class ComponentVertices {
 public:
  ComponentVertices(const TriMesh& mesh, const EdgeLengths& edges, const Component& component)
      : points_([&] {
          std::vector<V3d> points;
          points.reserve(component.vertices.size());
          for (const std::uint32_t v : component.vertices) points.push_back(mesh.positions[v]);
          return points;
        }()),
        tree_(makePointSearch(points_)) {
    lengths_.reserve(points_.size());
    for (const std::uint32_t v : component.vertices) lengths_.push_back(edges.lengths[v]);
    longest_ = *std::max_element(lengths_.begin(), lengths_.end());
  }

  [[nodiscard]] std::optional<V3d> nearest(const V3d& p, double limit) const {
    const FoundItem found = tree_.closest(p, limit * limit);
    if (!found.isValid()) return {};
    return points_[found.index];
  }
  [[nodiscard]] double lengthAt(const V3d& p) const {
    const FoundItem found = tree_.closest(p, 16 * longest_ * longest_);
    return lengths_[found.isValid() ? found.index : 0];
  }
  [[nodiscard]] double longest() const { return longest_; }

  /// Returns true if each vertex has a vertex of a front within two edge lengths and `margin`.
  [[nodiscard]] bool areNear(const FrontMesh& front, double scale, double margin) const {
    const PointSearch tree = makePointSearch(front.positions);
    std::atomic<bool> all = true;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points_.size(), 1024),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t i = range.begin(); i < range.end() && all; ++i)
                          if (!isNear(tree, points_[i], 2 * scale * lengths_[i] + margin))
                            all = false;
                      });
    return all;
  }

 private:
  std::vector<V3d> points_;
  PointSearch tree_;
  std::vector<double> lengths_;
  double longest_ = 0;
};

/// One component of the zero set of the tricubic interpolant of a band.
class ZeroSetFront : public FrontSurface {
 public:
  ZeroSetFront(const NarrowBand& band, const ComponentVertices& vertices, double scale)
      : field_(band, Interpolation::Tricubic),
        vertices_(vertices),
        voxel_(band.voxelSize()),
        shortest_(voxel_ / 2),
        scale_(scale) {}

  [[nodiscard]] std::optional<Foot> project(const V3d& position) const override {
    std::optional<Foot> foot = descend(position);
    if (!foot) {
      // Outside the band the gradient is zero. Starts again at the tangent plane of a vertex.
      const auto vertex = vertices_.nearest(position, 4 * vertices_.longest());
      if (!vertex) return {};
      const V3d normal = field_.gradient(*vertex).normalized();
      foot = descend(position - normal * normal.dot(position - *vertex));
      if (!foot) return {};
    }
    // A foot on another component would lead the front there.
    if (!vertices_.nearest(foot->point, kOwn * voxel_)) return {};
    return foot;
  }

  [[nodiscard]] double edgeLength(const V3d& point) const override {
    return std::max(shortest_, scale_ * vertices_.lengthAt(point));
  }
  [[nodiscard]] double longest() const { return std::max(shortest_, scale_ * vertices_.longest()); }

 private:
  /// Distance from the vertices of marching cubes within which the zero set is their component,
  /// voxels.
  static constexpr double kOwn = 1.0;

  [[nodiscard]] std::optional<Foot> descend(const V3d& position) const {
    constexpr int kMaxSteps = 32;
    // Distances are stored in single precision, so values are known to about 1e-7 voxel.
    constexpr double kExact = 2e-7, kAccepted = 1e-4;
    V3d p = position;
    double best = INFINITY;
    Foot foot{position, V3d(0)};
    for (int i = 0; i < kMaxSteps && best > kExact * voxel_; ++i) {
      const double value = field_.value(p);
      const V3d gradient = field_.gradient(p);
      const double slope = gradient.length2();
      if (!(slope > 1e-4)) break;
      if (std::abs(value) < best) {
        best = std::abs(value);
        foot = {p, gradient / std::sqrt(slope)};
      }
      V3d step = gradient * (value / slope);
      if (const double length = step.length(); length > voxel_) step *= voxel_ / length;
      p -= step;
    }
    if (!(best < kAccepted * voxel_)) return {};
    return foot;
  }

  BandSampler field_;
  const ComponentVertices& vertices_;
  double voxel_, shortest_, scale_;
};

/// Returns true if a closed front is a mesh of the component: it has the same Euler characteristic,
/// its area and volume differ by no more than its chords explain, and it comes near each vertex.
bool isMeshOf(const FrontMesh& front, const Component& component, const ComponentVertices& vertices,
              double scale, double voxel) {
  if (!front.isClosed) return false;
  const SurfaceComponents found = findSurfaceComponents(front.positions, front.triangles);
  if (found.figures.size() != 1) return false;
  const ComponentFigures &own = found.figures[0], &other = component.figures;
  // Marching cubes cut creases off: up to 0.07 of the area, and 0.11 voxels of thickness.
  constexpr double kArea = 0.12, kThickness = 0.2;
  // Some edges are twice as long as the edge length.
  const double chords = 2 * scale * scale;
  return own.euler == other.euler &&
         std::abs(own.area - other.area) <= kArea * other.area + chords * component.chordArea &&
         std::abs(own.volume - other.volume) <=
             kThickness * voxel * other.area + chords * component.chordVolume &&
         vertices.areNear(front, scale, 2 * voxel);
}

/// Appends some triangles of a mesh with the vertices that they use.
/// @param numbers  for each vertex its new number, or kUnnumbered
void append(const std::vector<V3d>& positions,
            const std::vector<std::array<std::uint32_t, 3>>& triangles,
            std::vector<std::uint32_t>& numbers, TriMesh& mesh) {
  for (const auto& t : triangles) {
    std::array<std::uint32_t, 3> own;
    for (std::size_t i = 0; i < 3; ++i) {
      std::uint32_t& number = numbers[t[i]];
      if (number == kUnnumbered) {
        number = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.push_back(positions[t[i]]);
      }
      own[i] = number;
    }
    mesh.triangles.push_back(own);
  }
}

EdgeLimits checkedLimits(const FrontMeshOptions& options, double voxel) {
  if (!(options.angle > 0 && options.angle <= 1))
    throw UsageError(fmt::format(
        "the angle between normals is {} radians; give an angle above 0 and up to 1 radian",
        options.angle));
  const double longest = options.edgeLength == 0 ? kLongest * voxel : options.edgeLength;
  if (!(longest >= voxel) || !std::isfinite(longest))
    throw UsageError(fmt::format("the edge length {} is below the voxel size {}; give a larger one",
                                 longest, voxel));
  return {voxel, longest, options.angle};
}

}  // namespace

BandFrontMesh bandToFrontMesh(const NarrowBand& band, const FrontMeshOptions& options) {
  report(options.progress, 0);
  const EdgeLimits limits = checkedLimits(options, band.isEmpty() ? 1 : band.voxelSize());
  const TriMesh uniform = bandToMesh(band);
  const EdgeLengths edges = edgeLengths(band, uniform, limits);
  const std::vector<Component> components = componentsOf(uniform, edges);

  // === Fronts
  std::vector<FrontMesh> fronts(components.size());
  std::mutex mutex;
  double least = 0.1;
  const auto progressOf = [&](double share) -> Progress {
    if (!options.progress) return {};
    return [&, share](double fraction) {
      const std::lock_guard lock(mutex);
      least = std::max(least, 0.1 + 0.85 * share * fraction);
      return options.progress(least);
    };
  };
  tbb::parallel_for(std::size_t{0}, components.size(), [&](std::size_t i) {
    const Component& component = components[i];
    const ComponentVertices vertices(uniform, edges, component);
    const double share = static_cast<double>(component.triangles.size()) /
                         static_cast<double>(uniform.triangles.size());
    for (const double scale : kScales) {
      const ZeroSetFront surface(band, vertices, scale);
      AdvancingFrontOptions front;
      front.longest = surface.longest();
      front.expectedTriangles = static_cast<std::size_t>(component.expected / (scale * scale)) + 1;
      front.progress = progressOf(share);
      for (const std::uint32_t start : component.starts) {
        fronts[i] = advanceFront(surface, uniform.positions[start], front);
        if (!fronts[i].triangles.empty()) break;
      }
      if (isMeshOf(fronts[i], component, vertices, scale, band.voxelSize())) return;
    }
    fronts[i] = {};
  });
  report(options.progress, 0.95);

  // === Result
  BandFrontMesh result;
  result.components = components.size();
  std::vector<std::uint32_t> numbers(uniform.positions.size(), kUnnumbered), ofFront;
  for (std::size_t i = 0; i < components.size(); ++i) {
    if (!fronts[i].isClosed) {
      append(uniform.positions, components[i].triangles, numbers, result.mesh);
      ++result.uniform;
      continue;
    }
    result.filled += fronts[i].filled;
    ofFront.assign(fronts[i].positions.size(), kUnnumbered);
    append(fronts[i].positions, fronts[i].triangles, ofFront, result.mesh);
  }
  report(options.progress, 1);
  return result;
}

}  // namespace levelset
