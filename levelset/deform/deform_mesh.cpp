#include "levelset/deform/deform_mesh.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "levelset/error.h"

namespace levelset {
namespace {

using Imath::V3d;

/// Bytes of a vertex with its attributes and of two triangles, twice during the division.
constexpr double kBytesPerDividedVertex = 300;
constexpr int kMostDivisionRounds = 24;

std::uint64_t meshEdgeKey(std::uint32_t a, std::uint32_t b) {
  if (a > b) std::swap(a, b);
  return (static_cast<std::uint64_t>(a) << 32) | b;
}

/// Orders positions, so that an edge has the same begin and the same bits from both sides.
bool isBeforePosition(const V3d& a, const V3d& b) {
  if (a.x != b.x) return a.x < b.x;
  if (a.y != b.y) return a.y < b.y;
  return a.z < b.z;
}

/// Largest distance between a deformed edge and the straight edge between its deformed ends.
double bendOf(const Deformation& deformation, V3d a, V3d b) {
  if (isBeforePosition(b, a)) std::swap(a, b);
  const V3d begin = deformation.at(a), end = deformation.at(b);
  double worst = 0;
  for (const double t : {0.25, 0.5, 0.75}) {
    const V3d off = deformation.at(a + (b - a) * t) - (begin + (end - begin) * t);
    worst = std::max(worst, off.length());
  }
  return worst;
}

template <class T>
void appendMiddle(std::vector<T>& list, std::uint32_t a, std::uint32_t b) {
  if (!list.empty()) list.push_back((list[a] + list[b]) / 2);
}

/// Adds the middle of an edge to the mesh before the deformation.
std::uint32_t addMiddle(TriMesh& mesh, std::uint32_t a, std::uint32_t b) {
  if (isBeforePosition(mesh.positions[b], mesh.positions[a])) std::swap(a, b);
  const auto number = static_cast<std::uint32_t>(mesh.positions.size());
  const V3d from = mesh.positions[a], to = mesh.positions[b];
  mesh.positions.push_back(from + (to - from) * 0.5);
  appendMiddle(mesh.attributes.normals, a, b);
  appendMiddle(mesh.attributes.uvs, a, b);
  appendMiddle(mesh.attributes.colors, a, b);
  return number;
}

/// Divides triangles at the middles of their halved edges into two, three or four.
class TriangleDivision {
 public:
  TriangleDivision(TriMesh& mesh, const Deformation& deformation, double tolerance)
      : mesh_(mesh), deformation_(deformation), tolerance_(tolerance) {}

  /// Halves all edges beyond the tolerance. Returns their number.
  std::size_t round() {
    const std::size_t count = mesh_.triangles.size();
    // Bit n: the edge from corner n is halved.
    std::vector<std::uint8_t> halved(count, 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
      for (std::size_t t = range.begin(); t != range.end(); ++t)
        for (std::size_t n = 0; n < 3; ++n)
          if (bendOf(deformation_, mesh_.positions[mesh_.triangles[t][n]],
                     mesh_.positions[mesh_.triangles[t][(n + 1) % 3]]) > tolerance_)
            halved[t] = static_cast<std::uint8_t>(halved[t] | (1u << n));
    });
    middles_.clear();
    for (std::size_t t = 0; t < count; ++t)
      if (halved[t]) divide(t, halved[t]);
    return middles_.size();
  }

 private:
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    const auto [entry, isNew] = middles_.try_emplace(meshEdgeKey(a, b), 0);
    if (isNew) entry->second = addMiddle(mesh_, a, b);
    return entry->second;
  }

  void divide(std::size_t t, unsigned halved) {
    std::array<std::uint32_t, 3> c = mesh_.triangles[t];
    // Turns the triangle, so that one halved edge is the first, or one whole edge the last.
    const int number = ((halved & 1u) != 0) + ((halved & 2u) != 0) + ((halved & 4u) != 0);
    const auto isHalved = [&](std::size_t edge) { return (halved >> edge & 1u) != 0; };
    std::size_t first = 0;
    if (number == 1)
      while (!isHalved(first)) ++first;
    if (number == 2)
      while (isHalved((first + 2) % 3)) ++first;
    std::rotate(c.begin(), c.begin() + static_cast<std::ptrdiff_t>(first), c.end());
    const std::uint32_t ab = middle(c[0], c[1]);
    if (number == 1) {
      mesh_.triangles[t] = {c[0], ab, c[2]};
      mesh_.triangles.push_back({ab, c[1], c[2]});
      return;
    }
    const std::uint32_t bc = middle(c[1], c[2]);
    if (number == 2) {
      mesh_.triangles[t] = {ab, c[1], bc};
      // The rest is divided by its shorter diagonal.
      const double one = (mesh_.positions[c[0]] - mesh_.positions[bc]).length2(),
                   other = (mesh_.positions[ab] - mesh_.positions[c[2]]).length2();
      if (one < other) {
        mesh_.triangles.push_back({c[0], ab, bc});
        mesh_.triangles.push_back({c[0], bc, c[2]});
      } else {
        mesh_.triangles.push_back({c[0], ab, c[2]});
        mesh_.triangles.push_back({ab, bc, c[2]});
      }
      return;
    }
    const std::uint32_t ca = middle(c[2], c[0]);
    mesh_.triangles[t] = {ab, bc, ca};
    mesh_.triangles.push_back({c[0], ab, ca});
    mesh_.triangles.push_back({ab, c[1], bc});
    mesh_.triangles.push_back({ca, bc, c[2]});
  }

  TriMesh& mesh_;
  const Deformation& deformation_;
  double tolerance_;
  std::unordered_map<std::uint64_t, std::uint32_t> middles_;
};

double largestBend(const TriMesh& mesh, const Deformation& deformation) {
  std::vector<double> bends(mesh.triangles.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bends.size(), 256), [&](const auto& range) {
    for (std::size_t t = range.begin(); t != range.end(); ++t)
      for (std::size_t n = 0; n < 3; ++n)
        bends[t] = std::max(bends[t], bendOf(deformation, mesh.positions[mesh.triangles[t][n]],
                                             mesh.positions[mesh.triangles[t][(n + 1) % 3]]));
  });
  return bends.empty() ? 0 : *std::max_element(bends.begin(), bends.end());
}

}  // namespace

DeformMeshResult deformMesh(const TriMesh& mesh, const Deformation& deformation,
                            const DeformMeshOptions& options) {
  if (!(options.tolerance >= 0) || !std::isfinite(options.tolerance))
    throw UsageError(fmt::format("the tolerance is {}; give a length, or 0 to divide no triangle",
                                 options.tolerance));
  requireAttributes(mesh);
  DeformMeshResult result;
  result.certificate = deformation
                           .certify({mesh.positions, mesh.triangles},
                                    {.maxMemory = options.maxMemory,
                                     .progress = subProgress(options.progress, 0, 0.3)})
                           .certificate;
  requireInjective(result.certificate);
  deformation.requireDefined(mesh.positions, "vertex");
  result.mesh = mesh;
  if (deformation.isIdentity()) return result;
  TriMesh& moved = result.mesh;
  if (options.tolerance > 0) {
    TriangleDivision division(moved, deformation, options.tolerance);
    for (int round = 0; round < kMostDivisionRounds; ++round) {
      report(options.progress, 0.3 + 0.5 * round / kMostDivisionRounds);
      const std::size_t before = moved.positions.size();
      const std::size_t halved = division.round();
      result.halvedEdges += halved;
      if (halved == 0) break;
      // The next round at most quadruples the triangles.
      const double vertices = static_cast<double>(moved.positions.size());
      requireMemory(vertices * kBytesPerDividedVertex, options.maxMemory);
      if (vertices > 1e9 && moved.positions.size() > before)
        throw ResourceLimit("the divided mesh has over 1e9 vertices; use a larger tolerance");
    }
  }
  result.bend = largestBend(moved, deformation);
  report(options.progress, 0.9);
  double stretch = 1;
  std::vector<double> stretches(moved.positions.size());
  const bool hasNormals = !moved.attributes.normals.empty();
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, moved.positions.size(), 256),
                    [&](const auto& range) {
                      for (std::size_t n = range.begin(); n != range.end(); ++n) {
                        const DeformationJet jet = deformation.jet(moved.positions[n]);
                        moved.positions[n] = jet.position;
                        for (const V3d& slope : jet.slopes)
                          stretches[n] = std::max(stretches[n], slope.length());
                        if (hasNormals)
                          moved.attributes.normals[n] =
                              transformedNormal(moved.attributes.normals[n], jet.slopes, 1);
                      }
                    });
  for (const double s : stretches) stretch = std::max(stretch, s);
  moved.spacing = coordinateSpacing(mesh) * stretch;
  moved.precision = CoordinatePrecision::Double;  // deformed coordinates may need more digits
  report(options.progress, 1);
  return result;
}

DeformPointsResult deformPoints(PointCloud cloud, const Deformation& deformation,
                                const CertifyOptions& options) {
  const Progress& progress = options.progress;
  requirePoints(cloud);
  DeformPointsResult result;
  result.certificate =
      deformation
          .certify({cloud.positions, {}},
                   {.maxMemory = options.maxMemory, .progress = subProgress(progress, 0, 0.5)})
          .certificate;
  requireInjective(result.certificate);
  deformation.requireDefined(cloud.positions, "point");
  if (!deformation.isIdentity()) {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, cloud.positions.size(), 256), [&](const auto& range) {
          for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const DeformationJet jet = deformation.jet(cloud.positions[n]);
            cloud.positions[n] = jet.position;
            if (!cloud.normals.empty())
              cloud.normals[n] =
                  Imath::V3f(transformedNormal(V3d(cloud.normals[n]), jet.slopes, 1));
            if (!cloud.radii.empty())
              cloud.radii[n] = static_cast<float>(static_cast<double>(cloud.radii[n]) *
                                                  std::cbrt(jet.determinant()));
          }
        });
    cloud.precision = CoordinatePrecision::Double;
    requirePoints(cloud);
  }
  result.cloud = std::move(cloud);
  report(progress, 1);
  return result;
}

}  // namespace levelset
