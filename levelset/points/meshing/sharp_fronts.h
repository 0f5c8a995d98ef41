#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstddef>
#include <optional>
#include <vector>

#include "levelset/points/creases/crease_network.h"
#include "levelset/points/meshing/part_front.h"

namespace levelset::points {

/// Surface through points, divided at its sharp edges.
struct SharpSurface {
  Pieces pieces;
  std::optional<PointSurface> divided;  ///< empty: no part has two pieces
  CreaseNetwork network;
  std::size_t guessed = 0;  ///< parts whose outside is a guess
};

struct SharpOptions {
  double angle;      ///< least angle between the normals at a sharp edge, radians
  double smoothing;  ///< width of the weight of a fit, point spacings
  /// The normals of the cloud gave the sides of the surface. Else those of sharp wedges may be
  /// wrong, and normals that keep sharp edges are computed.
  bool hasSides = false;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Divides a surface at its sharp edges. Pieces whose common curve is not found as a whole are
/// joined again, so that their edge is rounded.
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SharpSurface divideSurface(const PointSurface& whole, const SharpOptions& options);

/// Meshes the pieces of a divided part by fronts that start at its sharp edges. The pieces share
/// the vertices of these edges.
class SharpFronts {
 public:
  /// @param sharp  with a divided surface
  SharpFronts(const PointSurface& whole, const SharpSurface& sharp, const PointEdgeLimits& limits);

  [[nodiscard]] bool isDivided(std::uint32_t part) const { return pieces_[part].size() > 1; }
  /// Number of triangles of all divided parts, about.
  [[nodiscard]] double expectedTriangles() const;
  /// @return a mesh that is not complete if a front fails with all edge lengths
  [[nodiscard]] PartMesh mesh(std::uint32_t part, const Progress& progress) const;

 private:
  /// Vertices along the curves of a part.
  struct Outline;
  /// Loops around a piece.
  struct PieceLoops {
    FrontLoops start;
    std::vector<std::uint32_t> numbers;  ///< vertices of the outline, then those of the mesh
    double longest = 0;                  ///< edge
  };

  [[nodiscard]] std::vector<double> capsAtCreases() const;
  [[nodiscard]] double lengthAt(const CreaseCurve& curve, std::size_t position) const;
  [[nodiscard]] Outline outlineOf(std::uint32_t part, double scale) const;
  void addCurve(std::uint32_t curve, double scale, Outline& outline) const;
  [[nodiscard]] PieceLoops loopsOf(std::uint32_t piece, const Outline& outline) const;
  [[nodiscard]] PartMesh meshPiece(std::uint32_t piece, const PieceLoops& loops, double scale,
                                   const Progress& progress) const;
  [[nodiscard]] bool join(const std::vector<PartMesh>& fronts, std::vector<PieceLoops>& loops,
                          const Outline& outline, FrontMesh& mesh) const;

  const PointSurface& surface_;
  const SharpSurface& sharp_;
  PointEdgeLimits limits_;
  std::vector<double> lengths_;
  BorderPoints borders_;
  std::vector<SurfacePart> parts_;                  ///< for each piece
  std::vector<std::vector<std::uint32_t>> pieces_;  ///< for each part
  std::vector<std::vector<std::uint32_t>> curves_;  ///< for each part
};

}  // namespace levelset::points
