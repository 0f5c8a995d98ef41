#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "levelset/fields/grid.h"
#include "levelset/narrow_band.h"
#include "levelset/points/point_cloud.h"
#include "levelset/points/processing/normals.h"
#include "levelset/progress.h"

/// Solids from point clouds without connectivity.
namespace levelset {

/// Surface through a cloud of points with normals.
enum class PointMethod {
  /// Partition of unity over planes that are shifted towards an interpolating surface
  /// [Sigg06, 4.3].
  Meshless,
  /// A quadratic height function, fitted to the points and normals near each position [Levin03,
  /// Alexa03]. Smooths noise.
  MovingLeastSquares,
  /// An octree of quadratic height functions, blended with each other [Ohtake03]. Keeps sharp
  /// edges and corners.
  MultilevelPartition,
  /// A radial basis function φ(r) = r through the points and places beside them [Carr01]. As few of
  /// the points as its tolerance needs are its centres. Bridges gaps of several spacings. The
  /// most accurate method on smooth shapes with few points, and the slowest.
  RadialBasis
};

/// Number of points that determine the surface at a position, if the caller gives none.
[[nodiscard]] std::size_t defaultNeighbours(PointMethod method);

/// Support certificate: where points determine the surface, and where it is a guess across a hole.
/// A place on the surface is supported when its distance to the closest point of the cloud is at
/// most kSupportRadius times the spacing about that point. Points whose
/// normal opposes that of the surface do not count.
struct SupportCertificate {
  std::size_t points = 0;      ///< number of different positions
  std::size_t centres = 0;     ///< for RadialBasis: number of them that are centres
  double medianSpacing = 0;    ///< distance between neighbouring points, world units
  double area = 0;             ///< area of the surface, world units²
  double unsupportedArea = 0;  ///< area of the part that is a guess, world units²
  double largestGap = 0;       ///< largest distance to the closest point, in its spacings
  /// Mean distance of the points from the surface, in the median spacing. Points outside the band
  /// count with its half width.
  double meanResidual = 0;
  std::size_t farPoints = 0;  ///< points outside the band, or farther than their spacing
  /// Solids and cavities that were dropped, since fewer than four points lie beside them.
  std::size_t droppedParts = 0;
  /// Share of the points whose normal opposes the mean normal of their neighbours.
  double opposedShare = 0;

  /// Fraction of the area that is a guess.
  [[nodiscard]] double unsupportedShare() const { return area > 0 ? unsupportedArea / area : 1; }
};

/// Returns a summary of the certificate in one line of text.
[[nodiscard]] std::string describe(const SupportCertificate& certificate);

/// Largest distance of a supported place from the cloud, in spacings.
inline constexpr double kSupportRadius = 2;

/// Limit of SupportCertificate::unsupportedShare(). Above it pointsToBand() refuses the cloud,
/// unless the option acceptUnsupported is set.
inline constexpr double kUnsupportedLimit = 0.01;

struct PointsToBandOptions {
  PointMethod method = PointMethod::MovingLeastSquares;
  /// Number of points that determine the surface at a position, from 6 to 1000; 0: that of
  /// defaultNeighbours().
  std::size_t neighbours = 0;
  /// For MultilevelPartition and RadialBasis: aimed distance of the points from the surface, in the
  /// median spacing, positive.
  double tolerance = 0.02;
  /// For RadialBasis: relaxation λ ≥ 0, in mean distances between its particles. 0 interpolates the
  /// centres; larger values smooth noise.
  double lambda = 0;
  double halfWidth = 3;  ///< half width of the band, voxels, at least 1
  /// Accept a surface of which a large part is a guess, and normals that oppose each other.
  bool acceptUnsupported = false;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
  /// Called with the certificate, even if pointsToBand() then throws because of it.
  std::function<void(const SupportCertificate&)> onCertificate = {};
};

struct PointsToBandResult {
  NarrowBand band;
  SupportCertificate certificate;
  /// Distance from the surface to the closest point of the cloud, in spacings about that point, at
  /// the grid points beside the surface.
  FieldGrid support;
};

/// Makes the solid of a cloud with normals: samples the field of a method on the grid, then
/// computes exact distances to its surface. The field is sampled only beside the surface, which is
/// followed from block to block, across holes too. A surface that does not close is cut by a box
/// about the cloud, larger on each side by a tenth of its diagonal. That part is a guess, too.
/// @param voxelSize  world units; grid points lie at its integer multiples
/// @throws UsageError for options out of range
/// @throws InvalidInput for a cloud without normals, with a normal of length zero, with fewer than
///         four different positions, or with all positions on a line; when a share of the surface
///         above kUnsupportedLimit is a guess, or a share of the normals above kOpposedLimit
///         opposes their neighbours; when the voxel is larger than the cloud
/// @throws NoSurface when the field has no zero at the points
/// @throws ResourceLimit, Cancelled
[[nodiscard]] PointsToBandResult pointsToBand(const PointCloud& cloud, double voxelSize,
                                              const PointsToBandOptions& options = {});

}  // namespace levelset
