#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "levelset/progress.h"
#include "render/bezier/bezier_volume.h"
#include "render/camera.h"

/// Ray casting of surfaces in Bézier volumes by shared subdivision trees [Liu14]. All rays of a
/// camera read one tree of subdivided patches: a ray is only an offset of the projected patches.
namespace render {

/// Intersection of a ray with the surface of a Bézier volume.
struct BezierRoot {
  double depth = 0;                        ///< along the view axis, world units
  double distance = 0;                     ///< along the ray, world units
  std::uint32_t patch = 0, attribute = 0;  ///< indices in the volume
  Imath::V3d parameter{0};                 ///< in the unit cube of the patch
  /// Unit normal to the outside, world space. It faces the ray where the map is singular.
  Imath::V3d normal{0};
  bool isEntry = false;  ///< the ray enters the object
  /// True if the tree was split down to its deepest level without proving that there is one root.
  /// So it is at double roots, and where the map is singular.
  bool isSingular = false;
};

/// Work of a picture.
struct TreeCounts {
  std::size_t nodes = 0;      ///< nodes whose bounds were computed
  std::size_t splits = 0;     ///< nodes that were split into eight
  std::size_t tests = 0;      ///< pairs of a ray and a node whose boxes were tested
  std::size_t solutions = 0;  ///< pairs to which Newton's method was applied
  std::size_t steps = 0;      ///< steps of Newton's method
  std::size_t singular = 0;   ///< roots with isSingular
  /// Number of times that a ray had kMostVisits undecided nodes below one shared node. It keeps the
  /// roots found before.
  std::size_t overruns = 0;
  std::size_t peakBytes = 0;  ///< memory of shared nodes, plus the largest one of a tile
  /// CPU seconds: overlap tests, Newton's method, splits with bounds, and the first level with the
  /// grouping of nodes. Only if they are measured.
  double overlapSeconds = 0, solutionSeconds = 0, splitSeconds = 0, groupSeconds = 0;

  void add(const TreeCounts& other);
};

struct TreeOptions {
  /// True: all roots of each ray, in order of their distance. False: the nearest one.
  bool allRoots = false;
  bool measureTime = false;
  /// Nodes are shared by the rays of one tile of this edge, in pixels.
  int tile = 32;
  /// Levels that are split before the tiles begin, where nodes are larger than a tile. With 0, and
  /// a tile of one pixel, each ray has its own tree: the basic scheme of [Liu14].
  int sharedLevels = 8;
  int uniformLevels = 0;  ///< levels that are split everywhere, as in pre-subdivision [Liu14]
  std::size_t maxBytes = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

/// A ray gives up a shared node after this number of undecided nodes below it, as when it lies in
/// the surface.
inline constexpr std::size_t kMostVisits = 20'000;

/// The shared tree of a volume for one view. It refers to the volume. Methods may run concurrently.
class SharedTree {
 public:
  /// Splits the patches until they are no larger than a tile or have at most one root for each ray.
  /// @pre requireBezierVolume() accepts the volume, validate() the camera
  /// @throws levelset::ResourceLimit if the nodes exceed TreeOptions::maxBytes
  SharedTree(const BezierVolume& volume, const Camera& camera, const TreeOptions& options = {});
  ~SharedTree();
  SharedTree(SharedTree&&) noexcept;
  SharedTree& operator=(SharedTree&&) noexcept;

  /// Roots of rays.
  struct Roots {
    /// Roots of ray n: from roots[first[n]] to before roots[first[n + 1]].
    std::vector<std::size_t> first;
    std::vector<BezierRoot> roots;
  };
  /// Finds the roots of the rays through image positions, in pixels. It is fastest when neighbours
  /// are in one call.
  [[nodiscard]] Roots rootsAt(const std::vector<Imath::V2d>& positions, TreeCounts* counts) const;
  /// Finds the roots of rays of the camera.
  [[nodiscard]] Roots rootsOf(const std::vector<Camera::Ray>& rays,
                              TreeCounts* counts = nullptr) const;
  /// Screen positions of rays of the camera, as BezierView defines them.
  [[nodiscard]] std::vector<Imath::V2d> screensOf(const std::vector<Camera::Ray>& rays) const;
  /// Finds the roots of rays through screen positions.
  [[nodiscard]] Roots rootsOn(std::vector<Imath::V2d> screens, TreeCounts* counts = nullptr) const;
  /// Work of the constructor.
  [[nodiscard]] const TreeCounts& counts() const;

  struct Data;  ///< private to the ray casters
  [[nodiscard]] const Data& data() const { return *data_; }

 private:
  std::unique_ptr<const Data> data_;
};

/// Roots of all rays through the centres of pixels.
struct BezierPicture {
  int width = 0, height = 0;
  std::vector<std::size_t> first;  ///< as SharedTree::Roots, by pixel, row by row
  std::vector<BezierRoot> roots;
  TreeCounts counts;

  /// Nearest root of a pixel, or null.
  [[nodiscard]] const BezierRoot* nearest(std::size_t pixel) const {
    return first[pixel] == first[pixel + 1] ? nullptr : &roots[first[pixel]];
  }
};

/// Finds the roots of all pixels. The result has the same bits for any number of threads.
/// @throws levelset::InvalidInput as requireBezierVolume()
/// @throws levelset::UsageError as validate()
[[nodiscard]] BezierPicture castBezier(const BezierVolume& volume, const Camera& camera,
                                       const TreeOptions& options = {});

}  // namespace render
