#pragma once

#include <cstddef>
#include <numbers>

#include "levelset/mesh.h"
#include "levelset/points/point_cloud.h"

namespace levelset {

struct PointsToMeshOptions {
  /// Largest target length of edges, world units; 0: 8 median point spacings. Edges reach about
  /// twice the target.
  double edgeLength = 0;
  /// Angle between the normals at the ends of an edge, radians, in (0, 1]. Edges are shorter where
  /// the surface bends more, but not below the spacing of the points.
  double angle = 20 * std::numbers::pi / 180;
  /// Width of the weight of a fit, in point spacings, from 1 to 10. Larger values smooth noise.
  /// With 1 the fit follows points without noise most closely.
  double smoothing = 2;
  /// Radius of the largest disc without points that the surface covers, in point spacings, from 1.5
  /// to 4. Larger holes get a border.
  double gap = 2.5;
  /// Least angle between the normals on both sides of an edge that is kept sharp, radians, from
  /// 10 to 90 degrees; 0: sharp edges are rounded over about a spacing.
  double sharpAngle = 0;
  bool acceptHoles = false;  ///< return a mesh that misses points or has holes
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Figures of pointsToMesh().
struct PointsToMeshReport {
  std::size_t components = 0;  ///< connected parts of the surface
  std::size_t incomplete = 0;  ///< parts whose mesh misses points or has holes
  std::size_t borders = 0;     ///< loops of edges with one triangle
  double borderLength = 0;     ///< world units
  std::size_t filled = 0;      ///< triangles that fill holes the fronts left
  /// Smallest factor on the edge lengths; below 1 where the front needed shorter edges.
  double smallestScale = 1;
  std::size_t unusedPoints = 0;  ///< points that belong to no surface
  std::size_t missedPoints = 0;  ///< points without a triangle nearby
  std::size_t guessed = 0;       ///< parts whose outside is a guess
  std::size_t pieces = 0;        ///< smooth pieces between sharp edges
  std::size_t sharpCurves = 0;   ///< sharp edges that are kept, between corners or closed
  std::size_t sharpCorners = 0;  ///< corners where sharp edges meet
  double sharpLength = 0;        ///< length of the curves along sharp edges, world units
  /// Pairs of neighbouring points across a sharp edge that is rounded: it fades out, meets a
  /// border, or its curve was not found.
  std::size_t roundedPairs = 0;
  double spacing = 0;  ///< median, world units
  // Wall seconds.
  double connectivitySeconds = 0, reconstructionSeconds = 0, triangulationSeconds = 0;
};

struct PointsToMeshResult {
  TriMesh mesh;
  PointsToMeshReport report;
};

/// Returns true if this build can mesh points: CGAL was found.
[[nodiscard]] bool canMeshPoints();

/// Converts points of a surface to a mesh of nearly equilateral triangles, without a level set
/// [Kalbe11]. The Delaunay tetrahedra connect the points. Height polynomials are fitted to the
/// neighbours of each point, and an advancing front moves on their blend. Vertices lie on the
/// surface, not at points. Borders of the surface stay open. The triangles face outwards; normals
/// of the cloud decide on the side if there are any.
/// @throws UsageError if an option is outside its range, or this build has no Delaunay
///         triangulation
/// @throws InvalidInput if the points lie on a line or are fewer than 3, if they form no surface,
///         if over 10 % of the normals oppose those of their neighbours, and unless `acceptHoles`,
///         if the mesh would miss points or have holes
/// @throws ResourceLimit, Cancelled
[[nodiscard]] PointsToMeshResult pointsToMesh(const PointCloud& cloud,
                                              const PointsToMeshOptions& options = {});

}  // namespace levelset
