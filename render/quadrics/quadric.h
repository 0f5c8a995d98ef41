#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "render/camera.h"

namespace render {

/// Surfaces of degree two, by their equations in parameter space [Sigg06, 7.2].
enum class QuadricKind : std::uint8_t {
  Ellipsoid,   ///< x² + y² + z² = 1; it has no range and no caps
  Cylinder,    ///< x² + y² = 1
  Cone,        ///< x² + y² = z²; both halves, as far as the range reaches
  Paraboloid,  ///< x² + y² = z
  OneSheet,    ///< x² + y² = z² + 1, a hyperboloid of one sheet
  TwoSheet     ///< x² + y² = z² − 1, a hyperboloid of two sheets
};

/// Name of a kind in files and messages.
[[nodiscard]] const char* nameOf(QuadricKind kind);
inline constexpr int kQuadricKinds = 6;

/// Range of z in parameter space of a surface without end.
struct QuadricRange {
  double low = -1, high = 1;
};
/// Default range: of a cone and a paraboloid 0 … 1, of a hyperboloid of two sheets −2 … 2,
/// otherwise −1 … 1.
[[nodiscard]] QuadricRange defaultRange(QuadricKind kind);

/// A piece of a quadric: position + x·axes[0] + y·axes[1] + z·axes[2] for the points (x, y, z) of
/// its kind with z in the range. The axes need not be orthogonal.
struct Quadric {
  QuadricKind kind = QuadricKind::Ellipsoid;
  Imath::V3d position{0};  ///< world units
  std::array<Imath::V3d, 3> axes{Imath::V3d(1, 0, 0), Imath::V3d(0, 1, 0), Imath::V3d(0, 0, 1)};
  QuadricRange range = {};
  bool isCapped = true;                    ///< flat disks close the ends of the range
  Imath::C3f colour{0.66f, 0.62f, 0.56f};  ///< linear, 0 … 1
};

/// A sphere in compact form.
struct Ball {
  Imath::V3d centre{0};
  float radius = 1;
  std::uint32_t colour = 0;  ///< packedColour()
};

/// A circular cylinder with flat ends, in compact form.
struct Stick {
  Imath::V3d a{0}, b{0, 0, 1};  ///< centres of the ends
  float radius = 1;
  std::uint32_t colour = 0;  ///< packedColour()
};

/// Quadrics that are drawn as one part of a scene.
struct QuadricModel {
  std::vector<Ball> balls;
  std::vector<Stick> sticks;
  std::vector<Quadric> quadrics;

  [[nodiscard]] std::size_t size() const { return balls.size() + sticks.size() + quadrics.size(); }
};

/// Linear colour in eight bits for each channel; red is lowest. Channels are clamped to 0 … 1.
[[nodiscard]] std::uint32_t packedColour(const Imath::C3f& colour);
[[nodiscard]] Imath::C3f unpackedColour(std::uint32_t colour);

/// The same solids as general quadrics.
[[nodiscard]] Quadric quadricOf(const Ball& ball);
[[nodiscard]] Quadric quadricOf(const Stick& stick);

/// Check one quadric. Messages begin with "has".
/// @throws levelset::InvalidInput as requireQuadrics()
void requireQuadric(const Ball& ball);
void requireQuadric(const Stick& stick);
void requireQuadric(const Quadric& quadric);
/// Checks a model. Messages count the quadrics of a kind from 1.
/// @throws levelset::InvalidInput if it is empty or has more than 2^30 quadrics, for numbers that
/// are not finite or exceed 1e15, for radii that are not positive, for ends that coincide, for axes
/// that are zero or nearly in one plane, and for an empty range
void requireQuadrics(const QuadricModel& model);

/// Values of a linear function on the smallest interval that contains them.
struct QuadricExtent {
  double low = 0, high = 0;
};
/// Coefficients of a linear function of homogeneous coordinates (x, y, z, 1).
using HomogeneousRow = std::array<double, 4>;

/// Smallest interval of the quotient (numerator·p) / (denominator·p) over the points p of a quadric
/// with its caps. Its ends are at planes that touch the quadric or an end of it: roots of a
/// quadratic in the dual quadric [Sigg06, eqs. 7.7 to 7.9].
/// @return nothing if the denominator is not positive everywhere, or the range has no point
[[nodiscard]] std::optional<QuadricExtent> extentOf(const Quadric& quadric,
                                                    const HomogeneousRow& numerator,
                                                    const HomogeneousRow& denominator = {0, 0, 0,
                                                                                         1});

/// Tight box of a quadric with its caps, world units; empty if the range has no point.
[[nodiscard]] Imath::Box3d boundsOf(const Quadric& quadric);

/// Tight box of the picture of a quadric, pixels; (0, 0) is the upper left corner of the image.
/// @return nothing if the quadric reaches the plane of the eye, or the range has no point
[[nodiscard]] std::optional<Imath::Box2d> pictureBox(const Quadric& quadric, const Camera& camera);

}  // namespace render
