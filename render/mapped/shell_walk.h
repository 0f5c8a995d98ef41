#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <array>
#include <functional>
#include <vector>

#include "render/scene/mapped_texture.h"

/// Walks of rays through the tetrahedra of a shell.
namespace render {

/// A tetrahedron of a shell: its cell, and the axes in the order in which the path of its corners
/// takes them.
struct ShellTetrahedron {
  PrismShell::Node cell{};
  std::array<int, 3> axes = {0, 1, 2};
};

/// Part of a ray in one tetrahedron. The ray is straight there in the space of the texture, too.
struct ShellSegment {
  ShellTetrahedron tetrahedron;
  /// Distances along the ray at which it enters and leaves the tetrahedron, world units; the first
  /// may be negative.
  double enter = 0, leave = 0;
  Imath::V3d from, to;  ///< positions at `enter` and `leave` in the space of the texture
};

/// A shell prepared for walks. Boxes of parts of its border find the tetrahedra where a ray
/// enters. Keeps a reference to the shell.
///
/// The corners of the tetrahedra are projected along the ray. A ray crosses a face if it is inside
/// the projected triangle. This is decided by the exact signs of 2D determinants of the rounded
/// projections, with a symbolic perturbation of the ray for zeros. So each ray crosses exactly two
/// faces of a tetrahedron or none, and no ray is lost at a common face, edge or vertex.
class ShellWalker {
 public:
  /// @throws levelset::InvalidInput for a shell without cells, with wrong numbers of nodes, with
  ///         coordinates that do not ascend, or with numbers that are not finite
  explicit ShellWalker(const PrismShell& shell);

  /// World-space box of all nodes.
  [[nodiscard]] const Imath::Box3d& bounds() const { return bounds_; }

  /// Visits the segments of a ray in the tetrahedra, in order along each connected part of the ray
  /// in the shell. Where the shell is not convex there may be several parts; they are visited from
  /// the one that begins first. Parts that begin beyond `far` are left out, and so are segments
  /// that end before `near`.
  /// @param direction  unit vector
  /// @param near, far  distances along the ray, world units; `far` is read before each part
  /// @param visit  called with the segment, and true if it is the first of its part; returns false
  ///         to end the part
  void walk(const Imath::V3d& origin, const Imath::V3d& direction, double near, const double& far,
            const std::function<bool(const ShellSegment&, bool)>& visit) const;

  /// Derivatives of the map in a tetrahedron: row i is the derivative of the position in the space
  /// of the texture along axis i of the drawn space. Zero if the tetrahedron has no volume.
  [[nodiscard]] Imath::M33d slopes(const ShellTetrahedron& tetrahedron) const;

  [[nodiscard]] std::size_t bytes() const { return tiles_.size() * sizeof(Tile); }

 private:
  /// Up to kEdge² neighbouring quadrilaterals of the shell's border.
  struct Tile {
    Imath::V3f low, high;            // box around the nodes, relative to the centre of the shell
    std::array<int, 2> first, last;  // range of cells along the two axes of the side
    int axis;                        // axis across the side
    bool isHigh;                     // the side is at the last nodes along `axis`
  };
  class Projection;
  struct Corner;
  struct Position;
  struct Entry;
  class Step;

  void addTiles(int axis, bool isHigh);
  void findEntries(const Tile& tile, const Projection& project, std::vector<Entry>& found) const;

  const PrismShell& shell_;
  Imath::Box3d bounds_;
  std::vector<Tile> tiles_;
};

}  // namespace render
