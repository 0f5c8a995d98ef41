#include "levelset/meshing/front_mesh.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/geometry/point_tree.h"
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

/// Edge lengths at the vertices of a mesh, for lookups nearby.
struct LengthField {
  LengthField(std::vector<openvdb::Vec3d> at, std::vector<double> all, double far)
      : points(std::move(at)), tree(points), lengths(std::move(all)), limit(far) {}

  std::vector<openvdb::Vec3d> points;
  eikonal::PointTree tree;
  std::vector<double> lengths;
  double limit;  ///< distance beyond which no vertex is searched

  [[nodiscard]] double at(const V3d& p) const {
    const std::uint32_t nearest = tree.nearest(toVdb(p), limit);
    return lengths[nearest == eikonal::PointTree::kNone ? 0 : nearest];
  }
};

/// Zero set of the tricubic interpolant of a band.
class ZeroSetFront : public FrontSurface {
 public:
  ZeroSetFront(const NarrowBand& band, const LengthField& lengths, double scale)
      : field_(band, Interpolation::Tricubic),
        lengths_(lengths),
        voxel_(band.voxelSize()),
        shortest_(voxel_ / 2),
        scale_(scale) {}

  [[nodiscard]] std::optional<Foot> project(const V3d& position) const override {
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

  [[nodiscard]] double edgeLength(const V3d& point) const override {
    return std::max(shortest_, scale_ * lengths_.at(point));
  }

 private:
  BandSampler field_;
  const LengthField& lengths_;
  double voxel_, shortest_, scale_;
};

/// One component of the mesh of marching cubes.
struct Component {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::uint32_t start = 0;  ///< vertex with the largest edge length
  double expected = 0;      ///< number of triangles of the new mesh
  long euler = 0;
};

std::vector<Component> componentsOf(const TriMesh& mesh, const std::vector<double>& lengths) {
  const SurfaceComponents found = findSurfaceComponents(mesh.positions, mesh.triangles);
  std::vector<Component> components(found.figures.size());
  for (std::size_t i = 0; i < components.size(); ++i) components[i].euler = found.figures[i].euler;
  const double shape = std::sqrt(3.0) / 4;
  for (const auto& t : mesh.triangles) {
    Component& component = components[found.componentOfVertex[t[0]]];
    if (component.triangles.empty()) component.start = t[0];
    component.triangles.push_back(t);
    double length = 0;
    for (const std::uint32_t v : t) {
      length += lengths[v] / 3;
      if (lengths[v] > lengths[component.start]) component.start = v;
    }
    const V3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    component.expected += (b - a).cross(c - a).length() / 2 / (shape * length * length);
  }
  return components;
}

long eulerOf(const FrontMesh& mesh) {
  return static_cast<long>(mesh.positions.size()) - static_cast<long>(mesh.triangles.size() / 2);
}

void append(const FrontMesh& front, TriMesh& mesh) {
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), front.positions.begin(), front.positions.end());
  for (const auto& t : front.triangles)
    mesh.triangles.push_back({base + t[0], base + t[1], base + t[2]});
}

/// Appends some triangles of a mesh with the vertices that they use.
void append(const TriMesh& from, const std::vector<std::array<std::uint32_t, 3>>& triangles,
            std::vector<std::uint32_t>& numbers, TriMesh& mesh) {
  constexpr std::uint32_t kNone = 0xffffffffu;
  numbers.resize(from.positions.size(), kNone);
  for (const auto& t : triangles) {
    std::array<std::uint32_t, 3> own;
    for (std::size_t i = 0; i < 3; ++i) {
      std::uint32_t& number = numbers[t[i]];
      if (number == kNone) {
        number = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.push_back(from.positions[t[i]]);
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
  const LengthField lengths(
      [&] {
        std::vector<openvdb::Vec3d> points;
        points.reserve(uniform.positions.size());
        for (const V3d& p : uniform.positions) points.push_back(toVdb(p));
        return points;
      }(),
      edgeLengths(band, uniform, limits), 2 * limits.longest + 4 * band.voxelSize());
  const std::vector<Component> components = componentsOf(uniform, lengths.lengths);

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
    for (const double scale : kScales) {
      const ZeroSetFront surface(band, lengths, scale);
      FrontOptions front;
      front.shortest = limits.shortest;
      front.longest = limits.longest;
      front.maxTriangles =
          static_cast<std::size_t>(4 * component.expected / (scale * scale)) + 1000;
      const double share = static_cast<double>(component.triangles.size()) /
                           static_cast<double>(uniform.triangles.size());
      front.progress = progressOf(share);
      fronts[i] = advanceFront(surface, uniform.positions[component.start], front);
      if (fronts[i].isClosed && eulerOf(fronts[i]) == component.euler) return;
    }
  });
  report(options.progress, 0.95);

  // === Result
  BandFrontMesh result;
  result.components = components.size();
  std::vector<std::uint32_t> numbers;
  for (std::size_t i = 0; i < components.size(); ++i) {
    if (!fronts[i].isClosed) {
      append(uniform, components[i].triangles, numbers, result.mesh);
      ++result.uniform;
      continue;
    }
    result.filled += fronts[i].filled;
    if (eulerOf(fronts[i]) != components[i].euler) ++result.otherTopology;
    append(fronts[i], result.mesh);
  }
  report(options.progress, 1);
  return result;
}

}  // namespace levelset
