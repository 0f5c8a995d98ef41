#include "levelset/terrain/sculpt/brush.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "levelset/error.h"
#include "levelset/fields/gradient_noise.h"
#include "levelset/memory/memory_limit.h"

namespace levelset {
namespace {

/// Heights and weights of the samples below a brush, with a border of weight 0.
class BrushedPart {
 public:
  BrushedPart(const HeightField& field, const BrushDab& dab, const SampleRange& range)
      : field_(field), dab_(dab), range_(range) {
    heights_.resize(static_cast<std::size_t>(range.columns()) *
                    static_cast<std::size_t>(range.rows()));
    weights_.resize(heights_.size());
    forEachRow([&](int row) {
      for (int column = range_.firstColumn; column <= range_.lastColumn; ++column) {
        const Imath::V2d d = field_.position(column, row) - dab_.center;
        const double share = 1 - d.length2() / (dab_.radius * dab_.radius);
        const std::size_t n = at(column, row);
        heights_[n] = static_cast<double>(field_.at(column, row));
        weights_[n] = share > 0 ? share * share : 0;
      }
    });
  }

  /// Returns false if the brush lies between the samples, or on missing ones only.
  [[nodiscard]] bool hasWeight() const {
    for (std::size_t n = 0; n < weights_.size(); ++n)
      if (weights_[n] > 0 && !std::isnan(heights_[n])) return true;
    return false;
  }

  void run() {
    switch (dab_.effect) {
      case BrushEffect::Raise:
        return change([&](int, int, std::size_t n) { return dab_.strength * weights_[n]; });
      case BrushEffect::Flatten: {
        const double level = dab_.level ? *dab_.level : meanHeight();
        return change([&](int, int, std::size_t n) {
          return dab_.strength * weights_[n] * (level - heights_[n]);
        });
      }
      case BrushEffect::Noise: {
        const double wavelength = dab_.wavelength > 0 ? dab_.wavelength : dab_.radius / 4;
        // Points on a plane between those of the lattice, where the noise is 0. Two seeds have no
        // plane of the lattice in common.
        const double layer = 0.5 + 2.0 * dab_.seed;
        return change([&](int column, int row, std::size_t n) {
          const Imath::V2d p = field_.position(column, row) / wavelength;
          return dab_.strength * weights_[n] * gradientNoise({p.x, p.y, layer});
        });
      }
      case BrushEffect::Smooth:
        for (int pass = 0; pass < dab_.passes; ++pass)
          change([&](int column, int row, std::size_t n) {
            // An eighth removes the steepest wave at once, and keeps all others from growing.
            return dab_.strength * weights_[n] / 8 *
                   (secondDifference(column, row, 1, 0) + secondDifference(column, row, 0, 1));
          });
        return;
      case BrushEffect::Erode:
        for (int pass = 0; pass < dab_.passes; ++pass)
          change([&](int column, int row, std::size_t) { return inflow(column, row); });
        return;
    }
  }

  /// Writes the heights back. @throws InvalidInput before the first one
  void writeTo(HeightField& field) const {
    for (const double height : heights_)
      if (std::isinf(static_cast<float>(height)))
        throw InvalidInput(fmt::format(
            "the brush makes a height of {:.9g}, but heights are floats; give a smaller "
            "strength",
            height));
    for (int row = range_.firstRow; row <= range_.lastRow; ++row)
      for (int column = range_.firstColumn; column <= range_.lastColumn; ++column)
        // Samples without weight keep their bits, also those of −0.
        if (const std::size_t n = at(column, row); weights_[n] > 0 && !std::isnan(heights_[n]))
          field.heights[field.index(column, row)] = static_cast<float>(heights_[n]);
  }

 private:
  [[nodiscard]] std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row - range_.firstRow) *
               static_cast<std::size_t>(range_.columns()) +
           static_cast<std::size_t>(column - range_.firstColumn);
  }
  [[nodiscard]] bool has(int column, int row) const {
    return column >= range_.firstColumn && column <= range_.lastColumn && row >= range_.firstRow &&
           row <= range_.lastRow && !std::isnan(heights_[at(column, row)]);
  }

  template <typename Function>
  void forEachRow(const Function& function) const {
    tbb::parallel_for(range_.firstRow, range_.lastRow + 1, function);
  }

  /// Adds a difference to each height. All differences are those of the old heights.
  template <typename Function>
  void change(const Function& difference) {
    next_.resize(heights_.size());
    forEachRow([&](int row) {
      for (int column = range_.firstColumn; column <= range_.lastColumn; ++column) {
        const std::size_t n = at(column, row);
        next_[n] = weights_[n] > 0 ? heights_[n] + difference(column, row, n) : heights_[n];
      }
    });
    heights_.swap(next_);
  }

  [[nodiscard]] double meanHeight() const {
    double sum = 0, weight = 0;
    for (std::size_t n = 0; n < heights_.size(); ++n) {
      if (std::isnan(heights_[n])) continue;
      sum += weights_[n] * heights_[n];
      weight += weights_[n];
    }
    return weight > 0 ? sum / weight : 0;
  }

  /// 0 beside a missing sample, and at the border.
  [[nodiscard]] double secondDifference(int column, int row, int dc, int dr) const {
    if (!has(column - dc, row - dr) || !has(column + dc, row + dr)) return 0;
    return heights_[at(column - dc, row - dr)] + heights_[at(column + dc, row + dr)] -
           2 * heights_[at(column, row)];
  }

  /// Ground that comes from the eight neighbours. What one sample gives, another one gets.
  [[nodiscard]] double inflow(int column, int row) const {
    constexpr std::array<std::array<int, 2>, 4> ways = {{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
    const double talus = std::tan(dab_.talusDegrees * std::numbers::pi / 180);
    const std::size_t n = at(column, row);
    double sum = 0;
    for (const auto& way : ways)
      for (const int sign : {-1, 1}) {
        const int c = column + sign * way[0], r = row + sign * way[1];
        if (!has(c, r)) continue;
        const double allowed =
            talus * std::hypot(way[0] * field_.spacing.x, way[1] * field_.spacing.y);
        const double difference = heights_[at(c, r)] - heights_[n];
        const double excess = std::max(0.0, std::abs(difference) - allowed);
        // A sixteenth for each of eight neighbours keeps all heights within those around them.
        sum += std::copysign(
            dab_.strength * std::min(weights_[n], weights_[at(c, r)]) / 16 * excess, difference);
      }
    return sum;
  }

  const HeightField& field_;
  const BrushDab& dab_;
  SampleRange range_;
  std::vector<double> heights_, next_, weights_;
};

}  // namespace

void requireDab(const BrushDab& dab) {
  const auto refuse = [](const char* what, double number, const char* remedy) {
    throw UsageError(fmt::format("the {} of the brush is {:.9g}; give {}", what, number, remedy));
  };
  if (!std::isfinite(dab.center.x + dab.center.y))
    throw UsageError("the centre of the brush is not finite; give a position of the terrain");
  if (!(dab.radius > 0) || !std::isfinite(dab.radius)) refuse("radius", dab.radius, "a length > 0");
  const bool isShare = dab.effect != BrushEffect::Raise && dab.effect != BrushEffect::Noise;
  if (!std::isfinite(dab.strength)) refuse("strength", dab.strength, "a finite number");
  if (isShare && !(dab.strength >= 0 && dab.strength <= 1))
    refuse("strength", dab.strength, "a share from 0 to 1");
  if (dab.level && !std::isfinite(*dab.level)) refuse("level", *dab.level, "a finite height");
  if (!(dab.wavelength >= 0) || !std::isfinite(dab.wavelength))
    refuse("wavelength", dab.wavelength, "a length >= 0");
  if (!(dab.talusDegrees >= 0 && dab.talusDegrees < 90))
    refuse("talus", dab.talusDegrees, "an angle from 0 to below 90 degrees");
  if (dab.passes < 1 || dab.passes > 1000) refuse("number of passes", dab.passes, "1 to 1000");
}

SampleRange dabRange(const HeightField& field, const BrushDab& dab) {
  const Imath::V2d low = (dab.center - Imath::V2d(dab.radius) - field.origin) / field.spacing,
                   high = (dab.center + Imath::V2d(dab.radius) - field.origin) / field.spacing;
  // Samples on the rim have no weight. They are neighbours of those with weight.
  const auto first = [](double at, int count) {
    return static_cast<int>(std::floor(std::clamp(at, 0.0, count + 0.0)));
  };
  const auto last = [](double at, int count) {
    return static_cast<int>(std::ceil(std::clamp(at, -1.0, count - 1.0)));
  };
  const SampleRange range{.firstColumn = first(low.x, field.columns),
                          .firstRow = first(low.y, field.rows),
                          .lastColumn = last(high.x, field.columns),
                          .lastRow = last(high.y, field.rows)};
  return range.isEmpty() ? SampleRange() : range;
}

SampleRange applyDab(HeightField& field, const BrushDab& dab, std::size_t maxMemory) {
  requireDab(dab);
  const SampleRange range = dabRange(field, dab);
  if (range.isEmpty()) return range;
  if (dab.effect == BrushEffect::Erode) requireLengths(field);
  requireMemory(3.0 * sizeof(double) * range.columns() * range.rows(),
                memoryLeft(memoryLimit(maxMemory)));
  BrushedPart part(field, dab, range);
  if (!part.hasWeight()) return {};
  part.run();
  part.writeTo(field);
  return range;
}

}  // namespace levelset
