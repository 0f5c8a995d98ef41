#include "levelset/points/projection/point_surface.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>

#include "levelset/error.h"
#include "levelset/geometry/disjoint_sets.h"
#include "levelset/points/processing/normals.h"
#include "levelset/points/processing/orientation.h"
#include "levelset/points/processing/point_neighbours.h"
#include "levelset/progress_gate.h"

namespace levelset::points {
namespace {

using Imath::V3d;
using Clock = std::chrono::steady_clock;

/// Greatest condition number of the normal equations of a fit [Kalbe11: 200 to 400].
constexpr double kCondition = 300;
/// Reach of a fit, in widths of its weight, which is 1e-7 there.
constexpr double kReach = 4;
/// Turns of the local coordinate system, at most, and the angle below which it stays, radians.
constexpr int kMostTurns = 8;
constexpr double kTurnAngle = 0.05;
/// Least angle of a sector without neighbours, radians. Narrow triangles have large circles too.
constexpr double kLeastSector = 1.3;
/// Width of the weight of a polynomial in a blend, in spacings of its point.
constexpr double kBlend = 0.75;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Returns the median distance from a point to its neighbours; 0 without neighbours.
double medianDistance(std::span<const V3d> positions, const CoconeGraph& graph, std::size_t point,
                      std::vector<double>& lengths) {
  lengths.clear();
  for (const std::uint32_t other : graph.neighbours(point))
    lengths.push_back((positions[other] - positions[point]).length());
  if (lengths.empty()) return 0;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

/// Fits the height function of one point. Turns the frame until its normal is about that of the
/// fit.
template <class Fit>
HeightPolynomial fitPoint(std::uint32_t point, LocalFrame& frame, CandidateSearch& search,
                          double width, std::vector<HeightSample>& samples, const Fit& fit) {
  HeightPolynomial best;
  for (int turn = 0; turn <= kMostTurns; ++turn) {
    samples.clear();
    for (const FitCandidate& one : search.find(point, frame, kReach * width))
      samples.push_back({one.local.x, one.local.y, one.local.z,
                         std::exp(-one.local.length2() / (width * width))});
    const auto found = fit(samples, kMostDegree, kCondition);
    if (!found) return best;
    best = *found;
    const V3d local = V3d(-found->coefficients[1], -found->coefficients[2], 1).normalized();
    if (local.z >= std::cos(kTurnAngle) || turn == kMostTurns) return best;
    frame.setNormal((frame.directionToWorld(local) + frame.normal).normalized());
  }
  return best;
}

}  // namespace

PointSurface::PointSurface(const PointCloud& cloud, const PointSurfaceOptions& options) {
  auto start = Clock::now();
  PointNeighbours different(cloud.positions);
  if (different.size() < 3)
    throw InvalidInput(
        "the point cloud has fewer than 3 different positions, and a triangle needs 3; read a file "
        "with more points");
  std::vector<std::uint32_t> numbers(different.size());
  positions_.resize(different.size());
  for (std::size_t n = 0; n < different.size(); ++n) {
    numbers[n] = different.at(n);
    positions_[n] = different.positionAt(n);
  }
  search_ = std::move(different).takeSearch();
  report(options.progress, 0.02);
  // The largest disc without points, and a little more. Farther off, no polynomial is of use.
  constexpr double kMostReach = 3;
  reach_ = std::min(options.gap + 0.5, kMostReach);
  graph_ = coconeGraph(positions_, options.maxMemory, subProgress(options.progress, 0.02, 0.15));
  computeSpacings();
  timing_.connectivity = secondsSince(start);
  report(options.progress, 0.2);
  start = Clock::now();
  fitPoints(options.smoothing, {}, fitHeights, subProgress(options.progress, 0.2, 0.8));
  pruneGraph(options.gap);
  findParts();
  orient(cloud, numbers, subProgress(options.progress, 0.8, 0.95));
  findBorders(options.gap);
  timing_.reconstruction = secondsSince(start);
  report(options.progress, 1);
}

void PointSurface::computeSpacings() {
  frames_.resize(positions_.size());
  std::vector<double> medians(positions_.size());
  const auto forEach = [&](const auto& work) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, positions_.size(), 4096),
                      [&](const auto& range) {
                        std::vector<double> lengths;
                        for (std::size_t i = range.begin(); i < range.end(); ++i) work(i, lengths);
                      });
  };
  forEach([&](std::size_t i, std::vector<double>& lengths) {
    medians[i] = medianDistance(positions_, graph_, i, lengths);
  });
  forEach([&](std::size_t i, std::vector<double>&) {
    double sum = medians[i], count = 1;
    for (const std::uint32_t other : graph_.neighbours(i)) {
      sum += medians[other];
      ++count;
    }
    frames_[i].origin = positions_[i];
    frames_[i].scale = sum > 0 ? count / sum : 0;
    frames_[i].setNormal(graph_.normals[i]);
  });
}

/// @param isLeftOut  points that keep their fits; empty: none
/// @param fit        fitHeights() or fitHeightsByPrediction()
template <class Fit>
void PointSurface::fitPoints(double smoothing, const std::vector<bool>& isLeftOut, const Fit& fit,
                             const Progress& progress) {
  fits_.resize(positions_.size());
  ProgressGate gate(progress, positions_.size());
  struct Scratch {
    CandidateSearch search;
    std::vector<HeightSample> samples;
  };
  tbb::enumerable_thread_specific<Scratch> scratches([&] {
    return Scratch{CandidateSearch(positions_, graph_), {}};
  });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, positions_.size(), 256),
                    [&](const auto& range) {
                      Scratch& scratch = scratches.local();
                      for (std::size_t i = range.begin(); i < range.end(); ++i)
                        if (frames_[i].scale > 0 && (isLeftOut.empty() || !isLeftOut[i]))
                          fits_[i] = fitPoint(static_cast<std::uint32_t>(i), frames_[i],
                                              scratch.search, smoothing, scratch.samples, fit);
                      gate.advance(range.size());
                    });
}

void PointSurface::divide(std::span<const std::uint32_t> pieces, std::size_t count,
                          std::span<const V3d> normals, double smoothing,
                          const Progress& progress) {
  std::vector<std::uint32_t> first(partCount_, kNone);
  std::vector<bool> isDivided(partCount_, false), isLeftOut(size(), true);
  for (std::size_t i = 0; i < size(); ++i) {
    if (parts_[i] == kNone) continue;
    if (first[parts_[i]] == kNone) first[parts_[i]] = pieces[i];
    if (first[parts_[i]] != pieces[i]) isDivided[parts_[i]] = true;
  }
  CoconeGraph cut;
  cut.normals = std::move(graph_.normals);
  cut.first.assign(size() + 1, 0);
  for (std::size_t i = 0; i < size(); ++i) {
    for (const std::uint32_t j : graph_.neighbours(i))
      if (pieces[i] == pieces[j]) cut.ends.push_back(j);
    cut.first[i + 1] = cut.ends.size();
    if (parts_[i] == kNone || !isDivided[parts_[i]]) continue;
    isLeftOut[i] = false;
    cut.normals[i] = normals[i];
    frames_[i].setNormal(normals[i]);
  }
  graph_ = std::move(cut);
  // Beyond the points, polynomials of high degree would swing with the noise.
  fitPoints(smoothing, isLeftOut, fitHeightsByPrediction, progress);
  for (std::size_t i = 0; i < size(); ++i) {
    if (isLeftOut[i]) continue;
    normals_[i] = normals[i];
    if (!hasFit(i)) continue;
    const V3d normal = normalOfFit(static_cast<std::uint32_t>(i), positions_[i]);
    normals_[i] = normal.dot(normals[i]) < 0 ? -normal : normal;
  }
  parts_.assign(pieces.begin(), pieces.end());
  partCount_ = count;
}

/// Removes the edges across gaps, and those of points without a fit.
void PointSurface::pruneGraph(double gap) {
  CoconeGraph pruned;
  pruned.normals = std::move(graph_.normals);
  pruned.first.assign(positions_.size() + 1, 0);
  pruned.ends.reserve(graph_.ends.size());
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    for (const std::uint32_t j : graph_.neighbours(i)) {
      const double longest = 2 * gap * std::max(spacing(i), spacing(j));
      if (hasFit(i) && hasFit(j) && (positions_[i] - positions_[j]).length() <= longest)
        pruned.ends.push_back(j);
    }
    pruned.first[i + 1] = pruned.ends.size();
  }
  graph_ = std::move(pruned);
}

/// Numbers the connected parts by their first point. Points of tiny parts lose their fit.
void PointSurface::findParts() {
  constexpr std::size_t kLeastPoints = 6;
  DisjointSets sets(positions_.size());
  for (std::uint32_t i = 0; i < positions_.size(); ++i)
    for (const std::uint32_t j : graph_.neighbours(i)) sets.join(i, j);
  std::vector<std::size_t> sizes(positions_.size(), 0);
  for (std::uint32_t i = 0; i < positions_.size(); ++i) ++sizes[sets.find(i)];
  std::vector<std::uint32_t> numbers(positions_.size(), kNone);
  parts_.assign(positions_.size(), kNone);
  for (std::uint32_t i = 0; i < positions_.size(); ++i) {
    const std::uint32_t root = sets.find(i);
    if (sizes[root] < kLeastPoints) {
      fits_[i] = {};
      continue;
    }
    if (numbers[root] == kNone) numbers[root] = static_cast<std::uint32_t>(partCount_++);
    parts_[i] = numbers[root];
  }
}

/// Computes the normals of the fits, outwards.
void PointSurface::orient(const PointCloud& cloud, const std::vector<std::uint32_t>& numbers,
                          const Progress& progress) {
  const std::size_t n = positions_.size();
  normals_.assign(n, V3d(0));
  for (std::size_t i = 0; i < n; ++i)
    if (hasFit(i)) normals_[i] = normalOfFit(static_cast<std::uint32_t>(i), positions_[i]);
  std::vector<signed char> side(n, 0);
  std::size_t missing = 0;
  if (!cloud.normals.empty())
    for (std::size_t i = 0; i < n; ++i) {
      const double cosine = normals_[i].dot(V3d(cloud.normals[numbers[i]]));
      side[i] = cosine > 0 ? 1 : cosine < 0 ? -1 : 0;
    }
  for (std::size_t i = 0; i < n; ++i) missing += hasFit(i) && side[i] == 0;
  if (missing > 0) {
    PointCloud own;
    own.positions = positions_;
    own.normals.resize(n);
    NeighbourGraph edges(n);
    std::vector<Neighbour> found;
    for (std::size_t i = 0; i < n; ++i) {
      own.normals[i] = Imath::V3f(normals_[i]);
      found.clear();
      for (const std::uint32_t j : graph_.neighbours(i))
        found.push_back({(positions_[j] - positions_[i]).length2(), j});
      std::sort(found.begin(), found.end(), [](const Neighbour& a, const Neighbour& b) {
        return a.squared != b.squared ? a.squared < b.squared : a.index < b.index;
      });
      edges.set(static_cast<std::uint32_t>(i), found);
    }
    const std::size_t guessed = orientNormals(own, edges, progress).guessed;
    const auto ownSide = [&](std::size_t i) -> signed char {
      return normals_[i].dot(V3d(own.normals[i])) < 0 ? -1 : 1;
    };
    // The given normals of a part decide on its side, so points without one follow them.
    std::vector<double> votes(partCount_, 0);
    for (std::size_t i = 0; i < n; ++i)
      if (side[i] != 0 && parts_[i] != kNone) votes[parts_[i]] += side[i] * ownSide(i);
    const auto undecided = static_cast<std::size_t>(std::count(votes.begin(), votes.end(), 0.0));
    guessedParts_ = std::min(guessed, undecided);
    for (std::size_t i = 0; i < n; ++i)
      if (side[i] == 0) {
        side[i] = ownSide(i);
        if (parts_[i] != kNone && votes[parts_[i]] < 0)
          side[i] = static_cast<signed char>(-side[i]);
      }
  }
  for (std::size_t i = 0; i < n; ++i)
    if (side[i] < 0) normals_[i] = -normals_[i];
  if (!cloud.normals.empty()) requireAgreement();
}

/// Refuses normals whose side changes from point to point.
void PointSurface::requireAgreement() const {
  std::size_t fitted = 0, opposed = 0;
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    if (!hasFit(i)) continue;
    V3d mean(0);
    for (const std::uint32_t j : graph_.neighbours(i)) mean += normals_[j];
    ++fitted;
    opposed += mean.dot(normals_[i]) < 0;
  }
  const double share = static_cast<double>(opposed) / static_cast<double>(std::max(fitted, 1UL));
  if (share > kOpposedLimit)
    throw InvalidInput(
        fmt::format("the normals of {:.0f} % of the points oppose those of their neighbours, so "
                    "they do not tell inside from outside; compute them with `normals`, with more "
                    "neighbours if the points are noisy, or give points without normals",
                    100 * share));
}

void PointSurface::findBorders(double gap) {
  struct Around {
    double angle;
    V3d local;
    std::uint32_t point;
  };
  sectorsFirst_.assign(positions_.size() + 1, 0);
  std::vector<Around> around;
  for (std::uint32_t i = 0; i < positions_.size(); ++i) {
    around.clear();
    for (const std::uint32_t j : graph_.neighbours(i)) {
      const V3d local = frames_[i].toLocal(positions_[j]);
      around.push_back({std::atan2(local.y, local.x), local, j});
    }
    std::sort(around.begin(), around.end(), [](const Around& a, const Around& b) {
      return a.angle != b.angle ? a.angle < b.angle : a.point < b.point;
    });
    for (std::size_t k = 0; k < around.size(); ++k) {
      const Around &from = around[k], &to = around[(k + 1) % around.size()];
      double angle = to.angle - from.angle;
      if (k + 1 == around.size()) angle += 2 * std::numbers::pi;
      const double chord = std::hypot(to.local.x - from.local.x, to.local.y - from.local.y);
      // The circle through the three points has no point inside.
      const bool isOpen = angle >= std::numbers::pi ||
                          (angle > kLeastSector && chord / (2 * std::sin(angle)) > gap);
      // Radius of a hole. None is known on the outer side of a bend.
      const double radius = angle < std::numbers::pi ? chord / (2 * std::sin(angle)) : INFINITY;
      if (isOpen) sectors_.push_back({from.point, to.point, radius * spacing(i)});
    }
    sectorsFirst_[i + 1] = static_cast<std::uint32_t>(sectors_.size());
  }
  dropLoneSectors();
}

/// Removes the sectors of points that do not belong to a border: fewer than four connected points.
void PointSurface::dropLoneSectors() {
  constexpr std::size_t kLeastPoints = 4;
  DisjointSets sets(positions_.size());
  for (std::uint32_t i = 0; i < positions_.size(); ++i)
    for (const std::uint32_t j : graph_.neighbours(i))
      if (isBorder(i) && isBorder(j)) sets.join(i, j);
  std::vector<std::size_t> sizes(positions_.size(), 0);
  for (std::uint32_t i = 0; i < positions_.size(); ++i) ++sizes[sets.find(i)];
  std::vector<Sector> kept;
  std::uint32_t begin = 0;
  for (std::uint32_t i = 0; i < positions_.size(); ++i) {
    const std::uint32_t end = sectorsFirst_[i + 1];
    if (sizes[sets.find(i)] >= kLeastPoints)
      kept.insert(kept.end(), sectors_.begin() + begin, sectors_.begin() + end);
    begin = end;
    sectorsFirst_[i + 1] = static_cast<std::uint32_t>(kept.size());
  }
  sectors_ = std::move(kept);
}

double PointSurface::curvature(std::size_t point) const {
  const LocalFrame& frame = frames_[point];
  const HeightJet jet = fits_[point].jet(0, 0);
  // Shape operator of a height function.
  const double e = 1 + jet.x * jet.x, f = jet.x * jet.y, g = 1 + jet.y * jet.y;
  const double area = e * g - f * f, root = std::sqrt(area);
  const double mean = (e * jet.yy - 2 * f * jet.xy + g * jet.xx) / (2 * area * root);
  const double gauss = (jet.xx * jet.yy - jet.xy * jet.xy) / (area * area);
  return (std::abs(mean) + std::sqrt(std::max(0.0, mean * mean - gauss))) * frame.scale;
}

double PointSurface::holeRadius(std::size_t point) const {
  double least = INFINITY;
  for (std::uint32_t s = sectorsFirst_[point]; s < sectorsFirst_[point + 1]; ++s)
    least = std::min(least, sectors_[s].radius);
  return least;
}

V3d PointSurface::normalOfFit(std::uint32_t point, const V3d& at) const {
  const LocalFrame& frame = frames_[point];
  const V3d local = frame.toLocal(at);
  const HeightJet jet = fits_[point].jet(local.x, local.y);
  return frame.directionToWorld(V3d(-jet.x, -jet.y, 1)).normalized();
}

std::uint32_t PointSurface::nearest(const V3d& position, const V3d& side,
                                    std::uint32_t part) const {
  constexpr std::size_t kTried = 24;
  constexpr double kLeastCosine = -0.3;  // below the cosine across a sharp edge
  thread_local std::vector<FoundItem> found;
  const bool isSided = side.length2() > 0;
  const FoundItem first = search_.closest(position, std::numeric_limits<double>::infinity());
  const auto fits = [&](std::uint32_t i) {
    return hasFit(i) && (part == kNone || parts_[i] == part) &&
           (!isSided || normals_[i].dot(side) > kLeastCosine);
  };
  if (first.isValid() && fits(first.index)) return first.index;
  search_.closest(position, kTried, found);
  for (const FoundItem& one : found)
    if (fits(one.index)) return one.index;
  return kNone;
}

/// Finds where a line meets the polynomial of a point.
std::optional<double> PointSurface::crossing(std::uint32_t point, const V3d& from,
                                             const V3d& direction, double start) const {
  const LocalFrame& frame = frames_[point];
  const V3d origin = frame.toLocal(from);
  const V3d along =
      V3d(direction.dot(frame.u), direction.dot(frame.v), direction.dot(frame.normal));
  double t = start * frame.scale;
  constexpr int kSteps = 12;
  constexpr double kFlat = 0.1, kExact = 1e-13;
  for (int step = 0; step < kSteps; ++step) {
    const V3d p = origin + along * t;
    const HeightJet jet = fits_[point].jet(p.x, p.y);
    const double slope = along.z - jet.x * along.x - jet.y * along.y;
    if (!(std::abs(slope) > kFlat)) return std::nullopt;
    const double change = (p.z - jet.value) / slope;
    t -= change;
    if (std::abs(change) <= kExact * (1 + std::abs(t))) return t / frame.scale;
  }
  return std::nullopt;
}

bool PointSurface::isBeyond(std::uint32_t point, const V3d& at) const {
  if (!isBorder(point)) return false;
  const V3d local = frames_[point].toLocal(at);
  const double angle = std::atan2(local.y, local.x);
  const auto turnFrom = [](double from, double to) {
    return to < from ? to - from + 2 * std::numbers::pi : to - from;
  };
  for (std::uint32_t s = sectorsFirst_[point]; s < sectorsFirst_[point + 1]; ++s) {
    const V3d from = frames_[point].toLocal(positions_[sectors_[s].from]),
              to = frames_[point].toLocal(positions_[sectors_[s].to]);
    const double start = std::atan2(from.y, from.x), end = std::atan2(to.y, to.x);
    const double width =
        sectors_[s].from == sectors_[s].to ? 2 * std::numbers::pi : turnFrom(start, end);
    if (turnFrom(start, angle) < width) return true;
  }
  return false;
}

PointSurface::BorderEnd PointSurface::borderEnd(const V3d& position,
                                                std::uint32_t borderPoint) const {
  BorderEnd best{positions_[borderPoint], normals_[borderPoint],
                 (position - positions_[borderPoint]).length()};
  const V3d& a = positions_[borderPoint];
  for (std::uint32_t s = sectorsFirst_[borderPoint]; s < sectorsFirst_[borderPoint + 1]; ++s)
    for (const std::uint32_t other : {sectors_[s].from, sectors_[s].to}) {
      const V3d along = positions_[other] - a;
      const double t = std::clamp((position - a).dot(along) / along.length2(), 0.0, 1.0);
      const V3d at = a + along * t;
      const double distance = (position - at).length();
      if (distance < best.distance) best = {at, normals_[t > 0.5 ? other : borderPoint], distance};
    }
  return best;
}

std::optional<PointSurface::Foot> PointSurface::project(const V3d& position, const V3d& side,
                                                        std::uint32_t part) const {
  std::uint32_t i = nearest(position, side, part);
  if (i == kNone) return std::nullopt;
  // Polynomials grow fast beyond the points. There the tangent plane tells the direction to a
  // border.
  const V3d local = frames_[i].toLocal(position);
  if (std::hypot(local.x, local.y) > reach_) {
    if (!isBeyond(i, position)) return std::nullopt;
    return Foot{position - normals_[i] * normals_[i].dot(position - positions_[i]), normals_[i], i,
                true};
  }
  // === Foot on the polynomial of the nearest point, along its normal there
  V3d direction = normals_[i];
  auto t = crossing(i, position, direction, (positions_[i] - position).dot(direction));
  if (!t) return std::nullopt;
  constexpr int kTurns = 2;
  for (int turn = 0; turn < kTurns; ++turn) {
    const V3d foot = position + direction * *t;
    // A position far off may have a foot beside another point.
    if (const std::uint32_t other = nearest(foot, direction, part); other != kNone) i = other;
    const V3d normal = normalOfFit(i, foot);
    const V3d next = normal.dot(normals_[i]) < 0 ? -normal : normal;
    const auto better = crossing(i, position, next, (foot - position).dot(next));
    if (!better) break;
    direction = next;
    t = better;
  }
  const V3d foot = position + direction * *t;
  // === Blend of the polynomials along the line
  double sum = 0, weights = 0;
  V3d normal(0);
  const auto add = [&](std::uint32_t j) {
    if (normals_[j].dot(direction) < 0.3) return;
    const double width = kBlend / frames_[j].scale;
    const double weight = std::exp(-(foot - positions_[j]).length2() / (width * width));
    if (!(weight > 1e-9)) return;
    const auto at = crossing(j, position, direction, *t);
    if (!at) return;
    const V3d own = normalOfFit(j, position + direction * *at);
    sum += weight * (*at - *t);
    weights += weight;
    normal += (own.dot(direction) < 0 ? -own : own) * weight;
  };
  add(i);
  for (const std::uint32_t j : graph_.neighbours(i)) add(j);
  Foot result{foot, direction, i, isBeyond(i, foot)};
  if (weights > 0) {
    result.point += direction * (sum / weights);
    result.normal = normal.normalized();
  }
  return result;
}

}  // namespace levelset::points
