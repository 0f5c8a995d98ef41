#pragma once

// Internal header of levelset: public headers must not include it.

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <optional>

#include "levelset/distance/nearest/distance_request.h"
#include "levelset/distance/nearest/polisher.h"

namespace levelset::eikonal {

/// Distance of a grid point, voxels, and its closest point if it is near the band.
struct PointDistance {
  double value = 0;
  std::optional<Closest> closest = {};
};

/// Returns the grid points of a block whose distance minus the requested shift may be below the
/// half width.
[[nodiscard]] NearestPoints::Mask nearBand(const NearestPoints::Block& block,
                                           const DistanceRequest& request);

/// Computes the distance of a grid point from the surface, minus the requested shift.
/// @param n  number of the grid point in the block
[[nodiscard]] PointDistance distanceAt(const NearestPoints::Block& block, openvdb::Index n,
                                       Polisher& polisher, const DistanceRequest& request);

/// Computes distanceAt() for a grid point of nearBand().
[[nodiscard]] PointDistance nearDistanceAt(const NearestPoints::Block& block, openvdb::Index n,
                                           Polisher& polisher, const DistanceRequest& request);

/// Returns the old value if the computed one equals it within the error of interpolation, voxels.
/// So repeated redistancing does not shift a distance field.
[[nodiscard]] double keptOr(double value, double old, const Polisher& polisher,
                            std::uint32_t surfacePoint);

/// Sets a grid point to a distance, or to the background beyond the half width.
/// @param value, halfWidth  voxels
/// @param background  world units
void setDistance(openvdb::FloatTree::LeafNodeType& leaf, openvdb::Index n, double value,
                 double halfWidth, double voxelSize, float background);

/// Polishers of all threads.
class Polishers {
 public:
  /// Keeps a reference to `surface`.
  explicit Polishers(const ZeroSet& surface)
      : polishers_([&surface] { return Polisher(surface); }) {}

  /// Returns the polisher of this thread.
  [[nodiscard]] Polisher& local() { return polishers_.local(); }

  /// Calls work(index, polisher) for the indices below `count`, in parallel.
  template <typename Work>
  void forEach(std::size_t count, const Work& work) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 8), [&](const auto& range) {
      Polisher& polisher = polishers_.local();
      polisher.forgetBlock();
      for (std::size_t i = range.begin(); i != range.end(); ++i) work(i, polisher);
    });
  }

 private:
  tbb::enumerable_thread_specific<Polisher> polishers_;
};

}  // namespace levelset::eikonal
