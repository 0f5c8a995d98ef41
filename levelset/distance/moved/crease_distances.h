#pragma once

// Internal header of levelset: public headers must not include it.

#include <tbb/enumerable_thread_specific.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <vector>

#include "levelset/distance/moved/moved_surface.h"
#include "levelset/distance/nearest/distance_request.h"
#include "levelset/distance/nearest/point_distance.h"

namespace levelset::eikonal {

/// Grid points on the near side of one leaf whose value is not the distance to the moved surface.
struct WrongPoints {
  const NearestPoints::Block* block = nullptr;
  NearestPoints::Mask mask;
};

/// Distances of the grid points whose value is not the distance to the moved surface. Takes them
/// slab by slab (all leaf blocks with the same x), in ascending order.
class CreaseDistances {
 public:
  /// Keeps references to all parameters.
  CreaseDistances(const ZeroSet& surface, Polishers& polishers, const DistanceRequest& request);

  /// Number of slabs on each side of a slab that must be searched before it is resolved.
  static constexpr int kSlabsAround = (kCreaseReach + 7) / 8;

  /// Finds the distance of each grid point by itself. Forgets the grid points whose value is right.
  /// @param wrong  grid points of one slab, with distances minus the shift below the half width
  void search(int slab, const std::vector<WrongPoints>& wrong);

  /// Completes the distances of the slabs first to last. Starts the search again from the crease
  /// points of the neighbours, where these are nearer. So the nearest of several creases is found.
  /// Starts the failed searches again: from the nearest crease points of other grid points, and
  /// from zero crossings of the field. The nearest point of the moved surface lies on a crease
  /// wherever the plain distance is wrong.
  /// @param field  distances minus the shift. The trusted distances are written into the slabs
  /// before
  ///               `last`.
  /// @pre search() for kSlabsAround more slabs on each side
  void resolve(int first, int last, openvdb::FloatGrid& field);

  /// Grid points without a trusted distance (`points`), and those around them to which the moved
  /// surface may be nearest (`near`). `nearEdges` are the part of `near` around points beside edges
  /// of the surface.
  struct Missing {
    openvdb::MaskTree points, near, nearEdges;
  };

  /// Writes the last trusted distances into the field.
  [[nodiscard]] Missing finish(openvdb::FloatGrid& field);

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
  /// Points of one leaf.
  struct Leaf {
    const NearestPoints::Block* block = nullptr;
    std::vector<Point> points;
    [[nodiscard]] openvdb::Coord gridPoint(const Point& point) const {
      return block->origin + openvdb::FloatTree::LeafNodeType::offsetToLocalCoord(point.n);
    }
  };
  using Leaves = std::vector<Leaf>;
  /// A point whose search is complete.
  struct Resolved {
    double plain = 0, found = INFINITY, bound = INFINITY;  ///< as in Point
    std::uint16_t n = 0;
    bool isInside = false, isBesideCrease = false, meetsPatches = false;
  };
  struct ResolvedLeaf {
    openvdb::Coord origin;
    std::vector<std::pair<openvdb::Index, double>> trusted;  ///< as LeafDistances
    std::vector<Resolved> others;
    [[nodiscard]] openvdb::Coord gridPoint(const Resolved& point) const {
      return origin + openvdb::FloatTree::LeafNodeType::offsetToLocalCoord(point.n);
    }
  };

  [[nodiscard]] static bool isTrusted(const Point& point);
  [[nodiscard]] Leaves takeAround(int last);
  void adoptFromNeighbours(Leaves& leaves);
  void searchAgain(Leaves& leaves, int first, int last, const openvdb::FloatGrid& field);
  void keep(const Leaves& leaves, int first, int last);
  void writeTrusted(int last, openvdb::FloatGrid& field);
  void add(const openvdb::Coord& c, const Resolved& point, bool mayHaveEdge,
           Missing& missing) const;

  /// Grid points and their crease points by cells of kCell³ grid points.
  using Cells =
      std::unordered_map<openvdb::Coord,
                         std::vector<std::pair<openvdb::Coord, const MovedSurface::CreasePoint*>>,
                         std::hash<openvdb::Coord>>;
  [[nodiscard]] static openvdb::Coord cellOf(const openvdb::Coord& c);
  [[nodiscard]] static Cells creasesByCell(const Leaves& leaves, const openvdb::MaskTree& within);
  [[nodiscard]] static std::vector<const MovedSurface::CreasePoint*> nearestCreases(
      const Cells& cells, const openvdb::Coord& x);

  const DistanceRequest& request_;
  Polishers& polishers_;
  tbb::enumerable_thread_specific<MovedSurface> searches_;
  std::map<int, Leaves> searched_;                     ///< by slab
  std::map<int, std::vector<ResolvedLeaf>> resolved_;  ///< not written yet, by slab
  std::vector<ResolvedLeaf> missing_;                  ///< leaves with points without a distance
};

}  // namespace levelset::eikonal
