#include "render/kernel/csg_traversal.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace render {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::infinity();

}  // namespace

CsgTraversal::CsgTraversal(const CsgExpression& csg, std::size_t solids,
                           std::vector<double> maxDistances)
    : csg_(csg), solids_(solids), maxDistances_(std::move(maxDistances)) {
  const std::size_t rays = maxDistances_.size();
  place_.assign(rays * solids_, kNowhere);
  passed_.assign(rays * solids_, 0);
  inside_.assign(rays * solids_, 0);
  asked_.assign(rays * solids_, 0);
  met_.assign(rays, -1);
  flipped_.assign(rays, 0);
  for (std::size_t i = 0; i < asked_.size(); ++i)
    asked_[i] = csg_.isEmpty() || csg_.uses(i % solids_) ? 1 : 0;
}

std::vector<CsgTraversal::Query> CsgTraversal::queriesFor(std::size_t solid) const {
  std::vector<Query> queries;
  for (std::size_t ray = 0; ray < maxDistances_.size(); ++ray) {
    const std::size_t i = ray * solids_ + solid;
    if (asked_[i] && met_[ray] < 0) queries.push_back({ray, passed_[i]});
  }
  return queries;
}

void CsgTraversal::answer(std::size_t solid, const Query& query, double place, bool enters) {
  const std::size_t i = query.ray * solids_ + solid;
  place_[i] = place;
  inside_[i] = enters ? 0 : 1;
  asked_[i] = 0;
}

void CsgTraversal::answerNone(std::size_t solid, const Query& query) {
  const std::size_t i = query.ray * solids_ + solid;
  place_[i] = kNowhere;
  asked_[i] = 0;
}

bool CsgTraversal::advance() {
  if (solids_ == 0) return false;  // no solid has a surface
  bool asks = false;
  for (std::size_t ray = 0; ray < maxDistances_.size(); ++ray) asks = advance(ray) || asks;
  return asks;
}

// Moves one ray to its next hit, or up to the point where it needs another crossing. Returns true
// when the ray has open queries.
bool CsgTraversal::advance(std::size_t ray) {
  if (met_[ray] >= 0) return false;
  const auto row = [&](auto& all) {
    return all.begin() + static_cast<std::ptrdiff_t>(ray * solids_);
  };
  const auto last = static_cast<std::ptrdiff_t>(solids_);
  if (std::any_of(row(asked_), row(asked_) + last, [](char a) { return a != 0; })) return true;
  const double place = *std::min_element(row(place_), row(place_) + last);
  if (place == kNowhere || place > maxDistances_[ray]) return false;
  cross(ray, place);
  return met_[ray] < 0;
}

// Crosses the surfaces of all solids at `place`, the position of the ray's nearest crossing ahead.
void CsgTraversal::cross(std::size_t ray, double place) {
  char* inside = inside_.data() + ray * solids_;
  const bool before = csg_.holds(inside);
  std::size_t first = solids_;
  for (std::size_t s = solids_; s-- > 0;) {
    const std::size_t i = ray * solids_ + s;
    if (place_[i] != place) continue;
    inside[s] = inside[s] ? 0 : 1;
    ++passed_[i];
    asked_[i] = 1;
    first = s;
  }
  const bool after = csg_.holds(inside);
  if (before == after && !csg_.isEmpty()) return;
  met_[ray] = static_cast<std::int32_t>(first);
  flipped_[ray] = !csg_.isEmpty() && (inside[first] != 0) != after ? 1 : 0;
}

}  // namespace render
