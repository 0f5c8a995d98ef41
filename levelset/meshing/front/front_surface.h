#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <optional>

namespace levelset {

/// Surface on which an advancing front moves.
class FrontSurface {
 public:
  /// Point of the surface and its unit normal, which points outwards.
  struct Foot {
    Imath::V3d point, normal;
    bool isBorder = false;  ///< the surface ends there
  };

  FrontSurface() = default;
  FrontSurface(const FrontSurface&) = delete;
  FrontSurface& operator=(const FrontSurface&) = delete;
  virtual ~FrontSurface() = default;

  /// Projects a position onto the surface. Empty if no point of the surface is found nearby.
  [[nodiscard]] virtual std::optional<Foot> project(const Imath::V3d& position) const = 0;
  /// Projects a position beside a point with the given normal. Surfaces with thin parts override
  /// it, and pass the other side over. A position beyond a border has a foot on the border.
  [[nodiscard]] virtual std::optional<Foot> projectBeside(const Imath::V3d& position,
                                                          const Imath::V3d& /*normal*/) const {
    return project(position);
  }
  /// Returns the edge length of the mesh at a point of the surface.
  [[nodiscard]] virtual double edgeLength(const Imath::V3d& point) const = 0;
};

}  // namespace levelset
