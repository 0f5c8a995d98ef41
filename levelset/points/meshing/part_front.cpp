#include "levelset/points/meshing/part_front.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>
#include <utility>

#include "levelset/meshing/front/edge_lengths.h"

namespace levelset::points {
namespace {

using Imath::V3d;

/// Scale of the edge lengths, and number of the start. Each is a try of a part whose front failed.
struct FrontTry {
  double scale;
  std::size_t start;
};
constexpr FrontTry kFrontTries[] = {{1, 0},   {1, 2},   {1, 5},   {0.9, 0},
                                    {0.9, 3}, {0.8, 1}, {0.7, 4}, {0.6, 0}};
/// Positions nearer to a border than this lie on it, edge lengths. Avoids thin strips there.
constexpr double kBorderSnap = 0.4;

}  // namespace

std::vector<double> lengthsAtPoints(const PointSurface& surface, const CoconeGraph& graph,
                                    const PointEdgeLimits& limits,
                                    const std::vector<double>& caps) {
  const double chord = 2 * std::sin(limits.angle / 2), longest = limits.longest;
  std::vector<double> lengths(surface.size(), longest);
  tbb::parallel_for(std::size_t{0}, surface.size(), [&](std::size_t i) {
    if (!surface.hasFit(i)) return;
    const double curvature = surface.curvature(i);
    const double shortest = std::min(surface.spacing(i), longest);
    if (curvature > 0) lengths[i] = std::clamp(chord / curvature, shortest, longest);
    if (!caps.empty()) lengths[i] = std::min(lengths[i], std::max(shortest, caps[i]));
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
    for (const std::uint32_t j : graph.neighbours(i)) {
      const double limit =
          length + kGradation * (surface.positions()[i] - surface.positions()[j]).length();
      if (limit >= lengths[j]) continue;
      lengths[j] = limit;
      queue.emplace(limit, j);
    }
  }
  return lengths;
}

BorderPoints::BorderPoints(const PointSurface& surface) : surface_(surface) {
  for (std::uint32_t i = 0; i < surface.size(); ++i)
    if (surface.part(i) != PointSurface::kNone && surface.isBorder(i)) numbers_.push_back(i);
  std::vector<V3d> positions;
  positions.reserve(numbers_.size());
  for (const std::uint32_t i : numbers_) positions.push_back(surface.positions()[i]);
  if (!positions.empty()) search_ = makePointSearch(positions);
}

std::optional<PointSurface::BorderEnd> BorderPoints::nearest(const V3d& position, const V3d& side,
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

std::optional<FrontSurface::Foot> PartFront::projectBeside(const V3d& position,
                                                           const V3d& normal) const {
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

double PartFront::edgeLength(const V3d& point) const {
  const std::uint32_t nearest = surface_.nearest(point, V3d(0), part_);
  return scale_ * (nearest == PointSurface::kNone ? longest_ : lengths_[nearest]);
}

AdvancingFrontOptions advancingFrontOptions(const SurfacePart& part, double scale,
                                            const Progress& progress) {
  AdvancingFrontOptions options;
  options.longest = scale * part.longest;
  options.expectedTriangles = static_cast<std::size_t>(part.expected / (scale * scale)) + 1;
  options.progress = progress;
  return options;
}

std::vector<SurfacePart> partsOf(const PointSurface& surface, const std::vector<double>& lengths) {
  std::vector<SurfacePart> parts(surface.partCount());
  for (std::uint32_t i = 0; i < surface.size(); ++i) {
    if (surface.part(i) == PointSurface::kNone) continue;
    SurfacePart& part = parts[surface.part(i)];
    part.points.push_back(i);
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
    const AdvancingFrontOptions options = advancingFrontOptions(part, scale, progress);
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

}  // namespace levelset::points
