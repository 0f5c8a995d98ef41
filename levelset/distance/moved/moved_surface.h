#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <optional>
#include <vector>

#include "levelset/distance/nearest/polisher.h"

namespace levelset::eikonal {

/// Distances to the surface moved along its normals by a constant. A grid point on the far side of
/// the moved surface is as far from it as from the surface, minus the shift. This class computes
/// the distances of the grid points on the near side, where the surface itself is. One per thread.
class MovedSurface {
 public:
  /// @param shift      length by which the surface moves, voxels; outwards if positive
  /// @param halfWidth  largest distance of interest, voxels
  /// @param cache      dense copies of the field
  MovedSurface(const ZeroSet& surface, DenseBlockCache& cache, double shift, double halfWidth);

  /// Distance along each axis, voxels, from a grid point within which its search reads the nearest
  /// surface points of other grid points. A crease point farther away counts as not found.
  [[nodiscard]] static double reach(double shift, double halfWidth);
  /// As above, for the field. A search that would read farther away fails.
  [[nodiscard]] static double fieldReach(double shift, double halfWidth);

  /// Most parts of the surface that are equally far from a point of a crease.
  static constexpr std::size_t kParts = 3;

  /// Point of the moved surface at which two or three of its parts meet.
  struct CreasePoint {
    openvdb::Vec3d point = {};              ///< index space
    std::vector<openvdb::Vec3d> feet = {};  ///< closest points of the surface on these parts
  };
  /// Distance of a grid point from the moved surface, voxels, and its closest point if that lies on
  /// a crease.
  struct Result {
    double distance = 0;
    std::optional<CreasePoint> crease = {};
  };
  /// Result of a search; none if it fails.
  struct Search {
    std::optional<Result> result = {};
    /// Another part is nearer to the moved surface than the closest point, by kBesideCrease voxels
    /// or more. So the nearest point of the moved surface lies on a crease, also if the search
    /// fails.
    bool isBesideCrease = false;
    /// The search fails, and comes to sharp patches of the surface (triangles near edges).
    bool meetsPatches = false;
  };

  /// Finds the distance of a grid point on the near side from the moved surface. If the normal at
  /// the closest point of the surface meets the moved surface, the distance is the length of that
  /// line. Otherwise another part of the surface is nearer there, and the moved parts meet in a
  /// crease. Then the nearest point of the crease lies at the same distance from two or three
  /// parts; Newton's method finds it.
  /// @param closest  closest point of the surface for the grid point number `n` of the block
  [[nodiscard]] Search distance(const NearestPoints::Block& block, openvdb::Index n,
                                const Closest& closest);

  /// As distance(), but searches for a crease beside `near`, which lies near the moved surface.
  [[nodiscard]] std::optional<Result> distanceNear(const NearestPoints::Block& block,
                                                   openvdb::Index n, const openvdb::Vec3d& near);

  /// As distance(), but starts from a crease point of a neighbouring grid point.
  [[nodiscard]] std::optional<Result> distanceFrom(const NearestPoints::Block& block,
                                                   openvdb::Index n, CreasePoint start);

 private:
  enum class Nearer { None, Part, Unknown };
  enum class Meeting { Found, Smooth, Failed };
  enum class PatchDistance {
    Nearer,   ///< the patches are nearer
    Farther,  ///< they are not, and the surface beside them is not nearer either
    PastEnd,  ///< they are not nearer, but the surface may be where they end
  };
  struct NearerPart {
    Nearer kind = Nearer::None;
    openvdb::Vec3d point = {};  ///< closest point of the nearer part
    double distance = 0;        ///< its distance, voxels
  };

  [[nodiscard]] std::vector<openvdb::Vec3d> partsAround(const NearestPoints::Block& block,
                                                        const openvdb::Vec3d& point);
  [[nodiscard]] Result nearestPair(const NearestPoints::Block& block, const openvdb::Vec3d& x,
                                   const openvdb::Vec3d& start,
                                   const std::vector<openvdb::Vec3d>& feet, Result best);
  [[nodiscard]] NearerPart nearerPart(const NearestPoints::Block& block, const openvdb::Vec3d& at,
                                      const std::vector<openvdb::Vec3d>& parts);
  [[nodiscard]] Meeting meetActive(const openvdb::Vec3d& x, std::vector<openvdb::Vec3d>& feet,
                                   openvdb::Vec3d& meeting);
  [[nodiscard]] Meeting meet(const openvdb::Vec3d& x, std::vector<openvdb::Vec3d>& feet,
                             openvdb::Vec3d& meeting, std::array<double, kParts>& multipliers);
  [[nodiscard]] PatchDistance patchDistance(const openvdb::Vec3d& at) const;
  [[nodiscard]] bool isOnOuterSide(const openvdb::Vec3d& foot, const openvdb::Vec3d& point);
  [[nodiscard]] bool follow(openvdb::Vec3d& foot, const openvdb::Vec3d& from);
  [[nodiscard]] bool isWithin(const openvdb::Vec3d& point, double distance) const;

  DenseBlockCache& cache_;
  const SurfacePoints& points_;
  const SharpPatches& patches_;
  const double shift_, halfWidth_;
  openvdb::Vec3d gridPoint_ = {};  ///< of the present search
  bool meetsPatches_ = false;      ///< the last search came to sharp patches
};

}  // namespace levelset::eikonal
