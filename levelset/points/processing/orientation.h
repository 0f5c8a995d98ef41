#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/points/point_cloud.h"
#include "levelset/points/processing/point_neighbours.h"

// Internal header of levelset/points/processing.

namespace levelset::points {

/// The nearest neighbours of each point, as edges of a graph, and the area around each point.
class NeighbourGraph {
 public:
  static constexpr std::size_t kEdges = 8;  ///< number of edges that a point has at most
  static constexpr std::uint32_t kNone = 0xffffffffu;

  explicit NeighbourGraph(std::size_t points)
      : edges_(points * kEdges, kNone), areas_(points, 0.0) {}
  /// Sets the edges of a point. `found` is the result of PointNeighbours::nearest at the point.
  void set(std::uint32_t point, const std::vector<Neighbour>& found);
  [[nodiscard]] const std::uint32_t* edges(std::size_t point) const {
    return edges_.data() + point * kEdges;
  }
  /// Area of the surface around a point, world units²; 0 for a point that has no edges.
  [[nodiscard]] double area(std::size_t point) const { return areas_[point]; }

 private:
  std::vector<std::uint32_t> edges_;
  std::vector<double> areas_;
};

struct Orientation {
  std::size_t components = 0, guessed = 0;
  double doubtful = 0;
};

/// Turns the normals of a cloud so that they agree with their neighbours and point outwards.
/// Normals of length 0 stay.
[[nodiscard]] Orientation orientNormals(PointCloud& cloud, const NeighbourGraph& graph,
                                        const Progress& progress);

}  // namespace levelset::points
