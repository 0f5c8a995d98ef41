#include "render/direct/transfer_function.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "levelset/error.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::UsageError;

void requirePoint(const TransferPoint& point) {
  if (!std::isfinite(point.value) || !(point.opacity >= 0 && point.opacity < 1))
    throw UsageError(fmt::format(
        "the opacity {} at the value {} is not valid; give a finite value, and an opacity of at "
        "least 0 and less than 1 for a layer of one voxel",
        point.opacity, point.value));
  for (int c = 0; c < 3; ++c)
    if (!(point.colour[c] >= 0 && std::isfinite(point.colour[c])))
      throw UsageError(fmt::format(
          "the colour {},{},{} at the value {} is not valid; give numbers of at least 0",
          point.colour.x, point.colour.y, point.colour.z, point.value));
}

V3d colourOf(const TransferPoint& point) {
  return {static_cast<double>(point.colour.x), static_cast<double>(point.colour.y),
          static_cast<double>(point.colour.z)};
}

}  // namespace

TransferFunction::TransferFunction(std::vector<TransferPoint> points, double voxel)
    : points_(std::move(points)) {
  if (points_.empty())
    throw UsageError("the transfer function has no point; give at least one, as 40:0.1");
  if (!(voxel > 0) || !std::isfinite(voxel))
    throw UsageError(fmt::format("the length of a voxel is {}; give a positive number", voxel));
  for (const TransferPoint& point : points_) requirePoint(point);
  std::sort(points_.begin(), points_.end(),
            [](const TransferPoint& a, const TransferPoint& b) { return a.value < b.value; });
  for (std::size_t n = 1; n < points_.size(); ++n)
    if (points_[n].value == points_[n - 1].value)
      throw UsageError(
          fmt::format("the transfer function has two points at the value {}; give one of them, or "
                      "move one a little",
                      points_[n].value));
  const auto extinctionOf = [&](const TransferPoint& point) {
    return -std::log1p(-point.opacity) / voxel;
  };
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const auto addConstant = [&](double low, const TransferPoint& point) {
    pieces_.push_back({low, kFar, extinctionOf(point), 0, colourOf(point), V3d(0)});
  };
  addConstant(-kFar, points_.front());
  for (std::size_t n = 0; n + 1 < points_.size(); ++n) {
    const TransferPoint &a = points_[n], &b = points_[n + 1];
    const double width = b.value - a.value;
    pieces_.push_back({a.value, width, extinctionOf(a), (extinctionOf(b) - extinctionOf(a)) / width,
                       colourOf(a), colourOf(b) - colourOf(a)});
  }
  addConstant(points_.back().value, points_.back());
}

std::size_t TransferFunction::pieceAt(double value) const {
  // Few points are usual, so a linear search is fast.
  std::size_t n = pieces_.size() - 1;
  while (n > 0 && !(value >= pieces_[n].low)) --n;
  return n;
}

double TransferFunction::extinctionIn(const Piece& piece, double value) {
  // At the end of a piece, rounding may leave a negative number.
  return piece.slope == 0 ? piece.extinction
                          : std::max(piece.extinction + piece.slope * (value - piece.low), 0.0);
}

V3d TransferFunction::emissionIn(const Piece& piece, double value) {
  const V3d colour = piece.turn == V3d(0)
                         ? piece.colour
                         : piece.colour + piece.turn * ((value - piece.low) / piece.width);
  return colour * extinctionIn(piece, value);
}

double TransferFunction::extinction(double value) const {
  return extinctionIn(pieces_[pieceAt(value)], value);
}

V3d TransferFunction::emission(double value) const {
  return emissionIn(pieces_[pieceAt(value)], value);
}

bool TransferFunction::isEmptyBetween(double low, double high) const {
  std::size_t n = pieceAt(low);
  if (extinctionIn(pieces_[n], low) > 0) return false;
  for (; n + 1 < pieces_.size() && pieces_[n + 1].low < high; ++n)
    if (pieces_[n + 1].extinction > 0) return false;
  return extinctionIn(pieces_[n], high) == 0;
}

std::vector<double> TransferFunction::pieceNumbers() const {
  std::vector<double> numbers;
  for (const Piece& piece : pieces_) {
    const bool hasOneColour = piece.turn == V3d(0);
    numbers.insert(numbers.end(), {piece.low, hasOneColour ? 0 : piece.width, piece.extinction,
                                   piece.slope, piece.colour.x, piece.colour.y, piece.colour.z,
                                   piece.turn.x, piece.turn.y, piece.turn.z});
  }
  return numbers;
}

std::vector<TransferPoint> parseTransfer(const std::string& text) {
  std::vector<TransferPoint> points;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    std::istringstream numbers(word);
    TransferPoint point;
    char mark = 0;
    bool isValid =
        static_cast<bool>(numbers >> point.value >> mark >> point.opacity) && mark == ':';
    if (isValid && numbers.peek() == '/') {
      char comma[2] = {};
      isValid = static_cast<bool>(numbers >> mark >> point.colour.x >> comma[0] >> point.colour.y >>
                                  comma[1] >> point.colour.z) &&
                comma[0] == ',' && comma[1] == ',';
    }
    if (!isValid || numbers.peek() != std::istringstream::traits_type::eof())
      throw UsageError(fmt::format(
          "'{}' is no point of a transfer function; write VALUE:OPACITY or "
          "VALUE:OPACITY/RED,GREEN,BLUE, and separate points by blanks: \"40:0 60:0.1/1,0.8,0.7\"",
          word));
    points.push_back(point);
  }
  if (points.empty())
    throw UsageError("the transfer function has no point; give at least one, as 40:0.1");
  return points;
}

std::string transferText(const std::vector<TransferPoint>& points) {
  std::string text;
  for (const TransferPoint& point : points) {
    text += fmt::format("{}{}:{}", text.empty() ? "" : " ", point.value, point.opacity);
    if (point.colour != Imath::C3f(1))
      text += fmt::format("/{},{},{}", point.colour.x, point.colour.y, point.colour.z);
  }
  return text;
}

std::vector<TransferPoint> suggestedTransfer(const levelset::VolumeHistogram& histogram) {
  const Imath::C3f faint(0.80f, 0.42f, 0.25f), dense(0.95f, 0.90f, 0.80f);
  const double low = histogram.low, high = histogram.high, span = high - low;
  if (!(span > 0)) return {{low, 0.05, dense}};
  const double first = histogram.otsu.empty() ? low + 0.3 * span : histogram.otsu.front(),
               last =
                   histogram.otsu.size() < 2 ? first + 0.3 * (high - first) : histogram.otsu.back();
  const double soft = 0.25 * (first - low);
  // Short numbers are easier to edit.
  const auto shortened = [&](double value) {
    const double near = std::stod(fmt::format("{:.4g}", value));
    return std::abs(near - value) < 1e-3 * span ? near : value;
  };
  return {{shortened(first - soft), 0, faint},
          {shortened(first + soft), 0.02, faint},
          {shortened(last), 0.03, faint},
          {shortened(last + 0.15 * (high - last)), 0.25, dense},
          {shortened(std::max(high, last + 0.2 * (high - last))), 0.5, dense}};
}

}  // namespace render
