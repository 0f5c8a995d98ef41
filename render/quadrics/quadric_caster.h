#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "levelset/progress.h"
#include "render/camera.h"
#include "render/quadrics/quadric.h"

namespace render {

struct QuadricTables;

/// First intersection of a ray with quadrics.
struct QuadricHit {
  bool found = false;
  double distance = 0;     ///< along the ray, world units
  Imath::V3d normal{0};    ///< outward unit normal of the quadric
  std::uint32_t slot = 0;  ///< place of the primitive in the tables
};

/// Quadrics prepared for ray casting, in a tree of boxes with eight children.
///
/// Numbers are stored in single precision, relative to the middle of the model. So a position is
/// rounded to 2^-24 of the model's half diagonal, wherever the model lies. Tests in single
/// precision only find the primitives that a ray may meet, with a margin for rounding. The
/// intersections of these are computed in double precision (render/shaders/exact/quadrics.glsl).
/// The result is the nearest intersection of all primitives, at equal distances that of the lowest
/// slot, whatever the order of the tests.
///
/// The class has value semantics. Copies share the data. All methods may run concurrently.
class QuadricCaster {
 public:
  /// @throws levelset::InvalidInput as requireQuadrics()
  /// @throws levelset::ResourceLimit if the preparation needs more than `maxBytes` beside the model
  explicit QuadricCaster(const QuadricModel& model,
                         std::size_t maxBytes = levelset::kNoMemoryLimit);

  /// Box of the quadrics, world units.
  [[nodiscard]] const Imath::Box3d& bounds() const { return bounds_; }
  /// For each direction the largest p·direction over the points p of the quadrics, world units.
  [[nodiscard]] std::vector<double> extents(const std::vector<Imath::V3d>& directions) const;
  /// Number of the quadrics.
  [[nodiscard]] std::size_t count() const;
  /// Memory of the tables, bytes: about 30 for a sphere and 43 for a cylinder of a large model.
  [[nodiscard]] std::size_t bytes() const;
  /// The quadrics as stored. Spheres, cylinders and general quadrics keep their kinds, not their
  /// order.
  [[nodiscard]] QuadricModel model() const;

  /// First intersection of a ray between its ends. A ray that starts inside a quadric meets it from
  /// within.
  [[nodiscard]] QuadricHit firstHit(const Camera::Ray& ray) const;
  /// First intersections of rays, with the bits of firstHit(). Sixteen at a time are searched
  /// together if they are close to each other, as the rays through a square of a picture.
  [[nodiscard]] std::vector<QuadricHit> firstHits(std::span<const Camera::Ray> rays) const;
  /// Returns true if a ray intersects a quadric between its ends. Cheaper than firstHit().
  [[nodiscard]] bool isOccluded(const Camera::Ray& ray) const;
  /// Colour of the primitive of a hit, linear.
  [[nodiscard]] Imath::C3f colourOf(const QuadricHit& hit) const;
  /// Hit at a distance that a kernel found. @param slot  place of its primitive
  [[nodiscard]] QuadricHit hitAt(const Camera::Ray& ray, double distance, std::uint32_t slot) const;

  /// Data for the back ends of the kernel.
  [[nodiscard]] const std::shared_ptr<const QuadricTables>& tables() const { return tables_; }

 private:
  /// @param face  of the primitive, as QuadricKernel::QuadricRoot
  [[nodiscard]] QuadricHit hitOn(const Camera::Ray& ray, double distance, std::uint32_t slot,
                                 int face) const;

  std::shared_ptr<const QuadricTables> tables_;
  Imath::Box3d bounds_;
};

}  // namespace render
