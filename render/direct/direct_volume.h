#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <memory>
#include <vector>

#include "render/direct/transfer_function.h"
#include "render/volumes/volume_surface.h"

namespace render {

struct LightStart;
struct LightTables;

/// Light that reaches the eye along a ray through a volume.
struct VolumeLight {
  Imath::V3d colour = Imath::V3d(0);  ///< emitted in the volume, linear
  double transmittance = 1;           ///< share of the light from behind that passes the volume
};

/// Light that brightens the colours of a volume by the direction of its gradient.
struct VolumeShading {
  Imath::V3d toLight{0, 0, 1};  ///< unit vector towards the light, world space
  double ambient = 0.35;        ///< brightness where the light does not reach, [0, 1]
};

/// Part of a ray through a volume.
struct VolumeSegment {
  Imath::V3d origin, direction;  ///< world space; unit length
  double near, far;              ///< distances in world units; `far` may be infinite
};

/// A volume that is drawn by direct volume rendering: each point emits and absorbs light by the
/// transfer function of the trilinear interpolant. Along a ray the emission–absorption integral is
///
///     C = ∫ c(s) τ(s) exp(−∫₀ˢ τ(t) dt) ds,
///
/// with the extinction τ and the colour c [Max95]. In each cell the interpolant is a cubic along
/// the ray. It is replaced by linear pieces, so short that the optical depth of a cell changes by
/// less than a tolerance. Linear pieces are cut at the points of the transfer function, and
/// integrated in closed form, as in pre-integrated volume rendering [Engel01]. A cell has at most
/// 4096 pieces. Blocks of 8³ cells without extinction are skipped. The code is
/// render/shaders/direct.glsl, which the GPU runs, too.
///
/// The class has value semantics. Copies share the numbers and the ranges of the volume. All
/// methods may run concurrently.
class DirectVolume {
 public:
  /// Error of the optical depth of a cell that linear pieces may cause.
  static constexpr double kTolerance = 3e-4;

  /// @param volume  an isosurface of the volume, whose ranges are shared
  /// @param points  of the transfer function; opacities are those of a layer as thick as the
  /// smallest
  ///        spacing of the grid
  /// @param tolerance  error of the optical depth of a cell, > 0
  /// @throws as TransferFunction
  DirectVolume(const VolumeSurface& volume, std::vector<TransferPoint> points,
               double tolerance = kTolerance);

  [[nodiscard]] const levelset::Volume& volume() const;
  [[nodiscard]] const TransferFunction& transfer() const { return transfer_; }
  [[nodiscard]] const Imath::M44d& worldToIndex() const;
  /// Bounds of the grid points, world units.
  [[nodiscard]] Imath::Box3d bounds() const { return volume().grid().bounds(); }
  /// Share of the blocks that are skipped, because all their values have no extinction.
  [[nodiscard]] double skippedShare() const;

  /// Integrates along a ray until less than kLeastTransmittance of the light passes.
  /// @param direction  unit length
  /// @param near, far  part of the ray, distances in world units; `far` may be infinite
  /// @param shading  null: colours do not depend on the gradient
  [[nodiscard]] VolumeLight light(const Imath::V3d& origin, const Imath::V3d& direction,
                                  double near, double far,
                                  const VolumeShading* shading = nullptr) const;
  /// Brightness of a point by the direction of the gradient, [0, 1]. The gradient is interpolated
  /// between central differences at the grid points. The judge uses this function; the kernel has
  /// its own. @param index  position in the grid
  [[nodiscard]] double brightness(const Imath::V3d& index, const VolumeShading& shading) const;

  /// Data for the back ends of the kernel. Copies of this object share them.
  [[nodiscard]] const std::shared_ptr<const LightTables>& tables() const { return tables_; }
  /// A ray for the kernel.
  [[nodiscard]] LightStart start(const VolumeSegment& segment) const;

 private:
  TransferFunction transfer_;
  std::shared_ptr<const LightTables> tables_;
};

}  // namespace render
