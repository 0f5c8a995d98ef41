#include "levelset/deform/cage/domain_cells.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace levelset::cage {
namespace {

using Imath::V3d;

enum CellState : std::uint8_t { kEnclosedPart = 1, kNearPart = 2, kBeyondPart = 0 };

}  // namespace

DomainCells::DomainCells(const DeformationDomain& domain) {
  Imath::Box3d box;
  for (const auto& t : domain.triangles)
    for (const std::uint32_t n : t) box.extendBy(domain.points[n]);
  const V3d size = box.size() + V3d(2 * domain.margin);
  const double longest = std::max({size.x, size.y, size.z, 1e-300});
  // Layers of cells around all stay free, so that the outside is connected.
  cell_ = longest * (1 + 1e-9) / (kSide - 7);
  low_ = (box.min + box.max) * 0.5 - V3d(0.5 * kSide * cell_);
  isPart_.assign(static_cast<std::size_t>(kSide) * kSide * kSide, kEnclosedPart);
  for (const auto& t : domain.triangles) {
    Imath::Box3d around;
    for (const std::uint32_t n : t) around.extendBy(domain.points[n]);
    std::array<std::uint32_t, 3> first{}, last{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto cellAt = [&](double x) {
        return static_cast<std::uint32_t>(
            std::clamp(std::floor((x - low_[axis]) / cell_), 1.0, double(kSide) - 2));
      };
      first[static_cast<std::size_t>(axis)] = cellAt(around.min[axis]);
      last[static_cast<std::size_t>(axis)] = cellAt(around.max[axis]);
    }
    for (std::uint32_t i = first[0]; i <= last[0]; ++i)
      for (std::uint32_t j = first[1]; j <= last[1]; ++j)
        for (std::uint32_t k = first[2]; k <= last[2]; ++k) isPart_[indexOf(i, j, k)] = kNearPart;
  }
  // Two points of two cells are nearer than the centres by less than a diagonal.
  if (domain.margin > 0) widen(domain.margin / cell_ + std::sqrt(3.0));
  floodOutside();
}

void DomainCells::widen(double cells) {
  constexpr int kEdge = static_cast<int>(kSide);
  constexpr std::uint16_t kFar = 0xffff;
  const int reach = static_cast<int>(std::ceil(cells));
  const auto limit = static_cast<std::uint32_t>(cells * cells);
  // Squared distances from the nearest marked cell, one axis after the other.
  std::vector<std::uint16_t> squares(isPart_.size(), kFar);
  for (std::size_t n = 0; n < isPart_.size(); ++n)
    if (isPart_[n] == kNearPart) squares[n] = 0;
  for (const std::size_t stride : {std::size_t{1}, std::size_t{kSide}, std::size_t{kSide} * kSide})
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, kSide * kSide, 64), [&](const auto& range) {
          std::array<std::uint16_t, kSide> line{};
          for (std::size_t row = range.begin(); row != range.end(); ++row) {
            const std::size_t begin = stride == 1 ? row * kSide
                                      : stride == kSide
                                          ? (row / kSide) * kSide * kSide + row % kSide
                                          : row;
            for (int i = 0; i < kEdge; ++i)
              line[static_cast<std::size_t>(i)] =
                  squares[begin + static_cast<std::size_t>(i) * stride];
            for (int i = 0; i < kEdge; ++i) {
              std::uint32_t best = kFar;
              for (int k = std::max(0, i - reach); k <= std::min(kEdge - 1, i + reach); ++k)
                best = std::min(best, line[static_cast<std::size_t>(k)] +
                                          static_cast<std::uint32_t>((i - k) * (i - k)));
              squares[begin + static_cast<std::size_t>(i) * stride] =
                  static_cast<std::uint16_t>(best);
            }
          }
        });
  for (std::size_t n = 0; n < isPart_.size(); ++n)
    if (squares[n] <= limit) isPart_[n] = kNearPart;
}

void DomainCells::floodOutside() {
  std::vector<std::array<std::uint32_t, 3>> stack = {{0, 0, 0}};
  isPart_[0] = kBeyondPart;
  while (!stack.empty()) {
    const std::array<std::uint32_t, 3> at = stack.back();
    stack.pop_back();
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1}) {
        std::array<std::uint32_t, 3> next = at;
        if (side < 0 ? at[axis] == 0 : at[axis] + 1 == kSide) continue;
        next[axis] = side < 0 ? at[axis] - 1 : at[axis] + 1;
        std::uint8_t& state = isPart_[indexOf(next[0], next[1], next[2])];
        if (state != kEnclosedPart) continue;
        state = kBeyondPart;
        stack.push_back(next);
      }
  }
}

double DomainCells::edgeOf(const Cube& cube) const {
  return std::ldexp(cell_ * kSide, -cube.level);
}

V3d DomainCells::centreOf(const Cube& cube) const {
  return low_ + V3d(cube.at[0] + 0.5, cube.at[1] + 0.5, cube.at[2] + 0.5) * edgeOf(cube);
}

bool DomainCells::touches(const Cube& cube) const {
  std::array<std::uint32_t, 3> first{}, count{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cube.level >= kLevels) {
      first[axis] = cube.at[axis] >> (cube.level - kLevels);
      count[axis] = 1;
    } else {
      first[axis] = cube.at[axis] << (kLevels - cube.level);
      count[axis] = 1u << (kLevels - cube.level);
    }
  }
  for (std::uint32_t i = 0; i < count[0]; ++i)
    for (std::uint32_t j = 0; j < count[1]; ++j)
      for (std::uint32_t k = 0; k < count[2]; ++k)
        if (isPart_[indexOf(first[0] + i, first[1] + j, first[2] + k)] != kBeyondPart) return true;
  return false;
}

bool DomainCells::contains(const V3d& world) const {
  std::array<std::uint32_t, 3> at{};
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::floor((world[axis] - low_[axis]) / cell_);
    if (!(cell >= 0 && cell < kSide)) return false;
    at[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(cell);
  }
  return isPart_[indexOf(at[0], at[1], at[2])] != kBeyondPart;
}

}  // namespace levelset::cage
