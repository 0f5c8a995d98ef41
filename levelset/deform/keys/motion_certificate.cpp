#include "levelset/deform/keys/motion_certificate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "levelset/deform/bernstein/least_value_search.h"
#include "levelset/deform/bernstein/tensor_bernstein.h"

namespace levelset {
namespace {

using Imath::V3d;

/// Largest number of multiplications for the determinants of all pieces. Beyond it, the motion
/// stays undecided.
constexpr double kMostProducts = 2e10;

/// Determinant on a box of parameters and time: Bernstein coefficients in time, each a polynomial
/// in the parameters.
struct MotionPart {
  V3d low, high;
  double begin = 0, end = 1;
  std::vector<TensorBernstein> coefficients = {};
};

struct MotionBracket {
  double low = 0, high = std::numeric_limits<double>::infinity();
  V3d place{0};  ///< parameters of `high`
  double time = 0;
};

class MotionBounds {
 public:
  explicit MotionBounds(const std::vector<ControlLattice>& control) {
    for (const ControlLattice& lattice : control) pieces_.emplace_back(lattice);
    const LatticeData& data = control.front().data();
    volume_ = boxVolume(data);
    const std::array<int, 3> degree = {data.axes[0].degree, data.axes[1].degree,
                                       data.axes[2].degree};
    const auto count = static_cast<double>(control.size());
    products_ = static_cast<double>(size()) * count * count * count * determinantCost(degree);
    rounding_ = 16 * (degree[0] + degree[1] + degree[2]) * std::numeric_limits<double>::epsilon();
  }

  [[nodiscard]] std::size_t size() const { return pieces_.front().size(); }
  [[nodiscard]] bool isAffordable() const { return products_ <= kMostProducts; }

  /// The determinant of a whole piece over the whole interval.
  [[nodiscard]] MotionPart partOf(std::size_t index) const {
    const std::size_t degree = pieces_.size() - 1;
    std::vector<TensorPartials> partials;  // for each lattice
    MotionPart part;
    std::array<double, 3> largest{};
    for (const BezierPieces& pieces : pieces_) {
      const BezierPiece piece = pieces.piece(index);
      part.low = piece.low;
      part.high = piece.high;
      partials.push_back(partialsOf(piece.numerator));
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const TensorBernstein& form : partials.back()[axis])
          largest[axis] = std::max(largest[axis], largestCoefficient(form));
    }
    const auto row = static_cast<int>(degree);
    const std::vector<double> one = binomials(row), three = binomials(3 * row);
    part.coefficients.resize(3 * degree + 1);
    for (std::size_t a = 0; a <= degree; ++a)
      for (std::size_t b = 0; b <= degree; ++b)
        for (std::size_t c = 0; c <= degree; ++c) {
          const std::size_t s = a + b + c;
          const TensorBernstein term =
              determinantOf(partials[a][0], partials[b][1], partials[c][2]);
          TensorBernstein& sum = part.coefficients[s];
          if (sum.coefficients.empty()) sum = TensorBernstein(term.degree);
          addTo(sum, term, one[a] * one[b] * one[c] / three[s]);
        }
    const V3d size = part.high - part.low;
    const double scale = volume_ * size.x * size.y * size.z;
    const double error = 6 * rounding_ * largest[0] * largest[1] * largest[2];
    // The rounding error is part of the lower bound.
    for (TensorBernstein& form : part.coefficients)
      for (double& value : form.coefficients) value = value / scale - error / std::abs(scale);
    return part;
  }

  /// Bounds of the determinant on a part. The values at its corners are coefficients.
  [[nodiscard]] static MotionBracket boundsOf(const MotionPart& part) {
    MotionBracket bounds{std::numeric_limits<double>::infinity()};
    for (const TensorBernstein& form : part.coefficients)
      bounds.low = std::min(bounds.low, rangeOf(form).least);
    for (const bool isEnd : {false, true}) {
      const TensorBernstein& form = isEnd ? part.coefficients.back() : part.coefficients.front();
      for (int corner = 0; corner < 8; ++corner) {
        const std::array<int, 3> side = {corner & 1, (corner >> 1) & 1, corner >> 2};
        const double value =
            form.at(side[0] * form.degree[0], side[1] * form.degree[1], side[2] * form.degree[2]);
        if (!(value < bounds.high)) continue;
        bounds.high = value;
        bounds.place = part.low + (part.high - part.low) * V3d(side[0], side[1], side[2]);
        bounds.time = isEnd ? part.end : part.begin;
      }
    }
    return bounds;
  }

  /// Halves a part along the parameter, or time, by which its determinant changes most.
  [[nodiscard]] static std::array<MotionPart, 2> split(MotionPart part) {
    int axis = 3;
    double most = 0;
    for (std::size_t s = 0; s + 1 < part.coefficients.size(); ++s)
      for (std::size_t n = 0; n < part.coefficients[s].coefficients.size(); ++n)
        most = std::max(most, std::abs(part.coefficients[s + 1].coefficients[n] -
                                       part.coefficients[s].coefficients[n]));
    most *= static_cast<double>(part.coefficients.size() - 1);
    for (int a = 0; a < 3; ++a)
      for (const TensorBernstein& form : part.coefficients) {
        const double change = largestCoefficient(derivative(form, a));
        if (change > most) most = change, axis = a;
      }
    return axis == 3 ? halvesInTime(std::move(part)) : halvesAlong(part, axis);
  }

 private:
  [[nodiscard]] static std::array<MotionPart, 2> halvesAlong(const MotionPart& part, int axis) {
    std::array<MotionPart, 2> result = {part, part};
    for (std::size_t s = 0; s < part.coefficients.size(); ++s)
      std::tie(result[0].coefficients[s], result[1].coefficients[s]) =
          halves(part.coefficients[s], axis);
    const double middle = 0.5 * (part.low[axis] + part.high[axis]);
    result[0].high[axis] = result[1].low[axis] = middle;
    return result;
  }

  [[nodiscard]] static std::array<MotionPart, 2> halvesInTime(MotionPart part) {
    std::array<MotionPart, 2> result = {part, part};
    result[0].end = result[1].begin = 0.5 * (part.begin + part.end);
    const std::size_t count = part.coefficients.size();
    std::vector<TensorBernstein>& row = part.coefficients;
    for (std::size_t n = 0; n < count; ++n) {
      result[0].coefficients[n] = row.front();
      result[1].coefficients[count - 1 - n] = row.back();
      for (std::size_t k = 0; k + 1 < row.size(); ++k)
        for (std::size_t i = 0; i < row[k].coefficients.size(); ++i)
          row[k].coefficients[i] = 0.5 * (row[k].coefficients[i] + row[k + 1].coefficients[i]);
      row.pop_back();
    }
    return result;
  }

  std::vector<BezierPieces> pieces_;
  double volume_ = 0, products_ = 0, rounding_ = 0;
};

double bytesOf(const MotionPart& part) {
  double sum = 0;
  for (const TensorBernstein& form : part.coefficients)
    sum += static_cast<double>(sizeof(double) * form.coefficients.size());
  return sum;
}

}  // namespace

MotionCertificate certifyMotion(const std::vector<ControlLattice>& control,
                                const MotionCertificateOptions& options) {
  report(options.progress, 0);
  const ControlLattice& lattice = control.front();
  MotionCertificate certificate;
  if (lattice.isRational()) return certificate;
  const MotionBounds bounds(control);
  if (!bounds.isAffordable()) return certificate;
  LeastValueSearch<MotionPart, MotionBracket, MotionBounds> search(bounds);
  const MotionBracket& best = search.best;
  for (std::size_t n = 0; n < bounds.size(); ++n) {
    search.add(MotionBounds::boundsOf(bounds.partOf(n)), n);
    report(options.progress, 0.6 * static_cast<double>(n) / static_cast<double>(bounds.size()));
  }
  certificate.boxes = bounds.size();
  certificate.boxes += search.run(
      options.mostBoxes, options.maxMemory,
      [&](double low) {
        return best.high <= 0 || (low > 0 && best.high - low <= options.tolerance * best.high);
      },
      [&](std::size_t boxes) {
        report(options.progress,
               0.6 + 0.4 * static_cast<double>(boxes) / static_cast<double>(options.mostBoxes + 2));
      });
  certificate.leastLow = search.low();
  certificate.leastHigh = best.high;
  certificate.place = lattice.worldOf(best.place);
  certificate.time = best.time;
  certificate.verdict = verdictOf(certificate.leastLow, best.high);
  report(options.progress, 1);
  return certificate;
}

}  // namespace levelset
