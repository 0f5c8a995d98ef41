#include "levelset/points/processing/point_neighbours.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <limits>

namespace levelset::points {
namespace {

using Imath::V3d;

constexpr std::size_t kItemsPerLeaf = 8;
constexpr std::size_t kItemsPerTask = 20000;

bool isBefore(const V3d& a, const V3d& b) {
  if (a.x != b.x) return a.x < b.x;
  if (a.y != b.y) return a.y < b.y;
  return a.z < b.z;
}

double squaredDistance(const V3d& a, const V3d& b) {
  const double x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
  return x * x + y * y + z * z;
}

bool isNearer(const Neighbour& a, const Neighbour& b) {
  return a.squared != b.squared ? a.squared < b.squared : a.index < b.index;
}

}  // namespace

/// State of a search: the distances along the axes from the query to the present cell.
struct PointNeighbours::Query {
  V3d from;
  V3d gap = V3d(0);
  double limit = std::numeric_limits<double>::infinity();  ///< squared; farther cells are skipped
};

PointNeighbours::PointNeighbours(std::span<const V3d> positions) : count_(positions.size()) {
  items_.resize(positions.size());
  tbb::parallel_for(std::size_t{0}, positions.size(), [&](std::size_t i) {
    items_[i] = {positions[i], static_cast<std::uint32_t>(i), 0};
  });
  tbb::parallel_sort(items_.begin(), items_.end(), [](const Item& a, const Item& b) {
    if (isBefore(a.position, b.position)) return true;
    return !isBefore(b.position, a.position) && a.index < b.index;
  });
  const auto isEqual = [](const Item& a, const Item& b) { return a.position == b.position; };
  if (std::adjacent_find(items_.begin(), items_.end(), isEqual) != items_.end()) {
    first_.resize(count_);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < items_.size(); ++i) {
      if (i == 0 || !isEqual(items_[i], items_[kept - 1])) items_[kept++] = items_[i];
      first_[items_[i].index] = items_[kept - 1].index;
    }
    items_.resize(kept);
    items_.shrink_to_fit();
  }
  build(0, items_.size());
}

double PointNeighbours::bytesFor(std::size_t points) {
  return static_cast<double>(points) * (sizeof(Item) + sizeof(std::uint32_t));
}

void PointNeighbours::build(std::size_t begin, std::size_t end) {
  if (end - begin <= kItemsPerLeaf) return;
  V3d low = items_[begin].position, high = low;
  for (std::size_t i = begin + 1; i < end; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], items_[i].position[axis]);
      high[axis] = std::max(high[axis], items_[i].position[axis]);
    }
  const V3d size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t middle = begin + (end - begin) / 2;
  const auto item = [&](std::size_t i) { return items_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(item(begin), item(middle), item(end), [axis](const Item& a, const Item& b) {
    return a.position[axis] != b.position[axis] ? a.position[axis] < b.position[axis]
                                                : a.index < b.index;
  });
  items_[middle].axis = static_cast<std::uint32_t>(axis);
  if (end - begin < kItemsPerTask) {
    build(begin, middle);
    build(middle + 1, end);
  } else {
    tbb::parallel_invoke([=, this] { build(begin, middle); },
                         [=, this] { build(middle + 1, end); });
  }
}

/// Calls look(item, squared distance) for the items of all cells that are not beyond the limit.
template <typename Look>
void PointNeighbours::visit(std::size_t begin, std::size_t end, Query& query,
                            const Look& look) const {
  if (end - begin <= kItemsPerLeaf) {
    for (std::size_t i = begin; i < end; ++i)
      look(items_[i], squaredDistance(query.from, items_[i].position));
    return;
  }
  const std::size_t middle = begin + (end - begin) / 2;
  const Item& split = items_[middle];
  const int axis = static_cast<int>(split.axis);
  const double offset = query.from[axis] - split.position[axis];
  const bool isLow = offset < 0;
  if (isLow)
    visit(begin, middle, query, look);
  else
    visit(middle + 1, end, query, look);
  look(split, squaredDistance(query.from, split.position));
  const double gap = query.gap[axis];
  query.gap[axis] = offset;
  // Rounding is monotone, so no item behind the split has a smaller squared distance.
  if (query.gap.x * query.gap.x + query.gap.y * query.gap.y + query.gap.z * query.gap.z <=
      query.limit) {
    if (isLow)
      visit(middle + 1, end, query, look);
    else
      visit(begin, middle, query, look);
  }
  query.gap[axis] = gap;
}

void PointNeighbours::nearest(const V3d& from, std::size_t count,
                              std::vector<Neighbour>& found) const {
  found.clear();
  if (count == 0) return;
  Query query{from};
  visit(0, items_.size(), query, [&](const Item& item, double squared) {
    const Neighbour next{squared, item.index};
    if (found.size() == count) {
      if (!isNearer(next, found.back())) return;
      found.pop_back();
    }
    found.insert(std::upper_bound(found.begin(), found.end(), next, isNearer), next);
    if (found.size() == count) query.limit = found.back().squared;
  });
}

void PointNeighbours::within(const V3d& from, double radius, std::vector<Neighbour>& found) const {
  found.clear();
  Query query{from};
  query.limit = radius * radius;
  visit(0, items_.size(), query, [&](const Item& item, double squared) {
    if (squared < query.limit) found.push_back({squared, item.index});
  });
  std::sort(found.begin(), found.end(),
            [](const Neighbour& a, const Neighbour& b) { return a.index < b.index; });
}

}  // namespace levelset::points
