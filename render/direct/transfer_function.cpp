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
  for (const TransferPoint& point : points_)
    extinctions_.push_back(-std::log1p(-point.opacity) / voxel);

  constexpr double kFar = std::numeric_limits<double>::infinity();
  pieces_.push_back({-kFar, kFar, 0, extinctions_[0], 0, colourOf(points_[0]), V3d(0), {}});
  for (std::size_t n = 0; n + 1 < points_.size(); ++n) {
    Piece piece{points_[n].value,
                points_[n + 1].value - points_[n].value,
                0,
                extinctions_[n],
                extinctions_[n + 1] - extinctions_[n],
                colourOf(points_[n]),
                colourOf(points_[n + 1]) - colourOf(points_[n]),
                {}};
    if (n > 0) piece.before = pieces_.back().upTo(piece.low);
    piece.slope = piece.rise / piece.width;
    pieces_.push_back(piece);
  }
  Piece last{points_.back().value,     kFar,   0, extinctions_.back(), 0,
             colourOf(points_.back()), V3d(0), {}};
  if (pieces_.size() > 1) last.before = pieces_.back().upTo(last.low);
  pieces_.push_back(last);
}

TransferFunction::Integral TransferFunction::Piece::upTo(double value) const {
  Integral sum = before;
  const double length = value - low;
  if (rise == 0 && turn == V3d(0)) {
    sum.extinction += extinction * length;
    sum.emission += colour * (extinction * length);
    return sum;
  }
  // With s from 0 to 1 along the piece, colour × extinction is a quadratic polynomial of s.
  const double s = length / width;
  sum.extinction += length * (extinction + 0.5 * rise * s);
  sum.emission += length * (colour * extinction + (colour * rise + turn * extinction) * (0.5 * s) +
                            turn * (rise * s * s / 3));
  return sum;
}

const TransferFunction::Piece& TransferFunction::pieceAt(double value) const {
  // Few points are usual, so a linear search is fast.
  std::size_t n = pieces_.size() - 1;
  while (n > 0 && !(value >= pieces_[n].low)) --n;
  return pieces_[n];
}

double TransferFunction::extinctionIn(const Piece& piece, double value) {
  return piece.rise == 0 ? piece.extinction : piece.extinction + piece.slope * (value - piece.low);
}

double TransferFunction::extinction(double value) const {
  // At the end of a piece, rounding may leave a negative number.
  return std::max(extinctionIn(pieceAt(value), value), 0.0);
}

V3d TransferFunction::emission(double value) const {
  const Piece& piece = pieceAt(value);
  const V3d colour = piece.turn == V3d(0)
                         ? piece.colour
                         : piece.colour + piece.turn * ((value - piece.low) / piece.width);
  return colour * extinction(value);
}

TransferFunction::Integral TransferFunction::integral(double value) const {
  if (value >= points_[0].value) return pieceAt(value).upTo(value);
  const double length = value - points_[0].value;
  return {extinctions_[0] * length, colourOf(points_[0]) * (extinctions_[0] * length)};
}

TransferFunction::Bounds TransferFunction::boundsBetween(double low, double high) const {
  // The first piece that reaches beyond `low`, and all that begin below `high`.
  std::size_t n = pieces_.size() - 1;
  while (n > 0 && !(low >= pieces_[n].low)) --n;
  Bounds bounds{std::max(extinctionIn(pieces_[n], low), 0.0), std::abs(pieces_[n].slope)};
  for (; n + 1 < pieces_.size() && pieces_[n + 1].low < high; ++n) {
    bounds.extinction = std::max(bounds.extinction, pieces_[n + 1].extinction);
    bounds.slope = std::max(bounds.slope, std::abs(pieces_[n + 1].slope));
  }
  bounds.extinction = std::max(bounds.extinction, extinctionIn(pieces_[n], high));
  return bounds;
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
    text += fmt::format("{}{:.4g}:{:.4g}", text.empty() ? "" : " ", point.value, point.opacity);
    if (point.colour != Imath::C3f(1))
      text += fmt::format("/{:.4g},{:.4g},{:.4g}", point.colour.x, point.colour.y, point.colour.z);
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
  return {{first - soft, 0, faint},
          {first + soft, 0.02, faint},
          {last, 0.03, faint},
          {last + 0.15 * (high - last), 0.25, dense},
          {std::max(high, last + 0.2 * (high - last)), 0.5, dense}};
}

}  // namespace render
