#pragma once

// Internal header of levelset: public headers must not include it.

#include <tbb/enumerable_thread_specific.h>

#include <cmath>
#include <optional>
#include <unordered_map>
#include <vector>

#include "levelset/distance/moved/moved_surface.h"
#include "levelset/distance/nearest/distance_request.h"

namespace levelset::eikonal {

/// Distances of the grid points whose value is not the distance to the moved surface.
class CreaseDistances {
 public:
  /// Keeps references to all parameters.
  /// @param wrong  the grid points
  CreaseDistances(const openvdb::MaskTree& wrong, const ZeroSet& surface,
                  const NearestPoints& nearest, const DistanceRequest& request);

  /// Finds the distance of each grid point by itself. Forgets the grid points whose value is right.
  void search(const Progress& progress);

  /// Starts the search again from the crease points of the neighbours, where these are nearer. So
  /// the nearest of several creases is found.
  void adoptFromNeighbours();

  /// Starts the failed searches again: from the nearest crease points of other grid points, and
  /// from zero crossings of the field. The nearest point of the moved surface lies on a crease
  /// wherever the plain distance is wrong.
  void searchAgain(const openvdb::FloatGrid& field);

  /// Grid points without a trusted distance (`points`), and those around them to which the moved
  /// surface may be nearest (`near`). `nearEdges` are the part of `near` around points beside edges
  /// of the surface.
  struct Missing {
    openvdb::MaskTree points, near, nearEdges;
  };

  /// Writes the trusted distances into the field.
  [[nodiscard]] Missing write(openvdb::FloatGrid& field) const;

  /// Compares the distances that were measured from the field with those to creases and with the
  /// lower bounds.
  void improveMeasured(openvdb::FloatGrid& field) const;

 private:
  struct Point {
    openvdb::Index n = 0;
    double sign = 1;
    bool hasFailed = false;                             ///< the search by itself found no distance
    bool isBesideCrease = false, meetsPatches = false;  ///< as in MovedSurface::Search
    double plain = 0;  ///< lower bound of the distance, voxels: the distance minus the shift
    std::optional<MovedSurface::Result> found = {};
    double bound = INFINITY;  ///< upper bound: distance of a crease point of another grid point
  };
  void add(const openvdb::Coord& c, const Point& point, bool mayHaveEdge, Missing& missing) const;
  [[nodiscard]] static bool isTrusted(const Point& point);

  /// Grid points and their crease points by cells of kCell³ grid points.
  using Cells =
      std::unordered_map<openvdb::Coord,
                         std::vector<std::pair<openvdb::Coord, const MovedSurface::CreasePoint*>>,
                         std::hash<openvdb::Coord>>;
  [[nodiscard]] static openvdb::Coord cellOf(const openvdb::Coord& c);
  [[nodiscard]] openvdb::MaskTree failedPoints() const;
  [[nodiscard]] Cells creasesByCell(const openvdb::MaskTree& within) const;
  [[nodiscard]] static std::vector<const MovedSurface::CreasePoint*> nearestCreases(
      const Cells& cells, const openvdb::Coord& x);
  [[nodiscard]] static std::vector<openvdb::Vec3d> nearestCrossings(
      const openvdb::FloatGrid::ConstAccessor& field, const openvdb::Coord& from);
  [[nodiscard]] openvdb::Coord gridPoint(std::size_t leaf, const Point& point) const;

  std::vector<const openvdb::MaskTree::LeafNodeType*> leaves_;
  const ZeroSet& surface_;
  const NearestPoints& nearest_;
  const DistanceRequest& request_;
  std::vector<std::vector<Point>> points_;  ///< by leaf
  tbb::enumerable_thread_specific<MovedSurface> searches_;
};

}  // namespace levelset::eikonal
