#include "levelset/deform/untangle/untangle_deformation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "levelset/deform/cage/cage_shared.h"
#include "levelset/deform/cage/domain_cells.h"
#include "levelset/deform/lattice_certificate.h"
#include "levelset/deform/untangle/untangle_solver.h"

namespace levelset {
namespace {

using Imath::V3d;
using untangle::ControlledMap;
using untangle::DeterminantSlope;

/// Test points along each axis in a piece of a lattice, and the level of the octree whose cubes
/// have a test point each.
constexpr int kTestsPerPiece = 3, kTestLevel = 4;
constexpr int kMostTestsPerAxis = 24;
/// Test points on the surface.
constexpr std::size_t kSurfaceTests = 500;

/// Cofactors of the Jacobian: the gradient of the determinant by its columns.
std::array<V3d, 3> cofactors(const DeformationJet& jet) {
  return {jet.slopes[1].cross(jet.slopes[2]), jet.slopes[2].cross(jet.slopes[0]),
          jet.slopes[0].cross(jet.slopes[1])};
}

V3d columnsTimes(const std::array<V3d, 3>& columns, const V3d& by) {
  return columns[0] * by.x + columns[1] * by.y + columns[2] * by.z;
}

class ControlledLattice final : public ControlledMap {
 public:
  explicit ControlledLattice(ControlLattice lattice) : lattice_(std::move(lattice)) {}

  [[nodiscard]] const ControlLattice& lattice() const { return lattice_; }
  [[nodiscard]] std::vector<V3d> controls() const override { return lattice_.data().points; }
  [[nodiscard]] std::vector<V3d> identity() const override {
    return identityLattice(lattice_.data().axes, lattice_.data().boxToWorld).data().points;
  }
  void move(const std::vector<V3d>& controls) override {
    LatticeData data = lattice_.data();
    data.points = controls;
    lattice_ = ControlLattice(std::move(data));
  }
  [[nodiscard]] FoldCertificate certificate(const CertifyOptions& options) const override {
    return certifyLattice(lattice_, {.maxMemory = options.maxMemory, .progress = options.progress});
  }
  [[nodiscard]] std::size_t slopesPerPoint() const override {
    std::size_t count = 1;
    for (const LatticeAxis& axis : lattice_.data().axes)
      count *= static_cast<std::size_t>(axis.degree + 1);
    return count;
  }

  [[nodiscard]] DeterminantSlope determinantAt(const V3d& world) const override {
    const DeformationJet jet = lattice_.jet(world);
    const std::array<V3d, 3> by = cofactors(jet);
    const LatticeData& data = lattice_.data();
    const V3d u = lattice_.parameterOf(world);
    // Values and derivatives of the basis along each axis. The derivatives only give the direction
    // of a step, so differences suffice.
    std::array<std::vector<double>, 3> value, slope;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double at = std::clamp(u[static_cast<int>(axis)], 0.0, 1.0);
      const double low = std::max(at - kBasisStep, 0.0), high = std::min(at + kBasisStep, 1.0);
      value[axis] = basisAt(data.axes[axis], at);
      slope[axis] = basisAt(data.axes[axis], high);
      const std::vector<double> before = basisAt(data.axes[axis], low);
      for (std::size_t n = 0; n < before.size(); ++n)
        slope[axis][n] = (slope[axis][n] - before[n]) / (high - low);
    }
    // World gradients of the parameters.
    const V3d origin = lattice_.parameterOf(V3d(0));
    std::array<V3d, 3> gradient;
    for (int axis = 0; axis < 3; ++axis) {
      V3d unit(0);
      unit[axis] = 1;
      const V3d change = lattice_.parameterOf(unit) - origin;
      for (int a = 0; a < 3; ++a) gradient[static_cast<std::size_t>(a)][axis] = change[a];
    }
    DeterminantSlope result{jet.determinant()};
    double weight = 0;
    V3d weightSlope(0);
    std::vector<double> shares;
    const std::size_t countV = value[1].size(), countW = value[2].size();
    for (std::size_t i = 0; i < value[0].size(); ++i)
      for (std::size_t j = 0; j < countV; ++j)
        for (std::size_t k = 0; k < countW; ++k) {
          const V3d partial(slope[0][i] * value[1][j] * value[2][k],
                            value[0][i] * slope[1][j] * value[2][k],
                            value[0][i] * value[1][j] * slope[2][k]);
          const double share = value[0][i] * value[1][j] * value[2][k];
          if (partial == V3d(0) && share == 0) continue;
          const std::size_t n = (i * countV + j) * countW + k;
          const double by1 = data.weights.empty() ? 1 : data.weights[n];
          result.slopes.emplace_back(static_cast<std::uint32_t>(n),
                                     columnsTimes(gradient, partial) * by1);
          shares.push_back(share * by1);
          weight += share * by1;
          weightSlope += columnsTimes(gradient, partial) * by1;
        }
    for (std::size_t n = 0; n < shares.size(); ++n) {
      V3d& entry = result.slopes[n].second;
      entry = (entry - weightSlope * (shares[n] / weight)) / weight;
      entry = columnsTimes(by, entry);
    }
    return result;
  }

  [[nodiscard]] std::vector<V3d> testPoints() const override {
    std::array<int, 3> counts{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const LatticeAxis& of = lattice_.data().axes[axis];
      counts[axis] =
          std::min(kMostTestsPerAxis,
                   std::max(of.degree + 1, kTestsPerPiece) * static_cast<int>(spanCount(of)) + 1);
    }
    std::vector<V3d> points;
    for (int i = 0; i < counts[0]; ++i)
      for (int j = 0; j < counts[1]; ++j)
        for (int k = 0; k < counts[2]; ++k)
          points.push_back(
              lattice_.worldOf(V3d(double(i) / (counts[0] - 1), double(j) / (counts[1] - 1),
                                   double(k) / (counts[2] - 1))));
    return points;
  }

  /// The place and a grid around it, since the determinant is a polynomial of high degree.
  [[nodiscard]] std::vector<V3d> testPointsAround(const V3d& place) const override {
    const V3d u = lattice_.parameterOf(place);
    std::vector<V3d> points;
    for (int n = 0; n < 27; ++n) {
      const int row = n / 3, layer = n / 9;
      V3d at(n % 3 - 1, row % 3 - 1, layer - 1);
      for (int axis = 0; axis < 3; ++axis) {
        const LatticeAxis& of = lattice_.data().axes[static_cast<std::size_t>(axis)];
        const double step =
            0.25 / (static_cast<double>(spanCount(of)) * static_cast<double>(of.degree + 1));
        at[axis] = std::clamp(u[axis] + at[axis] * step, 0.0, 1.0);
      }
      points.push_back(lattice_.worldOf(at));
    }
    return points;
  }

 private:
  static constexpr double kBasisStep = 1e-5;
  ControlLattice lattice_;
};

class ControlledCage final : public ControlledMap {
 public:
  ControlledCage(const CageDeformation& cage, const DeformationDomain& domain)
      : cage_(cage), domain_(domain) {}

  [[nodiscard]] const CageDeformation& cage() const { return cage_; }
  [[nodiscard]] std::vector<V3d> controls() const override { return cage_.moved(); }
  [[nodiscard]] std::vector<V3d> identity() const override { return cage_.rest(); }
  void move(const std::vector<V3d>& controls) override { cage_ = cage_.withMoved(controls); }
  [[nodiscard]] FoldCertificate certificate(const CertifyOptions& options) const override {
    return cage_.certify(domain_, options).certificate;
  }
  [[nodiscard]] std::size_t slopesPerPoint() const override { return cage_.rest().size(); }

  [[nodiscard]] DeterminantSlope determinantAt(const V3d& world) const override {
    const DeformationJet jet = cage_.jet(world);
    const std::array<V3d, 3> by = cofactors(jet);
    const CageDeformation::Coordinates at = cage_.coordinatesAt(world);
    std::vector<V3d> slopes(at.vertices.size());
    for (std::size_t n = 0; n < slopes.size(); ++n)
      slopes[n] = columnsTimes(by, at.vertexSlopes[n]);
    for (std::size_t t = 0; t < at.triangles.size(); ++t)
      addNormalSlopes(t, columnsTimes(by, at.triangleSlopes[t]), slopes);
    DeterminantSlope result{jet.determinant()};
    for (std::size_t n = 0; n < slopes.size(); ++n)
      result.slopes.emplace_back(static_cast<std::uint32_t>(n), slopes[n]);
    return result;
  }

  [[nodiscard]] std::vector<V3d> testPoints() const override {
    std::vector<V3d> points;
    const cage::DomainCells cells(domain_);
    const bool isGreen = cage_.coordinates() == CageCoordinates::Green;
    for (std::uint32_t i = 0; i < 1u << kTestLevel; ++i)
      for (std::uint32_t j = 0; j < 1u << kTestLevel; ++j)
        for (std::uint32_t k = 0; k < 1u << kTestLevel; ++k) {
          const V3d centre = cells.centreOf({kTestLevel, {i, j, k}});
          if (cells.contains(centre) && (!isGreen || cage_.contains(centre)))
            points.push_back(centre);
        }
    const std::size_t stride = std::max<std::size_t>(1, domain_.points.size() / kSurfaceTests);
    for (std::size_t n = 0; n < domain_.points.size(); n += stride)
      points.push_back(domain_.points[n]);
    return points;
  }

  [[nodiscard]] std::vector<V3d> testPointsAround(const V3d& place) const override {
    return {place};
  }

 private:
  /// Adds the gradient of `by` · stretched normal by the corners of a triangle, by differences.
  void addNormalSlopes(std::size_t t, const V3d& by, std::vector<V3d>& slopes) const {
    const auto& corners = cage_.triangles()[t];
    const cage::CageTriangle& rest = cage_.parts()[t];
    std::array<V3d, 3> at = {cage_.moved()[corners[0]], cage_.moved()[corners[1]],
                             cage_.moved()[corners[2]]};
    const double step = 1e-6 * rest.diameter;
    for (std::size_t n = 0; n < 3; ++n)
      for (int axis = 0; axis < 3; ++axis) {
        const double middle = at[n][axis];
        at[n][axis] = middle + step;
        const double after = by.dot(cage::stretchedNormal(rest, at));
        at[n][axis] = middle - step;
        const double before = by.dot(cage::stretchedNormal(rest, at));
        at[n][axis] = middle;
        slopes[corners[n]][axis] += (after - before) / (2 * step);
      }
  }

  CageDeformation cage_;
  const DeformationDomain& domain_;
};

}  // namespace

UntangledLattice untangled(const ControlLattice& lattice, const UntangleOptions& options) {
  ControlledLattice map(lattice);
  UntangleReport report = untangle::removeFolds(map, options);
  return {report.rounds > 1 ? map.lattice() : lattice, report};
}

UntangledCage untangled(const CageDeformation& cage, const DeformationDomain& domain,
                        const UntangleOptions& options) {
  ControlledCage map(cage, domain);
  UntangleReport report = untangle::removeFolds(map, options);
  return {report.rounds > 1 ? map.cage() : cage, report};
}

}  // namespace levelset
