#include "levelset/inspect/surface_difference.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>

#include "levelset/error.h"
#include "levelset/geometry/search/point_search.h"
#include "levelset/geometry/search/triangle_search.h"
#include "levelset/progress_gate.h"
#include "levelset/vdb.h"

namespace levelset {

using Imath::V3d;

struct TriangleSurface::Data {
  TriMesh mesh;
  TriangleSearch tree;
};

namespace {

/// Number of samples per task. Consecutive samples are usually close in space, which makes the
/// searches of SampleScan fast.
constexpr std::size_t kDifferenceChunk = 1024;
/// Maximum number of parts into which the side of a triangle is divided. It limits the samples on
/// the long triangles of decimated meshes.
constexpr double kMaxParts = 256;

struct DifferenceSums {
  double smooth = 0, crease = 0;
  std::size_t samples = 0, creaseSamples = 0;

  void add(const DifferenceSums& other) {
    smooth = std::max(smooth, other.smooth);
    crease = std::max(crease, other.crease);
    samples += other.samples;
    creaseSamples += other.creaseSamples;
  }
};

/// Measures the distances of samples to `target`, one after another. From one sample to the next,
/// the distance grows by at most the distance between the two samples. This bounds the search.
class SampleScan {
 public:
  SampleScan(const TriangleSurface& target, const PointSearch* creases, double reach)
      : target_(target), creases_(creases), reach_(reach) {}

  /// Measures one sample.
  /// @return the distance to `target`, world units; 0 within `reach` of a crease point
  double visit(const V3d& point) {
    const double limit =
        sums_.samples == 0 ? std::numeric_limits<double>::max() : last_ + (point - at_).length();
    last_ = target_.distance(point, limit);
    at_ = point;
    ++sums_.samples;
    if (creases_ && isNear(*creases_, point, reach_)) {
      sums_.crease = std::max(sums_.crease, last_);
      ++sums_.creaseSamples;
      return 0;
    }
    sums_.smooth = std::max(sums_.smooth, last_);
    return last_;
  }
  [[nodiscard]] const DifferenceSums& sums() const { return sums_; }

 private:
  const TriangleSurface& target_;
  const PointSearch* creases_;
  double reach_;
  V3d at_{0};
  double last_ = 0;
  DifferenceSums sums_;
};

/// Divides a triangle into parts with sides of at most `spacing`, world units, and measures the
/// distances from their midpoints to the target of `scan`. Sides have at most kMaxParts parts.
/// @return the largest of these distances, without those near creases
double visitMiddles(const V3d& a, const V3d& b, const V3d& c, double spacing, SampleScan& scan) {
  const double longest =
      std::sqrt(std::max({(b - a).length2(), (c - b).length2(), (a - c).length2()}));
  const int parts = static_cast<int>(std::clamp(std::ceil(longest / spacing), 1.0, kMaxParts));
  const V3d u = (b - a) / parts, v = (c - a) / parts;
  double largest = 0;
  for (int i = 0; i < parts; ++i)
    for (int j = 0; i + j < parts; ++j) {
      largest = std::max(largest, scan.visit(a + u * (i + 1 / 3.0) + v * (j + 1 / 3.0)));
      if (i + j + 1 < parts)
        largest = std::max(largest, scan.visit(a + u * (i + 2 / 3.0) + v * (j + 2 / 3.0)));
    }
  return largest;
}

/// Calls work(i, scan) for each i below `count`, in parallel, and combines the results.
/// @param fresh  scan without samples, copied for each task
template <typename Work>
DifferenceSums scanAll(std::size_t count, const SampleScan& fresh, const Progress& progress,
                       const Work& work) {
  const std::size_t chunks = (count + kDifferenceChunk - 1) / kDifferenceChunk;
  std::vector<DifferenceSums> parts(chunks);
  ProgressGate gate(progress, std::max<std::size_t>(1, chunks));
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
    SampleScan scan = fresh;
    const std::size_t end = std::min(count, (chunk + 1) * kDifferenceChunk);
    for (std::size_t i = chunk * kDifferenceChunk; i < end; ++i) work(i, scan);
    parts[chunk] = scan.sums();
    gate.advance(1);
  });
  DifferenceSums sums;
  for (const DifferenceSums& part : parts) sums.add(part);
  return sums;
}

/// Returns the indices of the triangles whose distance is positive and at least 0.75 times
/// `largest`. If these are more than 4,096, returns the 4,096 with the largest distances.
std::vector<std::uint32_t> farthest(const std::vector<float>& distances, double largest) {
  constexpr double kLargePart = 0.75;
  constexpr std::size_t kMaxCount = 4096;
  std::vector<std::uint32_t> numbers;
  for (std::size_t i = 0; i < distances.size(); ++i)
    if (distances[i] > 0 && distances[i] >= kLargePart * largest)
      numbers.push_back(static_cast<std::uint32_t>(i));
  if (numbers.size() > kMaxCount) {
    std::nth_element(numbers.begin(), numbers.begin() + kMaxCount, numbers.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                       return distances[a] > distances[b] ||
                              (distances[a] == distances[b] && a < b);
                     });
    numbers.resize(kMaxCount);
    std::sort(numbers.begin(), numbers.end());
  }
  return numbers;
}

/// Measures the distances from `surface` to `target`: everywhere at the requested spacing, and with
/// a quarter of it where distances are largest. The error of the largest distance is then about one
/// percent.
DifferenceSums differenceTo(const TriangleSurface& target, const TriangleSurface& surface,
                            const PointSearch* creases, const SurfaceDifferenceOptions& options,
                            const Progress& progress) {
  constexpr double kDenser = 4;
  const TriMesh& mesh = surface.mesh();
  const SampleScan fresh(target, creases, options.creaseRadius);
  std::vector<float> atVertices(mesh.positions.size()), ofTriangles(mesh.triangles.size());
  DifferenceSums sums = scanAll(mesh.positions.size(), fresh, subProgress(progress, 0, 0.3),
                                [&](std::size_t i, SampleScan& scan) {
                                  atVertices[i] = static_cast<float>(scan.visit(mesh.positions[i]));
                                });
  const auto visit = [&](std::size_t i, double spacing, SampleScan& scan) {
    const auto& [a, b, c] = mesh.triangles[i];
    return visitMiddles(mesh.positions[a], mesh.positions[b], mesh.positions[c], spacing, scan);
  };
  sums.add(scanAll(mesh.triangles.size(), fresh, subProgress(progress, 0.3, 0.9),
                   [&](std::size_t i, SampleScan& scan) {
                     const auto& [a, b, c] = mesh.triangles[i];
                     ofTriangles[i] = std::max({static_cast<float>(visit(i, options.spacing, scan)),
                                                atVertices[a], atVertices[b], atVertices[c]});
                   }));
  const std::vector<std::uint32_t> dense = farthest(ofTriangles, sums.smooth);
  const DifferenceSums again = scanAll(
      dense.size(), fresh, subProgress(progress, 0.9, 1),
      [&](std::size_t i, SampleScan& scan) { visit(dense[i], options.spacing / kDenser, scan); });
  sums.smooth = std::max(sums.smooth, again.smooth);
  sums.crease = std::max(sums.crease, again.crease);
  return sums;
}

/// Returns the turn of the surface at each vertex, radians. It is the angle between two planes of
/// equal area whose normals scatter as much as the normals of the triangles in two rings around the
/// vertex.
std::vector<float> turnsOf(const TriMesh& mesh) {
  std::vector<V3d> normals(mesh.positions.size(), V3d(0));
  std::vector<double> areas(mesh.positions.size(), 0);
  for (const auto& t : mesh.triangles) {
    const V3d normal = (mesh.positions[t[1]] - mesh.positions[t[0]])
                           .cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
    for (const std::uint32_t corner : t) {
      normals[corner] += normal;
      areas[corner] += normal.length();
    }
  }
  std::vector<V3d> wideNormals = normals;
  std::vector<double> wideAreas = areas;
  for (const auto& t : mesh.triangles) {
    const V3d normal = normals[t[0]] + normals[t[1]] + normals[t[2]];
    const double area = areas[t[0]] + areas[t[1]] + areas[t[2]];
    for (const std::uint32_t corner : t) {
      wideNormals[corner] += normal - normals[corner];
      wideAreas[corner] += area - areas[corner];
    }
  }
  std::vector<float> turns(mesh.positions.size(), 0);
  for (std::size_t i = 0; i < turns.size(); ++i) {
    if (!(wideAreas[i] > 0)) continue;
    const double kept = std::min(1.0, wideNormals[i].length() / wideAreas[i]);
    turns[i] = static_cast<float>(2 * std::acos(kept));
  }
  return turns;
}

/// Largest turn of the surface at a vertex, radians, in each cubic cell of edge `cell`. around()
/// also reads the 26 neighbouring cells.
class TurnGrid {
 public:
  explicit TurnGrid(double cell) : cell_(cell) {}

  void add(const V3d& point, float turn) {
    float& largest = turns_[key(point, 0, 0, 0)];
    largest = std::max(largest, turn);
  }
  [[nodiscard]] float around(const V3d& point) const {
    float largest = 0;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z)
          if (const auto it = turns_.find(key(point, x, y, z)); it != turns_.end())
            largest = std::max(largest, it->second);
    return largest;
  }

 private:
  [[nodiscard]] std::uint64_t key(const V3d& point, int x, int y, int z) const {
    const auto part = [&](double along, int shift) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(along / cell_)) +
                                        shift) &
             0x1fffffu;
    };
    return part(point.x, x) << 42 | part(point.y, y) << 21 | part(point.z, z);
  }

  double cell_;
  std::unordered_map<std::uint64_t, float> turns_;
};

}  // namespace

TriangleSurface::TriangleSurface(TriMesh mesh) {
  if (mesh.isEmpty())
    throw InvalidInput("a result has no surface to measure; choose a result with a surface");
  TriangleSearch tree = makeTriangleSearch(mesh);
  data_ = std::make_shared<const Data>(Data{std::move(mesh), std::move(tree)});
}

const TriMesh& TriangleSurface::mesh() const {
  return data_->mesh;
}

double TriangleSurface::distance(const V3d& point, double limit) const {
  // Enlarges the limit slightly, in case rounding made it too small.
  const double wide = limit < 1e300 ? limit * (1 + 1e-9) + 1e-300 : limit;
  FoundItem near = data_->tree.closest(point, wide * wide);
  if (!near.isValid()) near = data_->tree.closest(point, 1e300);
  return std::sqrt(near.squared);
}

SurfaceDifference surfaceDifference(const TriangleSurface& a, const TriangleSurface& b,
                                    const SurfaceDifferenceOptions& options) {
  const PointSearch creases = makePointSearch(options.creases);
  const PointSearch* near = creases.isEmpty() ? nullptr : &creases;
  DifferenceSums sums = differenceTo(b, a, near, options, subProgress(options.progress, 0, 0.5));
  sums.add(differenceTo(a, b, near, options, subProgress(options.progress, 0.5, 1)));
  return {
      .smooth = sums.smooth,
      .crease = sums.crease,
      .creaseShare = static_cast<double>(sums.creaseSamples) / static_cast<double>(sums.samples)};
}

std::vector<V3d> findCreases(const TriMesh& fine, double fineVoxel, const TriMesh& coarse,
                             double coarseVoxel) {
  // Smallest turn of a crease. Two planes that meet at 45 degrees reach this turn at the vertices
  // beside the triangles with which the mesh cuts off their edge.
  constexpr double kMinTurn = 30 * std::numbers::pi / 180;
  // Bounds of the turn in the coarse mesh divided by that in the fine mesh. For a resolved bend the
  // ratio is 2. For an edge it is 0.7 to 1.2, depending on the position of the edge in the grid.
  constexpr float kMinTurnRatio = 0.5f, kMaxTurnRatio = 1.35f;
  const std::vector<float> fineTurns = turnsOf(fine), coarseTurns = turnsOf(coarse);
  const double cell = 2 * std::max(fineVoxel, coarseVoxel);
  TurnGrid fineGrid(cell), coarseGrid(cell);
  for (std::size_t i = 0; i < fineTurns.size(); ++i)
    if (fineTurns[i] >= kMinTurn) fineGrid.add(fine.positions[i], fineTurns[i]);
  for (std::size_t i = 0; i < coarseTurns.size(); ++i)
    if (coarseTurns[i] >= kMinTurn * kMinTurnRatio)
      coarseGrid.add(coarse.positions[i], coarseTurns[i]);
  std::vector<V3d> creases;
  for (std::size_t i = 0; i < fineTurns.size(); ++i) {
    if (!(fineTurns[i] >= kMinTurn)) continue;
    const float here = fineGrid.around(fine.positions[i]);
    const float there = coarseGrid.around(fine.positions[i]);
    if (there >= kMinTurnRatio * here && there <= kMaxTurnRatio * here)
      creases.push_back(fine.positions[i]);
  }
  return creases;
}

double flatBesideEdges(const TriMesh& mesh) {
  struct Side {
    std::uint64_t edge;
    std::uint32_t triangle;
  };
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = mesh.triangles[i][k], b = mesh.triangles[i][(k + 1) % 3];
      sides.push_back({std::min(a, b) << 32 | std::max(a, b), static_cast<std::uint32_t>(i)});
    }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.edge < b.edge || (a.edge == b.edge && a.triangle < b.triangle);
  });
  const auto areaVector = [&](std::uint32_t triangle) {
    const auto& [a, b, c] = mesh.triangles[triangle];
    const V3d& at = mesh.positions[a];
    return (mesh.positions[b] - at).cross(mesh.positions[c] - at);
  };
  double widest = 0;
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    if (sides[i].edge != sides[i + 1].edge) continue;
    const V3d a = areaVector(sides[i].triangle), b = areaVector(sides[i + 1].triangle);
    const double areas = a.length() * b.length();
    if (!(areas > 0) || a.dot(b) > areas * std::numbers::sqrt2 / 2) continue;
    const double length =
        (mesh.positions[sides[i].edge >> 32] - mesh.positions[sides[i].edge & 0xffffffffu])
            .length();
    widest = std::max(widest, std::min(a.length(), b.length()) / length);
  }
  return widest;
}

}  // namespace levelset
