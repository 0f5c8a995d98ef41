#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/geometry/search/point_search.h"
#include "levelset/meshing/front/advancing_front.h"
#include "levelset/points/projection/point_surface.h"

namespace levelset::points {

/// Limits of the edge lengths of a mesh.
struct PointEdgeLimits {
  double longest;
  double angle;  ///< between the normals at the ends of an edge, radians
};

/// Returns the edge length at each point: the chord of the angle on a circle of the largest
/// curvature, within limits. Lengths change by at most kGradation per unit of length along the
/// graph.
/// @param graph  of the surface; may connect points across sharp edges too
/// @param caps   further limits at points; empty: none
[[nodiscard]] std::vector<double> lengthsAtPoints(const PointSurface& surface,
                                                  const CoconeGraph& graph,
                                                  const PointEdgeLimits& limits,
                                                  const std::vector<double>& caps = {});

/// Points of a border, for searches.
class BorderPoints {
 public:
  explicit BorderPoints(const PointSurface& surface);
  [[nodiscard]] bool isEmpty() const { return numbers_.empty(); }
  /// Finds the nearest position of the borders of a part, with a normal not against `side`.
  [[nodiscard]] std::optional<PointSurface::BorderEnd> nearest(const Imath::V3d& position,
                                                               const Imath::V3d& side,
                                                               std::uint32_t part) const;

 private:
  const PointSurface& surface_;
  std::vector<std::uint32_t> numbers_;
  PointSearch search_;
};

/// Points of one part.
struct SurfacePart {
  std::vector<std::uint32_t> points;
  std::vector<std::uint32_t> starts;  ///< some with large edge lengths, the largest first
  double longest = 0;                 ///< edge length
  double expected = 0;                ///< number of triangles
};

[[nodiscard]] std::vector<SurfacePart> partsOf(const PointSurface& surface,
                                               const std::vector<double>& lengths);

/// One part of the surface through points.
class PartFront : public FrontSurface {
 public:
  PartFront(const PointSurface& surface, const BorderPoints& borders,
            const std::vector<double>& lengths, std::uint32_t number, const SurfacePart& part,
            double scale)
      : surface_(surface),
        borders_(borders),
        lengths_(lengths),
        part_(number),
        longest_(part.longest),
        scale_(scale) {}

  [[nodiscard]] std::optional<Foot> project(const Imath::V3d& position) const override {
    return projectBeside(position, Imath::V3d(0));
  }
  [[nodiscard]] std::optional<Foot> projectBeside(const Imath::V3d& position,
                                                  const Imath::V3d& normal) const override;
  [[nodiscard]] double edgeLength(const Imath::V3d& point) const override;

 private:
  const PointSurface& surface_;
  const BorderPoints& borders_;
  const std::vector<double>& lengths_;
  std::uint32_t part_;
  double longest_;  ///< edge length of the part
  double scale_;
};

/// Returns the options of a front with edge lengths times a factor.
[[nodiscard]] AdvancingFrontOptions advancingFrontOptions(const SurfacePart& part, double scale,
                                                          const Progress& progress);

/// Mesh of a part, with the number of points that it misses.
struct PartMesh {
  FrontMesh front;
  std::size_t missed = 0;
  double scale = 1;  ///< factor on the edge lengths
  [[nodiscard]] bool isComplete() const { return front.isClosed && missed == 0; }
};

[[nodiscard]] std::size_t countMissed(const FrontMesh& front, const PointSurface& surface,
                                      const SurfacePart& part, const std::vector<double>& lengths,
                                      double scale);

/// Meshes a part by a front from one of its starts, with shorter edges if need be.
[[nodiscard]] PartMesh meshPart(const PointSurface& surface, const BorderPoints& borders,
                                const SurfacePart& part, const std::vector<double>& lengths,
                                std::uint32_t number, const Progress& progress);

}  // namespace levelset::points
