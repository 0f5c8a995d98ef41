#include "levelset/advection/advect.h"

#include <fmt/core.h>

#include <cmath>

#include "levelset/advection/front.h"
#include "levelset/advection/grid_schemes.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/offset/offset.h"
#include "levelset/transform/transform.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using Imath::V3d;

// Progress at which the triangle surface is extracted, and at which the motion is done. The rest is
// the conversion to a band. From measured times.
constexpr double kMeshed = 0.05, kMoved = 0.9;

void requireTime(double time, const char* what) {
  if (!std::isfinite(time))
    throw UsageError(fmt::format("the {} is {}; give a finite time", what, time));
}

/// Moves vertices by at most 0.3 voxels onto the zero set of the tricubic interpolant of the band.
/// Vertices for which Newton's method does not converge, such as those on a crease, stay.
void projectVertices(TriMesh& mesh, const NarrowBand& band) {
  constexpr int kNewtonSteps = 4;
  constexpr double kMostProjection = 0.3;  // voxels
  const double h = band.voxelSize();
  const BandSampler phi(band, Interpolation::Tricubic);
  for (V3d& vertex : mesh.positions) {
    V3d p = vertex;
    double value = phi.value(p);
    for (int i = 0; i < kNewtonSteps && std::abs(value) > 1e-6 * h; ++i) {
      const V3d gradient = phi.gradient(p);
      const double squared = gradient.length2();
      if (squared < 0.25) break;
      p -= gradient * (value / squared);
      value = phi.value(p);
    }
    if ((p - vertex).length() < kMostProjection * h && std::abs(value) <= 1e-4 * h) vertex = p;
  }
}

/// Returns the surface of a band as triangles in index space.
TriMesh surfaceOf(const NarrowBand& band) {
  TriMesh mesh = bandToMesh(band, {.sharp = true});
  projectVertices(mesh, band);
  const openvdb::math::Transform& transform = vdb(band).transform();
  for (V3d& p : mesh.positions) p = toImath(transform.worldToIndex(toVdb(p)));
  return mesh;
}

/// Converts a closed mesh in index space to a band with the transform and half width of `model`.
NarrowBand bandOf(const TriMesh& mesh, const NarrowBand& model, const AdvectOptions& options) {
  MeshToBandOptions conversion;
  conversion.halfWidth = model.halfWidth();
  conversion.sign = SignMode::Closed;
  conversion.nesting = Nesting::Orientation;
  conversion.maxMemory = options.maxMemory;
  conversion.progress = subProgress(options.progress, kMoved, 1);
  NarrowBand unit;
  try {
    unit = meshToBand(mesh, 1, conversion).band;
  } catch (const InvalidInput& error) {
    throw InvalidInput(
        fmt::format("the moved surface encloses no solid on this grid ({}); use smaller "
                    "voxels or a shorter time",
                    error.what()));
  }
  return transform(unit, model.indexToWorld());
}

/// Offsets the band until its volume is `volume`, world units³.
NarrowBand withVolume(NarrowBand band, double volume, const AdvectOptions& options) {
  constexpr int kTries = 6;
  constexpr double kTolerance = 1e-5;
  for (int i = 0; i < kTries; ++i) {
    const Measurement now = measure(band);
    if (std::abs(now.volume - volume) <= kTolerance * volume) break;
    band =
        offset(std::move(band), (volume - now.volume) / now.area, {.maxMemory = options.maxMemory});
  }
  return band;
}

}  // namespace

struct Advection::Impl {
  AdvectOptions options;
  /// Solid at the start of the motion. The grid schemes replace it by the moved solid.
  NarrowBand band;
  std::optional<flow::Front> front;
  double time, volumeBefore;
  std::size_t steps = 0;

  Impl(NarrowBand solid, const AdvectOptions& given)
      : options(given), band(std::move(solid)), time(given.start) {
    requireSolid(band);
    if (band.isEmpty()) throw InvalidInput("the solid is empty; give a solid with a surface");
    requireTime(time, "start time");
    flow::requireOrders({options.order, options.timeOrder});
    if (options.mask) checkMask(*options.mask);
    volumeBefore = measure(band).volume;
    if (options.scheme == AdvectScheme::Front) front.emplace(surfaceOf(band), options.maxMemory);
    report(options.progress, kMeshed);
  }

  /// Returns the velocity in index space, in voxels per unit of time, multiplied by the mask.
  [[nodiscard]] flow::Velocity inVoxels(const VectorField& velocity) const {
    const Imath::M44d toWorld = band.indexToWorld(), toIndex = toWorld.inverse();
    const V3d origin = toWorld.translation();
    return [this, &velocity, toWorld, toIndex, origin](const V3d& position, double at) {
      V3d world, result;
      toWorld.multDirMatrix(position, world);
      world += origin;
      const double share = options.mask ? options.mask->weight(world) : 1;
      if (share == 0) return V3d(0);
      toIndex.multDirMatrix(velocity(world, at) * share, result);
      return result;
    };
  }

  void advance(const VectorField& velocity, double duration) {
    requireTime(duration, "time");
    const double end = time + duration;
    requireTime(end, "final time");
    const flow::Velocity speed = inVoxels(velocity);
    const flow::TimeInterval interval{.velocity = speed,
                                      .from = time,
                                      .to = end,
                                      .toWorld = band.indexToWorld(),
                                      .maxMemory = options.maxMemory,
                                      .progress = subProgress(options.progress, kMeshed, kMoved)};
    if (front)
      steps += front->advance(interval);
    else if (options.scheme == AdvectScheme::SemiLagrangian)
      steps += flow::advectSemiLagrangian(band, interval);
    else
      steps += flow::advectUpwind(band, interval, {options.order, options.timeOrder});
    time = end;
  }

  [[nodiscard]] AdvectResult result() const {
    AdvectResult result;
    result.steps = steps;
    result.volumeBefore = volumeBefore;
    // Without a step the result is the given solid, to the bit, and not its converted mesh.
    result.band = front && steps > 0 ? bandOf(front->mesh(), band, options) : band;
    result.volumeAfter = measure(result.band).volume;
    if (options.fixVolume) result.band = withVolume(result.band, volumeBefore, options);
    report(options.progress, 1);
    return result;
  }
};

Advection::Advection(NarrowBand solid, const AdvectOptions& options)
    : impl_(std::make_unique<Impl>(std::move(solid), options)) {}
Advection::~Advection() = default;
Advection::Advection(Advection&&) noexcept = default;
Advection& Advection::operator=(Advection&&) noexcept = default;

void Advection::advance(const VectorField& velocity, double time) {
  impl_->advance(velocity, time);
}

AdvectResult Advection::result() const {
  return impl_->result();
}

AdvectResult advect(NarrowBand solid, const VectorField& velocity, double time,
                    const AdvectOptions& options) {
  Advection advection(std::move(solid), options);
  advection.advance(velocity, time);
  return advection.result();
}

}  // namespace levelset
