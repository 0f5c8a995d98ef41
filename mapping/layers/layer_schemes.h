#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

/// Layers of particles that are made from those on the surface, see also particle_layers.h.
namespace mapping {

/// Scheme A: each particle follows ∇φ for as long as the height is high, and the layers between lie
/// on its straight way [Brodersen07 §8.2]. The particles spread over what is convex and crowd where
/// it is concave; towards the medial axis they slow down. Ways along a gradient do not cross.
/// @param space    distances throughout patch space
/// @param surface  the layer w = 0
/// @return         `count` layers, the surface first
[[nodiscard]] std::vector<ParticleLayer> conformingLayers(const levelset::NarrowBand& space,
                                                          const ParticleLayer& surface,
                                                          double height, std::size_t count);

/// The one of them at w alone.
[[nodiscard]] ParticleLayer conformingLayer(const levelset::NarrowBand& space,
                                            const ParticleLayer& surface, double height, double w);

/// A curve through points, smooth and with tangents (Catmull-Rom by chord lengths), as a polyline
/// that is dense enough to measure lengths on.
class SweepCurve {
 public:
  /// @param points  two or more, no two that follow each other in one place
  explicit SweepCurve(std::span<const Imath::V3d> points);
  [[nodiscard]] double length() const { return lengths_.back(); }
  [[nodiscard]] Imath::V3d position(double length) const;
  /// Unit.
  [[nodiscard]] Imath::V3d tangent(double length) const;

 private:
  [[nodiscard]] std::size_t segment(double length) const;
  std::vector<Imath::V3d> positions_;
  std::vector<double> lengths_;
};

struct SplineSweep {
  std::vector<ParticleLayer> layers;
  /// Particles that would have met their neighbours, see TravelGuard, or gone backwards.
  std::size_t slowed = 0;
};

/// Scheme C: the surface's particles travel along a curve and turn with it by the least rotation;
/// w is the way travelled [Brodersen07 §8.2]. In a bend that is narrower than the patch those
/// inside would go backwards; they are slowed to a crawl instead, and none runs into another.
/// @param height  how far along the curve, no more than its length
/// @param isFaded let what stands above or below the plane across the curve go to nothing at the
///                end
[[nodiscard]] SplineSweep splineLayers(const ParticleLayer& surface, const SweepCurve& curve,
                                       double height, std::size_t count, bool isFaded);

/// Turns, scales and bends the layers about an axis, more with growing w.
/// @param origin, axis  of the patch: its centre and unit normal; @param side  unit, the direction
///        that a bend leans to
void transformLayers(std::vector<ParticleLayer>& layers, const LayerTransform& transform,
                     const Imath::V3d& origin, const Imath::V3d& axis, const Imath::V3d& side,
                     double height);

}  // namespace mapping
