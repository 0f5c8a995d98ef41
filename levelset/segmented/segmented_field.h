#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace levelset {

struct SegmentedData;  // defined in levelset/segmented/segmented_data_vdb.h, for the .cpp files

/// Number of a region.
using RegionLabel = std::uint16_t;
/// Label of the void: the outside of all regions.
inline constexpr RegionLabel kVoid = 0;

/// A partition of space into regions with labels, as a segmented distance field [Yamazaki02]. Each
/// grid point has the label of its region, and near an interface its distance to the interface with
/// each region around it, world units. Regions meet at interfaces without gaps or overlaps; three
/// or more meet at junctions.
///
/// A grid point of region a stores the distance to the nearest interface. Near junctions it also
/// stores the distances to the interfaces between a and the other regions there. The signed
/// distance to region a is minus the smallest of them; that to another region b is the one to the
/// interface between a and b. So each interface is interpolated between distances to itself, and
/// stays as accurate near a junction as elsewhere. The distances to the nearest interface alone, as
/// published, would shift it there.
///
/// A field made with sheets also stores where the edges of the grid cross surfaces. A sheet is a
/// surface with the same region on both sides, such as a wall with a door. Regions, and the
/// distances of the sampler, do not depend on sheets; meshes and measures hold them.
///
/// The class has value semantics. Copies share the data, which does not change. The transform to
/// world space is a rotation, a uniform scale and a translation.
class SegmentedField {
 public:
  SegmentedField() = default;
  explicit SegmentedField(std::shared_ptr<const SegmentedData> data) : data_(std::move(data)) {}

  /// Returns true when there is no interface and no sheet.
  [[nodiscard]] bool isEmpty() const;
  /// Edge length of a voxel, world units.
  [[nodiscard]] double voxelSize() const;
  /// Largest stored distance from an interface, voxels. Farther away the distance is this one.
  [[nodiscard]] double halfWidth() const;
  /// Labels of the regions that own a grid point, ascending, without the void.
  [[nodiscard]] std::vector<RegionLabel> labels() const;
  /// Labels of the regions that have sheets inside, ascending, the void among them.
  [[nodiscard]] std::vector<RegionLabel> sheetLabels() const;
  /// Transform from index to world space. Imath multiplies row vectors: `world = index * matrix`.
  [[nodiscard]] Imath::M44d indexToWorld() const;
  /// Grid points with a stored distance.
  [[nodiscard]] std::size_t activeVoxelCount() const;
  /// Distances to further regions, stored near junctions.
  [[nodiscard]] std::size_t extraCount() const;
  [[nodiscard]] std::size_t memoryUse() const;  ///< bytes
  /// Bounds of the interfaces and sheets, world units: box of all their crossings with edges
  /// between neighbouring grid points. Empty when there are none.
  [[nodiscard]] Imath::Box3d interfaceBounds() const;
  /// Hash of transform, labels and distances.
  [[nodiscard]] std::uint64_t contentHash() const;

  /// Data behind the field, for the .cpp files of this library. May be null if isEmpty().
  [[nodiscard]] const std::shared_ptr<const SegmentedData>& shared() const { return data_; }

 private:
  std::shared_ptr<const SegmentedData> data_;
};

/// Samples a segmented field at world positions. Caches the path through the tree. Cheap to
/// construct; use one per thread.
class SegmentedSampler {
 public:
  /// @pre the field is not empty
  explicit SegmentedSampler(const SegmentedField& field);
  ~SegmentedSampler();
  SegmentedSampler(SegmentedSampler&&) noexcept;
  SegmentedSampler& operator=(SegmentedSampler&&) noexcept;

  /// Region of a position: that with the smallest of the trilinearly interpolated distances. The
  /// void for a position that is not finite.
  [[nodiscard]] RegionLabel label(const Imath::V3d& world) const;
  /// Trilinearly interpolated signed distance to a region, world units, negative inside. ± the half
  /// width far from it.
  [[nodiscard]] double signedDistance(const Imath::V3d& world, RegionLabel region) const;
  /// Trilinearly interpolated distance to the nearest interface. It does not vanish at interfaces:
  /// use signedDistance() there.
  [[nodiscard]] double distance(const Imath::V3d& world) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace levelset
