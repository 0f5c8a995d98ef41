#include "levelset/volumes/volume.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "levelset/error.h"
#include "levelset/mix_hash.h"
#include "levelset/volumes/volume_numbers.h"

namespace levelset {
namespace {

using Imath::V3d;
using Imath::V3i;

V3d axisOf(const Imath::M44d& matrix, int axis) {
  return {matrix[axis][0], matrix[axis][1], matrix[axis][2]};
}

/// Volume of the unit cell relative to that of a box with the same edges: 1 for perpendicular axes,
/// 0 for axes in a plane.
double cellShare(const Imath::M44d& matrix) {
  const V3d a = axisOf(matrix, 0), b = axisOf(matrix, 1), c = axisOf(matrix, 2);
  return std::abs(a.cross(b).dot(c)) / (a.length() * b.length() * c.length());
}

void checkVolumeGrid(const VolumeGrid& grid) {
  for (int axis = 0; axis < 3; ++axis)
    if (grid.size[axis] < 1)
      throw InvalidInput(fmt::format(
          "the volume has the size {} x {} x {}, but each must be at least 1; check the header",
          grid.size.x, grid.size.y, grid.size.z));
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 3; ++column)
      if (!std::isfinite(grid.indexToWorld[row][column]))
        throw InvalidInput(
            "the position or spacing of the volume is not finite; repair the header of the file");
  if (!(cellShare(grid.indexToWorld) > 1e-9))
    throw InvalidInput(
        "the axes of the volume span no space: an axis has length zero, or they lie in a plane; "
        "repair the spacing or orientation in the header of the file");
}

struct StoredRange {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  std::size_t bad = std::numeric_limits<std::size_t>::max();  ///< first number that is not finite
};

template <typename T>
StoredRange rangeOfNumbers(const char* begin, std::size_t from, std::size_t to) {
  StoredRange range;
  T low = loadNumber<T>(begin + from * sizeof(T)), high = low;
  for (std::size_t n = from; n < to; ++n) {
    const T value = loadNumber<T>(begin + n * sizeof(T));
    if constexpr (std::is_same_v<T, float>) {
      if (!std::isfinite(value)) {
        range.bad = n;
        return range;
      }
    }
    low = std::min(low, value);
    high = std::max(high, value);
  }
  range.low = static_cast<double>(low);
  range.high = static_cast<double>(high);
  return range;
}

}  // namespace

const char* volumeTypeName(VolumeType type) {
  switch (type) {
    case VolumeType::U8:
      return "u8";
    case VolumeType::I8:
      return "i8";
    case VolumeType::U16:
      return "u16";
    case VolumeType::I16:
      return "i16";
    case VolumeType::F32:
      return "f32";
  }
  return "";
}

std::size_t volumeTypeSize(VolumeType type) {
  return withStoredType(type, [](auto number) { return sizeof number; });
}

V3d VolumeGrid::spacing() const {
  return {axisOf(indexToWorld, 0).length(), axisOf(indexToWorld, 1).length(),
          axisOf(indexToWorld, 2).length()};
}

Imath::Box3d VolumeGrid::bounds() const {
  Imath::Box3d box;
  for (int corner = 0; corner < 8; ++corner)
    box.extendBy(V3d((corner & 4) ? size.x - 1 : 0, (corner & 2) ? size.y - 1 : 0,
                     (corner & 1) ? size.z - 1 : 0) *
                 indexToWorld);
  return box;
}

std::string VolumeGrid::orientation() const {
  // Each world axis names one index axis: the strongest pair of axes is matched first.
  constexpr const char* kUp = "RAS";
  constexpr const char* kDown = "LPI";
  std::string letters = "???";
  std::array<bool, 3> used{};
  for (int round = 0; round < 3; ++round) {
    int axis = 0, world = 0;
    double strongest = -1;
    for (int a = 0; a < 3; ++a) {
      const V3d direction = axisOf(indexToWorld, a).normalized();
      for (int w = 0; w < 3; ++w)
        if (letters[static_cast<std::size_t>(a)] == '?' && !used[static_cast<std::size_t>(w)] &&
            std::abs(direction[w]) > strongest) {
          strongest = std::abs(direction[w]);
          axis = a;
          world = w;
        }
    }
    letters[static_cast<std::size_t>(axis)] =
        indexToWorld[axis][world] < 0 ? kDown[world] : kUp[world];
    used[static_cast<std::size_t>(world)] = true;
  }
  return letters;
}

bool VolumeGrid::isOrthogonal() const {
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(axisOf(indexToWorld, axis)
                     .normalized()
                     .dot(axisOf(indexToWorld, (axis + 1) % 3).normalized())) > 1e-6)
      return false;
  return true;
}

Volume::Volume(const VolumeGrid& grid, VolumeType type, const VolumeScale& scale, Data data,
               const Progress& progress)
    : grid_(grid), type_(type), scale_(scale), data_(std::move(data)) {
  checkVolumeGrid(grid_);
  if (!(std::abs(scale.slope) > 0) || !std::isfinite(scale.slope) ||
      !std::isfinite(scale.intercept))
    throw InvalidInput(
        fmt::format("the rescale slope {} or intercept {} of the volume is not usable; repair the "
                    "header of the file",
                    scale.slope, scale.intercept));
  findRange(progress);
}

Volume::Volume(const VolumeGrid& grid, std::vector<float> values, const Progress& progress)
    : grid_(grid), type_(VolumeType::F32) {
  checkVolumeGrid(grid_);
  if (values.size() != grid.pointCount())
    throw UsageError(fmt::format("there are {} values for a grid of {} points; give one for each",
                                 values.size(), grid.pointCount()));
  const auto owner = std::make_shared<const std::vector<float>>(std::move(values));
  data_ = {owner, reinterpret_cast<const char*>(owner->data()), false};
  findRange(progress);
}

double Volume::stored(std::size_t point) const {
  return withStoredType(type_, [&](auto number) {
    using T = decltype(number);
    return static_cast<double>(loadNumber<T>(data_.begin + point * sizeof(T)));
  });
}

void Volume::storedRow(int j, int k, std::span<float> out) const {
  const std::size_t first = index(0, j, k);
  withStoredType(type_, [&](auto number) {
    using T = decltype(number);
    const char* from = data_.begin + first * sizeof(T);
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = static_cast<float>(loadNumber<T>(from + i * sizeof(T)));
  });
}

void Volume::storedRun(std::size_t first, std::span<double> out) const {
  withStoredType(type_, [&](auto number) {
    using T = decltype(number);
    const char* from = data_.begin + first * sizeof(T);
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = static_cast<double>(loadNumber<T>(from + i * sizeof(T)));
  });
}

double Volume::trilinear(const V3d& position) const {
  std::array<int, 3> low{}, high{};
  std::array<double, 3> t{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const double last = grid_.size[axis] - 1;
    const double p = std::isnan(position[axis]) ? 0 : std::clamp(position[axis], 0.0, last);
    low[a] = std::min(static_cast<int>(p), std::max(0, grid_.size[axis] - 2));
    high[a] = std::min(low[a] + 1, grid_.size[axis] - 1);
    t[a] = p - low[a];
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const bool x = corner & 4, y = corner & 2, z = corner & 1;
    const double weight = (x ? t[0] : 1 - t[0]) * (y ? t[1] : 1 - t[1]) * (z ? t[2] : 1 - t[2]);
    sum += weight * stored(index(x ? high[0] : low[0], y ? high[1] : low[1], z ? high[2] : low[2]));
  }
  return scale_(sum);
}

void Volume::findRange(const Progress& progress) {
  // Parts of fixed size, so that the report of the first bad number does not depend on threads.
  constexpr std::size_t kPart = std::size_t{1} << 20, kSlice = 64;
  const std::size_t count = grid_.pointCount(), parts = (count + kPart - 1) / kPart;
  StoredRange whole;
  std::array<StoredRange, kSlice> slice;
  for (std::size_t from = 0; from < parts; from += kSlice) {
    const std::size_t size = std::min(kSlice, parts - from);
    tbb::parallel_for(std::size_t{0}, size, [&](std::size_t n) {
      const std::size_t begin = (from + n) * kPart, end = std::min(count, begin + kPart);
      slice[n] = withStoredType(type_, [&](auto number) {
        return rangeOfNumbers<decltype(number)>(data_.begin, begin, end);
      });
    });
    for (std::size_t n = 0; n < size; ++n) {
      whole.low = std::min(whole.low, slice[n].low);
      whole.high = std::max(whole.high, slice[n].high);
      whole.bad = std::min(whole.bad, slice[n].bad);
    }
    if (whole.bad < count) {
      const std::size_t nx = static_cast<std::size_t>(grid_.size.x),
                        ny = static_cast<std::size_t>(grid_.size.y);
      throw InvalidInput(fmt::format(
          "the value at the grid point ({}, {}, {}) is not a finite number; replace NaN and "
          "infinite values, for example by the value of the background",
          whole.bad % nx, whole.bad / nx % ny, whole.bad / nx / ny));
    }
    report(progress, static_cast<double>(from + size) / static_cast<double>(parts));
  }
  lowest_ = std::min(scale_(whole.low), scale_(whole.high));
  highest_ = std::max(scale_(whole.low), scale_(whole.high));
  if (!std::isfinite(highest_ - lowest_))
    throw InvalidInput(
        fmt::format("the rescale slope {} and intercept {} of the volume make values beyond the "
                    "range of numbers; repair the header of the file",
                    scale_.slope, scale_.intercept));
}

std::uint64_t Volume::contentHash() const {
  std::uint64_t hash = static_cast<std::uint64_t>(type_) + 1;
  const auto add = [&](const auto& value) {
    std::uint64_t word = 0;
    static_assert(sizeof value <= sizeof word);
    std::memcpy(&word, &value, sizeof value);
    hash = mixHash(hash, word);
  };
  for (int axis = 0; axis < 3; ++axis) add(grid_.size[axis]);
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 3; ++column) add(grid_.indexToWorld[row][column]);
  add(scale_.slope);
  add(scale_.intercept);
  return mixBytes(hash, data_.begin, memoryUse());
}

}  // namespace levelset
