#include "levelset/distance/surface/closest_point.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace levelset::eikonal {
namespace {

using openvdb::Vec3d;

constexpr int kMaxIterations = 12;
constexpr double kFootReach = 2;    // largest distance of the search from its start, voxels
constexpr double kLongestStep = 1;  // longest Newton step, voxels
// The iteration stops when the estimated error after a step falls below this, in voxels. The
// estimate is the cube of the step's length times the square of the curvature.
constexpr double kTolerance = 2e-5;
// Largest error along the surface after two steps with the same second derivatives, voxels. It
// changes the distance by half its square times the sum of curvature and inverse distance.
constexpr double kTangentTolerance = 1e-3;
constexpr double kLongestLastStep = 0.6;  // the iteration ends only after a shorter step, voxels
// A step that undoes more than this share of the step before is halved.
constexpr double kReversal = 0.3;
// Lower bound of the second derivative, along the surface, of half the squared distance from the
// query point. The derivative is 1 on a plane.
constexpr double kLeastCurvature = 0.1;

/// Computes two unit vectors perpendicular to a unit vector and to each other.
template <typename T>
LEVELSET_INLINE void tangents(const Triple<T>& n, Triple<T>& t1, Triple<T>& t2) {
  // [Duff17], without a branch that loses precision.
  const T sign = signOf(n.z);
  const T a = -1.0 / (sign + n.z), b = n.x * n.y * a;
  t1 = {1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x};
  t2 = {b, sign + n.y * n.y * a, -n.y};
}

template <typename T>
struct NewtonStep {
  Triple<T> along;  ///< step vector, voxels
  T length;         ///< length of the step, voxels
  T remains;        ///< estimated distance to the solution after the step, voxels
};

/// Computes one Newton step of the constrained problem. Along the normal, the step leads to φ = 0;
/// along the tangents, to the point whose distance from the query point is stationary. The normal
/// part includes the second-order term.
/// @param toFrom  vector from the current point to the query point, voxels
/// @tparam T  double, or one number for each lane
template <typename T>
LEVELSET_INLINE NewtonStep<T> newtonStep(const JetOf<T>& jet, const T& slope,
                                         const Triple<T>& toFrom) {
  const Triple<T> n = jet.gradient / slope;
  const T along = -jet.value / slope;
  const T lambda = (dot(toFrom, n) - along) / slope;
  Triple<T> t1, t2;
  tangents(n, t1, t2);
  const Triple<T> h1 = jet.hessianTimes(t1), h2 = jet.hessianTimes(t2);
  T a11 = 1.0 + lambda * dot(h1, t1), a22 = 1.0 + lambda * dot(h2, t2);
  const T a12 = lambda * dot(h1, t2);
  const T b1 = dot(toFrom, t1) - lambda * along * dot(h1, n);
  const T b2 = dot(toFrom, t2) - lambda * along * dot(h2, n);
  // If the query point lies beyond the centre of curvature, the stationary point is a maximum of
  // the distance. Increases the eigenvalues so that the step leads to a minimum.
  const T mean = (a11 + a22) / 2.0, half = (a11 - a22) / 2.0;
  const T least = mean - squareRoot(half * half + a12 * a12);
  const auto isSmall = least < kLeastCurvature;
  a11 = select(isSmall, a11 + (kLeastCurvature - least), a11);
  a22 = select(isSmall, a22 + (kLeastCurvature - least), a22);
  const T scale = 1.0 / (a11 * a22 - a12 * a12);
  NewtonStep<T> step;
  step.along =
      n * along + t1 * (scale * (a22 * b1 - a12 * b2)) + t2 * (scale * (a11 * b2 - a12 * b1));
  const T squared = dot(step.along, step.along);
  step.length = squareRoot(squared);
  const T curvature = (squareRoot(dot(h1, h1)) + squareRoot(dot(h2, h2))) / slope;
  step.remains = curvature * curvature * squared * step.length;
  const Triple<T> bent =
      step.along - n * (dot(step.along, jet.hessianTimes(step.along)) / (2.0 * slope));
  const auto isShort = step.length <= kLongestLastStep;
  step.along = {select(isShort, bent.x, step.along.x), select(isShort, bent.y, step.along.y),
                select(isShort, bent.z, step.along.z)};
  return step;
}

NewtonStep<double> newtonStep(const Jet& jet, double slope, const Vec3d& toFrom) {
  const JetOf<double> numbers{
      jet.value, tripleOf(jet.gradient), jet.xx, jet.yy, jet.zz, jet.xy, jet.xz, jet.yz};
  return newtonStep<double>(numbers, slope, tripleOf(toFrom));
}

/// State of Newton's method.
struct Iteration {
  Vec3d from, start;  ///< query point and start
  Vec3d y, last;      ///< present point, and the move that led to it
  Foot foot;          ///< result

  Iteration(const Vec3d& query, const Vec3d& first)
      : from(query),
        start(first),
        y(first),
        last(0),
        foot{first, (query - first).length(), false, false} {}

  /// Makes a step. Returns true if the search goes on.
  bool advance(double slope, const Vec3d& along, double length, double remains) {
    if (!(slope > 0) || !std::isfinite(length)) return false;
    Vec3d move = length > kLongestStep ? along * (kLongestStep / length) : along;
    // The second derivatives jump between cells, so that full steps can cycle around the solution.
    if (move.dot(last) < -kReversal * last.lengthSqr()) move *= 0.5;
    y += move;
    last = move;
    if ((y - start).lengthSqr() > kFootReach * kFootReach) {
      foot = Foot{y, foot.distance, false, true};
      return false;
    }
    if (length <= kLongestLastStep && remains < kTolerance) {
      foot = Foot{y, (from - y).length(), true, false};
      return false;
    }
    return true;
  }
};

/// One Newton step for each lane.
struct LaneSteps {
  DoubleLanes slope;
  NewtonStep<DoubleLanes> step;
};

/// Computes a Newton step for each lane.
LEVELSET_AVX2_CLONE
void stepsFrom(const JetOf<DoubleLanes>& jets, const Triple<DoubleLanes>& toFrom,
               LaneSteps& result) {
  result.slope = squareRoot(dot(jets.gradient, jets.gradient));
  result.step = newtonStep<DoubleLanes>(jets, result.slope, toFrom);
}

/// A search of closestPointsByTwoSteps() for each lane, and its state.
struct SearchLanes {
  std::array<const JetSearch*, kLanes> searches;
  DoubleLanes slope, length, remains;  ///< of the last step
  Triple<DoubleLanes> point;           ///< present point
  DoubleLanes distance;                ///< from the query point to the present point
};

/// Reads a vector of each search.
LEVELSET_INLINE Triple<DoubleLanes> gather(const SearchLanes& lanes, Vec3d JetSearch::*member) {
  const auto at = [&](std::size_t lane) -> const Vec3d& { return lanes.searches[lane]->*member; };
  return {DoubleLanes{at(0).x(), at(1).x(), at(2).x(), at(3).x()},
          DoubleLanes{at(0).y(), at(1).y(), at(2).y(), at(3).y()},
          DoubleLanes{at(0).z(), at(1).z(), at(2).z(), at(3).z()}};
}

/// Reads the derivatives of each search.
LEVELSET_INLINE JetOf<DoubleLanes> gatherJets(const SearchLanes& lanes) {
  constexpr int kFirst[] = {0, 4, 6};
  FloatLanes groups[3][kLanes];
  for (int group = 0; group < 3; ++group) {
    for (int lane = 0; lane < kLanes; ++lane)
      std::memcpy(
          &groups[group][lane],
          lanes.searches[static_cast<std::size_t>(lane)]->jet->numbers.data() + kFirst[group],
          sizeof(FloatLanes));
    transpose(groups[group]);
  }
  const auto& [first, second, third] = groups;
  return {toDouble(first[0]),  {toDouble(first[1]), toDouble(first[2]), toDouble(first[3])},
          toDouble(second[0]), toDouble(second[1]),
          toDouble(second[2]), toDouble(second[3]),
          toDouble(third[2]),  toDouble(third[3])};
}

/// Moves the present points by one Newton step.
LEVELSET_INLINE void advance(SearchLanes& lanes, const JetOf<DoubleLanes>& jets,
                             const Triple<DoubleLanes>& from) {
  lanes.slope = squareRoot(dot(jets.gradient, jets.gradient));
  const NewtonStep<DoubleLanes> step =
      newtonStep<DoubleLanes>(jets, lanes.slope, from - lanes.point);
  lanes.length = step.length;
  lanes.remains = step.remains;
  lanes.point = lanes.point + step.along;
  const Triple<DoubleLanes> toFrom = from - lanes.point;
  lanes.distance = squareRoot(dot(toFrom, toFrom));
}

LEVELSET_AVX2_CLONE
void firstSteps(SearchLanes& lanes) {
  lanes.point = gather(lanes, &JetSearch::start);
  advance(lanes, gatherJets(lanes), gather(lanes, &JetSearch::from));
}

LEVELSET_AVX2_CLONE
void secondSteps(DenseBlockCache& blocks, SearchLanes& lanes) {
  JetOf<DoubleLanes> jets = gatherJets(lanes);
  blocks.slopes(lanes.point, jets);
  advance(lanes, jets, gather(lanes, &JetSearch::from));
}

}  // namespace

Foot closestPoint(const DenseBlock& block, const Vec3d& from, const Vec3d& start) {
  Iteration search(from, start);
  for (int i = 0; i < kMaxIterations; ++i) {
    if (!DenseBlock::contains(search.y)) break;
    const Jet jet = block.jet(search.y);
    const double slope = jet.gradient.length();
    const NewtonStep<double> step = newtonStep(jet, slope, from - search.y);
    if (!search.advance(slope, vectorOf(step.along), step.length, step.remains)) break;
  }
  return search.foot;
}

void closestPoints(const DenseBlock& block, const std::vector<FootSearch>& searches,
                   std::vector<Foot>& feet) {
  std::vector<Iteration> all;
  all.reserve(searches.size());
  for (const FootSearch& search : searches) all.emplace_back(search.from, search.start);
  std::vector<Iteration*> active, next;
  for (Iteration& search : all) active.push_back(&search);
  for (int i = 0; i < kMaxIterations && !active.empty(); ++i) {
    std::erase_if(active, [](const Iteration* s) { return !DenseBlock::contains(s->y); });
    next.clear();
    for (std::size_t first = 0; first < active.size(); first += kLanes) {
      // The last search fills the lanes that are left.
      const auto searchOf = [&](int lane) {
        return active[std::min(first + static_cast<std::size_t>(lane), active.size() - 1)];
      };
      Triple<DoubleLanes> y, toFrom;
      for (int lane = 0; lane < kLanes; ++lane) {
        setLane(y, lane, searchOf(lane)->y);
        setLane(toFrom, lane, searchOf(lane)->from - searchOf(lane)->y);
      }
      JetOf<DoubleLanes> jets;
      block.jets(y, jets);
      LaneSteps steps;
      stepsFrom(jets, toFrom, steps);
      for (int lane = 0; first + static_cast<std::size_t>(lane) < active.size() && lane < kLanes;
           ++lane)
        if (searchOf(lane)->advance(steps.slope[lane], vectorOf(steps.step.along, lane),
                                    steps.step.length[lane], steps.step.remains[lane]))
          next.push_back(searchOf(lane));
    }
    active.swap(next);
  }
  feet.clear();
  for (const Iteration& search : all) feet.push_back(search.foot);
}

Foot closestPointByOneStep(const Jet& jet, const Vec3d& from, const Vec3d& start, double longest) {
  const double slope = jet.gradient.length();
  if (!(slope > 0)) return {};
  const NewtonStep<double> step = newtonStep(jet, slope, from - start);
  if (!(step.length <= longest)) return {};
  const Vec3d point = start + vectorOf(step.along);
  return {point, (from - point).length(), true, false};
}

void closestPointsByTwoSteps(DenseBlockCache& blocks, const std::vector<JetSearch>& searches,
                             std::vector<Foot>& feet) {
  // Search after its first step.
  struct Second {
    std::size_t number;
    Vec3d point;
    double length;  // of the first step
  };
  std::vector<Second> seconds;
  seconds.reserve(searches.size());
  feet.assign(searches.size(), Foot());
  SearchLanes lanes;
  for (std::size_t first = 0; first < searches.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, searches.size() - first);
    // The last search fills the lanes that are left.
    for (std::size_t i = 0; i < kLanes; ++i)
      lanes.searches[i] = &searches[first + std::min(i, count - 1)];
    firstSteps(lanes);
    for (std::size_t i = 0; i < count; ++i) {
      const auto lane = static_cast<int>(i);
      if (!(lanes.slope[lane] > 0) || !(lanes.length[lane] <= kLongestLastStep)) continue;
      const Vec3d point = vectorOf(lanes.point, lane);
      if (lanes.remains[lane] < kTolerance)
        feet[first + i] = Foot{point, lanes.distance[lane], true, false};
      else
        seconds.push_back({first + i, point, lanes.length[lane]});
    }
  }
  for (std::size_t first = 0; first < seconds.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, seconds.size() - first);
    for (std::size_t i = 0; i < kLanes; ++i) {
      const Second& second = seconds[first + std::min(i, count - 1)];
      lanes.searches[i] = &searches[second.number];
      setLane(lanes.point, static_cast<int>(i), second.point);
    }
    secondSteps(blocks, lanes);
    for (std::size_t i = 0; i < count; ++i) {
      const Second& second = seconds[first + i];
      const auto lane = static_cast<int>(i);
      const double length = lanes.length[lane];
      // Both steps use the same second derivatives, so the error decreases by the same factor each.
      const double remains = length * length / second.length;
      if (lanes.slope[lane] > 0 && length < second.length && remains < kTangentTolerance)
        feet[second.number] = Foot{vectorOf(lanes.point, lane), lanes.distance[lane], true, false};
    }
  }
}

bool changesSignAround(const DenseBlock& block, const Vec3d& point) {
  // A curved surface can bulge this far, in voxels, through the face of a cell before a corner
  // changes sign.
  constexpr double kBulge = 0.25;
  const DoubleLanes p = {point.x(), point.y(), point.z(), 0};
  const IntLanes low = floorOf(p - kBulge), high = floorOf(p + kBulge) + 1;
  return block.changesSign({low[0], low[1], low[2]}, {high[0], high[1], high[2]});
}

}  // namespace levelset::eikonal
