#include "apps/regress/truth/kalbe_errors.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "apps/regress/truth/kalbe_functions.h"
#include "levelset/splines/bcc_quadratic_spline.h"

namespace regress {

using levelset::BccCell;
using levelset::BccPartition;
using levelset::BccQuadraticSpline;
template <class Real>
using Form = levelset::BernsteinTetrahedron<2, KalbeNumbers<Real>>;

namespace {

constexpr int kDegree = 9;  ///< degree of the domain points: 220 of them in a tetrahedron
constexpr int kPoints = levelset::bernsteinCount(4, kDegree);
/// The domain points lie on a lattice of this many steps per grid spacing: vertices are multiples
/// of a quarter, and a ninth of that divides their differences.
constexpr int kSteps = 4 * kDegree;
constexpr int kSide = 2 * kSteps + 1;  ///< lattice points across a cell
constexpr int kRing = 3;               ///< cells beyond the first and the last datum that are read

struct Accumulator {
  std::array<double, 3> data{}, max{}, sum{}, squares{};

  template <class Real>
  void add(const KalbeNumbers<Real>& error, double times, bool isDatum) {
    for (std::size_t f = 0; f < 3; ++f) {
      const double e = std::abs(static_cast<double>(error.of[f]));
      max[f] = std::max(max[f], e);
      sum[f] += times * e;
      squares[f] += times * e * e;
      if (isDatum) data[f] = std::max(data[f], e);
    }
  }
  void add(const Accumulator& other) {
    for (std::size_t f = 0; f < 3; ++f) {
      data[f] = std::max(data[f], other.data[f]);
      max[f] = std::max(max[f], other.max[f]);
      sum[f] += other.sum[f];
      squares[f] += other.squares[f];
    }
  }
  [[nodiscard]] KalbeTables::Row errors(double count) const {
    KalbeTables::Row row;
    for (std::size_t f = 0; f < 3; ++f)
      row[f] = {data[f], max[f], sum[f] / count, std::sqrt(squares[f] / count)};
    return row;
  }
};

struct Accumulators {
  Accumulator valueOfQ3, valueOfQ2, slopeOfQ2, secondOfQ2;
};

/// Point of a cell that is measured in one tetrahedron for all tetrahedra that share it.
struct MeasuredPoint {
  int row = 0;            ///< domain point in the tetrahedron
  int column = 0, z = 0;  ///< position on the lattice of the cell
  double times = 1;       ///< number of the tetrahedra of the cell that hold it
  bool isDatum = false;
};

/// Tables that are the same for all cells.
template <class Real>
struct CellPoints {
  std::array<std::array<Real, 4>, kPoints> linear{};
  std::array<std::array<Real, 10>, kPoints> quadratic{};
  std::vector<std::vector<MeasuredPoint>> own;  ///< for each tetrahedron, the points it measures
  std::vector<std::vector<MeasuredPoint>> all;  ///< for each tetrahedron, all of its points

  CellPoints() : own(BccPartition::kTetrahedra), all(BccPartition::kTetrahedra) {
    constexpr auto kExponents = levelset::bernsteinExponents<4, kDegree>();
    for (int p = 0; p < kPoints; ++p) {
      const auto point = levelset::bernsteinDomainPoint<Real>(kExponents[p]);
      linear[p] = point;
      quadratic[p] = levelset::bernsteinBasis<4, 2, Real>(point);
    }
    std::map<std::array<int, 3>, std::pair<int, std::size_t>> first;
    for (int t = 0; t < BccPartition::kTetrahedra; ++t) {
      const BccPartition::Frame frame = BccPartition::frame(t);
      const auto vertices = BccPartition::quarters(frame.kind);
      for (int p = 0; p < kPoints; ++p) {
        std::array<int, 3> inFrame{};
        for (int v = 0; v < 4; ++v)
          for (int d = 0; d < 3; ++d) inFrame[d] += kExponents[p][v] * vertices[v][d];
        const std::array<int, 3> at = frame.toGrid(inFrame);
        MeasuredPoint measured;
        measured.row = p;
        measured.column = (at[0] + kSteps) * kSide + at[1] + kSteps;
        measured.z = at[2] + kSteps;
        measured.isDatum =
            std::all_of(at.begin(), at.end(), [](int c) { return std::abs(c) == kSteps / 2; });
        all[t].push_back(measured);
        const auto [owner, isNew] = first.try_emplace(at, t, own[t].size());
        if (isNew)
          own[t].push_back(measured);
        else
          own[owner->second.first][owner->second.second].times += 1;
      }
    }
  }
};

/// BccCells of the grid from −½ to ½ with n steps, and of some cells around it.
template <class Real>
class CellGrid {
 public:
  explicit CellGrid(int n) : side_(n + 2 * kRing + 2) {
    const Real h = Real(1) / Real(n);
    const int data = side_ + 1;
    std::vector<KalbeNumbers<Real>> values(static_cast<std::size_t>(data * data * data));
    const auto place = [&](int side, int i, int j, int k) {
      return static_cast<std::size_t>(((i + kRing) * side + j + kRing) * side + k + kRing);
    };
    std::vector<KalbeHeight<Real>> heights;
    for (int k = -kRing; k < data - kRing; ++k)
      heights.push_back(kalbeHeight<Real>(Real(k) * h - Real(0.5)));
    for (int i = -kRing; i < data - kRing; ++i)
      for (int j = -kRing; j < data - kRing; ++j) {
        const KalbeColumn<Real> column =
            kalbeColumn<Real>(Real(i) * h - Real(0.5), Real(j) * h - Real(0.5), 0);
        for (int k = -kRing; k < data - kRing; ++k)
          values[place(data, i, j, k)] =
              kalbeValue(column, heights[static_cast<std::size_t>(k + kRing)]);
      }
    cells_.resize(static_cast<std::size_t>(side_ * side_ * side_));
    const auto sample = [&](int i, int j, int k) { return values[place(data, i, j, k)]; };
    for (int i = -kRing; i < side_ - kRing; ++i)
      for (int j = -kRing; j < side_ - kRing; ++j)
        for (int k = -kRing; k < side_ - kRing; ++k)
          cells_[place(side_, i, j, k)] = levelset::bccCell(sample, {i, j, k});
  }

  const BccCell<KalbeNumbers<Real>>& operator()(const std::array<int, 3>& cell) const {
    return cells_[static_cast<std::size_t>(((cell[0] + kRing) * side_ + cell[1] + kRing) * side_ +
                                           cell[2] + kRing)];
  }

 private:
  int side_;
  std::vector<BccCell<KalbeNumbers<Real>>> cells_;
};

/// Derivatives by x at the four vertices of a tetrahedron, per grid spacing. They are linear.
template <class Real>
std::array<KalbeNumbers<Real>, 4> slopesAtVertices(const Form<Real>& form,
                                                   const levelset::BarycentricMap<4, Real>& map) {
  std::array<KalbeNumbers<Real>, 4> slopes{};
  for (int v = 0; v < 4; ++v) {
    slopes[v] = KalbeNumbers<Real>(0);
    for (int m = 0; m < 4; ++m) {
      std::array<int, 4> e{};
      ++e[v];
      ++e[m];
      slopes[v] += (2 * map.rows[m][0]) * form.at(e);
    }
  }
  return slopes;
}

template <class Real>
KalbeTables measuredTables(int n, bool withSecond, const std::function<void()>& tick) {
  static const CellPoints<Real> points;
  const CellGrid<Real> cells(n);
  const Real h = Real(1) / Real(n);
  // The position of a lattice point of the cells −1 to n, along an axis.
  const auto position = [&](int cell, int step) {
    const int steps = kSteps * cell + kSteps / 2 + step - kSteps;
    return Real(steps) * (h / kSteps) - Real(0.5);
  };
  std::array<levelset::BarycentricMap<4, Real>, BccPartition::kTetrahedra> maps{};
  for (int t = 0; t < BccPartition::kTetrahedra; ++t)
    maps[t] = BccPartition::barycentric<Real>({{0, 0, 0}, t});
  std::vector<KalbeHeight<Real>> heights;
  for (int k = -1; k <= n; ++k)
    for (int s = 0; s < kSide; ++s) heights.push_back(kalbeHeight(position(k, s)));

  const auto measureColumn = [&](int i, int j) {
    Accumulators result;
    std::array<std::vector<KalbeColumn<Real>>, 3> columns;
    for (int order = 0; order < (withSecond ? 3 : 2); ++order)
      for (int x = 0; x < kSide; ++x)
        for (int y = 0; y < kSide; ++y)
          columns[order].push_back(kalbeColumn(position(i, x), position(j, y), order));
    for (int k = i % 2 == 0 ? 0 : -1; k <= n; k += 2) {
      const KalbeHeight<Real>* const height = &heights[static_cast<std::size_t>((k + 1) * kSide)];
      for (int t = 0; t < BccPartition::kTetrahedra; ++t) {
        const levelset::PartitionTetrahedron tetrahedron{{i, j, k}, t};
        const Form<Real> q3 =
            BccQuadraticSpline<3>::fromCells<KalbeNumbers<Real>>(cells, tetrahedron);
        const Form<Real> q2 =
            BccQuadraticSpline<2>::fromCells<KalbeNumbers<Real>>(cells, tetrahedron);
        const std::array<KalbeNumbers<Real>, 4> slopes = slopesAtVertices(q2, maps[t]);
        for (const MeasuredPoint& p : points.own[t]) {
          const auto& quadratic = points.quadratic[p.row];
          const auto& linear = points.linear[p.row];
          KalbeNumbers<Real> value3(0), value2(0), slope(0);
          for (int c = 0; c < 10; ++c) {
            value3 += quadratic[c] * q3.coefficients[c];
            value2 += quadratic[c] * q2.coefficients[c];
          }
          for (int v = 0; v < 4; ++v) slope += linear[v] * slopes[v];
          const KalbeNumbers<Real> exact = kalbeValue(columns[0][p.column], height[p.z]);
          const KalbeNumbers<Real> exactSlope = kalbeValue(columns[1][p.column], height[p.z]);
          result.valueOfQ3.add(value3 - exact, p.times, p.isDatum);
          result.valueOfQ2.add(value2 - exact, p.times, p.isDatum);
          result.slopeOfQ2.add(Real(n) * slope - exactSlope, p.times, p.isDatum);
        }
        if (!withSecond) continue;
        KalbeNumbers<Real> second(0);
        for (int v = 0; v < 4; ++v) second += maps[t].rows[v][0] * slopes[v];
        for (const MeasuredPoint& p : points.all[t])
          result.secondOfQ2.add(
              Real(n) * Real(n) * second - kalbeValue(columns[2][p.column], height[p.z]), 1,
              p.isDatum);
      }
    }
    return result;
  };

  Accumulators all;
  double count = 0;
  for (int i = -1; i <= n; ++i) {
    tick();
    const int first = i % 2 == 0 ? 0 : -1;
    const int many = (n - first) / 2 + 1;
    std::vector<Accumulators> row(static_cast<std::size_t>(many));
    tbb::parallel_for(0, many, [&](int j) {
      row[static_cast<std::size_t>(j)] = measureColumn(i, first + 2 * j);
    });
    for (const Accumulators& a : row) {
      all.valueOfQ3.add(a.valueOfQ3);
      all.valueOfQ2.add(a.valueOfQ2);
      all.slopeOfQ2.add(a.slopeOfQ2);
      all.secondOfQ2.add(a.secondOfQ2);
    }
    count += static_cast<double>(many) * many * BccPartition::kTetrahedra * kPoints;
  }
  return {all.valueOfQ3.errors(count), all.valueOfQ2.errors(count), all.slopeOfQ2.errors(count),
          all.secondOfQ2.errors(count)};
}

}  // namespace

template <>
KalbeTables kalbeTables<float>(int n, bool withSecond, const std::function<void()>& tick) {
  return measuredTables<float>(n, withSecond, tick);
}

template <>
KalbeTables kalbeTables<double>(int n, bool withSecond, const std::function<void()>& tick) {
  return measuredTables<double>(n, withSecond, tick);
}

template <>
KalbeTables kalbeTables<long double>(int n, bool withSecond, const std::function<void()>& tick) {
  return measuredTables<long double>(n, withSecond, tick);
}

}  // namespace regress
