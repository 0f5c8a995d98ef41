#include "levelset/terrain/tiles/patch_codec.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "levelset/terrain/height_field.h"
#include "levelset/terrain/tiles/range_coder.h"

namespace levelset::terrain {
namespace {

// === Numbers

/// Denominators of fixed-point heights, beside the powers of two: whole numbers, decimals, and the
/// grey values of pictures of 8 and 16 bits.
constexpr std::array<int, 8> kDenominators = {1, 10, 100, 1000, 10'000, 100'000, 255, 65'535};
/// Forms of the numbers, as they are stored: single floats, multiples of the step of the file, and
/// whole numbers by a denominator of the table, or by a power of two.
constexpr int kFloatForm = 0, kStepForm = 1, kTableForm = 2,
              kPowerForm = kTableForm + static_cast<int>(kDenominators.size());
constexpr int kMostPower = 32, kForms = kPowerForm + kMostPower;
/// Largest whole number of a fixed-point height. Sums of predictions fit 64 bits for any 32 bits.
constexpr double kMostWhole = 1 << 28;

/// Fixed-point numbers: whole numbers times a step, or divided by a denominator.
struct FixedPoint {
  double step = 0, denominator = 1;  ///< the step counts if it is not 0
  double mostWhole = kMostWhole;     ///< limit for the encoder

  [[nodiscard]] double heightOf(std::int32_t whole) const {
    return step != 0 ? whole * step : whole / denominator;
  }
  /// Whole number of a height, if it restores all bits of the height.
  [[nodiscard]] std::optional<std::int32_t> wholeOf(float height) const {
    const double scaled = std::nearbyint(step != 0 ? height / step : height * denominator);
    if (!(std::abs(scaled) <= mostWhole)) return {};
    const auto whole = static_cast<std::int32_t>(scaled);
    const auto again = static_cast<float>(heightOf(whole));
    if (std::bit_cast<std::uint32_t>(again) != std::bit_cast<std::uint32_t>(height)) return {};
    return whole;
  }
};

FixedPoint fixedPointOf(int form, double step) {
  if (form == kStepForm) return {.step = step};
  // Beyond these limits floats are coarser than the fixed-point numbers, which then waste bits.
  constexpr double kMostBinary = 1 << 24, kMostDecimal = 1 << 22;
  if (form == kTableForm) return {.mostWhole = kMostBinary};
  if (form < kPowerForm)
    return {.denominator = static_cast<double>(kDenominators[static_cast<std::size_t>(form) - 2]),
            .mostWhole = kMostDecimal};
  return {.denominator = std::ldexp(1.0, form - kPowerForm + 1), .mostWhole = kMostBinary};
}

// === Predictions

/// Weights of the neighbours, in units of 1/4096. A prediction is the western neighbour plus the
/// weighted differences of the others from it, so that it is exact on level ground.
struct Weights {
  static constexpr int kBits = 12;
  /// Weights of the neighbours in the south, south-west, south-east, second west and second south.
  std::array<std::int16_t, 5> of = {1 << kBits, -(1 << kBits), 0, 0, 0};  // a plane

  [[nodiscard]] bool isPlane() const { return *this == Weights(); }
  bool operator==(const Weights&) const = default;
};

/// Sums and differences of whole numbers modulo 2^32. Residuals fold the sign into the lowest bit.
struct WholeNumbers {
  using Value = std::int32_t;
  static Value predict(const Weights& weights, Value west, const std::array<Value, 5>& others) {
    std::int64_t sum = 1 << (Weights::kBits - 1);
    for (std::size_t n = 0; n < others.size(); ++n)
      sum += weights.of[n] * (std::int64_t{others[n]} - west);
    return static_cast<Value>(static_cast<std::uint32_t>(west + (sum >> Weights::kBits)));
  }
  static std::uint32_t residual(Value value, Value prediction) {
    return folded(static_cast<std::uint32_t>(value) - static_cast<std::uint32_t>(prediction));
  }
  static Value restored(std::uint32_t residual, Value prediction) {
    return static_cast<Value>(static_cast<std::uint32_t>(prediction) + unfolded(residual));
  }
  static std::uint32_t folded(std::uint32_t difference) {
    return difference << 1 ^ (0 - (difference >> 31));
  }
  static std::uint32_t unfolded(std::uint32_t residual) {
    return residual >> 1 ^ (0 - (residual & 1));
  }
};

/// Floats. Residuals count the floats between a value and its prediction [Lindstrom06].
struct Floats {
  using Value = float;
  static Value predict(const Weights& weights, Value west, const std::array<Value, 5>& others) {
    double sum = 0;
    for (std::size_t n = 0; n < others.size(); ++n)
      sum += weights.of[n] * (static_cast<double>(others[n]) - static_cast<double>(west));
    constexpr double kMost = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(west + sum / (1 << Weights::kBits), -kMost, kMost));
  }
  static std::uint32_t residual(Value value, Value prediction) {
    return WholeNumbers::folded(ordered(value) - ordered(prediction));
  }
  static Value restored(std::uint32_t residual, Value prediction) {
    const std::uint32_t number = ordered(prediction) + WholeNumbers::unfolded(residual);
    return std::bit_cast<float>(number >> 31 != 0 ? number ^ kSign : ~number);
  }

 private:
  static constexpr std::uint32_t kSign = std::uint32_t{1} << 31;
  /// Number of a float in the order of all floats.
  static std::uint32_t ordered(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return (bits & kSign) != 0 ? ~bits : bits | kSign;
  }
};

/// Values of a patch, row by row, and the known neighbours of a place. A missing value is that of
/// its prediction.
template <typename Numbers>
class PatchValues {
 public:
  using Value = typename Numbers::Value;
  PatchValues(int width, std::size_t count)
      : width_(static_cast<std::size_t>(width)), values_(count) {}

  [[nodiscard]] std::size_t width() const { return width_; }
  [[nodiscard]] std::size_t size() const { return values_.size(); }
  Value& operator[](std::size_t n) { return values_[n]; }
  Value operator[](std::size_t n) const { return values_[n]; }

  /// Predicts the value at a place from the values before it.
  [[nodiscard]] Value predict(const Weights& weights, std::size_t column, std::size_t n) const {
    if (n < width_) return n == 0 ? Value() : values_[n - 1];
    if (column == 0) return values_[n - width_];
    return Numbers::predict(weights, values_[n - 1], others(column, n));
  }
  /// Neighbours of a place that is in neither the first row nor the first column.
  [[nodiscard]] std::array<Value, 5> others(std::size_t column, std::size_t n) const {
    const Value south = values_[n - width_];
    return {south, values_[n - width_ - 1], column + 1 < width_ ? values_[n - width_ + 1] : south,
            column > 1 ? values_[n - 2] : values_[n - 1],
            n >= 2 * width_ ? values_[n - 2 * width_] : south};
  }

 private:
  std::size_t width_;
  std::vector<Value> values_;
};

using Row5 = std::array<double, 6>;  // a row of five equations, and its right side

/// Solves five linear equations. @return false if they have no single solution
bool solve(std::array<Row5, 5>& rows, std::array<double, 5>& solution) {
  for (std::size_t pivot = 0; pivot < 5; ++pivot) {
    std::size_t best = pivot;
    for (std::size_t n = pivot + 1; n < 5; ++n)
      if (std::abs(rows[n][pivot]) > std::abs(rows[best][pivot])) best = n;
    std::swap(rows[pivot], rows[best]);
    if (!(std::abs(rows[pivot][pivot]) > 0)) return false;
    for (std::size_t n = pivot + 1; n < 5; ++n) {
      const double factor = rows[n][pivot] / rows[pivot][pivot];
      for (std::size_t k = pivot; k < 6; ++k) rows[n][k] -= factor * rows[pivot][k];
    }
  }
  for (std::size_t n = 5; n-- > 0;) {
    double sum = rows[n][5];
    for (std::size_t k = n + 1; k < 5; ++k) sum -= rows[n][k] * solution[k];
    solution[n] = sum / rows[n][n];
  }
  return true;
}

/// Weights with the least squares of residuals in a patch.
template <typename Numbers>
Weights fittedWeights(const PatchValues<Numbers>& values, std::span<const float> heights) {
  std::array<Row5, 5> rows{};
  const std::size_t width = values.width();
  for (std::size_t n = width, column = 0; n < values.size(); ++n, ++column) {
    if (column == width) column = 0;
    if (column == 0 || std::isnan(heights[n])) continue;
    const auto west = static_cast<double>(values[n - 1]);
    const auto others = values.others(column, n);
    Row5 row;
    for (std::size_t k = 0; k < 5; ++k) row[k] = static_cast<double>(others[k]) - west;
    row[5] = static_cast<double>(values[n]) - west;
    for (std::size_t i = 0; i < 5; ++i)
      for (std::size_t k = i; k < 6; ++k) rows[i][k] += row[i] * row[k];
  }
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < i; ++k) rows[i][k] = rows[k][i];
    rows[i][i] *= 1 + 1e-6;  // keeps weights small where neighbours tell the same
  }
  Weights weights;
  std::array<double, 5> solution{};
  if (!solve(rows, solution)) return weights;
  for (std::size_t k = 0; k < 5; ++k) {
    const double scaled = std::nearbyint(solution[k] * (1 << Weights::kBits));
    if (!(std::abs(scaled) < 1 << 15)) return {};
    weights.of[k] = static_cast<std::int16_t>(scaled);
  }
  return weights;
}

/// Fills missing values with their predictions. @return estimated size of the residuals, bits
template <typename Numbers>
double fillAndEstimate(const Weights& weights, std::span<const float> heights,
                       PatchValues<Numbers>& values) {
  double bits = 0;
  for (std::size_t n = 0, column = 0; n < values.size(); ++n) {
    const auto prediction = values.predict(weights, column, n);
    if (std::isnan(heights[n]))
      values[n] = prediction;
    else
      bits += std::bit_width(Numbers::residual(values[n], prediction));
    if (++column == values.width()) column = 0;
  }
  return bits;
}

// === Code of the residuals

/// Models of the places of missing heights, and of residuals. A residual is coded as its number of
/// bits, in the context of those beside it, then its highest bits with a model, and the others.
class ResidualModels {
 public:
  explicit ResidualModels(int width) : lengths_(static_cast<std::size_t>(width)) {}

  BitModel& missing(bool west, bool south) {
    return missing_[(west ? 1u : 0u) + (south ? 2u : 0u)];
  }
  /// Model of the next bit of a length. @param prefix  1, then the bits before
  BitModel& length(std::size_t column, unsigned prefix) {
    const unsigned south = lengths_[column], west = column > 0 ? lengths_[column - 1] : south;
    return length_[(south + west + 1) / 2][prefix];
  }
  BitModel& highest(unsigned length, unsigned prefix) { return highest_[length][prefix]; }
  void setLength(std::size_t column, unsigned length) {
    lengths_[column] = static_cast<std::uint8_t>(length);
  }

 private:
  std::array<BitModel, 4> missing_;
  std::array<std::array<BitModel, 64>, 33> length_;
  std::array<std::array<BitModel, 4>, 33> highest_;
  std::vector<std::uint8_t> lengths_;  // of the row before, and of this one up to the column
};

constexpr int kLengthBits = 6;  // lengths are from 0 to 32
constexpr int kModelled = 2;    // number of bits below the first one that have a model

void encodeResidual(RangeEncoder& code, ResidualModels& models, std::size_t column,
                    std::uint32_t residual) {
  const auto length = static_cast<unsigned>(std::bit_width(residual));
  for (unsigned n = kLengthBits, prefix = 1; n-- > 0;) {
    const unsigned bit = length >> n & 1;
    code.bit(models.length(column, prefix), bit);
    prefix = prefix << 1 | bit;
  }
  models.setLength(column, length);
  if (length < 2) return;
  int rest = static_cast<int>(length) - 1;
  for (unsigned n = 0, prefix = 1; n < kModelled && rest > 0; ++n) {
    const unsigned bit = residual >> --rest & 1;
    code.bit(models.highest(length, prefix), bit);
    prefix = prefix << 1 | bit;
  }
  code.rawBits(residual, rest);
}

std::uint32_t decodeResidual(RangeDecoder& code, ResidualModels& models, std::size_t column) {
  unsigned prefix = 1;
  for (int n = 0; n < kLengthBits; ++n)
    prefix = prefix << 1 | code.bit(models.length(column, prefix));
  const unsigned length = std::min(prefix - (1u << kLengthBits), 32u);
  models.setLength(column, length);
  if (length < 2) return length;
  std::uint32_t residual = 1;
  int rest = static_cast<int>(length) - 1;
  for (unsigned n = 0, bits = 1; n < kModelled && rest > 0; ++n, --rest) {
    const unsigned bit = code.bit(models.highest(length, bits));
    bits = bits << 1 | bit;
    residual = residual << 1 | bit;
  }
  return rest > 0 ? residual << rest | code.rawBits(rest) : residual;
}

// === Patches

// Bits of the first byte of a patch beside the form of its numbers.
constexpr unsigned kSomeMissing = 0x40, kOwnWeights = 0x80;

template <typename Numbers>
std::string encodeValues(PatchValues<Numbers>& values, std::span<const float> heights, int form) {
  Weights weights;
  const double plane = fillAndEstimate(weights, heights, values);
  if (const Weights fitted = fittedWeights(values, heights);
      !fitted.isPlane() && fillAndEstimate(fitted, heights, values) + 80 < plane)
    weights = fitted;
  const bool someMissing =
      std::any_of(heights.begin(), heights.end(), [](float height) { return std::isnan(height); });
  std::string bytes(
      1, static_cast<char>(static_cast<unsigned>(form) | (someMissing ? kSomeMissing : 0) |
                           (weights.isPlane() ? 0 : kOwnWeights)));
  if (!weights.isPlane())
    for (const std::int16_t weight : weights.of) {
      bytes += static_cast<char>(weight & 0xff);
      bytes += static_cast<char>(weight >> 8 & 0xff);
    }
  RangeEncoder code;
  ResidualModels models(static_cast<int>(values.width()));
  for (std::size_t n = 0, column = 0; n < values.size(); ++n) {
    const auto prediction = values.predict(weights, column, n);
    const bool isMissing = std::isnan(heights[n]);
    if (someMissing)
      code.bit(models.missing(column > 0 && std::isnan(heights[n - 1]),
                              n >= values.width() && std::isnan(heights[n - values.width()])),
               isMissing ? 1 : 0);
    if (isMissing)
      values[n] = prediction;
    else
      encodeResidual(code, models, column, Numbers::residual(values[n], prediction));
    if (++column == values.width()) column = 0;
  }
  code.finish(bytes);
  return bytes;
}

/// Takes the weights off the bytes of a patch.
std::optional<Weights> takeWeights(std::string_view& bytes) {
  Weights weights;
  if (bytes.size() < 2 * weights.of.size()) return {};
  for (std::int16_t& weight : weights.of) {
    weight = static_cast<std::int16_t>(static_cast<unsigned char>(bytes[0]) |
                                       static_cast<unsigned char>(bytes[1]) << 8);
    bytes.remove_prefix(2);
  }
  return weights;
}

/// @param heightOf  height of a value; NaN if there is none
template <typename Numbers, typename HeightOf>
bool decodeValues(std::string_view bytes, int width, const Weights& weights, bool someMissing,
                  const HeightOf& heightOf, std::span<float> heights) {
  RangeDecoder code(bytes);
  ResidualModels models(width);
  PatchValues<Numbers> values(width, heights.size());
  for (std::size_t n = 0, column = 0; n < values.size(); ++n) {
    values[n] = values.predict(weights, column, n);
    const bool isMissing =
        someMissing && code.bit(models.missing(
                           column > 0 && std::isnan(heights[n - 1]),
                           n >= values.width() && std::isnan(heights[n - values.width()]))) == 1;
    if (isMissing) {
      heights[n] = kMissingHeight;
    } else {
      values[n] = Numbers::restored(decodeResidual(code, models, column), values[n]);
      heights[n] = heightOf(values[n]);
      if (!std::isfinite(heights[n])) return false;
    }
    if (++column == values.width()) column = 0;
  }
  return true;
}

/// Takes the whole numbers of all known heights. @return false if they do not restore the heights
bool takeWholes(const FixedPoint& numbers, std::span<const float> heights,
                PatchValues<WholeNumbers>& values) {
  for (std::size_t n = 0; n < heights.size(); ++n) {
    if (std::isnan(heights[n])) continue;
    const std::optional<std::int32_t> whole = numbers.wholeOf(heights[n]);
    if (!whole) return false;
    values[n] = *whole;
  }
  return true;
}

/// Number of binary digits behind the point of the heights; at most one more than kMostPower.
int fractionBits(std::span<const float> heights) {
  int bits = 0;
  for (const float height : heights) {
    if (std::isnan(height) || height == 0) continue;
    const auto raw = std::bit_cast<std::uint32_t>(height);
    const int exponent = static_cast<int>(raw >> 23 & 0xff);
    const std::uint32_t digits = raw & 0x7fffff;
    // The height is the significand times 2^(exponent − 150).
    const std::uint32_t significand = exponent > 0 ? digits | 0x800000 : digits;
    bits = std::max(bits, 150 - std::max(exponent, 1) - std::countr_zero(significand));
    if (bits > kMostPower) return kMostPower + 1;
  }
  return bits;
}

/// Forms of fixed-point numbers that may restore the heights, the shortest first.
std::vector<int> fixedForms(std::span<const float> heights, double step) {
  std::vector<int> forms;
  if (step != 0) forms.push_back(kStepForm);
  forms.push_back(kTableForm);
  const int power = fractionBits(heights);
  const bool hasPower = power > 0 && power <= kMostPower;
  constexpr int kShortPower = 6;  // shorter than most decimals
  if (hasPower && power <= kShortPower) forms.push_back(kPowerForm + power - 1);
  for (int form = kTableForm + 1; form < kPowerForm; ++form) forms.push_back(form);
  if (hasPower && power > kShortPower) forms.push_back(kPowerForm + power - 1);
  return forms;
}

}  // namespace

double heightStep(double tolerance) {
  if (!(tolerance > 0)) return 0;
  int exponent = 0;
  const double significand = std::frexp(2 * tolerance, &exponent);
  return std::ldexp(std::floor(significand * 32), exponent - 5);
}

float storedHeight(float height, double step, double tolerance) {
  if (step == 0) return height;
  const double whole = std::nearbyint(height / step);
  if (!(std::abs(whole) <= kMostWhole) ||
      std::abs(whole * step) > static_cast<double>(std::numeric_limits<float>::max()))
    return height;
  const auto stored = static_cast<float>(whole * step) + 0.F;  // no negative zero
  return std::abs(static_cast<double>(stored) - static_cast<double>(height)) <= tolerance ? stored
                                                                                          : height;
}

std::string encodeHeights(std::span<const float> heights, int width, double step) {
  PatchValues<WholeNumbers> wholes(width, heights.size());
  for (const int form : fixedForms(heights, step))
    if (takeWholes(fixedPointOf(form, step), heights, wholes))
      return encodeValues(wholes, heights, form);
  PatchValues<Floats> floats(width, heights.size());
  for (std::size_t n = 0; n < heights.size(); ++n)
    floats[n] = std::isnan(heights[n]) ? 0 : heights[n];
  return encodeValues(floats, heights, kFloatForm);
}

bool decodeHeights(std::string_view bytes, int width, double step, std::span<float> heights) {
  if (bytes.empty()) return false;
  const unsigned head = static_cast<unsigned char>(bytes[0]);
  bytes.remove_prefix(1);
  const int form = static_cast<int>(head & (kSomeMissing - 1));
  if (form >= kForms || (form == kStepForm && step == 0)) return false;
  Weights weights;
  if ((head & kOwnWeights) != 0) {
    const std::optional<Weights> own = takeWeights(bytes);
    if (!own) return false;
    weights = *own;
  }
  const bool someMissing = (head & kSomeMissing) != 0;
  if (form == kFloatForm)
    return decodeValues<Floats>(
        bytes, width, weights, someMissing, [](float value) { return value; }, heights);
  const FixedPoint numbers = fixedPointOf(form, step);
  const auto heightOf = [&](std::int32_t whole) {
    const double height = numbers.heightOf(whole);
    return std::abs(height) <= std::numeric_limits<float>::max() ? static_cast<float>(height)
                                                                 : kMissingHeight;
  };
  return decodeValues<WholeNumbers>(bytes, width, weights, someMissing, heightOf, heights);
}

}  // namespace levelset::terrain
