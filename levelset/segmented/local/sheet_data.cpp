#include "levelset/segmented/local/sheet_data.h"

#include <algorithm>

#include "levelset/grid_tools_vdb.h"

namespace levelset {
namespace {

constexpr std::size_t kNotFound = static_cast<std::size_t>(-1);

/// Place of a key among those of a block.
std::size_t placeOf(const std::vector<std::uint16_t>& keys, std::uint32_t first, std::uint32_t last,
                    std::uint16_t key) {
  const auto begin = keys.begin() + first, end = keys.begin() + last;
  const auto found = std::lower_bound(begin, end, key);
  return found != end && *found == key ? static_cast<std::size_t>(found - keys.begin()) : kNotFound;
}

}  // namespace

float SheetData::positionOf(std::size_t block, std::uint16_t key) const {
  const std::size_t place = placeOf(edges, firstEdge[block], firstEdge[block + 1], key);
  return place == kNotFound ? 0.5f : positions[place];
}

const Imath::V3f* SheetData::pointOf(std::size_t block, std::uint16_t key) const {
  const std::size_t place = placeOf(pointKeys, firstPoint[block], firstPoint[block + 1], key);
  return place == kNotFound ? nullptr : &points[place];
}

std::size_t SheetData::memoryUse() const {
  return sizeof(SheetData) +
         (firstEdge.capacity() + firstPoint.capacity()) * sizeof(std::uint32_t) +
         (edges.capacity() + pointKeys.capacity() + owners.capacity()) * sizeof(std::uint16_t) +
         positions.capacity() * sizeof(float) + points.capacity() * sizeof(Imath::V3f);
}

std::uint64_t SheetData::contentHash() const {
  std::uint64_t hash = 0x5348454554534544ull;
  hash = mixBytes(hash, firstEdge.data(), firstEdge.size());
  hash = mixBytes(hash, edges.data(), edges.size());
  hash = mixBytes(hash, positions.data(), positions.size());
  hash = mixBytes(hash, firstPoint.data(), firstPoint.size());
  hash = mixBytes(hash, pointKeys.data(), pointKeys.size());
  for (const Imath::V3f& p : points) hash = mixBytes(hash, p.getValue(), 3);
  return hash;
}

}  // namespace levelset
