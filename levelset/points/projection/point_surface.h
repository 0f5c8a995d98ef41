#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "levelset/geometry/search/point_search.h"
#include "levelset/points/point_cloud.h"
#include "levelset/points/projection/candidates.h"
#include "levelset/points/projection/cocone.h"
#include "levelset/points/projection/height_polynomial.h"
#include "levelset/progress.h"

namespace levelset::points {

struct PointSurfaceOptions {
  /// Width of the Gaussian weight of a fit, in local spacings. Larger values smooth noise.
  double smoothing = 1;
  /// Radius of the largest disc without points that the surface covers, in local spacings.
  double gap = 2.5;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Surface through points: a height polynomial at each point, fitted to its neighbours along the
/// surface, and a projection that blends the polynomials nearby [Kalbe11]. The projection needs no
/// optimisation. The surface may have borders.
class PointSurface {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// Position on the surface.
  struct Foot {
    Imath::V3d point, normal;  ///< the normal is a unit vector, outwards
    std::uint32_t nearest;     ///< number of the point whose fit was used
    bool isBeyondBorder;       ///< the surface ends between the nearest point and the foot
  };
  /// Part of the polygon through the points of a border.
  struct BorderEnd {
    Imath::V3d point;  ///< on the polygon
    Imath::V3d normal;
    double distance;  ///< from the position
  };
  struct Timing {
    double connectivity = 0, reconstruction = 0;  ///< seconds
  };

  /// Connects the points, fits the polynomials and turns their normals outwards; normals of the
  /// cloud give the side if there are any.
  /// @param cloud  finite positions of moderate size; points at equal positions count once
  /// @throws InvalidInput if all points lie on a line, if fewer than 3 positions differ, or if over
  ///         10 % of the given normals oppose those of their neighbours
  /// @throws UsageError if this build has no Delaunay triangulation
  PointSurface(const PointCloud& cloud, const PointSurfaceOptions& options);

  /// Divides parts into pieces that do not join smoothly. part() then is the piece. Points of
  /// divided parts get a polynomial that is fitted to points of their own piece. Borders stay.
  /// @param pieces   number of the piece of each point; kNone for points without a part
  /// @param normals  outwards, on the side of the piece
  /// @throws Cancelled
  void divide(std::span<const std::uint32_t> pieces, std::size_t count,
              std::span<const Imath::V3d> normals, double smoothing, const Progress& progress = {});

  /// Points at different positions, in the order of a search tree.
  [[nodiscard]] std::size_t size() const { return search_.size(); }
  [[nodiscard]] std::span<const Imath::V3d> positions() const { return positions_; }
  /// Neighbours along the surface, without those beyond gaps.
  [[nodiscard]] const CoconeGraph& graph() const { return graph_; }
  [[nodiscard]] const LocalFrame& frame(std::size_t point) const { return frames_[point]; }
  [[nodiscard]] double spacing(std::size_t point) const { return 1 / frames_[point].scale; }
  [[nodiscard]] bool hasFit(std::size_t point) const { return fits_[point].degree > 0; }
  [[nodiscard]] int degree(std::size_t point) const { return fits_[point].degree; }
  [[nodiscard]] const Imath::V3d& normal(std::size_t point) const { return normals_[point]; }
  /// Height of a position above the polynomial of a point, along its frame.
  [[nodiscard]] double heightOverFit(std::size_t point, const Imath::V3d& position) const {
    const Imath::V3d local = frames_[point].toLocal(position);
    return (local.z - fits_[point].value(local.x, local.y)) / frames_[point].scale;
  }
  /// Largest absolute curvature at a point, per world unit.
  [[nodiscard]] double curvature(std::size_t point) const;
  [[nodiscard]] bool isBorder(std::size_t point) const {
    return sectorsFirst_[point + 1] > sectorsFirst_[point];
  }
  /// Radius of the circle through a border point and its neighbours on the border; infinite if the
  /// surface lies inside it.
  [[nodiscard]] double holeRadius(std::size_t point) const;
  [[nodiscard]] const Timing& timing() const { return timing_; }
  /// Number of parts whose outside is a guess, as a plane.
  [[nodiscard]] std::size_t guessedParts() const { return guessedParts_; }
  /// Number of connected parts of the surface.
  [[nodiscard]] std::size_t partCount() const { return partCount_; }
  /// Part of a point; kNone for a point without a fit.
  [[nodiscard]] std::uint32_t part(std::size_t point) const { return parts_[point]; }

  /// Projects a position onto the surface: onto the polynomial of the nearest point, then along its
  /// normal onto the blend of the polynomials of that point and its neighbours.
  /// @param side  if not zero, points with a normal against it are passed over
  /// @param part  if given, points of other parts are passed over
  [[nodiscard]] std::optional<Foot> project(const Imath::V3d& position,
                                            const Imath::V3d& side = Imath::V3d(0),
                                            std::uint32_t part = kNone) const;
  /// Number of the nearest point with a fit, with a normal not against `side`; kNone if no point
  /// nearby has one.
  [[nodiscard]] std::uint32_t nearest(const Imath::V3d& position, const Imath::V3d& side,
                                      std::uint32_t part) const;
  /// Finds the nearest position of the border polygon near a point of the border.
  [[nodiscard]] BorderEnd borderEnd(const Imath::V3d& position, std::uint32_t borderPoint) const;

 private:
  /// Directions without neighbours at a point, counter-clockwise between two neighbours.
  struct Sector {
    std::uint32_t from, to;
    double radius;  ///< radius of the circle through the three points; infinite for an outer border
  };

  void computeSpacings();
  template <class Fit>
  void fitPoints(double smoothing, const std::vector<bool>& isLeftOut, const Fit& fit,
                 const Progress& progress);
  void orient(const PointCloud& cloud, const std::vector<std::uint32_t>& numbers,
              const Progress& progress);
  void requireAgreement() const;
  void pruneGraph(double gap);
  void findParts();
  void findBorders(double gap);
  void dropLoneSectors();
  [[nodiscard]] std::optional<double> crossing(std::uint32_t point, const Imath::V3d& from,
                                               const Imath::V3d& direction, double start) const;
  [[nodiscard]] Imath::V3d normalOfFit(std::uint32_t point, const Imath::V3d& at) const;
  [[nodiscard]] bool isBeyond(std::uint32_t point, const Imath::V3d& at) const;

  PointSearch search_;
  std::vector<Imath::V3d> positions_, normals_;
  CoconeGraph graph_;
  std::vector<LocalFrame> frames_;
  std::vector<HeightPolynomial> fits_;  ///< degree 0: none
  std::vector<std::uint32_t> sectorsFirst_;
  std::vector<Sector> sectors_;
  double reach_ = 0;  ///< radius in which the polynomial of a point is used, spacings
  Timing timing_;
  std::size_t guessedParts_ = 0, partCount_ = 0;
  std::vector<std::uint32_t> parts_;
};

}  // namespace levelset::points
