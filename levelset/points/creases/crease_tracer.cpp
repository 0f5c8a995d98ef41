#include "levelset/points/creases/crease_tracer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "levelset/points/creases/meeting.h"

namespace levelset::points {
namespace {

using Imath::V3d;

// Lengths in spacings.
constexpr double kStep = 0.5;
constexpr double kLost = 2.5;          ///< distance from the samples at which a curve is lost
constexpr double kCornerReach = 0.35;  ///< distance from a corner at which a curve ends there
constexpr double kCovered = 0.8;       ///< distance of samples from a curve
constexpr double kCornerArea = 1.8;    ///< distance of samples from a corner, where some are false

double distanceToSpan(const V3d& p, const V3d& a, const V3d& b) {
  const V3d along = b - a;
  const double t = std::clamp((p - a).dot(along) / along.length2(), 0.0, 1.0);
  return (p - a - along * t).length();
}

}  // namespace

CreaseTracer::CreaseTracer(const PointSurface& divided, const std::vector<CreaseCorner>& corners,
                           const PairSamples& pair)
    : surface_(divided),
      corners_(corners),
      pair_(pair),
      search_([&] {
        std::vector<V3d> positions;
        positions.reserve(pair.samples.size());
        for (const CreaseSample& one : pair.samples) positions.push_back(one.position);
        return positions.empty() ? PointSearch() : makePointSearch(positions);
      }()),
      isCovered_(pair.samples.size(), false) {
  for (std::uint32_t c = 0; c < corners.size(); ++c) {
    const auto& own = corners[c].pieces;
    if (std::binary_search(own.begin(), own.end(), pair.pieces[0]) &&
        std::binary_search(own.begin(), own.end(), pair.pieces[1]))
      ends_.push_back(c);
  }
}

double CreaseTracer::spacingAt(const V3d& position) const {
  return pair_.samples[search_.closest(position, INFINITY).index].spacing;
}

double CreaseTracer::cornerDistance(const V3d& position) const {
  double least = INFINITY;
  for (const std::uint32_t c : ends_)
    least = std::min(least, (corners_[c].position - position).length());
  return least;
}

/// Takes a step along the curve. A shorter one follows a bend, and a longer one leaves a place
/// where the blended surfaces jump.
std::optional<CreaseTracer::Place> CreaseTracer::next(const Place& from, double spacing) const {
  for (const double length : {kStep, kStep / 2, kStep / 4, 1.5 * kStep, 2 * kStep}) {
    const double step = length * spacing;
    const auto at = meet(surface_, pair_.pieces, from.normals, from.position + from.tangent * step,
                         spacing, std::max(0.7 * step, 0.3 * spacing));
    if (!at) continue;
    Place place{at->position, {at->normals[0], at->normals[1]}, V3d(0)};
    place.tangent = place.normals[0].cross(place.normals[1]).normalized();
    if (place.tangent.dot(from.tangent) < 0) place.tangent = -place.tangent;
    const V3d along = place.position - from.position;
    if (place.tangent.dot(from.tangent) > 0.5 && along.dot(from.tangent) > 0.3 * step) return place;
  }
  return std::nullopt;
}

/// Returns the corner that a step passes, or kNoPiece.
std::uint32_t CreaseTracer::cornerBetween(const V3d& from, const V3d& to, double spacing) const {
  std::uint32_t best = kNoPiece;
  double least = kCornerReach * spacing;
  for (const std::uint32_t c : ends_) {
    const double distance = distanceToSpan(corners_[c].position, from, to);
    if (!(distance < least)) continue;
    least = distance;
    best = c;
  }
  return best;
}

CreaseTracer::Walk CreaseTracer::walk(const Place& seed) const {
  Walk walk;
  walk.places.push_back(seed);
  // A walk takes about two steps for each spacing, where samples lie too.
  const std::size_t most = 8 * (pair_.samples.size() + 10);
  while (walk.places.size() < most) {
    const Place& last = walk.places.back();
    const FoundItem near = search_.closest(last.position, INFINITY);
    const double spacing = pair_.samples[near.index].spacing;
    if (near.squared > kLost * kLost * spacing * spacing) return walk;
    const auto place = next(last, spacing);
    if (!place) {
      // Beside a corner, the surfaces may not be continued far enough.
      walk.corner =
          cornerBetween(last.position, last.position + last.tangent * kStep * spacing, spacing);
      if (walk.corner != kNoPiece) walk.end = End::Corner;
      return walk;
    }
    walk.corner = cornerBetween(last.position, place->position, spacing);
    if (walk.corner != kNoPiece) {
      walk.end = End::Corner;
      return walk;
    }
    constexpr std::size_t kFewest = 5;
    if (walk.places.size() >= kFewest && place->tangent.dot(seed.tangent) > 0.5 &&
        distanceToSpan(seed.position, last.position, place->position) < 0.3 * kStep * spacing) {
      walk.end = End::Closed;
      return walk;
    }
    walk.places.push_back(*place);
  }
  return walk;
}

/// Ends a walk at a corner.
void CreaseTracer::endAt(std::uint32_t corner, std::vector<Place>& places) const {
  Place end = places.back();
  end.position = corners_[corner].position;
  for (std::size_t k = 0; k < 2; ++k)
    if (const auto foot = surface_.project(end.position, end.normals[k], pair_.pieces[k]))
      end.normals[k] = foot->normal;
  const double spacing = spacingAt(end.position);
  if (places.size() > 1 && (places.back().position - end.position).length() < 0.3 * kStep * spacing)
    places.pop_back();
  places.push_back(end);
}

/// Follows the curve through a sample both ways; empty if it is lost.
std::optional<CreaseCurve> CreaseTracer::curveFrom(std::uint32_t sample) const {
  const CreaseSample& from = pair_.samples[sample];
  Place seed{from.position, from.normals, from.normals[0].cross(from.normals[1]).normalized()};
  if (cornerDistance(seed.position) < kCornerReach * from.spacing) return std::nullopt;
  CreaseCurve curve;
  curve.pieces = pair_.pieces;
  Walk forward = walk(seed);
  std::vector<Place> places;
  if (forward.end == End::Lost) {
    Place back = seed;
    back.tangent = -seed.tangent;
    forward = walk(back);
    if (forward.end != End::Closed) return std::nullopt;
  }
  if (forward.end == End::Closed) {
    const double left = (forward.places.back().position - seed.position).length();
    if (left < 0.3 * kStep * from.spacing) forward.places.pop_back();
    places = std::move(forward.places);
  } else {
    seed.tangent = -seed.tangent;
    Walk backward = walk(seed);
    if (backward.end != End::Corner) return std::nullopt;
    endAt(backward.corner, backward.places);
    endAt(forward.corner, forward.places);
    places.assign(backward.places.rbegin(), backward.places.rend());
    places.pop_back();  // the seed is the first place of both
    places.insert(places.end(), forward.places.begin(), forward.places.end());
    curve.corners = {backward.corner, forward.corner};
  }
  for (const Place& place : places) {
    curve.positions.push_back(place.position);
    curve.normals.push_back(place.normals);
  }
  return curve;
}

/// Puts the piece on the left of the curve first.
CreaseTracer::Sides CreaseTracer::orient(CreaseCurve& curve) const {
  std::array<double, 2> sums{}, sizes{};
  const std::size_t n = curve.positions.size();
  const std::size_t step = std::max<std::size_t>(1, n / 64);
  for (std::size_t i = 0; i < n; i += step) {
    const std::size_t before = i > 0              ? i - 1
                               : curve.isClosed() ? n - 1
                                                  : 0,
                      after = i + 1 < n          ? i + 1
                              : curve.isClosed() ? 0
                                                 : n - 1;
    const V3d along = (curve.positions[after] - curve.positions[before]).normalized();
    for (std::size_t k = 0; k < 2; ++k) {
      const V3d& p = curve.positions[i];
      const std::uint32_t near = surface_.nearest(p, curve.normals[i][k], curve.pieces[k]);
      if (near == kNoPiece) continue;
      const V3d left = curve.normals[i][k].cross(along);
      const auto add = [&](std::uint32_t j) {
        const double offset = (surface_.positions()[j] - p).dot(left) / surface_.spacing(j);
        sums[k] += offset;
        sizes[k] += std::abs(offset);
      };
      add(near);
      for (const std::uint32_t j : surface_.graph().neighbours(near)) add(j);
    }
  }
  constexpr double kClear = 0.4;
  for (std::size_t k = 0; k < 2; ++k)
    if (!(std::abs(sums[k]) > kClear * sizes[k])) return Sides::Unclear;
  if ((sums[0] > 0) == (sums[1] > 0)) return Sides::Opposed;
  if (sums[0] > 0) return Sides::Agreed;
  std::swap(curve.pieces[0], curve.pieces[1]);
  for (auto& normals : curve.normals) std::swap(normals[0], normals[1]);
  return Sides::Agreed;
}

void CreaseTracer::cover(const CreaseCurve& curve) {
  const PointSearch near = makePointSearch(curve.positions);
  const std::size_t n = curve.positions.size();
  for (std::size_t s = 0; s < isCovered_.size(); ++s) {
    const V3d& position = pair_.samples[s].position;
    const std::size_t at = near.closest(position, INFINITY).index;
    const double reach = kCovered * pair_.samples[s].spacing;
    const auto isBeside = [&](std::size_t other) {
      return distanceToSpan(position, curve.positions[at], curve.positions[other]) < reach;
    };
    if (isBeside(at > 0 || !curve.isClosed() ? (at > 0 ? at - 1 : at + 1) : n - 1) ||
        isBeside(at + 1 < n         ? at + 1
                 : curve.isClosed() ? 0
                                    : at - 1))
      isCovered_[s] = true;
  }
}

bool CreaseTracer::trace(std::vector<CreaseCurve>& curves) {
  std::size_t lost = 0;
  // Samples beside a corner come last: some are false, and a short curve may have no others.
  for (const bool isBesideCorner : {false, true})
    for (std::uint32_t s = 0; s < isCovered_.size(); ++s) {
      const CreaseSample& sample = pair_.samples[s];
      if (isCovered_[s] ||
          (cornerDistance(sample.position) < kCornerArea * sample.spacing) != isBesideCorner)
        continue;
      auto curve = curveFrom(s);
      const Sides sides = curve ? orient(*curve) : Sides::Unclear;
      if (sides == Sides::Unclear) {
        lost += !isBesideCorner;
        continue;
      }
      cover(*curve);
      isCovered_[s] = true;
      if (sides == Sides::Opposed)
        isOpposed_ = true;
      else
        curves.push_back(std::move(*curve));
    }
  // Single points that belong to another piece give false samples. If a curve is missing, the loops
  // of curves around a piece do not close, or its front leaves a hole.
  constexpr std::size_t kFalse = 2, kFalseShare = 10;
  return lost <= std::max(kFalse, isCovered_.size() / kFalseShare);
}

}  // namespace levelset::points
