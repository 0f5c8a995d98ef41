#include "render/mapped/shell_walk.h"

#include <fmt/core.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <tuple>
#include <utility>

#include "levelset/error.h"

namespace render {

using Imath::V3d;
using Imath::V3f;
using Node = PrismShell::Node;

namespace {

constexpr int kTileEdge = 4;  // cells along the edge of a tile
// Padding of the boxes of tiles as a share of the coordinates, so that rounding to floats loses no
// ray.
constexpr float kTilePad = 1e-6f;

void requirePrismShell(const PrismShell& shell) {
  std::size_t nodes = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double>& at = shell.coordinates[axis];
    if (shell.cells[axis] < 1 || at.size() != static_cast<std::size_t>(shell.cells[axis]) + 1)
      throw levelset::InvalidInput(
          fmt::format("a shell has {} cells and {} coordinates along axis {}; give at least one "
                      "cell, and one coordinate more than cells",
                      shell.cells[axis], at.size(), axis));
    for (std::size_t i = 0; i < at.size(); ++i)
      if (!std::isfinite(at[i]) || (i > 0 && !(at[i] > at[i - 1])))
        throw levelset::InvalidInput(
            "the coordinates of a shell do not ascend; give finite numbers in ascending order");
    nodes *= at.size();
  }
  if (shell.offsets.size() != nodes)
    throw levelset::InvalidInput(fmt::format("a shell has {} positions for {} nodes; give one each",
                                             shell.offsets.size(), nodes));
  double sum = shell.centre.x + shell.centre.y + shell.centre.z;
  for (const V3f& offset : shell.offsets)
    sum += static_cast<double>(offset.x + offset.y + offset.z);
  if (!std::isfinite(sum))
    throw levelset::InvalidInput("a position of a shell is not finite; give finite numbers");
}

}  // namespace

/// Projects points along a ray onto the plane of two axes. The ray is projected to the origin.
class ShellWalker::Projection {
 public:
  /// @param origin  relative to the centre of the shell
  Projection(const V3d& origin, const V3d& direction) : origin_(origin), direction_(direction) {
    for (int a = 0; a < 3; ++a)
      if (std::abs(direction[a]) > std::abs(direction[along_])) along_ = a;
    first_ = (along_ + 1) % 3;
    second_ = (along_ + 2) % 3;
    inverse_ = 1 / direction[along_];
    shearX_ = direction[first_] * inverse_;
    shearY_ = direction[second_] * inverse_;
  }
  [[nodiscard]] Corner operator()(const PrismShell& shell, const Node& node) const;
  /// True if the ray, as a line, meets a box.
  [[nodiscard]] bool meets(const V3f& low, const V3f& high) const {
    double near = -HUGE_VAL, far = HUGE_VAL;
    for (int a = 0; a < 3; ++a) {
      const double from = static_cast<double>(low[a]) - origin_[a],
                   to = static_cast<double>(high[a]) - origin_[a];
      if (direction_[a] == 0) {
        if (from > 0 || to < 0) return false;
        continue;
      }
      const double t0 = from / direction_[a], t1 = to / direction_[a];
      near = std::max(near, std::min(t0, t1));
      far = std::min(far, std::max(t0, t1));
    }
    return near <= far;
  }

 private:
  V3d origin_, direction_;
  int along_ = 0, first_ = 1, second_ = 2;
  double inverse_, shearX_, shearY_;
};

/// A node of the shell, projected along the ray.
struct ShellWalker::Corner {
  Node node;
  double x, y;  // projection
  double t;     // distance along the ray, world units

  /// Sign of the area of the triangle (ray, a, b) in the projection: exact for the rounded
  /// coordinates, and never 0. A ray in the line through a and b counts as moved by (ε, ε²) with an
  /// infinitesimal ε. If both have one projection, any antisymmetric answer is consistent.
  static int side(const Corner& a, const Corner& b) {
    const double p = a.x * b.y, q = a.y * b.x;
    // Rounding is monotone, so unequal rounded products are in the order of the exact ones.
    if (p != q) return p > q ? 1 : -1;
    const double pError = std::fma(a.x, b.y, -p), qError = std::fma(a.y, b.x, -q);
    if (pError != qError) return pError > qError ? 1 : -1;
    if (a.y != b.y) return a.y > b.y ? 1 : -1;
    if (a.x != b.x) return b.x > a.x ? 1 : -1;
    return a.node < b.node ? 1 : -1;
  }
};

ShellWalker::Corner ShellWalker::Projection::operator()(const PrismShell& shell,
                                                        const Node& node) const {
  const V3d at = V3d(shell.offsets[shell.index(node)]) - origin_;
  return {node, at[first_] - shearX_ * at[along_], at[second_] - shearY_ * at[along_],
          at[along_] * inverse_};
}

/// Position of a ray on a face.
struct ShellWalker::Position {
  double t;     // distance along the ray, world units
  V3d texture;  // position in the space of the texture

  /// @pre the ray is inside the projected triangle
  static Position on(const PrismShell& shell, const Corner& a, const Corner& b, const Corner& c) {
    const auto area = [](const Corner& p, const Corner& q) {
      return std::abs(p.x * q.y - p.y * q.x);
    };
    double u = area(b, c), v = area(c, a), w = area(a, b);
    const double sum = u + v + w;
    if (!(sum > 0)) u = v = w = 1;  // the area is too small for a double
    const double scale = 1 / (u + v + w);
    u *= scale, v *= scale, w *= scale;
    return {u * a.t + v * b.t + w * c.t, shell.textureOf(a.node) * u + shell.textureOf(b.node) * v +
                                             shell.textureOf(c.node) * w};
  }
};

/// A triangle of the border that the ray crosses.
struct ShellWalker::Entry {
  ShellTetrahedron tetrahedron;
  int opposite;  // corner of the tetrahedron that is not on the border, 0 or 3
  double t;      // distance along the ray, world units
  bool isUsed = false;

  [[nodiscard]] bool isFaceOf(const ShellTetrahedron& other, int corner) const {
    return opposite == corner && tetrahedron.cell == other.cell && tetrahedron.axes == other.axes;
  }
};

/// The present tetrahedron of a walk.
class ShellWalker::Step {
 public:
  Step(const PrismShell& shell, const Projection& project, const ShellTetrahedron& tetrahedron,
       int opposite)
      : shell_(shell), project_(project), tetrahedron_(tetrahedron), opposite_(opposite) {
    Node node = tetrahedron.cell;
    corners_[0] = project(shell, node);
    for (std::size_t step = 0; step < 3; ++step) {
      ++node[static_cast<std::size_t>(tetrahedron.axes[step])];
      corners_[step + 1] = project(shell, node);
    }
    orderFace();
  }
  Step(const Step&) = delete;  // face_ points to corners_
  Step& operator=(const Step&) = delete;

  [[nodiscard]] Position entry() const {
    return Position::on(shell_, *face_[0], *face_[1], *face_[2]);
  }
  [[nodiscard]] const ShellTetrahedron& tetrahedron() const { return tetrahedron_; }

  /// Finds the face through which the ray leaves the tetrahedron.
  /// @return the corner opposite that face; -1 if there is none, which cannot happen for a ray that
  ///         crosses the entry face
  int findExit(Position& exit) const {
    const Corner& apex = corners_[static_cast<std::size_t>(opposite_)];
    std::array<bool, 3> isBefore;
    for (std::size_t i = 0; i < 3; ++i) isBefore[i] = Corner::side(apex, *face_[i]) == turn_;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t next = (i + 1) % 3;
      if (!isBefore[i] || isBefore[next]) continue;
      exit = Position::on(shell_, apex, *face_[i], *face_[next]);
      return static_cast<int>(face_[(i + 2) % 3] - corners_.data());
    }
    return -1;
  }

  /// Moves to the neighbour across the face opposite `corner`. One corner changes. Returns false at
  /// the border.
  bool cross(int corner) {
    std::array<int, 3>& axes = tetrahedron_.axes;
    if (corner == 1 || corner == 2) {
      const auto i = static_cast<std::size_t>(corner);
      std::swap(axes[i - 1], axes[i]);
      Node node = corners_[i - 1].node;
      ++node[static_cast<std::size_t>(axes[i - 1])];
      corners_[i] = project_(shell_, node);
      opposite_ = corner;
    } else if (corner == 0) {
      const auto axis = static_cast<std::size_t>(axes[0]);
      if (tetrahedron_.cell[axis] + 1 == shell_.cells[axis]) return false;
      ++tetrahedron_.cell[axis];
      Node node = corners_[3].node;
      ++node[axis];
      std::rotate(corners_.begin(), corners_.begin() + 1, corners_.end());
      std::rotate(axes.begin(), axes.begin() + 1, axes.end());
      corners_[3] = project_(shell_, node);
      opposite_ = 3;
    } else {
      const auto axis = static_cast<std::size_t>(axes[2]);
      if (tetrahedron_.cell[axis] == 0) return false;
      --tetrahedron_.cell[axis];
      Node node = corners_[0].node;
      --node[axis];
      std::rotate(corners_.begin(), corners_.end() - 1, corners_.end());
      std::rotate(axes.begin(), axes.end() - 1, axes.end());
      corners_[0] = project_(shell_, node);
      opposite_ = 0;
    }
    orderFace();
    return true;
  }

 private:
  /// Sets the corners of the entry face, and the sign of its projected area.
  void orderFace() {
    std::size_t n = 0;
    for (std::size_t i = 0; i < 4; ++i)
      if (static_cast<int>(i) != opposite_) face_[n++] = &corners_[i];
    turn_ = Corner::side(*face_[0], *face_[1]);
  }

  const PrismShell& shell_;
  const Projection& project_;
  ShellTetrahedron tetrahedron_;
  int opposite_;
  std::array<Corner, 4> corners_;
  std::array<const Corner*, 3> face_ = {};
  int turn_ = 1;
};

ShellWalker::ShellWalker(const PrismShell& shell) : shell_(shell) {
  requirePrismShell(shell);
  for (const V3f& offset : shell.offsets) bounds_.extendBy(shell.centre + V3d(offset));
  for (int axis = 0; axis < 3; ++axis)
    for (const bool isHigh : {false, true}) addTiles(axis, isHigh);
}

void ShellWalker::addTiles(int axis, bool isHigh) {
  const auto across = static_cast<std::size_t>(axis), u = (across + 1) % 3, v = (across + 2) % 3;
  for (int j = 0; j < shell_.cells[v]; j += kTileEdge)
    for (int i = 0; i < shell_.cells[u]; i += kTileEdge) {
      Tile tile;
      tile.axis = axis;
      tile.isHigh = isHigh;
      tile.first = {i, j};
      tile.last = {std::min(i + kTileEdge, shell_.cells[u]) - 1,
                   std::min(j + kTileEdge, shell_.cells[v]) - 1};
      Imath::Box3f box;
      Node node;
      node[across] = isHigh ? shell_.cells[across] : 0;
      for (node[v] = j; node[v] <= tile.last[1] + 1; ++node[v])
        for (node[u] = i; node[u] <= tile.last[0] + 1; ++node[u])
          box.extendBy(shell_.offsets[shell_.index(node)]);
      const V3f pad(kTilePad * std::max(box.min.length(), box.max.length()));
      tile.low = box.min - pad;
      tile.high = box.max + pad;
      tiles_.push_back(tile);
    }
}

void ShellWalker::findEntries(const Tile& tile, const Projection& project,
                              std::vector<Entry>& found) const {
  const auto across = static_cast<std::size_t>(tile.axis), u = (across + 1) % 3,
             v = (across + 2) % 3;
  // Each node is projected once, and used by up to six triangles.
  std::array<std::array<Corner, kTileEdge + 1>, kTileEdge + 1> corners;
  Node node;
  node[across] = tile.isHigh ? shell_.cells[across] : 0;
  const auto cornerAt = [&](int i, int j) -> Corner& {
    return corners[static_cast<std::size_t>(j - tile.first[1])]
                  [static_cast<std::size_t>(i - tile.first[0])];
  };
  for (node[v] = tile.first[1]; node[v] <= tile.last[1] + 1; ++node[v])
    for (node[u] = tile.first[0]; node[u] <= tile.last[0] + 1; ++node[u])
      cornerAt(node[u], node[v]) = project(shell_, node);
  const int opposite = tile.isHigh ? 0 : 3;
  Node cell;
  cell[across] = tile.isHigh ? shell_.cells[across] - 1 : 0;
  for (cell[v] = tile.first[1]; cell[v] <= tile.last[1]; ++cell[v])
    for (cell[u] = tile.first[0]; cell[u] <= tile.last[0]; ++cell[u])
      for (const bool isUFirst : {true, false}) {
        const Corner &p = cornerAt(cell[u], cell[v]),
                     &q =
                         isUFirst ? cornerAt(cell[u] + 1, cell[v]) : cornerAt(cell[u], cell[v] + 1),
                     &r = cornerAt(cell[u] + 1, cell[v] + 1);
        const int turn = Corner::side(p, q);
        if (Corner::side(q, r) != turn || Corner::side(r, p) != turn) continue;
        const int first = static_cast<int>(isUFirst ? u : v),
                  second = static_cast<int>(isUFirst ? v : u);
        const std::array<int, 3> axes = tile.isHigh ? std::array{tile.axis, first, second}
                                                    : std::array{first, second, tile.axis};
        found.push_back({{cell, axes}, opposite, Position::on(shell_, p, q, r).t});
      }
}

void ShellWalker::walk(const V3d& origin, const V3d& direction, double near, const double& far,
                       const std::function<bool(const ShellSegment&, bool)>& visit) const {
  const Projection project(origin - shell_.centre, direction);
  std::vector<Entry> entries;
  for (const Tile& tile : tiles_)
    if (project.meets(tile.low, tile.high)) findEntries(tile, project, entries);
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.t, a.tetrahedron.cell, a.tetrahedron.axes) <
           std::tie(b.t, b.tetrahedron.cell, b.tetrahedron.axes);
  });
  for (Entry& entry : entries) {
    if (entry.t > far) break;
    if (std::exchange(entry.isUsed, true)) continue;
    Step step(shell_, project, entry.tetrahedron, entry.opposite);
    ShellSegment segment;
    Position at = step.entry();
    bool isFirst = true, isVisited = true;
    for (;;) {
      Position exit;
      const int corner = step.findExit(exit);
      assert(corner >= 0);
      if (corner < 0) break;
      if (isVisited && exit.t >= near) {
        segment = {step.tetrahedron(), at.t, exit.t, at.texture, exit.texture};
        isVisited = visit(segment, std::exchange(isFirst, false));
      }
      // An ended part is followed to its other end only if other parts may follow.
      if (!isVisited && entries.size() == 2) return;
      if (!step.cross(corner)) {
        for (Entry& other : entries)
          if (other.isFaceOf(step.tetrahedron(), corner)) other.isUsed = true;
        break;
      }
      at = exit;
    }
  }
}

Imath::M33d ShellWalker::slopes(const ShellTetrahedron& tetrahedron) const {
  // The path of the corners has three edges, and each is along one axis in the space of the
  // texture.
  Imath::M33d edges, steps(0.0);
  Node node = tetrahedron.cell;
  for (int i = 0; i < 3; ++i) {
    const int axis = tetrahedron.axes[static_cast<std::size_t>(i)];
    const Node before = node;
    ++node[static_cast<std::size_t>(axis)];
    const V3d edge =
        V3d(shell_.offsets[shell_.index(node)]) - V3d(shell_.offsets[shell_.index(before)]);
    for (int a = 0; a < 3; ++a) edges[i][a] = edge[a];
    steps[i][axis] = (shell_.textureOf(node) - shell_.textureOf(before))[axis];
  }
  if (edges.determinant() == 0) return Imath::M33d(0.0);
  return edges.inverse() * steps;
}

}  // namespace render
