#include "mapping/layers/layer_schemes.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "mapping/patches/travel_guard.h"
#include "mapping/surface/surface_field.h"

namespace mapping {
namespace {

using Imath::V3d;

constexpr int kPiecesPerSpan = 64;

double shareOf(std::size_t k, std::size_t count) {
  return static_cast<double>(k) / static_cast<double>(count - 1);
}

/// Copy of a layer with the same particles and rim, but other w and height.
ParticleLayer layerLike(const ParticleLayer& surface, double w, double height) {
  ParticleLayer layer = surface;
  layer.w = w;
  layer.height = height;
  return layer;
}

/// Rotates v by the least rotation that maps one unit vector to another.
V3d turned(const V3d& v, const V3d& from, const V3d& to) {
  const V3d axis = from.cross(to);
  const double cosine = from.dot(to);
  // Consecutive tangents of a dense curve never differ by half a turn.
  if (cosine < -0.999) return v;
  return v + axis.cross(v) + axis.cross(axis.cross(v)) / (1 + cosine);
}

V3d rotated(const V3d& v, const V3d& axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return v * c + axis.cross(v) * s + axis * (axis.dot(v) * (1 - c));
}

template <typename Work>
void forEachParticle(ParticleLayer& layer, const Work& work) {
  for (V3d& p : layer.positions) work(p);
  for (V3d& p : layer.rim) work(p);
}

std::vector<V3d> particlesOf(const ParticleLayer& layer) {
  std::vector<V3d> all = layer.positions;
  all.insert(all.end(), layer.rim.begin(), layer.rim.end());
  return all;
}

void setParticles(const std::vector<V3d>& all, ParticleLayer& layer) {
  const auto rim = all.begin() + static_cast<std::ptrdiff_t>(layer.positions.size());
  std::copy(all.begin(), rim, layer.positions.begin());
  std::copy(rim, all.end(), layer.rim.begin());
}

ParticleLayer advected(const levelset::NarrowBand& space, const ParticleLayer& surface,
                       double height) {
  ParticleLayer top = layerLike(surface, 1, height);
  const auto follow = [&](std::vector<V3d>& particles) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, particles.size(), 64),
                      [&](const auto& range) {
                        const SurfaceField field(space);
                        const double steps = std::ceil(height / (0.5 * field.voxelSize()));
                        const double step = height / steps;
                        for (std::size_t n = range.begin(); n != range.end(); ++n)
                          for (int i = 0; i < static_cast<int>(steps); ++i) {
                            const V3d& p = particles[n];
                            const V3d middle = p + field.gradient(p) * (0.5 * step);
                            particles[n] += field.gradient(middle) * step;
                          }
                      });
  };
  follow(top.positions);
  follow(top.rim);
  return top;
}

/// Interpolates linearly at w between the positions of each particle on the surface and on the top
/// layer.
ParticleLayer between(const ParticleLayer& surface, const ParticleLayer& top, double height,
                      double w) {
  ParticleLayer layer = layerLike(surface, w, w * height);
  for (std::size_t n = 0; n < layer.positions.size(); ++n)
    layer.positions[n] += (top.positions[n] - surface.positions[n]) * w;
  for (std::size_t n = 0; n < layer.rim.size(); ++n)
    layer.rim[n] += (top.rim[n] - surface.rim[n]) * w;
  return layer;
}

/// Returns a guard whose spheres have a diameter of a twentieth of the least distance between
/// neighbouring particles.
TravelGuard guardOf(const ParticleLayer& surface) {
  constexpr double kShare = 0.05;
  double least = HUGE_VAL;
  const auto meet = [&](const V3d& a, const V3d& b) { least = std::min(least, (a - b).length()); };
  const int border = surface.hasRim() ? 1 : 0;
  const int columns = static_cast<int>(surface.columns), rows = static_cast<int>(surface.rows);
  for (int j = -border; j < rows + border; ++j)
    for (int i = -border; i < columns + border; ++i) {
      const V3d& p = surface.beyond(i, j);
      if (i + 1 < columns + border) meet(p, surface.beyond(i + 1, j));
      if (j + 1 < rows + border) meet(p, surface.beyond(i, j + 1));
    }
  return {kShare * least, surface.positions.size() + surface.rim.size()};
}

}  // namespace

std::vector<ParticleLayer> conformingLayers(const levelset::NarrowBand& space,
                                            const ParticleLayer& surface, double height,
                                            std::size_t count) {
  const ParticleLayer top = advected(space, surface, height);
  std::vector<ParticleLayer> layers;
  for (std::size_t k = 0; k < count; ++k)
    layers.push_back(between(surface, top, height, shareOf(k, count)));
  return layers;
}

ParticleLayer conformingLayer(const levelset::NarrowBand& space, const ParticleLayer& surface,
                              double height, double w) {
  return between(surface, advected(space, surface, height), height, w);
}

SweepCurve::SweepCurve(std::span<const V3d> points) {
  const std::size_t last = points.size() - 1;
  // The tangent at a point is that of the parabola through the point and its two neighbours, at
  // unit speed.
  std::vector<V3d> tangents(points.size());
  std::vector<double> chords(last);
  for (std::size_t i = 0; i < last; ++i) chords[i] = (points[i + 1] - points[i]).length();
  for (std::size_t i = 1; i < last; ++i) {
    const V3d before = (points[i] - points[i - 1]) / chords[i - 1],
              after = (points[i + 1] - points[i]) / chords[i];
    tangents[i] = (before * chords[i] + after * chords[i - 1]) / (chords[i - 1] + chords[i]);
  }
  const V3d first = (points[1] - points[0]) / chords[0],
            final = (points[last] - points[last - 1]) / chords[last - 1];
  tangents[0] = last > 1 ? first * 2.0 - tangents[1] : first;
  tangents[last] = last > 1 ? final * 2.0 - tangents[last - 1] : final;

  positions_.push_back(points[0]);
  lengths_.push_back(0);
  for (std::size_t i = 0; i < last; ++i)
    for (int piece = 1; piece <= kPiecesPerSpan; ++piece) {
      const double t = static_cast<double>(piece) / kPiecesPerSpan, u = 1 - t;
      const V3d p = points[i] * (u * u * (1 + 2 * t)) + points[i + 1] * (t * t * (3 - 2 * t)) +
                    (tangents[i] * (u * u * t) - tangents[i + 1] * (t * t * u)) * chords[i];
      lengths_.push_back(lengths_.back() + (p - positions_.back()).length());
      positions_.push_back(p);
    }
}

std::size_t SweepCurve::segment(double length) const {
  const auto next = std::upper_bound(lengths_.begin() + 1, lengths_.end() - 1, length);
  return static_cast<std::size_t>(next - lengths_.begin()) - 1;
}

V3d SweepCurve::position(double length) const {
  const std::size_t i = segment(length);
  const double t = (length - lengths_[i]) / (lengths_[i + 1] - lengths_[i]);
  return positions_[i] + (positions_[i + 1] - positions_[i]) * t;
}

V3d SweepCurve::tangent(double length) const {
  // Interpolates between the directions of two segments; t = 0 and 1 are the middles of the
  // segments.
  const std::size_t i = segment(length);
  const double middle = 0.5 * (lengths_[i] + lengths_[i + 1]);
  const std::size_t j =
      length < middle ? (i > 0 ? i - 1 : i) : std::min(i + 1, positions_.size() - 2);
  const auto direction = [&](std::size_t k) {
    return (positions_[k + 1] - positions_[k]).normalized();
  };
  const double other = 0.5 * (lengths_[j] + lengths_[j + 1]);
  const double t = j == i ? 0 : (length - middle) / (other - middle);
  return (direction(i) * (1 - t) + direction(j) * t).normalized();
}

SplineSweep splineLayers(const ParticleLayer& surface, const SweepCurve& curve, double height,
                         std::size_t count, bool isFaded) {
  constexpr std::size_t kSteps = 32;  // integration steps between two layers
  // Least forward motion of a particle in a step, as a share of the length that the step covers on
  // the curve.
  constexpr double kCrawl = 0.02;
  SplineSweep sweep;
  sweep.layers.push_back(layerLike(surface, 0, 0));
  ParticleLayer layer = surface;
  std::vector<V3d> places = particlesOf(surface), moves(places.size());
  TravelGuard guard = guardOf(surface);
  std::vector<char> isSlowed(places.size(), 0);
  // Heights of the particles above the plane through the start of the curve and perpendicular to
  // it.
  std::vector<double> above;
  const V3d start = curve.position(0), along = curve.tangent(0);
  for (const V3d& p : places) above.push_back((p - start).dot(along));

  const std::size_t steps = kSteps * (count - 1);
  double before = 0;
  for (std::size_t step = 1; step <= steps; ++step) {
    const double now = height * static_cast<double>(step) / static_cast<double>(steps);
    const V3d from = curve.position(before), to = curve.position(now);
    const V3d tangent = curve.tangent(before), next = curve.tangent(now);
    const V3d forward = (tangent + next).normalized();
    const double least = kCrawl * (now - before);
    for (std::size_t n = 0; n < places.size(); ++n) {
      const V3d p = places[n];
      V3d& move = moves[n];
      move = to + turned(p - from, tangent, next) - p;
      if (isFaded) move -= next * (above[n] * (now - before) / height);
      const double progress = move.dot(forward);
      if (progress >= least) continue;
      move += forward * (least - progress);
      isSlowed[n] = 1;
    }
    guard.limit(places, moves);
    for (std::size_t n = 0; n < places.size(); ++n) places[n] += moves[n];
    before = now;
    if (step % kSteps != 0) continue;
    const double w = shareOf(step / kSteps, count);
    setParticles(places, layer);
    sweep.layers.push_back(layerLike(layer, w, w * height));
  }
  for (std::size_t n = 0; n < surface.positions.size(); ++n)
    sweep.slowed += guard.slowed()[n] || isSlowed[n];
  return sweep;
}

void transformLayers(std::vector<ParticleLayer>& layers, const LayerTransform& transform,
                     const V3d& origin, const V3d& axis, const V3d& side, double height) {
  for (ParticleLayer& layer : layers) {
    const double w = layer.w, scale = std::lerp(1.0, transform.taper, w);
    const double lean = transform.bend * w;
    // The straight axis becomes an arc of the same length.
    const double radius = transform.bend != 0 ? height / transform.bend : 0;
    const V3d foot = origin + axis * (w * height);
    const V3d bent = transform.bend != 0 ? origin + axis * (radius * std::sin(lean)) +
                                               side * (radius * (1 - std::cos(lean)))
                                         : foot;
    const V3d hinge = axis.cross(side);
    forEachParticle(layer, [&](V3d& p) {
      V3d local = p - foot;
      const double up = local.dot(axis);
      local = axis * up + (local - axis * up) * scale;
      local = rotated(local, axis, transform.twist * w);
      p = bent + rotated(local, hinge, lean);
    });
  }
}

}  // namespace mapping
