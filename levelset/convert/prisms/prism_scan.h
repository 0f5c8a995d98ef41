#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "levelset/convert/prisms/prism_covering.h"
#include "levelset/mesh_sign/triangle_distance.h"

namespace levelset::convert {

/// Distances, in voxels, from the 8³ grid points of a block to the nearest triangle, by scan
/// conversion of prisms: each triangle is measured only from the grid points in its prism. If many
/// triangles touch a block, bounding spheres exclude those that cannot be nearest in a cell of 4³
/// points. The distances are exact up to the reach of the prisms.
class PrismScan {
 public:
  static constexpr std::uint32_t kNoTriangle = ~std::uint32_t{0};

  explicit PrismScan(const PrismCovering& prisms) : prisms_(prisms) {}

  /// @param candidates  triangles, including all whose prism touches the block, ascending
  /// @param origin  lowest grid point of the block
  /// @return true when a grid point lies within reach of a triangle
  bool measure(const LocalMesh& mesh, std::span<const std::uint32_t> candidates,
               const Imath::V3d& origin);

  /// Distances in voxels, x slowest, z fastest; the reach for points that are further away.
  [[nodiscard]] const std::array<double, kBlockVoxels>& distances() const { return distances_; }
  /// The triangle that is nearest to each point: among those at the same distance, the one with the
  /// lowest index of those whose prism contains the point. kNoTriangle beyond the reach.
  [[nodiscard]] const std::array<std::uint32_t, kBlockVoxels>& nearest() const { return nearest_; }
  /// Number of distances that all calls of measure() computed.
  [[nodiscard]] std::size_t measuredCount() const { return measured_; }

 private:
  // Triangle of a block. Its centre and radius bound its distance from a cell of grid points.
  // Coordinates are relative to the centre of the block.
  struct Candidate {
    std::uint32_t triangle = 0;
    std::array<Imath::V3d, 3> corners;
    std::optional<PrismPlanes> planes;
    TriangleFrame frame;
  };
  struct Sphere {
    Imath::V3f centre;
    float radius = 0;
    std::uint32_t candidate = 0;
  };
  using Spheres = std::vector<Sphere>;

  void keepNear(const Spheres& from, const Imath::V3f& centre, float cellRadius, Spheres& to);
  template <int kDim>
  void scanCell(const Spheres& spheres, const Imath::V3d& centre);
  template <int kDim>
  bool findRows(const PrismPlanes::HalfPlanes& planes, const Imath::V3d& centre);
  template <int kDim>
  void measureRows(const Candidate& candidate, const Imath::V3d& centre);

  const PrismCovering& prisms_;
  std::array<double, kBlockVoxels> distances_{};  // squared during measure()
  std::array<std::uint32_t, kBlockVoxels> nearest_{};
  std::vector<Candidate> candidates_;
  Spheres all_, block_, cell_;  // of all candidates; of those that can be nearest in a cell
  std::vector<float> squared_;  // squared distances to the centres of spheres
  // First and last z in a half of a prism for each row of a cell, relative to its centre.
  static constexpr std::size_t kMostRows = std::size_t{kBlockDim} * kBlockDim;
  std::array<float, kMostRows> low_{}, high_{};
  std::size_t measured_ = 0;
};

}  // namespace levelset::convert
