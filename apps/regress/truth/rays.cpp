#include "apps/regress/truth/rays.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/grids/sample.h"
#include "levelset/vdb.h"

namespace regress {

using Imath::V3d;
using levelset::BandSampler;
using levelset::NarrowBand;

namespace {

/// Returns number i of the van der Corput sequence of `base`, in [0, 1).
double radicalInverse(int i, int base) {
  double result = 0, digit = 1.0 / base;
  for (; i > 0; i /= base, digit /= base) result += digit * (i % base);
  return result;
}

V3d onSphere(double u, double v) {
  const double z = 1 - 2 * u, r = std::sqrt(std::max(0.0, 1 - z * z)), a = 2 * std::numbers::pi * v;
  return {r * std::cos(a), r * std::sin(a), z};
}

struct Chord {
  V3d from, direction;
  double length = 0;
};

/// Builds chord number i, between two independent points of a sphere. Such chords are evenly
/// distributed over the lines that cross the sphere.
Chord chord(int i, const V3d& centre, double radius) {
  const V3d from = onSphere(radicalInverse(i + 1, 2), radicalInverse(i + 1, 3));
  const V3d to = onSphere(radicalInverse(i + 1, 5), radicalInverse(i + 1, 7));
  const V3d way = (to - from) * radius;
  const double length = way.length();
  return {centre + from * radius, length > 0 ? way / length : V3d(1, 0, 0), length};
}

/// Finds a zero by regula falsi with the Illinois rule: the value at an end that stays twice in a
/// row is halved.
template <typename Function>
double root(const Function& f, double low, double high, double atLow, double atHigh,
            double tolerance) {
  const bool rises = atLow < 0;
  int stayed = 0;  // end that stayed in the last step: -1: `low`, 1: `high`, 0: none yet
  for (int i = 0; i < 60 && high - low > tolerance; ++i) {
    const double t = std::clamp((low * atHigh - high * atLow) / (atHigh - atLow), low, high);
    const double value = f(t);
    if (std::abs(value) < 0.1 * tolerance) return t;
    if ((value < 0) == rises) {
      low = t;
      atLow = value;
      if (stayed > 0) atHigh *= 0.5;
      stayed = 1;
    } else {
      high = t;
      atHigh = value;
      if (stayed < 0) atLow *= 0.5;
      stayed = -1;
    }
  }
  return 0.5 * (low + high);
}

/// Finds the zeros of a band's interpolant along chords, by steps that are so short that they skip
/// no zero if the band is a distance.
class Walk {
 public:
  explicit Walk(const NarrowBand& band)
      : grid_(&levelset::vdb(band)),
        accessor_(grid_->getConstAccessor()),
        phi_(band, levelset::Interpolation::Tricubic),
        voxel_(band.voxelSize()) {}

  void zeros(const Chord& line, const Distance& exact, std::vector<double>& errors) {
    const auto at = [&](double t) { return phi_.value(line.from + t * line.direction); };
    Sample last = sample(line, 0);
    for (double t = 0; t < line.length;) {
      const double before = t;
      t = std::min(line.length, t + std::max(kShortest * voxel_, last.clear));
      const Sample next = sample(line, t);
      if (next.isInside != last.isInside) {
        const double zero = root(at, before, t, at(before), at(t), 1e-6 * voxel_);
        errors.push_back(exact(line.from + zero * line.direction));
      }
      last = next;
    }
  }

 private:
  /// Shortest step, voxels. Two zeros that are closer together may be counted as none or as one.
  static constexpr double kShortest = 0.25;

  struct Sample {
    bool isInside = false;
    double clear = 0;  ///< length of the next step, on which there is no zero, world units
  };

  /// Evaluates the sign of φ and the next step at position t. Far from the surface, the value at
  /// the nearest grid point, at most 0.87 voxels away, is used in place of the interpolant.
  Sample sample(const Chord& line, double t) {
    const V3d p = line.from + t * line.direction;
    const openvdb::Vec3d index = grid_->worldToIndex(levelset::toVdb(p));
    const openvdb::Coord c = openvdb::Coord::round(index);
    const auto* leaf = accessor_.probeConstLeaf(c);
    if (!leaf) return {accessor_.getValue(c) < 0, leaveBlock(line, index, c)};
    const double near = static_cast<double>(leaf->getValue(c));
    if (std::abs(near) > 1.2 * voxel_) return {near < 0, std::abs(near) - 0.95 * voxel_};
    const double value = phi_.value(p);
    return {value < 0, 0.7 * std::abs(value)};
  }

  /// Returns the length of the chord up to the end of a block without a leaf. Such a block has no
  /// surface: values of its neighbours affect the interpolant only within two voxels of its faces.
  [[nodiscard]] double leaveBlock(const Chord& line, const openvdb::Vec3d& index,
                                  const openvdb::Coord& c) const {
    const openvdb::Vec3d way =
        grid_->transform().baseMap()->applyInverseJacobian(levelset::toVdb(line.direction));
    double exit = 1e30;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = (c[axis] & ~7) - 0.5, high = low + 8;
      if (way[axis] > 0) exit = std::min(exit, (high - index[axis]) / way[axis]);
      if (way[axis] < 0) exit = std::min(exit, (low - index[axis]) / way[axis]);
    }
    return std::max(exit, 0.0) + 1e-3 * voxel_;
  }

  const openvdb::FloatGrid* grid_;
  openvdb::FloatGrid::ConstAccessor accessor_;
  BandSampler phi_;
  double voxel_;
};

/// Counts zeros by sphere tracing, which skips no zero of an exact distance.
int exactZeros(const Chord& line, const Distance& exact, double voxel) {
  int count = 0;
  double value = exact(line.from);
  for (double t = 0; t < line.length;) {
    t += std::max(0.1 * voxel, std::abs(value));
    const double next = exact(line.from + std::min(t, line.length) * line.direction);
    if ((next < 0) != (value < 0)) ++count;
    value = next;
  }
  return count;
}

}  // namespace

RayHits shootRays(const NarrowBand& band, const Truth& truth, int count) {
  constexpr int kPerTask = 100;
  struct Part {
    std::vector<double> errors;
    int exactHits = 0, different = 0;
  };
  std::vector<Part> parts(static_cast<std::size_t>(count / kPerTask));
  const double radius = truth.reach + 4 * band.voxelSize();
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
    Walk walk(band);
    for (int k = 0; k < kPerTask; ++k) {
      const Chord line = chord(static_cast<int>(part) * kPerTask + k, truth.centre, radius);
      std::vector<double>& errors = parts[part].errors;
      const auto before = static_cast<int>(errors.size());
      walk.zeros(line, truth.distance, errors);
      const int exact = exactZeros(line, truth.distance, band.voxelSize());
      parts[part].exactHits += exact;
      parts[part].different += std::abs(static_cast<int>(errors.size()) - before - exact);
    }
  });
  RayHits hits;
  for (const Part& part : parts) {
    hits.errors.insert(hits.errors.end(), part.errors.begin(), part.errors.end());
    hits.exactHits += part.exactHits;
    hits.different += part.different;
  }
  return hits;
}

}  // namespace regress
