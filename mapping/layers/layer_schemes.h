#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

/// Builds particle layers by moving the particles on the surface (schemes A and C of LayerScheme);
/// particle_layers.h builds them from sides.
namespace mapping {

/// Scheme A: each particle follows ∇φ up to `height`, and the inner layers lie on the straight line
/// from its start to its end [Brodersen07 §8.2]. Particles spread over convex parts of the base and
/// crowd over concave parts; they slow down towards its medial axis. Paths along a gradient do not
/// cross.
/// @param space    distances to the base throughout the space above the patch
/// @param surface  the layer at w = 0
/// @return `count` layers, the surface first
[[nodiscard]] std::vector<ParticleLayer> conformingLayers(const levelset::NarrowBand& space,
                                                          const ParticleLayer& surface,
                                                          double height, std::size_t count);

/// Computes only the layer at w that conformingLayers would build.
[[nodiscard]] ParticleLayer conformingLayer(const levelset::NarrowBand& space,
                                            const ParticleLayer& surface, double height, double w);

/// A smooth curve through given points (Catmull-Rom by chord lengths). It is stored as a polyline
/// with 64 segments between two of the points.
class SweepCurve {
 public:
  /// @param points  at least two; successive points differ
  explicit SweepCurve(std::span<const Imath::V3d> points);
  [[nodiscard]] double length() const { return lengths_.back(); }
  [[nodiscard]] Imath::V3d position(double length) const;
  /// Unit tangent at an arc length from the start, world units.
  [[nodiscard]] Imath::V3d tangent(double length) const;

 private:
  [[nodiscard]] std::size_t segment(double length) const;
  std::vector<Imath::V3d> positions_;
  std::vector<double> lengths_;
};

struct SplineSweep {
  std::vector<ParticleLayer> layers;
  /// Number of particles that were slowed because they would have met neighbours (see TravelGuard)
  /// or moved backwards along the curve.
  std::size_t slowed = 0;
};

/// Scheme C: the particles of the layer at w = 0 travel along a curve and rotate with it by the
/// least rotation; w is the share of `height` travelled [Brodersen07 §8.2]. In a bend narrower than
/// the patch, particles on its inner side would go backwards. They are slowed almost to a stop
/// instead, and none collides with another.
/// @param height   distance along the curve, at most its length
/// @param isFaded  true: the distances of the particles from the plane perpendicular to the start
///         of the curve shrink linearly to zero at its end
[[nodiscard]] SplineSweep splineLayers(const ParticleLayer& surface, const SweepCurve& curve,
                                       double height, std::size_t count, bool isFaded);

/// Twists, tapers and bends the layers about an axis, more with growing w.
/// @param origin, axis  centre of the patch, and its unit normal there
/// @param side  unit direction towards which the axis bends
void transformLayers(std::vector<ParticleLayer>& layers, const LayerTransform& transform,
                     const Imath::V3d& origin, const Imath::V3d& axis, const Imath::V3d& side,
                     double height);

}  // namespace mapping
