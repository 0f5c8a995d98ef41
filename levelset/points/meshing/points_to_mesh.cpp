#include "levelset/points/meshing/points_to_mesh.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <queue>
#include <set>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/memory_limit.h"
#include "levelset/meshing/front/advancing_front.h"
#include "levelset/meshing/front/edge_lengths.h"
#include "levelset/points/projection/delaunay.h"
#include "levelset/points/projection/point_surface.h"

namespace levelset {
namespace {

using Imath::V3d;
using points::PointSurface;
using Clock = std::chrono::steady_clock;

/// Longest edges by default, median spacings.
constexpr double kLongestSpacings = 8;
/// Scale of the edge lengths, and number of the start. Each is a try of a part whose front failed.
struct FrontTry {
  double scale;
  std::size_t start;
};
constexpr FrontTry kFrontTries[] = {{1, 0},   {1, 2},   {1, 5},   {0.9, 0},
                                    {0.9, 3}, {0.8, 1}, {0.7, 4}, {0.6, 0}};
/// Positions nearer to a border than this lie on it, edge lengths. Avoids thin strips there.
constexpr double kBorderSnap = 0.4;

/// Moves positions to coordinates of magnitude one. Powers of two keep the bits of the digits.
struct Normalisation {
  V3d centre;
  double scale;  ///< new units per world unit

  explicit Normalisation(const PointCloud& cloud) {
    const Imath::Box3d box = bounds(cloud);
    centre = box.min + (box.max - box.min) * 0.5;
    int exponent = 0;
    std::frexp((box.max - box.min).length(), &exponent);
    scale = std::ldexp(1.0, -std::clamp(exponent, -1000, 1000));
  }
  [[nodiscard]] V3d to(const V3d& world) const { return (world - centre) * scale; }
  [[nodiscard]] V3d back(const V3d& p) const { return p / scale + centre; }
};

/// Edge length at each point: the chord of the angle on a circle of the largest curvature, within
/// limits. Lengths change by at most kGradation per unit of length along the graph.
std::vector<double> lengthsAtPoints(const PointSurface& surface, double longest, double angle) {
  const double chord = 2 * std::sin(angle / 2);
  std::vector<double> lengths(surface.size(), longest);
  tbb::parallel_for(std::size_t{0}, surface.size(), [&](std::size_t i) {
    if (!surface.hasFit(i)) return;
    const double curvature = surface.curvature(i);
    const double shortest = std::min(surface.spacing(i), longest);
    if (curvature > 0) lengths[i] = std::clamp(chord / curvature, shortest, longest);
    // A hole keeps its shape with about twelve edges, and none of them reaches across.
    lengths[i] = std::min(lengths[i], std::max(shortest, 0.5 * surface.holeRadius(i)));
  });
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (std::uint32_t i = 0; i < lengths.size(); ++i) queue.emplace(lengths[i], i);
  while (!queue.empty()) {
    const auto [length, i] = queue.top();
    queue.pop();
    if (length > lengths[i]) continue;
    for (const std::uint32_t j : surface.graph().neighbours(i)) {
      const double limit =
          length + kGradation * (surface.positions()[i] - surface.positions()[j]).length();
      if (limit >= lengths[j]) continue;
      lengths[j] = limit;
      queue.emplace(limit, j);
    }
  }
  return lengths;
}

/// Points of a border, for searches.
class BorderPoints {
 public:
  explicit BorderPoints(const PointSurface& surface) : surface_(surface) {
    for (std::uint32_t i = 0; i < surface.size(); ++i)
      if (surface.part(i) != PointSurface::kNone && surface.isBorder(i)) numbers_.push_back(i);
    std::vector<V3d> positions;
    positions.reserve(numbers_.size());
    for (const std::uint32_t i : numbers_) positions.push_back(surface.positions()[i]);
    if (!positions.empty()) search_ = makePointSearch(positions);
  }
  [[nodiscard]] bool isEmpty() const { return numbers_.empty(); }
  /// Finds the nearest position of the borders of a part, with a normal not against `side`.
  [[nodiscard]] std::optional<PointSurface::BorderEnd> nearest(const V3d& position, const V3d& side,
                                                               std::uint32_t part) const {
    constexpr std::size_t kTried = 6;
    thread_local std::vector<FoundItem> found;
    search_.closest(position, kTried, found);
    std::optional<PointSurface::BorderEnd> best;
    for (const FoundItem& one : found) {
      const std::uint32_t i = numbers_[one.index];
      if (surface_.part(i) != part || surface_.normal(i).dot(side) < 0.1) continue;
      const PointSurface::BorderEnd end = surface_.borderEnd(position, i);
      if (!best || end.distance < best->distance) best = end;
    }
    return best;
  }

 private:
  const PointSurface& surface_;
  std::vector<std::uint32_t> numbers_;
  PointSearch search_;
};

/// Points of one part.
struct SurfacePart {
  std::vector<std::uint32_t> points;
  std::vector<std::uint32_t> starts;  ///< some with large edge lengths, the largest first
  double shortest = INFINITY, longest = 0;
  double expected = 0;  ///< number of triangles
};

/// One part of the surface through points.
class PartFront : public FrontSurface {
 public:
  PartFront(const PointSurface& surface, const BorderPoints& borders,
            const std::vector<double>& lengths, std::uint32_t number, const SurfacePart& part,
            double scale)
      : surface_(surface),
        borders_(borders),
        lengths_(lengths),
        part_(number),
        longest_(part.longest),
        scale_(scale) {}

  [[nodiscard]] std::optional<Foot> project(const V3d& position) const override {
    return projectBeside(position, V3d(0));
  }
  [[nodiscard]] std::optional<Foot> projectBeside(const V3d& position,
                                                  const V3d& normal) const override {
    const auto foot = surface_.project(position, normal, part_);
    if (!foot) return {};
    const Foot found{foot->point, foot->normal, false};
    if (borders_.isEmpty()) return found;
    const auto end = borders_.nearest(foot->point, foot->normal, part_);
    const double length = scale_ * lengths_[foot->nearest];
    if (!end || !(foot->isBeyondBorder || end->distance < kBorderSnap * length)) return found;
    const auto onBorder = surface_.project(end->point, foot->normal, part_);
    if (!onBorder) return {};
    return Foot{onBorder->point, onBorder->normal, true};
  }
  [[nodiscard]] double edgeLength(const V3d& point) const override {
    const std::uint32_t nearest = surface_.nearest(point, V3d(0), part_);
    return scale_ * (nearest == PointSurface::kNone ? longest_ : lengths_[nearest]);
  }

 private:
  const PointSurface& surface_;
  const BorderPoints& borders_;
  const std::vector<double>& lengths_;
  std::uint32_t part_;
  double longest_;  ///< edge length of the part
  double scale_;
};

std::vector<SurfacePart> partsOf(const PointSurface& surface, const std::vector<double>& lengths) {
  std::vector<SurfacePart> parts(surface.partCount());
  for (std::uint32_t i = 0; i < surface.size(); ++i) {
    if (surface.part(i) == PointSurface::kNone) continue;
    SurfacePart& part = parts[surface.part(i)];
    part.points.push_back(i);
    part.shortest = std::min(part.shortest, lengths[i]);
    part.longest = std::max(part.longest, lengths[i]);
    // Areas of a hexagonal lattice and of an equilateral triangle.
    const double ratio = surface.spacing(i) / lengths[i];
    part.expected += 2 * ratio * ratio;
  }
  for (SurfacePart& part : parts) {
    constexpr std::size_t kStarts = 8;
    std::vector<std::uint32_t> large;
    for (const bool mayBeBorder : {false, true}) {
      for (const std::uint32_t i : part.points)
        if (lengths[i] >= 0.8 * part.longest && (mayBeBorder || !surface.isBorder(i)))
          large.push_back(i);
      if (!large.empty()) break;
    }
    for (std::size_t k = 0; k < kStarts; ++k)
      part.starts.push_back(large[k * large.size() / kStarts]);
  }
  return parts;
}

/// Mesh of a part, with the number of points that it misses.
struct PartMesh {
  FrontMesh front;
  std::size_t missed = 0;
  double scale = 1;  ///< factor on the edge lengths
  [[nodiscard]] bool isComplete() const { return front.isClosed && missed == 0; }
};

std::size_t countMissed(const FrontMesh& front, const PointSurface& surface,
                        const SurfacePart& part, const std::vector<double>& lengths, double scale) {
  if (front.triangles.empty()) return part.points.size();
  const PointSearch search = makePointSearch(front.positions);
  std::size_t missed = 0;
  for (const std::uint32_t i : part.points) {
    const double reach = 2 * scale * lengths[i] + surface.spacing(i);
    missed += !search.closest(surface.positions()[i], reach * reach).isValid();
  }
  return missed;
}

PartMesh meshPart(const PointSurface& surface, const BorderPoints& borders, const SurfacePart& part,
                  const std::vector<double>& lengths, std::uint32_t number,
                  const Progress& progress) {
  PartMesh best;
  best.missed = part.points.size() + 1;
  for (const auto& [scale, first] : kFrontTries) {
    const PartFront front(surface, borders, lengths, number, part, scale);
    FrontOptions options;
    options.shortest = scale * part.shortest;
    options.longest = scale * part.longest;
    options.expectedTriangles = static_cast<std::size_t>(part.expected / (scale * scale)) + 1;
    options.progress = progress;
    PartMesh found;
    found.scale = scale;
    for (std::size_t k = 0; k < part.starts.size(); ++k) {
      const std::uint32_t start = part.starts[(first + k) % part.starts.size()];
      found.front = advanceFront(front, surface.positions()[start], options);
      if (!found.front.triangles.empty()) break;
    }
    found.missed = countMissed(found.front, surface, part, lengths, scale);
    if (found.isComplete()) return found;
    if (found.missed < best.missed) best = std::move(found);
  }
  return best;
}

/// Appends the triangles of a front with the vertices that they use.
void appendFront(const FrontMesh& front, const Normalisation& normalisation, TriMesh& mesh) {
  constexpr std::uint32_t kUnused = 0xffffffffu;
  std::vector<std::uint32_t> numbers(front.positions.size(), kUnused);
  for (const auto& t : front.triangles) {
    std::array<std::uint32_t, 3> own;
    for (std::size_t i = 0; i < 3; ++i) {
      std::uint32_t& number = numbers[t[i]];
      if (number == kUnused) {
        number = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.push_back(normalisation.back(front.positions[t[i]]));
      }
      own[i] = number;
    }
    mesh.triangles.push_back(own);
  }
}

/// Counts the loops of edges with one triangle.
void measureBorders(const TriMesh& mesh, PointsToMeshReport& report) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> sides;
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) sides.insert({t[i], t[(i + 1) % 3]});
  std::multimap<std::uint32_t, std::uint32_t> next;
  for (const auto& [a, b] : sides)
    if (!sides.contains({b, a})) {
      next.insert({b, a});
      report.borderLength += (mesh.positions[a] - mesh.positions[b]).length();
    }
  while (!next.empty()) {
    ++report.borders;
    for (auto at = next.begin(); at != next.end();) {
      const std::uint32_t to = at->second;
      next.erase(at);
      at = next.find(to);
    }
  }
}

void requireOptions(const PointsToMeshOptions& options) {
  if (!(options.angle > 0 && options.angle <= 1))
    throw UsageError(fmt::format(
        "the angle between normals is {} radians; give an angle above 0 and up to 1 radian",
        options.angle));
  if (!(options.edgeLength >= 0) || !std::isfinite(options.edgeLength))
    throw UsageError(
        fmt::format("the edge length {} is not positive; give a positive one", options.edgeLength));
  if (!(options.smoothing >= 1 && options.smoothing <= 10))
    throw UsageError(fmt::format(
        "a smoothing of {} point spacings is outside the range from 1 to 10", options.smoothing));
  if (!(options.gap >= 1.5 && options.gap <= 4))
    throw UsageError(
        fmt::format("a gap of {} point spacings is outside the range from 1.5 to 4", options.gap));
}

double medianSpacing(const PointSurface& surface) {
  std::vector<double> spacings;
  for (std::size_t i = 0; i < surface.size(); ++i)
    if (surface.hasFit(i)) spacings.push_back(surface.spacing(i));
  if (spacings.empty()) return 0;
  const auto middle = spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 2);
  std::nth_element(spacings.begin(), middle, spacings.end());
  return *middle;
}

PointCloud normalised(const PointCloud& cloud, const Normalisation& normalisation) {
  PointCloud result;
  result.positions.reserve(cloud.size());
  for (const V3d& p : cloud.positions) result.positions.push_back(normalisation.to(p));
  result.normals = cloud.normals;
  return result;
}

}  // namespace

bool canMeshPoints() {
  return points::hasDelaunay();
}

PointsToMeshResult pointsToMesh(const PointCloud& cloud, const PointsToMeshOptions& options) {
  requireOptions(options);
  requirePoints(cloud);
  if (cloud.isEmpty()) throw InvalidInput("the point cloud has no points; read another file");
  constexpr double kBytesPerPoint = 1800;
  requireMemory(kBytesPerPoint * static_cast<double>(cloud.size()), memoryLimit(options.maxMemory));
  report(options.progress, 0);
  const Normalisation normalisation(cloud);
  const PointSurface surface(normalised(cloud, normalisation),
                             {.smoothing = options.smoothing,
                              .gap = options.gap,
                              .maxMemory = memoryLimit(options.maxMemory),
                              .progress = subProgress(options.progress, 0, 0.6)});
  const auto start = Clock::now();
  const double spacing = medianSpacing(surface);
  if (surface.partCount() == 0)
    throw InvalidInput(
        "the points form no surface: no six of them lie side by side; check the file, raise --gap, "
        "or use 'level-set --method particles'");
  const double longest = options.edgeLength > 0 ? options.edgeLength * normalisation.scale
                                                : kLongestSpacings * spacing;
  const std::vector<double> lengths = lengthsAtPoints(surface, longest, options.angle);
  const std::vector<SurfacePart> parts = partsOf(surface, lengths);
  double triangles = 0;
  for (const SurfacePart& part : parts) triangles += part.expected;
  constexpr double kBytesPerTriangle = 400, kSmallestScale = 0.6;
  triangles /= kSmallestScale * kSmallestScale;
  withContext(
      fmt::format("a mesh of about {:.2g} triangles; raise the edge length", triangles), [&] {
        requireMemory(
            kBytesPerPoint * static_cast<double>(cloud.size()) + kBytesPerTriangle * triangles,
            memoryLimit(options.maxMemory));
      });
  const BorderPoints borders(surface);

  // === Fronts
  std::vector<PartMesh> meshes(parts.size());
  std::mutex mutex;
  double least = 0.6;
  const auto progressOf = [&](double share) -> Progress {
    if (!options.progress) return {};
    return [&, share](double fraction) {
      const std::lock_guard lock(mutex);
      least = std::max(least, 0.6 + 0.35 * share * fraction);
      return options.progress(least);
    };
  };
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
    const double share =
        static_cast<double>(parts[i].points.size()) / static_cast<double>(surface.size());
    meshes[i] = meshPart(surface, borders, parts[i], lengths, static_cast<std::uint32_t>(i),
                         progressOf(share));
  });

  // === Result
  PointsToMeshResult result;
  PointsToMeshReport& figures = result.report;
  figures.components = parts.size();
  figures.guessed = surface.guessedParts();
  figures.spacing = spacing / normalisation.scale;
  for (std::size_t i = 0; i < surface.size(); ++i)
    figures.unusedPoints += surface.part(i) == PointSurface::kNone;
  for (const PartMesh& mesh : meshes) {
    figures.incomplete += !mesh.isComplete();
    figures.missedPoints += mesh.missed;
    figures.filled += mesh.front.filled;
    figures.smallestScale = std::min(figures.smallestScale, mesh.scale);
    appendFront(mesh.front, normalisation, result.mesh);
  }
  if (figures.incomplete > 0 && !options.acceptHoles)
    throw InvalidInput(fmt::format(
        "the mesh of {} of {} parts of the surface has holes or misses points ({} of {} points); "
        "raise --smoothing for noise, lower --edge, use 'level-set', or keep the mesh with "
        "--accept-holes",
        figures.incomplete, figures.components, figures.missedPoints, surface.size()));
  measureBorders(result.mesh, figures);
  figures.connectivitySeconds = surface.timing().connectivity;
  figures.reconstructionSeconds = surface.timing().reconstruction;
  figures.triangulationSeconds = std::chrono::duration<double>(Clock::now() - start).count();
  report(options.progress, 1);
  return result;
}

}  // namespace levelset
