#include "levelset/points/creases/pieces.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <tuple>

#include "levelset/geometry/disjoint_sets.h"

namespace levelset::points {
namespace {

using Imath::V3d;

/// Radius of the neighbourhoods that tell sharp edges, spacings. With noise it grows up to the
/// greatest one.
constexpr double kLeastRadius = 2.6, kMostRadius = 4;
/// Noise above which the radius grows, spacings.
constexpr double kQuiet = 0.05;
/// Greatest growth of the errors with the radius.
constexpr double kMostGrowth = 1.25;
/// Points of a piece, at least.
constexpr std::size_t kLeastPiece = 10;

/// Fit of the points around a point.
struct SideFit {
  V3d normal = V3d(0);      ///< outwards
  double error = INFINITY;  ///< spacings
  bool isReliable = false;
};

double weightAt(const V3d& local, double radius) {
  const double share = local.length2() / (1.44 * radius * radius);
  return share < 1 ? (1 - share) * (1 - share) : 0;
}

/// Fits a polynomial of degree 1 or 2, the one with the smaller error of prediction.
SideFit fitSide(const std::vector<HeightSample>& samples, const LocalFrame& frame) {
  SideFit best;
  for (const int degree : {1, 2}) {
    const double unknowns = degree == 1 ? 3 : 6;
    const auto count = static_cast<double>(samples.size());
    if (count < unknowns + 2) continue;
    constexpr double kSideCondition = 1e5;
    const auto fit = fitHeights(samples, degree, kSideCondition);
    if (!fit || fit->degree < degree) continue;
    double squares = 0, weights = 0;
    for (const HeightSample& s : samples) {
      const double miss = s.height - fit->value(s.x, s.y);
      squares += s.weight * miss * miss;
      weights += s.weight;
    }
    const double error = std::sqrt(squares / weights) / (1 - unknowns / count);
    if (!(error < best.error)) continue;
    best.error = error;
    best.normal =
        frame.directionToWorld(V3d(-fit->coefficients[1], -fit->coefficients[2], 1)).normalized();
  }
  return best;
}

class PieceFinder {
 public:
  PieceFinder(const PointSurface& surface, double angle, std::span<const V3d> sides)
      : surface_(surface),
        sides_(sides),
        leastCosine_(std::cos(angle)),
        mostTilt_(0.7 * std::sin(angle / 2)),
        fits_(surface.size()) {}

  Pieces find();

 private:
  struct Scratch {
    CandidateSearch search;
    std::vector<HeightSample> samples;
    std::vector<FitCandidate> around;
  };

  template <class Work>
  void forEachPoint(const Work& work);
  void fitAround(std::uint32_t point, Scratch& scratch);
  void fitOneSide(std::uint32_t point, Scratch& scratch);
  [[nodiscard]] V3d planeOfMost(const std::vector<FitCandidate>& around) const;
  void setNoise();
  [[nodiscard]] bool isSmooth(std::uint32_t i, std::uint32_t j) const;
  void joinReliable(Pieces& result) const;
  void grow(Pieces& result) const;
  void joinSmooth(Pieces& result) const;

  const PointSurface& surface_;
  std::span<const V3d> sides_;
  double leastCosine_;
  double mostTilt_;  ///< limit of isSmooth() without noise
  double radius_ = kLeastRadius, noise_ = 0;
  std::vector<SideFit> fits_;
};

template <class Work>
void PieceFinder::forEachPoint(const Work& work) {
  tbb::enumerable_thread_specific<Scratch> scratches([&] {
    return Scratch{CandidateSearch(surface_.positions(), surface_.graph()), {}, {}};
  });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, surface_.size(), 256),
                    [&](const auto& range) {
                      Scratch& scratch = scratches.local();
                      for (std::size_t i = range.begin(); i < range.end(); ++i)
                        if (surface_.part(i) != kNoPiece)
                          work(static_cast<std::uint32_t>(i), scratch);
                    });
}

void PieceFinder::fitAround(std::uint32_t point, Scratch& scratch) {
  LocalFrame frame = surface_.frame(point);
  frame.setNormal(surface_.normal(point));
  scratch.samples.clear();
  for (const FitCandidate& one : scratch.search.find(point, frame, radius_))
    scratch.samples.push_back(
        {one.local.x, one.local.y, one.local.z, weightAt(one.local, radius_)});
  fits_[point] = fitSide(scratch.samples, frame);
  if (!(fits_[point].normal.length2() > 0)) fits_[point].normal = surface_.normal(point);
}

/// Returns the normal of the plane through a point that passes near most of its neighbours, in the
/// coordinates of its frame; zero if there is none.
V3d PieceFinder::planeOfMost(const std::vector<FitCandidate>& around) const {
  constexpr std::size_t kTried = 14;  // nearest neighbours that span planes
  constexpr double kSlope = 0.1, kLeastSpread = 0.3;
  const double tolerance = 2 * noise_ + 1e-6;
  V3d best(0);
  double most = 0;
  const std::size_t tried = std::min(kTried, around.size());
  for (std::size_t j = 1; j < tried; ++j)
    for (std::size_t k = j + 1; k < tried; ++k) {
      const V3d across = around[j].local.cross(around[k].local);
      const double length = across.length();
      if (!(length > kLeastSpread * around[j].local.length() * around[k].local.length())) continue;
      const V3d normal = across / length;
      double sum = 0;
      for (const FitCandidate& one : around) {
        const double miss = std::abs(one.local.dot(normal));
        const double share = miss / (tolerance + kSlope * one.local.length());
        if (share < 1) sum += weightAt(one.local, radius_) * (1 - share * share);
      }
      if (sum <= most) continue;
      most = sum;
      best = normal;
    }
  return best;
}

/// Fits the neighbours on the side of a point, where they are fitted much better than all of them.
void PieceFinder::fitOneSide(std::uint32_t point, Scratch& scratch) {
  SideFit& all = fits_[point];
  LocalFrame frame = surface_.frame(point);
  frame.setNormal(surface_.normal(point));
  scratch.around = scratch.search.find(point, frame, radius_);
  std::sort(scratch.around.begin() + 1, scratch.around.end(),
            [](const FitCandidate& a, const FitCandidate& b) {
              const double p = a.local.length2(), q = b.local.length2();
              return p != q ? p < q : a.point < b.point;
            });
  const V3d plane = planeOfMost(scratch.around);
  if (!(plane.length2() > 0)) return;
  V3d normal = frame.directionToWorld(plane);
  if (normal.dot(sides_[point]) < 0) normal = -normal;
  constexpr double kMostSlope = 0.15, kGain = 0.4;
  constexpr std::size_t kFewest = 6;
  SideFit best;
  for (int pass = 0; pass < 2; ++pass) {
    frame.setNormal(normal);
    scratch.samples.clear();
    for (const FitCandidate& one : scratch.around) {
      const V3d local = frame.toLocal(surface_.positions()[one.point]);
      if (std::abs(local.z) <= 2 * noise_ + 1e-6 + kMostSlope * local.length())
        scratch.samples.push_back({local.x, local.y, local.z, weightAt(local, radius_)});
    }
    if (scratch.samples.size() < kFewest) return;
    best = fitSide(scratch.samples, frame);
    if (!(best.normal.dot(normal) > 0.9)) return;
    normal = best.normal;
  }
  if (!(best.error <= kGain * all.error)) return;
  all = best;
  all.isReliable = true;
}

/// Estimates the noise from the lowest tenth of the errors: most points of a solid with narrow
/// faces lie beside sharp edges.
void PieceFinder::setNoise() {
  std::vector<double> errors;
  for (std::size_t i = 0; i < surface_.size(); ++i)
    if (surface_.part(i) != kNoPiece && std::isfinite(fits_[i].error))
      errors.push_back(fits_[i].error);
  if (errors.empty()) return;
  const auto tenth = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 10);
  std::nth_element(errors.begin(), tenth, errors.end());
  constexpr double kMedian = 1.25;  // of the errors of one noise, over their tenth
  noise_ = kMedian * *tenth;
}

/// Returns true if the surface bends evenly from one point to another. Then the chord leans alike
/// to both normals. A normal that is a mean of both sides of a sharp edge does not pass.
bool PieceFinder::isSmooth(std::uint32_t i, std::uint32_t j) const {
  const SideFit &a = fits_[i], &b = fits_[j];
  if (!a.isReliable || !b.isReliable || !(a.normal.dot(b.normal) >= leastCosine_)) return false;
  const V3d along = surface_.positions()[j] - surface_.positions()[i];
  constexpr double kNoise = 5;  // the noise of both points counts for both normals
  return std::abs(along.dot(a.normal + b.normal)) <= (mostTilt_ + kNoise * noise_) * along.length();
}

void PieceFinder::joinReliable(Pieces& result) const {
  const auto n = static_cast<std::uint32_t>(surface_.size());
  DisjointSets sets(n);
  for (std::uint32_t i = 0; i < n; ++i)
    for (const std::uint32_t j : surface_.graph().neighbours(i))
      if (isSmooth(i, j)) sets.join(i, j);
  std::vector<std::size_t> sizes(n, 0);
  for (std::uint32_t i = 0; i < n; ++i) ++sizes[sets.find(i)];
  // Parts without a piece of enough points stay whole.
  std::vector<std::uint32_t> numbers(n, kNoPiece), whole(surface_.partCount(), kNoPiece);
  std::vector<bool> hasPiece(surface_.partCount(), false);
  for (std::uint32_t i = 0; i < n; ++i)
    if (surface_.part(i) != kNoPiece && sizes[sets.find(i)] >= kLeastPiece)
      hasPiece[surface_.part(i)] = true;
  result.pieces.assign(n, kNoPiece);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t part = surface_.part(i);
    if (part == kNoPiece) continue;
    std::uint32_t& number = hasPiece[part] ? numbers[sets.find(i)] : whole[part];
    if (hasPiece[part] && sizes[sets.find(i)] < kLeastPiece) continue;
    if (number == kNoPiece) {
      number = static_cast<std::uint32_t>(result.count++);
      result.parts.push_back(part);
    }
    result.pieces[i] = number;
  }
}

/// Gives the points that are left to the pieces, those first that lie nearest to the tangent plane
/// of a neighbour.
void PieceFinder::grow(Pieces& result) const {
  using Entry = std::tuple<double, std::uint32_t, std::uint32_t>;  // cost, point, neighbour
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  const auto offer = [&](std::uint32_t from) {
    for (const std::uint32_t to : surface_.graph().neighbours(from)) {
      if (result.pieces[to] != kNoPiece || surface_.part(to) == kNoPiece) continue;
      const V3d along = surface_.positions()[to] - surface_.positions()[from];
      queue.emplace(std::abs(along.dot(result.normals[from])) / surface_.spacing(to), to, from);
    }
  };
  const auto n = static_cast<std::uint32_t>(surface_.size());
  for (std::uint32_t i = 0; i < n; ++i)
    if (result.pieces[i] != kNoPiece) offer(i);
  while (!queue.empty()) {
    const auto [cost, to, from] = queue.top();
    queue.pop();
    if (result.pieces[to] != kNoPiece) continue;
    result.pieces[to] = result.pieces[from];
    if (!isSmooth(from, to)) result.normals[to] = result.normals[from];
    offer(to);
  }
}

/// Joins pieces without a sharp edge between them: noise parted them.
void PieceFinder::joinSmooth(Pieces& result) const {
  struct Pairs {
    std::size_t all = 0, sharp = 0;
  };
  std::map<std::array<std::uint32_t, 2>, Pairs> found;
  for (std::uint32_t i = 0; i < surface_.size(); ++i)
    for (const std::uint32_t j : surface_.graph().neighbours(i)) {
      const std::uint32_t a = result.pieces[i], b = result.pieces[j];
      if (a == kNoPiece || b == kNoPiece || a >= b) continue;
      Pairs& pairs = found[{a, b}];
      ++pairs.all;
      pairs.sharp += result.normals[i].dot(result.normals[j]) < leastCosine_;
    }
  std::vector<std::array<std::uint32_t, 2>> smooth;
  for (const auto& [pieces, pairs] : found)
    if (2 * pairs.sharp < pairs.all) smooth.push_back(pieces);
  result.join(smooth);
}

Pieces PieceFinder::find() {
  const auto fitAll = [&] {
    forEachPoint([&](std::uint32_t i, Scratch& scratch) { fitAround(i, scratch); });
    setNoise();
  };
  fitAll();
  if (noise_ > kQuiet) {
    const double quiet = noise_;
    radius_ = std::min(kMostRadius, kLeastRadius * std::sqrt(noise_ / kQuiet));
    fitAll();
    // Between near sharp edges, hardly any neighbourhood of this radius has none.
    if (noise_ > kMostGrowth * quiet) {
      radius_ = kLeastRadius;
      fitAll();
    }
  }
  constexpr double kPlain = 1.6, kLeastError = 0.02;
  forEachPoint([&](std::uint32_t i, Scratch& scratch) {
    if (fits_[i].error <= kPlain * noise_ + kLeastError)
      fits_[i].isReliable = true;
    else
      fitOneSide(i, scratch);
  });
  Pieces result;
  result.noise = noise_;
  result.normals.reserve(surface_.size());
  for (std::size_t i = 0; i < surface_.size(); ++i) {
    V3d normal = fits_[i].normal;
    if (normal.dot(sides_[i]) < 0) normal = -normal;
    result.normals.push_back(normal);
    result.isClear.push_back(fits_[i].isReliable);
    fits_[i].normal = normal;
  }
  result.ownNormals = result.normals;
  joinReliable(result);
  grow(result);
  joinSmooth(result);
  return result;
}

}  // namespace

void Pieces::join(const std::vector<std::array<std::uint32_t, 2>>& pairs) {
  DisjointSets sets(count);
  for (const auto& [a, b] : pairs) sets.join(a, b);
  std::vector<bool> hasPoint(count, false);
  for (const std::uint32_t piece : pieces)
    if (piece != kNoPiece) hasPoint[piece] = true;
  std::vector<std::uint32_t> numbers(count, kNoPiece), kept;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!hasPoint[i]) continue;
    const std::uint32_t root = sets.find(i);
    if (numbers[root] == kNoPiece) {
      numbers[root] = static_cast<std::uint32_t>(kept.size());
      kept.push_back(parts[i]);
    }
    numbers[i] = numbers[root];
  }
  for (std::uint32_t& piece : pieces)
    if (piece != kNoPiece) piece = numbers[piece];
  parts = std::move(kept);
  count = parts.size();
}

Pieces findPieces(const PointSurface& surface, double angle, std::span<const V3d> sides) {
  return PieceFinder(surface, angle, sides).find();
}

std::size_t reassign(const PointSurface& whole, const PointSurface& divided, Pieces& pieces) {
  constexpr double kBetter = 0.5;  // height above the new piece, share of that above the old one
  std::vector<std::uint32_t> moved = pieces.pieces;
  std::vector<V3d> normals = pieces.normals;
  tbb::parallel_for(std::size_t{0}, whole.size(), [&](std::size_t i) {
    const std::uint32_t own = pieces.pieces[i];
    const auto neighbours = whole.graph().neighbours(i);
    const auto isOther = [&](std::uint32_t j) { return pieces.pieces[j] != own; };
    if (own == kNoPiece || std::none_of(neighbours.begin(), neighbours.end(), isOther)) return;
    // Least height above the polynomials of each piece, and the point of that polynomial. Some
    // polynomials are spoilt by points of another piece.
    std::map<std::uint32_t, std::pair<double, std::uint32_t>> heights;
    for (const std::uint32_t j : neighbours) {
      if (pieces.pieces[j] == kNoPiece || !divided.hasFit(j)) continue;
      const std::pair found{std::abs(divided.heightOverFit(j, whole.positions()[i])), j};
      const auto [at, isNew] = heights.emplace(pieces.pieces[j], found);
      if (!isNew) at->second = std::min(at->second, found);
    }
    const auto at = heights.find(own);
    double least = at == heights.end() ? INFINITY : kBetter * at->second.first;
    constexpr double kExact = 1e-9;  // spacings
    if (least < kExact * whole.spacing(i)) return;
    for (const auto& [piece, found] : heights) {
      if (piece == own || !(found.first < least)) continue;
      least = found.first;
      moved[i] = piece;
      normals[i] = divided.normal(found.second);
    }
  });
  std::size_t count = 0;
  for (std::size_t i = 0; i < moved.size(); ++i) count += moved[i] != pieces.pieces[i];
  pieces.pieces = std::move(moved);
  pieces.normals = std::move(normals);
  pieces.join({});
  return count;
}

std::size_t countRoundedPairs(const PointSurface& surface, const Pieces& pieces, double angle,
                              const std::vector<bool>& isRounded) {
  const double leastCosine = std::cos(angle);
  // Some normals beside the edges that are kept are wrong.
  const auto isBesideKept = [&](std::uint32_t i) {
    const auto near = surface.graph().neighbours(i);
    return !isRounded[surface.part(i)] && std::any_of(near.begin(), near.end(), [&](auto j) {
      return pieces.pieces[j] != pieces.pieces[i];
    });
  };
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < surface.size(); ++i) {
    if (surface.part(i) == kNoPiece || !pieces.isClear[i] || isBesideKept(i)) continue;
    for (const std::uint32_t j : surface.graph().neighbours(i))
      count += i < j && pieces.isClear[j] && !isBesideKept(j) &&
               pieces.ownNormals[i].dot(pieces.ownNormals[j]) < leastCosine;
  }
  return count;
}

}  // namespace levelset::points
