#include "levelset/deform/lattice_certificate.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "levelset/deform/bernstein/least_value_search.h"
#include "levelset/mesh_sign/self_intersections.h"

namespace levelset {
namespace {

using Imath::V3d;

/// Largest number of multiplications for the determinant of one piece. Beyond it, the piece is
/// bounded by its derivatives alone.
constexpr double kMostProducts = 4e9;

/// Numerator of the Jacobian of a rational map: the determinant of the four homogeneous coordinates
/// and their derivatives. The denominator is the fourth power of the weight.
TensorBernstein rationalDeterminant(const std::array<TensorBernstein, 4>& map) {
  std::array<std::array<TensorBernstein, 4>, 4> rows;  // derivatives by u, v and w; value last
  for (std::size_t c = 0; c < 4; ++c) {
    for (int axis = 0; axis < 3; ++axis)
      rows[static_cast<std::size_t>(axis)][c] = derivative(map[c], axis);
    rows[3][c] = map[c];
  }
  // Laplace expansion by the first two and the last two rows.
  constexpr std::array<std::array<std::size_t, 2>, 6> kPairs = {
      {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
  constexpr std::array<double, 6> kSigns = {1, -1, 1, 1, -1, 1};
  TensorBernstein result;
  for (std::size_t n = 0; n < 6; ++n) {
    const auto [a, b] = kPairs[n];
    const auto [c, d] = kPairs[5 - n];
    const TensorBernstein term =
        product(difference2x2(rows[0][a], rows[1][b], rows[0][b], rows[1][a]),
                difference2x2(rows[2][c], rows[3][d], rows[2][d], rows[3][c]));
    if (n == 0)
      result = term;
    else
      addTo(result, term, kSigns[n]);
  }
  return result;
}

/// Number of multiplications of rationalDeterminant().
double rationalDeterminantCost(const std::array<int, 3>& degree) {
  const std::array<int, 3> twice = {2 * degree[0], 2 * degree[1], 2 * degree[2]};
  return 24 * productCost(degree, degree) + 6 * productCost(twice, twice);
}

/// Least Jacobian in a part of a piece: a lower bound, and the least value found.
struct JacobianBracket {
  double low = 0, high = std::numeric_limits<double>::infinity();
  V3d place{0};  ///< parameters of `high`
};

/// A box of parameters inside one piece, with the determinant on it.
struct JacobianPart {
  std::size_t piece = 0;
  V3d low, high;
  TensorBernstein numerator, weight;
};

/// Work on the pieces of one lattice.
class JacobianBounds {
 public:
  explicit JacobianBounds(const ControlLattice& lattice)
      : pieces_(lattice), isRational_(lattice.isRational()), volume_(boxVolume(lattice.data())) {
    const auto& axes = lattice.data().axes;
    const std::array<int, 3> degree = {axes[0].degree, axes[1].degree, axes[2].degree};
    isAffordable_ =
        (isRational_ ? rationalDeterminantCost(degree) : determinantCost(degree)) <= kMostProducts;
    // Terms of a coefficient times some roundings each.
    rounding_ = 16 * (degree[0] + degree[1] + degree[2]) * std::numeric_limits<double>::epsilon();
  }

  [[nodiscard]] std::size_t size() const { return pieces_.size(); }
  [[nodiscard]] bool isAffordable() const { return isAffordable_; }
  [[nodiscard]] bool isRational() const { return isRational_; }

  /// Bounds a piece without weights by the spread of its derivatives: with the Jacobian
  /// J(c) at the centre and J = J(c) (I + E), the determinant is at least det J(c) (1 − |E|)³.
  [[nodiscard]] JacobianBracket coarse(std::size_t index) const {
    const BezierPiece piece = pieces_.piece(index);
    const TensorPartials partials = partialsOf(piece.numerator);
    const double scale = scaleOf(piece);
    Eigen::Matrix3d centre;
    for (int axis = 0; axis < 3; ++axis)
      for (int c = 0; c < 3; ++c)
        centre(c, axis) = valueAt(
            partials[static_cast<std::size_t>(axis)][static_cast<std::size_t>(c)], {0.5, 0.5, 0.5});
    JacobianBracket bounds;
    const auto offer = [&](double value, const V3d& at) {
      if (value < bounds.high) {
        bounds.high = value;
        bounds.place = piece.low + (piece.high - piece.low) * at;
      }
    };
    const double middle = centre.determinant() / scale;
    offer(middle, V3d(0.5));
    for (int corner = 0; corner < 8; ++corner) {
      const std::array<int, 3> side = {corner & 1, (corner >> 1) & 1, corner >> 2};
      Eigen::Matrix3d jacobian;
      for (int axis = 0; axis < 3; ++axis)
        for (int c = 0; c < 3; ++c) {
          const TensorBernstein& form =
              partials[static_cast<std::size_t>(axis)][static_cast<std::size_t>(c)];
          jacobian(c, axis) =
              form.at(side[0] * form.degree[0], side[1] * form.degree[1], side[2] * form.degree[2]);
        }
      offer(jacobian.determinant() / scale, V3d(side[0], side[1], side[2]));
    }
    bounds.low = -std::numeric_limits<double>::infinity();
    if (!(middle > 0)) return bounds;
    const Eigen::Matrix3d inverse = centre.inverse();
    double squares = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto& column = partials[static_cast<std::size_t>(axis)];
      double worst = 0;
      for (std::size_t n = 0; n < column[0].coefficients.size(); ++n) {
        Eigen::Vector3d e =
            inverse * Eigen::Vector3d(column[0].coefficients[n], column[1].coefficients[n],
                                      column[2].coefficients[n]);
        e[axis] -= 1;
        worst = std::max(worst, e.squaredNorm());
      }
      squares += worst;
    }
    const double spread = std::sqrt(squares) * (1 + 1e-9) + 1e-12;
    if (spread < 1) bounds.low = middle * (1 - spread) * (1 - spread) * (1 - spread);
    return bounds;
  }

  /// The determinant of a piece as a polynomial.
  [[nodiscard]] JacobianPart partOf(std::size_t index) const {
    const BezierPiece piece = pieces_.piece(index);
    JacobianPart part{index, piece.low, piece.high, {}, piece.weight};
    const double scale = scaleOf(piece);
    double error = rounding_ * 6;
    if (isRational_) {
      // Relative to a point of the piece, so that far coordinates do not cancel.
      std::array<TensorBernstein, 4> map = {piece.numerator[0], piece.numerator[1],
                                            piece.numerator[2], piece.weight};
      for (std::size_t c = 0; c < 3; ++c)
        addTo(map[c], piece.weight, -map[c].coefficients[0] / piece.weight.coefficients[0]);
      part.numerator = rationalDeterminant(map);
      error *= 4 * largestCoefficient(piece.weight);
      for (int axis = 0; axis < 3; ++axis) {
        double largest = 0;
        for (const TensorBernstein& form : map)
          largest = std::max(largest, largestCoefficient(derivative(form, axis)));
        error *= largest;
      }
    } else {
      const TensorPartials partials = partialsOf(piece.numerator);
      part.numerator = determinantOf(partials[0], partials[1], partials[2]);
      for (const auto& column : partials) {
        double largest = 0;
        for (const TensorBernstein& form : column)
          largest = std::max(largest, largestCoefficient(form));
        error *= largest;
      }
    }
    // The rounding error is part of the lower bound.
    for (double& c : part.numerator.coefficients) c = c / scale - error / std::abs(scale);
    return part;
  }

  /// Bounds the determinant on a part. The values at its corners are coefficients.
  [[nodiscard]] static JacobianBracket boundsOf(const JacobianPart& part) {
    const CoefficientRange weight = rangeOf(part.weight);
    const auto over = [](double number, double by) { return number / (by * by * by * by); };
    const double least = rangeOf(part.numerator).least;
    JacobianBracket bounds{over(least, least > 0 ? weight.most : weight.least)};
    const TensorBernstein &n = part.numerator, &w = part.weight;
    for (int corner = 0; corner < 8; ++corner) {
      const std::array<int, 3> side = {corner & 1, (corner >> 1) & 1, corner >> 2};
      const double value =
          over(n.at(side[0] * n.degree[0], side[1] * n.degree[1], side[2] * n.degree[2]),
               w.at(side[0] * w.degree[0], side[1] * w.degree[1], side[2] * w.degree[2]));
      if (value < bounds.high) {
        bounds.high = value;
        bounds.place = part.low + (part.high - part.low) * V3d(side[0], side[1], side[2]);
      }
    }
    return bounds;
  }

  /// Halves a part along the parameter by which its determinant changes most.
  [[nodiscard]] static std::array<JacobianPart, 2> split(const JacobianPart& part) {
    int axis = 0;
    double most = -1;
    for (int a = 0; a < 3; ++a) {
      const double change = largestCoefficient(derivative(part.numerator, a)) +
                            largestCoefficient(derivative(part.weight, a));
      if (change > most) most = change, axis = a;
    }
    std::array<JacobianPart, 2> result = {part, part};
    std::tie(result[0].numerator, result[1].numerator) = halves(part.numerator, axis);
    std::tie(result[0].weight, result[1].weight) = halves(part.weight, axis);
    const double middle = 0.5 * (part.low[axis] + part.high[axis]);
    result[0].high[axis] = result[1].low[axis] = middle;
    return result;
  }

 private:
  /// Volume of the piece before the deformation; negative for a left-handed frame.
  [[nodiscard]] double scaleOf(const BezierPiece& piece) const {
    const V3d size = piece.high - piece.low;
    return volume_ * size.x * size.y * size.z;
  }

  BezierPieces pieces_;
  bool isRational_, isAffordable_ = true;
  double volume_, rounding_ = 0;
};

double bytesOf(const JacobianPart& part) {
  return static_cast<double>(
      sizeof(double) * (part.numerator.coefficients.size() + part.weight.coefficients.size()));
}

/// Number of segments along each parameter of the triangles on the faces of the box.
std::array<int, 3> faceSegments(const ControlLattice& lattice) {
  std::array<int, 3> segments{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const LatticeAxis& of = lattice.data().axes[axis];
    const double wanted = static_cast<double>(spanCount(of)) * (of.degree == 1 ? 1 : 2 * of.degree);
    segments[axis] = static_cast<int>(std::clamp(wanted, 4.0, 48.0));
  }
  return segments;
}

void testFaces(const ControlLattice& lattice, FoldCertificate& certificate,
               const Progress& progress) {
  const std::array<int, 3> n = faceSegments(lattice);
  std::vector<V3d> positions;
  std::vector<std::int64_t> numbers(static_cast<std::size_t>((n[0] + 1) * (n[1] + 1) * (n[2] + 1)),
                                    -1);
  const auto vertex = [&](const std::array<int, 3>& at) {
    std::int64_t& number =
        numbers[static_cast<std::size_t>((at[0] * (n[1] + 1) + at[1]) * (n[2] + 1) + at[2])];
    if (number < 0) {
      number = static_cast<std::int64_t>(positions.size());
      positions.push_back(lattice.at(
          lattice.worldOf(V3d(double(at[0]) / n[0], double(at[1]) / n[1], double(at[2]) / n[2]))));
    }
    return static_cast<std::uint32_t>(number);
  };
  std::vector<convert::Triangle> triangles;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int side : {0, n[axis]}) {
      const std::size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
      for (int i = 0; i < n[b]; ++i)
        for (int j = 0; j < n[c]; ++j) {
          std::array<int, 3> at{};
          at[axis] = side;
          std::array<std::uint32_t, 4> corners{};
          for (int corner = 0; corner < 4; ++corner) {
            at[b] = i + (corner == 1 || corner == 2);
            at[c] = j + (corner >= 2);
            corners[static_cast<std::size_t>(corner)] = vertex(at);
          }
          if (side == 0) std::swap(corners[1], corners[3]);
          triangles.push_back({corners[0], corners[1], corners[2]});
          triangles.push_back({corners[0], corners[2], corners[3]});
        }
    }
  const auto pairs = convert::findSelfIntersections(triangles, positions, progress);
  certificate.overlaps = !pairs.empty();
  if (pairs.empty()) return;
  const convert::Triangle& first = triangles[pairs[0].first];
  certificate.overlapPlace = (positions[first[0]] + positions[first[1]] + positions[first[2]]) / 3;
}

}  // namespace

FoldCertificate certifyLattice(const ControlLattice& lattice,
                               const LatticeCertificateOptions& options) {
  const JacobianBounds bounds(lattice);
  report(options.progress, 0);
  // Quick bounds of all pieces decide most of them. With weights there are none.
  std::vector<JacobianBracket> all(bounds.size());
  const auto inParallel = [](std::size_t count, const auto& work) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 8), [&](const auto& range) {
      for (std::size_t n = range.begin(); n != range.end(); ++n) work(n);
    });
  };
  const bool hasCoarse = !bounds.isRational();
  if (hasCoarse) inParallel(all.size(), [&](std::size_t n) { all[n] = bounds.coarse(n); });
  LeastValueSearch<JacobianPart, JacobianBracket, JacobianBounds> search(bounds);
  const JacobianBracket& best = search.best;
  double sum = 0;
  for (const JacobianBracket& one : all) {
    search.offer(one);
    if (hasCoarse) sum += std::abs(one.high);
  }
  report(options.progress, 0.2);
  const auto goal = [&](double low, double reference) {
    return best.high - low <= options.tolerance * std::max(std::abs(best.high), 0.01 * reference);
  };
  double reference = sum / static_cast<double>(all.size());
  std::vector<std::size_t> open;
  for (std::size_t n = 0; n < all.size(); ++n)
    if (!hasCoarse || !(all[n].low > 0) || !goal(all[n].low, reference)) open.push_back(n);
  FoldCertificate certificate{.pieces = all.size(), .boxes = all.size()};
  if (bounds.isAffordable()) {
    inParallel(open.size(), [&](std::size_t n) {
      all[open[n]] = JacobianBounds::boundsOf(bounds.partOf(open[n]));
    });
  } else if (!hasCoarse) {
    for (JacobianBracket& one : all) one.low = -std::numeric_limits<double>::infinity();
    const auto samples = faceSegments(lattice);
    for (int i = 0; i <= samples[0]; ++i)
      for (int j = 0; j <= samples[1]; ++j)
        for (int k = 0; k <= samples[2]; ++k) {
          const V3d u(double(i) / samples[0], double(j) / samples[1], double(k) / samples[2]);
          search.offer({0, lattice.jet(lattice.worldOf(u)).determinant(), u});
        }
  }
  report(options.progress, 0.6);
  std::vector<bool> isOpen(all.size(), false);
  for (const std::size_t n : open) {
    isOpen[n] = true;
    search.add(all[n], n);
    if (!hasCoarse) reference = std::max(reference, std::abs(all[n].high));
  }
  for (std::size_t n = 0; n < all.size(); ++n)
    if (!isOpen[n]) search.settled = std::min(search.settled, all[n].low);
  if (bounds.isAffordable()) {
    std::size_t passes = 0;
    certificate.boxes += search.run(
        options.mostBoxes, options.maxMemory,
        [&](double low) { return goal(low, reference) && (low > 0 || best.high <= 0); },
        [&](std::size_t boxes) {
          constexpr std::size_t kReported = 8;
          if (++passes % kReported == 0)
            report(options.progress, 0.6 + 0.2 * static_cast<double>(boxes) /
                                               (static_cast<double>(options.mostBoxes) + 1));
        });
  }
  report(options.progress, 0.8);
  certificate.leastLow = search.low();
  certificate.leastHigh = best.high;
  certificate.place = lattice.worldOf(best.place);
  certificate.verdict = verdictOf(certificate.leastLow, best.high);
  testFaces(lattice, certificate, subProgress(options.progress, 0.8, 1));
  report(options.progress, 1);
  return certificate;
}

}  // namespace levelset
