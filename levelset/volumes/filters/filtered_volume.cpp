#include "levelset/volumes/filters/filtered_volume.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "levelset/splines/bcc_quadratic_spline.h"
#include "levelset/splines/cubic_c1_spline.h"
#include "levelset/splines/quadratic_super_spline.h"
#include "levelset/volumes/filters/filter_weights.h"

namespace levelset {
namespace {

using Imath::V3d;

constexpr std::size_t kMost = FilterWeights::kMost;

/// Sums the samples with the weights of three axes, derivatives up to an order. The sums run along
/// x, then y, then z. @tparam IsCorrected  of BSplineQi: products with one corrected factor
template <int Order, bool IsCorrected>
VolumeDerivatives tensorProduct(const Volume& volume, VolumeFilter filter, const V3d& index,
                                GridExtension border) {
  const Imath::V3i size = volume.size();
  const FilterWeights x = filterWeights(filter, index.x, size.x, border),
                      y = filterWeights(filter, index.y, size.y, border),
                      z = filterWeights(filter, index.z, size.z, border);
  // Sums by the orders of the derivatives along x, y and z.
  double sums[3][3][3] = {};
  std::array<double, kMost> run{};
  const auto countX = static_cast<std::size_t>(x.count), countY = static_cast<std::size_t>(y.count),
             countZ = static_cast<std::size_t>(z.count);
  for (std::size_t c = 0; c < countZ; ++c) {
    double plane[3][3] = {}, uncorrected[3][3] = {};
    for (std::size_t b = 0; b < countY; ++b) {
      volume.storedRun(
          volume.index(x.first, y.first + static_cast<int>(b), z.first + static_cast<int>(c)),
          {run.data(), countX});
      for (std::size_t p = 0; p <= Order; ++p) {
        double row = 0;
        for (std::size_t a = 0; a < countX; ++a) row += x.weight[p][a] * run[a];
        if constexpr (!IsCorrected) {
          for (std::size_t q = 0; p + q <= Order; ++q) plane[p][q] += y.weight[q][b] * row;
        } else {
          double plain = 0;
          for (std::size_t a = 0; a < countX; ++a) plain += x.uncorrected[p][a] * run[a];
          for (std::size_t q = 0; p + q <= Order; ++q) {
            plane[p][q] += y.uncorrected[q][b] * (row - 2 * plain) + y.weight[q][b] * plain;
            uncorrected[p][q] += y.uncorrected[q][b] * plain;
          }
        }
      }
    }
    for (std::size_t p = 0; p <= Order; ++p)
      for (std::size_t q = 0; p + q <= Order; ++q)
        for (std::size_t r = 0; p + q + r <= Order; ++r)
          sums[p][q][r] +=
              IsCorrected ? z.uncorrected[r][c] * plane[p][q] + z.weight[r][c] * uncorrected[p][q]
                          : z.weight[r][c] * plane[p][q];
  }
  VolumeDerivatives found;
  found.value = volume.scale()(sums[0][0][0]);
  const double slope = volume.scale().slope;
  if constexpr (Order > 0)
    found.gradient = slope * V3d(sums[1][0][0], sums[0][1][0], sums[0][0][1]);
  if constexpr (Order > 1)
    found.hessian = slope * Imath::M33d(sums[2][0][0], sums[1][1][0], sums[1][0][1],  //
                                        sums[1][1][0], sums[0][2][0], sums[0][1][1],  //
                                        sums[1][0][1], sums[0][1][1], sums[0][0][2]);
  return found;
}

template <class Spline, int Order>
VolumeDerivatives onTetrahedra(const Volume& volume, const V3d& index, GridExtension border) {
  const Imath::V3i size = volume.size();
  const ExtendedGrid sample([&](int i, int j, int k) { return volume.at(i, j, k); },
                            {size.x, size.y, size.z}, border);
  const std::array<double, 3> position = {index.x, index.y, index.z};
  VolumeDerivatives found;
  if constexpr (Order == 0) {
    found.value = splineValue(Spline{}, sample, position);
  } else {
    const PointDerivatives<double> at = splineDerivatives(Spline{}, sample, position);
    found.value = at.value;
    for (int r = 0; r < 3; ++r) {
      const auto row = static_cast<std::size_t>(r);
      found.gradient[r] = at.gradient[row];
      for (int c = 0; c < 3; ++c)
        found.hessian[r][c] = at.hessian[row][static_cast<std::size_t>(c)];
    }
  }
  return found;
}

template <int Order>
VolumeDerivatives filtered(const Volume& volume, VolumeFilter filter, V3d index,
                           GridExtension border) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto last = static_cast<double>(volume.size()[axis] - 1);
    index[axis] = index[axis] > 0 ? std::min(index[axis], last) : 0;  // NaN becomes 0
  }
  switch (filter) {
    case VolumeFilter::SuperQuadratic:
      return onTetrahedra<QuadraticSuperSpline, Order>(volume, index, border);
    case VolumeFilter::CubicC1:
      return onTetrahedra<CubicC1Spline, Order>(volume, index, border);
    case VolumeFilter::BccQuadratic:
      return onTetrahedra<BccQuadraticSpline<2>, Order>(volume, index, border);
    case VolumeFilter::BSplineQi:
      return tensorProduct<Order, true>(volume, filter, index, border);
    default:
      return tensorProduct<Order, false>(volume, filter, index, border);
  }
}

}  // namespace

FilteredVolume::FilteredVolume(Volume volume, VolumeFilter filter, GridExtension border)
    : volume_(std::move(volume)),
      filter_(filter),
      border_(border),
      worldToIndex_(volume_.grid().indexToWorld.inverse()) {}

double FilteredVolume::value(const V3d& index) const {
  return filtered<0>(volume_, filter_, index, border_).value;
}

VolumeDerivatives FilteredVolume::derivatives(const V3d& index) const {
  return filtered<2>(volume_, filter_, index, border_);
}

VolumeDerivatives FilteredVolume::worldDerivatives(const V3d& world) const {
  VolumeDerivatives found = derivatives(world * worldToIndex_);
  Imath::M33d map;  // rows: derivatives of the index coordinates by x, y and z
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) map[r][c] = worldToIndex_[r][c];
  const V3d g = found.gradient;
  for (int r = 0; r < 3; ++r)
    found.gradient[r] = map[r][0] * g.x + map[r][1] * g.y + map[r][2] * g.z;
  found.hessian = map * found.hessian * map.transposed();
  return found;
}

}  // namespace levelset
