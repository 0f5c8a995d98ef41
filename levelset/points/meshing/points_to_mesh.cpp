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
#include "levelset/memory/memory_limit.h"
#include "levelset/points/meshing/part_front.h"
#include "levelset/points/meshing/sharp_fronts.h"
#include "levelset/points/projection/delaunay.h"
#include "levelset/points/projection/point_surface.h"

namespace levelset {
namespace {

using Imath::V3d;
using points::PartMesh;
using points::PointSurface;
using points::SharpFronts;
using points::SharpSurface;
using points::SurfacePart;
using Clock = std::chrono::steady_clock;

/// Longest edges by default, median spacings.
constexpr double kLongestSpacings = 8;
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

/// Counts the sharp edges of the parts that keep them.
void measureSharpEdges(const PointSurface& surface, const SharpSurface& sharp,
                       const std::vector<char>& isSharp, double angle, double scale,
                       PointsToMeshReport& report) {
  std::vector<bool> isRounded;
  for (const char one : isSharp) isRounded.push_back(one == 0);
  report.roundedPairs = points::countRoundedPairs(surface, sharp.pieces, angle, isRounded);
  if (!sharp.divided) return;
  const auto keeps = [&](std::uint32_t piece) { return isSharp[sharp.pieces.parts[piece]] != 0; };
  for (std::uint32_t i = 0; i < sharp.pieces.count; ++i) report.pieces += keeps(i);
  std::set<std::uint32_t> corners;
  for (const points::CreaseCurve& curve : sharp.network.curves) {
    if (!keeps(curve.pieces[0])) continue;
    ++report.sharpCurves;
    for (const std::uint32_t c : curve.corners)
      if (c != PointSurface::kNone) corners.insert(c);
    for (std::size_t i = curve.isClosed() ? 0 : 1; i < curve.positions.size(); ++i) {
      const std::size_t before = i > 0 ? i - 1 : curve.positions.size() - 1;
      report.sharpLength += (curve.positions[i] - curve.positions[before]).length() / scale;
    }
  }
  report.sharpCorners = corners.size();
}

void requireOptions(const PointsToMeshOptions& options) {
  if (!(options.angle > 0 && options.angle <= 1))
    throw UsageError(fmt::format(
        "the angle between normals is {} radians; give an angle above 0 and up to 1 radian",
        options.angle));
  if (!(options.edgeLength >= 0) || !std::isfinite(options.edgeLength))
    throw UsageError(
        fmt::format("the edge length {} is not positive; give a positive one", options.edgeLength));
  constexpr double kLeastSharp = std::numbers::pi / 18, kMostSharp = std::numbers::pi / 2;
  constexpr double kRounding = 1e-9;  // degrees come as radians
  if (options.sharpAngle != 0 && !(options.sharpAngle >= kLeastSharp - kRounding &&
                                   options.sharpAngle <= kMostSharp + kRounding))
    throw UsageError(
        fmt::format("an angle of {} radians between sharp faces is outside the range from 0.175 to "
                    "1.571 (10 to 90 "
                    "degrees)",
                    options.sharpAngle));
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
  // Sharp edges need a second set of polynomials.
  const double kBytesPerPoint = options.sharpAngle > 0 ? 3600 : 1800;
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
  const points::PointEdgeLimits limits{longest, options.angle};
  const std::vector<double> lengths = lengthsAtPoints(surface, surface.graph(), limits);
  const std::vector<SurfacePart> parts = partsOf(surface, lengths);
  std::optional<SharpSurface> sharp;
  std::optional<SharpFronts> sharpFronts;
  if (options.sharpAngle > 0)
    sharp = points::divideSurface(surface, {.angle = options.sharpAngle,
                                            .smoothing = options.smoothing,
                                            .hasSides = !cloud.normals.empty(),
                                            .maxMemory = memoryLimit(options.maxMemory),
                                            .progress = subProgress(options.progress, 0.6, 0.7)});
  if (sharp && sharp->divided) sharpFronts.emplace(surface, *sharp, limits);
  double triangles = sharpFronts ? sharpFronts->expectedTriangles() : 0;
  for (const SurfacePart& part : parts) triangles += part.expected;
  constexpr double kBytesPerTriangle = 400, kSmallestScale = 0.6;
  triangles /= kSmallestScale * kSmallestScale;
  withContext(
      fmt::format("a mesh of about {:.2g} triangles; raise the edge length", triangles), [&] {
        requireMemory(
            kBytesPerPoint * static_cast<double>(cloud.size()) + kBytesPerTriangle * triangles,
            memoryLimit(options.maxMemory));
      });
  const points::BorderPoints borders(surface);

  // === Fronts
  std::vector<PartMesh> meshes(parts.size());
  std::vector<char> isSharp(parts.size(), 0);
  std::mutex mutex;
  double least = 0.7;
  const auto progressOf = [&](double share) -> Progress {
    if (!options.progress) return {};
    return [&, share](double fraction) {
      const std::lock_guard lock(mutex);
      least = std::max(least, 0.7 + 0.25 * share * fraction);
      return options.progress(least);
    };
  };
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
    const double share =
        static_cast<double>(parts[i].points.size()) / static_cast<double>(surface.size());
    const auto number = static_cast<std::uint32_t>(i);
    if (sharpFronts && sharpFronts->isDivided(number)) {
      meshes[i] = sharpFronts->mesh(number, progressOf(share));
      isSharp[i] = meshes[i].isComplete();
      if (isSharp[i]) return;
    }
    meshes[i] = meshPart(surface, borders, parts[i], lengths, number, progressOf(share));
  });

  // === Result
  PointsToMeshResult result;
  PointsToMeshReport& figures = result.report;
  figures.components = parts.size();
  figures.guessed = sharp ? sharp->guessed : surface.guessedParts();
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
  if (sharp)
    measureSharpEdges(surface, *sharp, isSharp, options.sharpAngle, normalisation.scale, figures);
  figures.connectivitySeconds = surface.timing().connectivity;
  figures.reconstructionSeconds = surface.timing().reconstruction;
  figures.triangulationSeconds = std::chrono::duration<double>(Clock::now() - start).count();
  report(options.progress, 1);
  return result;
}

}  // namespace levelset
