#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "levelset/deform/cage/cage.h"
#include "levelset/deform/control_lattice.h"

namespace viewer {

/// A deformation that the user edits by its control points: those of a lattice, or the vertices of
/// a cage. Immutable and cheap to copy.
class DeformDesign {
 public:
  explicit DeformDesign(levelset::ControlLattice lattice);
  /// @param restFile  file of the cage at rest
  DeformDesign(levelset::CageDeformation cage, std::filesystem::path restFile);

  [[nodiscard]] bool isLattice() const { return map_.index() == 0; }
  /// @pre isLattice()
  [[nodiscard]] const levelset::ControlLattice& lattice() const { return std::get<0>(map_); }
  /// @pre !isLattice()
  [[nodiscard]] const levelset::CageDeformation& cage() const { return std::get<1>(map_); }
  [[nodiscard]] std::shared_ptr<const levelset::Deformation> deformation() const;

  /// Control points, world units.
  [[nodiscard]] const std::vector<Imath::V3d>& points() const;
  /// The same design with other control points.
  /// @throws levelset::InvalidInput for points that are not finite
  [[nodiscard]] DeformDesign withPoints(std::vector<Imath::V3d> points) const;
  /// False for a lattice with weights: it may have no control points that move nothing.
  [[nodiscard]] bool hasRestPoints() const { return !isLattice() || !lattice().isRational(); }
  /// Control points of the map that moves nothing. @return the points themselves without
  /// hasRestPoints()
  [[nodiscard]] std::vector<Imath::V3d> restPoints() const;
  /// Pairs of neighbouring control points.
  [[nodiscard]] std::vector<std::array<std::size_t, 2>> net() const;
  /// Adds the control points of the layer of the lattice, across an axis, of each selected point. A
  /// cage has no layers. @param isSelected  nonzero for a selected point
  void growAlongLayer(int axis, std::vector<char>& isSelected) const;

  /// Extension of the files that save() writes: ".json" of a lattice, ".ply" of a moved cage.
  [[nodiscard]] const char* extension() const { return isLattice() ? ".json" : ".ply"; }
  /// Writes a lattice file, or the mesh of the moved cage, exact to the last bit.
  /// @throws levelset::IoError
  void save(const std::filesystem::path& file) const;
  /// The `deform` action, which applies to the newest value. @param file  a file of save()
  [[nodiscard]] std::string action(const std::filesystem::path& file) const;

 private:
  std::variant<levelset::ControlLattice, levelset::CageDeformation> map_;
  std::filesystem::path restFile_;
};

/// Control points and degree of a box lattice, along each axis.
struct BoxLattice {
  std::array<int, 3> count = {4, 4, 4};
  int degree = 3;
  bool operator==(const BoxLattice&) const = default;
};
inline constexpr int kMostBoxCount = 20;

/// Identity lattice in the box around a solid, two voxels wider on each side, as `deform` makes its
/// ready lattices. The degree along an axis is at most the number of points minus one.
/// @param bounds  box of the solid, not empty; @param voxelSize  world units
[[nodiscard]] DeformDesign boxDesign(const Imath::Box3d& bounds, double voxelSize,
                                     const BoxLattice& box);

/// Reads a lattice file. @throws as levelset::readLattice()
[[nodiscard]] DeformDesign readLatticeDesign(const std::filesystem::path& file);

/// Reads a cage from a mesh at rest, and from a mesh with the same triangles and moved vertices.
/// @param moved  empty: the cage at rest
/// @throws as levelset::readMesh() and levelset::CageDeformation
[[nodiscard]] DeformDesign readCageDesign(const std::filesystem::path& rest,
                                          const std::filesystem::path& moved,
                                          levelset::CageCoordinates coordinates);

}  // namespace viewer
