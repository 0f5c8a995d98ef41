#include "levelset/points/processing/point_neighbours.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <utility>

#include "levelset/error.h"

namespace levelset::points {
namespace {

using Imath::V3d;

bool isBefore(const V3d& a, const V3d& b) {
  if (a.x != b.x) return a.x < b.x;
  if (a.y != b.y) return a.y < b.y;
  return a.z < b.z;
}

}  // namespace

void requireNeighbours(std::int64_t neighbours) {
  if (neighbours > kMostNeighbours)
    throw UsageError(fmt::format("{} neighbours are more than the maximum of {}; give fewer",
                                 neighbours, kMostNeighbours));
}

PointNeighbours::PointNeighbours(std::span<const V3d> positions) : count_(positions.size()) {
  std::vector<PointItem> items(positions.size());
  tbb::parallel_for(std::size_t{0}, positions.size(), [&](std::size_t i) {
    items[i] = {positions[i], static_cast<std::uint32_t>(i)};
  });
  tbb::parallel_sort(items.begin(), items.end(), [](const PointItem& a, const PointItem& b) {
    if (isBefore(a.position, b.position)) return true;
    return !isBefore(b.position, a.position) && a.index < b.index;
  });
  const auto isEqual = [](const PointItem& a, const PointItem& b) {
    return a.position == b.position;
  };
  if (std::adjacent_find(items.begin(), items.end(), isEqual) != items.end()) {
    first_.resize(count_);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < items.size(); ++i) {
      if (i == 0 || !isEqual(items[i], items[kept - 1])) items[kept++] = items[i];
      first_[items[i].index] = items[kept - 1].index;
    }
    items.resize(kept);
    items.shrink_to_fit();
  }
  tree_ = PointSearch(std::move(items));
}

double PointNeighbours::bytesFor(std::size_t points) {
  return static_cast<double>(points) * (PointSearch::bytesPerItem() + sizeof(std::uint32_t));
}

void PointNeighbours::within(const V3d& from, double radius, std::vector<Neighbour>& found) const {
  tree_.within(from, radius * radius, found);
  std::erase_if(found, [&](const Neighbour& one) { return one.squared == radius * radius; });
}

}  // namespace levelset::points
