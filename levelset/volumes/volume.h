#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "levelset/progress.h"

namespace levelset {

/// Type of the stored numbers of a volume.
enum class VolumeType { U8, I8, U16, I16, F32 };

/// Name of the type as options and reports write it: "u8", "i8", "u16", "i16", "f32".
[[nodiscard]] const char* volumeTypeName(VolumeType type);
/// Size of a stored number, bytes.
[[nodiscard]] std::size_t volumeTypeSize(VolumeType type);

/// Grid of a volume.
struct VolumeGrid {
  Imath::V3i size = Imath::V3i(0);  ///< number of grid points along i, j and k
  /// Transform from index to world space. Imath multiplies row vectors: `world = index * matrix`.
  /// Any invertible affine map; it may be anisotropic, oblique or mirrored.
  Imath::M44d indexToWorld = Imath::M44d();

  [[nodiscard]] std::size_t pointCount() const {
    return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
           static_cast<std::size_t>(size.z);
  }
  /// Distances between neighbouring grid points along i, j and k, world units.
  [[nodiscard]] Imath::V3d spacing() const;
  /// Bounds of the grid points, world units.
  [[nodiscard]] Imath::Box3d bounds() const;
  /// Orientation of the axes i, j and k in three letters, for example "RAS": each letter names the
  /// anatomical direction that is nearest to the axis (Right, Left, Anterior, Posterior, Superior,
  /// Inferior). In world space x points right, y anterior and z superior.
  [[nodiscard]] std::string orientation() const;
  /// Returns true when the axes are perpendicular, to 1e-6.
  [[nodiscard]] bool isOrthogonal() const;
};

/// Rescaling of stored numbers to values: value = slope × stored + intercept.
struct VolumeScale {
  double slope = 1;  ///< not 0
  double intercept = 0;

  [[nodiscard]] double operator()(double stored) const { return slope * stored + intercept; }
};

/// Numbers on a regular grid, as scanners and simulations store them. The numbers keep the type of
/// the file, and stay in the mapped file where possible.
///
/// The class has value semantics. Copies share the numbers, which never change. All values are
/// finite. World space is right-handed. Files of medical images use RAS: x points to the patient's
/// right, y to the front, z to the head. Readers turn the LPS coordinates of MetaImage and NRRD
/// into RAS by negating x and y.
class Volume {
 public:
  /// Numbers that a volume keeps, in the byte order of the machine, i fastest, k slowest.
  struct Data {
    std::shared_ptr<const void> owner = {};  ///< keeps `begin` valid
    const char* begin = nullptr;             ///< address of the first number, any alignment
    bool isMapped = false;                   ///< true: the numbers are in a mapped file
  };

  /// Makes a volume and finds the range of its numbers.
  /// @throws InvalidInput for a number that is NaN or infinite, a size below 1, or a transform that
  ///         is not invertible
  /// @throws Cancelled
  Volume(const VolumeGrid& grid, VolumeType type, const VolumeScale& scale, Data data,
         const Progress& progress = {});
  /// Makes a volume of type f32. @param values  i fastest; as many as the grid has points
  /// @throws as the other constructor; UsageError when the number of values does not fit the grid
  Volume(const VolumeGrid& grid, std::vector<float> values, const Progress& progress = {});

  [[nodiscard]] const VolumeGrid& grid() const { return grid_; }
  [[nodiscard]] Imath::V3i size() const { return grid_.size; }
  [[nodiscard]] VolumeType type() const { return type_; }
  [[nodiscard]] const VolumeScale& scale() const { return scale_; }
  /// Smallest and largest value.
  [[nodiscard]] double lowest() const { return lowest_; }
  [[nodiscard]] double highest() const { return highest_; }
  /// Value of a grid point. @pre the indices lie in the grid
  [[nodiscard]] double at(int i, int j, int k) const { return scale_(stored(index(i, j, k))); }
  /// Stored number of a grid point, before rescaling. @param point  index() of the grid point
  [[nodiscard]] double stored(std::size_t point) const;
  /// Copies the stored numbers of the row (0…size.x − 1, j, k). Every stored number fits a float
  /// exactly. @param out  size.x numbers
  void storedRow(int j, int k, std::span<float> out) const;
  /// Copies successive stored numbers. @param first  index() of the first grid point
  void storedRun(std::size_t first, std::span<double> out) const;
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(grid_.size.y) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(grid_.size.x) +
           static_cast<std::size_t>(i);
  }
  /// Trilinear interpolation. Positions outside the grid are moved to its border.
  /// @param position  index coordinates
  [[nodiscard]] double trilinear(const Imath::V3d& position) const;
  /// Memory of the numbers in bytes, in the file or in the process.
  [[nodiscard]] std::size_t memoryUse() const { return grid_.pointCount() * volumeTypeSize(type_); }
  /// Returns true when the numbers stay in a mapped file.
  [[nodiscard]] bool isMapped() const { return data_.isMapped; }
  /// Hash of grid, type, scale and numbers.
  [[nodiscard]] std::uint64_t contentHash() const;

 private:
  void findRange(const Progress& progress);

  VolumeGrid grid_;
  VolumeType type_;
  VolumeScale scale_;
  Data data_;
  double lowest_ = 0, highest_ = 0;
};

}  // namespace levelset
