#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <vector>

#include "levelset/points/field/oriented_points.h"

namespace levelset::points {

/// Closest points of many positions near each other. One search of the tree lists the candidates of
/// a ball. Smaller balls in it choose their candidates among them, and so does each position. The
/// results are those of PointSearch::closest(), but for their order: the nearest point is the first
/// one, and the farthest the last.
class CellPoints {
 public:
  /// Moves to a ball, and finds the closest points of its centre.
  /// @param points  must outlive the searches
  /// @param count   of closest points to find; fewer if the cloud has fewer
  const std::vector<FoundItem>& move(const OrientedPoints& points, const Imath::V3d& centre,
                                     double radius, std::size_t count);
  /// Moves to a smaller ball in that of move(), and finds the closest points of its centre.
  const std::vector<FoundItem>& moveInside(const Imath::V3d& centre, double radius);
  /// Finds the closest points of a position in the ball of moveInside().
  void closest(const Imath::V3d& at, std::vector<FoundItem>& found);

 private:
  enum class Candidates { Unknown, Listed, TooMany };
  struct Ball {
    Imath::V3d centre = Imath::V3d(0);
    double radius = 0;
    double farthest = 0;  ///< distance of the last one of the closest points from the centre
    Candidates candidates = Candidates::Unknown;
    std::vector<std::uint32_t> numbers;  ///< candidates, with their coordinates
    std::vector<double> x, y, z;

    void move(const Imath::V3d& to, double newRadius, const std::vector<FoundItem>& atCentre);
  };

  void find(Ball& ball, const Imath::V3d& at, std::vector<FoundItem>& found);
  void list(Ball& ball) const;
  void choose(const Ball& ball, const Imath::V3d& at, std::vector<FoundItem>& found);

  const OrientedPoints* points_ = nullptr;
  std::size_t count_ = 0;
  Ball outer_, inner_;
  std::vector<FoundItem> atOuter_, atInner_;
  std::vector<double> squared_;
  std::vector<std::uint32_t> sure_, possible_;
  std::vector<double> order_;
};

}  // namespace levelset::points
