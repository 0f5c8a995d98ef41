#include "levelset/points/surface/particles.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>

#include "levelset/distance/distance_transform.h"
#include "levelset/error.h"
#include "levelset/points/processing/point_neighbours.h"
#include "levelset/points/processing/point_spacing.h"
#include "levelset/points/surface/sample_field.h"

namespace levelset {
namespace {

using Imath::V3d;
using points::FieldMemory;

/// Kernel (1 − t²)³ of squared distances t² in fractions of the reach.
double particleWeight(double squared) {
  const double t = std::max(1 - squared, 0.0);
  return t * t * t;
}

/// Particles at different positions.
struct Particles {
  V3d centre = V3d(0);  ///< world position of the origin
  std::vector<V3d> positions;
  std::vector<double> radii;
  double largest = 0;  ///< largest radius
  PointSearch search;
};

Particles prepare(const PointCloud& cloud, const ParticleOptions& options) {
  requirePoints(cloud);
  if (cloud.isEmpty()) throw InvalidInput("the point cloud is empty; give particles");
  double common = options.radius;
  if (common == 0 && cloud.radii.empty()) {
    constexpr double kOfSpacing = 0.8;
    common = kOfSpacing * pointSpacing(cloud, options.maxMemory).median;
    if (!(common > 0))
      throw InvalidInput("a single particle has no spacing that gives a radius; give --radius");
  }
  Particles particles;
  particles.centre = bounds(cloud).center();
  std::vector<V3d> all;
  all.reserve(cloud.size());
  for (const V3d& p : cloud.positions) all.push_back(p - particles.centre);
  points::PointNeighbours different(all);
  std::vector<double> radii(cloud.size(), 0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    double& kept = radii[different.first(static_cast<std::uint32_t>(i))];
    kept = std::max(kept, common > 0 ? common : double{cloud.radii[i]});
  }
  for (std::size_t n = 0; n < different.size(); ++n) {
    particles.positions.push_back(different.positionAt(n));
    particles.radii.push_back(radii[different.at(n)]);
  }
  particles.largest = *std::max_element(particles.radii.begin(), particles.radii.end());
  particles.search = std::move(different).takeSearch();
  return particles;
}

/// Distance to the nearest ball among those found.
double toBalls(const Particles& particles, const std::vector<FoundItem>& found) {
  double distance = std::numeric_limits<double>::infinity();
  for (const FoundItem& f : found)
    distance = std::min(distance, std::sqrt(f.squared) - particles.radii[f.index]);
  return distance;
}

/// Value at a place that no particle reaches.
constexpr double kOutside = std::numeric_limits<double>::infinity();

/// Makes the field of a function of a position and the points within a distance, by number. One
/// search lists the candidates of a cube.
/// @param positions  those of the search; must outlive the field
template <class Value>
points::SampledField fieldOfNear(const PointSearch& search, const std::vector<V3d>& positions,
                                 double distance, Value value) {
  return [&search, &positions, distance, value = std::move(value)](const points::CubePositions& at,
                                                                   points::CubeValues& values,
                                                                   FieldMemory& memory, double) {
    constexpr double kRounding = 1 + 1e-12;
    const double reach = kRounding * (distance + (at.back() - at.front()).length() / 2);
    std::vector<FoundItem>& candidates = memory.candidates;
    search.within((at.front() + at.back()) / 2, reach * reach, candidates);
    for (std::size_t n = 0; n < at.size(); ++n) {
      memory.found.clear();
      for (const FoundItem& candidate : candidates)
        if (const double squared = (positions[candidate.index] - at[n]).length2();
            squared <= distance * distance)
          memory.found.push_back({squared, candidate.index});
      values[n] = value(at[n], memory.found);
    }
  };
}

points::SampledField balls(const Particles& particles, double margin) {
  return fieldOfNear(particles.search, particles.positions, particles.largest + margin,
                     [&particles](const V3d&, const std::vector<FoundItem>& found) {
                       return toBalls(particles, found);
                     });
}

/// Sum of the Gaussians exp(−a (|x − xᵢ|² / rᵢ² − 1)), turned into a distance that is exact for a
/// single particle. Each Gaussian is cut where it has fallen to a hundredth, and made continuous
/// there.
points::SampledField blobs(const Particles& particles, double reach) {
  constexpr double kCut = 0.01;
  const double sharpness = -std::log(kCut) / (reach * reach - 1);
  return fieldOfNear(
      particles.search, particles.positions, reach * particles.largest,
      [&particles, reach, sharpness](const V3d&, const std::vector<FoundItem>& found) {
        double sum = 0, radii = 0;
        for (const FoundItem& f : found) {
          const double radius = particles.radii[f.index],
                       value = std::exp(-sharpness * (f.squared / (radius * radius) - 1)) - kCut;
          if (!(value > 0)) continue;
          sum += value;
          radii += value * radius;
        }
        if (!(sum > 0)) return kOutside;
        const double squared = std::max(1 - std::log(sum + kCut) / sharpness, 0.0);
        return radii / sum * (std::sqrt(squared) - 1);
      });
}

/// |x − Σ wᵢ xᵢ| − Σ wᵢ rᵢ with normalised weights [Zhu05].
points::SampledField zhuBridson(const Particles& particles, double reach) {
  return fieldOfNear(particles.search, particles.positions, reach * particles.largest,
                     [&particles, reach](const V3d& at, const std::vector<FoundItem>& found) {
                       V3d centre(0);
                       double radius = 0, weights = 0;
                       for (const FoundItem& f : found) {
                         const double own = reach * particles.radii[f.index],
                                      weight = particleWeight(f.squared / (own * own));
                         weights += weight;
                         centre += weight * particles.positions[f.index];
                         radius += weight * particles.radii[f.index];
                       }
                       if (!(weights > 0)) return kOutside;
                       return (at - centre / weights).length() - radius / weights;
                     });
}

/// A particle that is moved towards its neighbours and flattened like their arrangement.
struct FlattenedParticle {
  V3d centre;
  Eigen::Matrix3d toUnit;  ///< maps the ellipsoid of its reach to the unit ball
};

/// Parameters of [Yu13, section 4]: share of the neighbours' mean in the centre, largest ratio of
/// axes, and fewest neighbours of a particle that is flattened.
constexpr double kTowardsMean = 0.9, kMostFlat = 4;
constexpr std::size_t kFewestNeighbours = 25;

FlattenedParticle flatten(const Particles& particles, std::size_t i, double reach,
                          std::vector<FoundItem>& found) {
  const V3d& at = particles.positions[i];
  // [Yu13] takes the mean of twice the reach, which moves a plane face inwards by two thirds of a
  // spacing. The moments need that many neighbours.
  const double size = reach * particles.radii[i], range = 2 * size;
  particles.search.within(at, range * range, found);
  const auto meanWithin = [&](double limit) {
    V3d sum(0);
    double weights = 0;
    for (const FoundItem& f : found) {
      const double t = std::sqrt(f.squared) / limit, weight = std::max(1 - t * t * t, 0.0);
      weights += weight;
      sum += weight * particles.positions[f.index];
    }
    return sum / weights;
  };
  Eigen::Vector3d axes(1, 1, 1);
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (found.size() > kFewestNeighbours) {
    const V3d middle = meanWithin(range);
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (const FoundItem& f : found) {
      const double t = std::sqrt(f.squared) / range;
      const V3d d = particles.positions[f.index] - middle;
      const Eigen::Vector3d arm(d.x, d.y, d.z);
      moments += (1 - t * t * t) * arm * arm.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments);
    turn = solver.eigenvectors();
    // The eigenvalues are squares of lengths; [Yu13] stretches by the eigenvalues themselves.
    axes = solver.eigenvalues().cwiseMax(solver.eigenvalues()[2] / kMostFlat);
    // The kernel keeps its volume.
    axes /= std::cbrt(axes.prod());
  }
  return {(1 - kTowardsMean) * at + kTowardsMean * meanWithin(size),
          turn * (1 / (size * axes.array())).matrix().asDiagonal() * turn.transpose()};
}

struct FlattenedParticles {
  std::vector<FlattenedParticle> particles;
  std::vector<V3d> centres;
  PointSearch search;  ///< tree of the centres
  double most = 0;     ///< farthest reach of a particle, world units
  double level = 0;    ///< value of the sum on the surface
  double slope = 0;    ///< distance for each unit of the sum
};

points::SampledField anisotropic(const Particles& particles, double reach) {
  const auto all = std::make_shared<FlattenedParticles>();
  all->particles.resize(particles.positions.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, all->particles.size()),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      std::vector<FoundItem> found;
                      for (std::size_t i = range.begin(); i < range.end(); ++i)
                        all->particles[i] = flatten(particles, i, reach, found);
                    });
  for (const FlattenedParticle& p : all->particles) all->centres.push_back(p.centre);
  all->search = makePointSearch(all->centres);
  // The longest axis of a flat kernel of equal volume.
  all->most = reach * particles.largest * std::cbrt(kMostFlat * kMostFlat);
  // A single particle is its ball.
  all->level = particleWeight(1 / (reach * reach));
  all->slope = particles.largest / (2 * all->level);
  return fieldOfNear(
      all->search, all->centres, all->most,
      [all](const V3d& at, const std::vector<FoundItem>& found) {
        double sum = 0;
        for (const FoundItem& f : found) {
          const FlattenedParticle& p = all->particles[f.index];
          const V3d d = at - p.centre;
          sum += particleWeight((p.toUnit * Eigen::Vector3d(d.x, d.y, d.z)).squaredNorm());
        }
        return sum > 0 ? all->slope * (all->level - sum) : kOutside;
      });
}

void checkParticleOptions(const ParticleOptions& options, double voxelSize) {
  if (!std::isfinite(voxelSize) || !(voxelSize > 0))
    throw UsageError(fmt::format("the voxel size is {}; give a positive number", voxelSize));
  if (!std::isfinite(options.radius) || options.radius < 0)
    throw UsageError(
        fmt::format("the radius of the particles is {}; give a positive number", options.radius));
  constexpr double kLeastReach = 1.5, kMostReach = 10;
  if (!(options.reach >= kLeastReach && options.reach <= kMostReach))
    throw UsageError(fmt::format("the reach of a particle is {} radii; give {} to {}",
                                 options.reach, kLeastReach, kMostReach));
  if (!std::isfinite(options.halfWidth) || options.halfWidth < 1)
    throw UsageError(
        fmt::format("the half width is {} voxels; give at least 1", options.halfWidth));
}

points::SampledField fieldOf(const Particles& particles, const ParticleOptions& options,
                             double voxelSize) {
  switch (options.kernel) {
    case ParticleKernel::Balls:
      return balls(particles, 4 * voxelSize);
    case ParticleKernel::Blobs:
      return blobs(particles, options.reach);
    case ParticleKernel::ZhuBridson:
      return zhuBridson(particles, options.reach);
    case ParticleKernel::Anisotropic:
      return anisotropic(particles, options.reach);
  }
  return {};
}

}  // namespace

NarrowBand particlesToBand(const PointCloud& cloud, double voxelSize,
                           const ParticleOptions& options) {
  checkParticleOptions(options, voxelSize);
  const Particles particles = prepare(cloud, options);
  if (voxelSize > particles.largest)
    throw InvalidInput(fmt::format(
        "the voxel size {:.3g} exceeds the largest radius {:.3g} of the particles; use smaller "
        "voxels or larger radii",
        voxelSize, particles.largest));
  report(options.progress, 0.05);
  const points::SampledField field = fieldOf(particles, options, voxelSize);
  report(options.progress, 0.2);
  points::SampleFrame frame{particles.centre, {}, voxelSize};
  for (const V3d& p : particles.positions) frame.box.extendBy(p);
  const V3d margin(options.reach * 3 * particles.largest + 4 * voxelSize);
  frame.box.min -= margin;
  frame.box.max += margin;
  // All blocks that a ball meets: the surface lies about a radius from the particles.
  std::vector<openvdb::Coord> blocks;
  constexpr int kSide = 8;
  for (std::size_t i = 0; i < particles.positions.size(); ++i) {
    const V3d radius(particles.radii[i]), &at = particles.positions[i];
    const openvdb::Coord low = points::blockAt(frame, at - radius),
                         high = points::blockAt(frame, at + radius);
    for (int x = low.x(); x <= high.x(); x += kSide)
      for (int y = low.y(); y <= high.y(); y += kSide)
        for (int z = low.z(); z <= high.z(); z += kSide) blocks.emplace_back(x, y, z);
  }
  openvdb::FloatGrid::Ptr samples = points::sampleField(
      field, frame, std::move(blocks), options.maxMemory, subProgress(options.progress, 0.2, 0.7));
  eikonal::DistanceRequest request;
  request.halfWidth = options.halfWidth;
  request.maxMemory = options.maxMemory;
  request.progress = subProgress(options.progress, 0.7, 1);
  return makeBand(eikonal::distanceTransform(std::move(samples), request));
}

}  // namespace levelset
