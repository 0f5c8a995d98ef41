#pragma once

#include "levelset/points/point_cloud.h"

namespace levelset {

/// Degree of the polynomial that is fitted to the neighbourhood of a point.
enum class FitDegree {
  Adaptive,  ///< degree 1 or 2, the one with the smaller error of prediction
  One,
  Two
};

struct NormalsOptions {
  int neighbours = 20;  ///< number of nearest points that are fitted, from 3 to 1000
  FitDegree degree = FitDegree::Adaptive;
  bool isOriented = true;  ///< false: the sign of each normal is arbitrary
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Largest share of the normals that may oppose those of their neighbours. Solids and meshes refuse
/// points above it. A thin sheet has opposed normals too.
inline constexpr double kOpposedLimit = 0.1;

/// Figures of the normals that estimateNormals() computes.
struct NormalsReport {
  std::size_t missing = 0;     ///< points without a normal: their neighbours lie on a line
  std::size_t quadratic = 0;   ///< points whose neighbourhood was fitted with degree 2
  std::size_t components = 0;  ///< connected parts, each of which was oriented alone
  std::size_t guessed = 0;     ///< parts whose winding number does not show the outside, as a plane
  /// Share of the tested points at which the winding number contradicts the normal. Points of
  /// guessed parts are not tested.
  double doubtful = 0;
};

struct NormalsResult {
  PointCloud cloud;
  NormalsReport report;
};

/// Computes unit normals by a weighted least-squares fit of a height function to the neighbours of
/// each point. Beside a sharp edge, those on one side are fitted. Orients them along a minimum
/// spanning tree of the neighbourhood graph [Hoppe92], then turns each connected part outwards by
/// its winding number [Barill18]. A part inside an odd number of others is a cavity, whose normals
/// point into it. Replaces present normals. Points at equal positions share a normal.
/// @throws UsageError for fewer than 3 or more than 1000 neighbours
/// @throws InvalidInput for a cloud of fewer than 3 positions, and when all points lie on a line
/// @throws ResourceLimit, Cancelled
[[nodiscard]] NormalsResult estimateNormals(PointCloud cloud, const NormalsOptions& options = {});

}  // namespace levelset
