#include "mapping/maps/prism_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

#include "mapping/maps/dual_basis.h"

namespace mapping {
namespace {

using Imath::Box3d;
using Imath::M33d;
using Imath::V3d;
using Cell = std::array<int, 3>;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Least barycentric coordinate of a point that counts as inside a tetrahedron. A point on a face
// may get one this far below 0 from rounding.
constexpr double kOnFace = -1e-9;

bool isInside(const std::array<double, 4>& shares) {
  return std::all_of(shares.begin(), shares.end(), [](double s) { return s >= kOnFace; });
}

V3d mix(const Lattice::Corners& corners, const std::array<double, 4>& shares) {
  return corners[0] * shares[0] + corners[1] * shares[1] + corners[2] * shares[2] +
         corners[3] * shares[3];
}

/// Gradients of u, v and w in a tetrahedron, as rows; not finite if it has no volume.
M33d slopes(const Lattice::Corners& world, const Lattice::Corners& texture) {
  const std::array<V3d, 3> dual =
      dualBasis(world[1] - world[0], world[2] - world[0], world[3] - world[0]);
  M33d result(0, 0, 0, 0, 0, 0, 0, 0, 0);
  for (std::size_t corner = 0; corner < 3; ++corner) {
    const V3d step = texture[corner + 1] - texture[0];
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis) result[k][axis] += step[k] * dual[corner][axis];
  }
  return result;
}

Box3d around(const GridBlock& block) {
  const V3d center = block.center();
  V3d half(0);
  for (int i = 0; i < 3; ++i)
    for (int axis = 0; axis < 3; ++axis)
      half[axis] += std::abs(block.row(i)[axis]) * 0.5 * (block.edge - 1);
  // Enlarged a little, so that rounding does not lose cells that touch the border of the box.
  half *= 1 + 1e-9;
  return {center - half, center + half};
}

}  // namespace

/// The cells of a prism map that touch a block.
class PrismBlock final : public BlockMap {
 public:
  PrismBlock(const PrismMap& map, const GridBlock& block) : map_(map), block_(block) {
    map.tree_.visit(around(block), [&](const Cell& cell) {
      cells_.push_back(cell);
      return false;
    });
    const auto outer = std::stable_partition(cells_.begin(), cells_.end(), [&](const Cell& cell) {
      return !map.lattice_.isOutermost(cell);
    });
    inner_ = static_cast<std::size_t>(outer - cells_.begin());
  }

  [[nodiscard]] Box3d imageBounds() const override {
    // With more cells than this, the cells are much smaller than the block, and their texture boxes
    // bound the image tightly enough.
    constexpr std::size_t kFew = 32;
    Box3d bounds;
    for (const Cell& cell : cells_) {
      const Box3d box = map_.lattice_.textureBox(cell);
      if (cells_.size() > kFew)
        bounds.extendBy(box);
      else
        for (int order = 0; order < 6; ++order) bounds.extendBy(imageIn({cell, order}, box));
    }
    // Barycentric sums have rounding errors.
    constexpr double kRounding = 1e-12;
    if (!bounds.isEmpty()) bounds = {bounds.min - V3d(kRounding), bounds.max + V3d(kRounding)};
    return bounds;
  }

  [[nodiscard]] bool isTotal() const override {
    if (inner_ < cells_.size()) return false;
    Tetrahedron t;
    return map_.find(block_.center(), t);
  }

  [[nodiscard]] std::unique_ptr<BlockMap> octant(int bits) const override {
    return std::unique_ptr<BlockMap>(new PrismBlock(*this, bits));
  }

  std::size_t evaluate(std::span<V3d, 512> uvw) const override {
    Walk walk(*this);
    for (std::size_t n = 0; n < uvw.size(); ++n) {
      if (n % 8 == 0) walk.returnToRow();
      const V3d x = block_.origin + block_.row(0) * static_cast<double>(n >> 6) +
                    block_.row(1) * static_cast<double>((n >> 3) & 7) +
                    block_.row(2) * static_cast<double>(n & 7);
      uvw[n] = walk.to(x);
    }
    return walk.tests();
  }

 private:
  PrismBlock(const PrismBlock& parent, int bits)
      : map_(parent.map_), block_(parent.block_.octant(bits)) {
    const Box3d box = around(block_);
    for (std::size_t n = 0; n < parent.cells_.size(); ++n) {
      if (!map_.lattice_.worldBox(parent.cells_[n]).intersects(box)) continue;
      cells_.push_back(parent.cells_[n]);
      if (n < parent.inner_) ++inner_;
    }
  }

  /// Box of the image of the block's hull under the linear map of one tetrahedron, clipped to the
  /// tetrahedron's own box in texture space.
  [[nodiscard]] Box3d imageIn(const Tetrahedron& t, const Box3d& own) const {
    const Lattice::Corners world = map_.lattice_.corners(t),
                           texture = map_.lattice_.textureCorners(t);
    const M33d slope = slopes(world, texture);
    const V3d offset = block_.center() - world[0];
    Box3d image;
    for (int k = 0; k < 3; ++k) {
      const V3d gradient(slope[k][0], slope[k][1], slope[k][2]);
      const double middle = texture[0][k] + gradient.dot(offset);
      double extent = 0;
      for (int i = 0; i < 3; ++i)
        extent += std::abs(gradient.dot(block_.row(i))) * 0.5 * (block_.edge - 1);
      if (!std::isfinite(middle) || !std::isfinite(extent)) return own;
      const double slack = 1e-9 * (std::abs(middle) + extent);
      image.min[k] = std::max(own.min[k], middle - extent - slack);
      image.max[k] = std::min(own.max[k], middle + extent + slack);
      if (image.min[k] > image.max[k]) return {};
    }
    return image;
  }

  /// Finds the tetrahedra that contain successive grid points by walking across faces. Searches all
  /// cells of the block when a walk fails. An inner cell is preferred to an outermost one, see
  /// PrismMap.
  class Walk {
   public:
    explicit Walk(const PrismBlock& block)
        : map_(block.map_), lattice_(block.map_.lattice_), block_(block) {}

    /// Resumes at the tetrahedron of the first grid point found in the previous row, which is near
    /// the first grid point of the next row.
    void returnToRow() {
      current_ = first_;
      isAt_ = hasFirst_;
      isRowStart_ = true;
    }

    V3d to(const V3d& x) {
      std::array<double, 4> shares;
      bool found = isAt_ && walk(x, shares);
      if (!found)
        found = search(x, block_.cells_, shares);
      else if (block_.inner_ > 0 && lattice_.isOutermost(current_.cell))
        search(x, rivals(), shares);
      if (found) isAt_ = true;
      if (isRowStart_ && found) first_ = current_, hasFirst_ = true, isRowStart_ = false;
      return found ? mix(lattice_.textureCorners(current_), shares) : V3d(kNaN);
    }

    [[nodiscard]] std::size_t tests() const { return tests_; }

   private:
    bool walk(const V3d& x, std::array<double, 4>& shares) {
      constexpr int kMostSteps = 24;
      Tetrahedron t = current_;
      for (int step = 0; step < kMostSteps; ++step) {
        shares = test(t, x);
        if (isInside(shares)) {
          current_ = t;
          return true;
        }
        const auto least = std::min_element(shares.begin(), shares.end());
        if (!std::isfinite(*least)) return false;
        if (!lattice_.cross(t, static_cast<int>(least - shares.begin()))) return false;
      }
      return false;
    }

    /// Leaves the current tetrahedron and `shares` as they are if no cell contains the point.
    bool search(const V3d& x, std::span<const Cell> cells, std::array<double, 4>& shares) {
      for (const Cell& cell : cells) {
        if (!lattice_.worldBox(cell).intersects(map_.aroundPoint(x))) continue;
        for (int order = 0; order < 6; ++order) {
          const std::array<double, 4> tested = test({cell, order}, x);
          if (!isInside(tested)) continue;
          current_ = {cell, order};
          shares = tested;
          return true;
        }
      }
      return false;
    }

    /// Inner cells that may overlap the outermost cell of the current tetrahedron. Those beside it
    /// do not, unless the lattice folds there.
    std::span<const Cell> rivals() {
      const Cell& outer = current_.cell;
      if (rivalsOf_ == outer) return rivals_;
      rivalsOf_ = outer;
      rivals_.clear();
      const Box3d box = lattice_.worldBox(outer);
      for (const Cell& cell : std::span(block_.cells_).first(block_.inner_)) {
        bool isBeside = true;
        for (std::size_t axis = 0; axis < 3; ++axis)
          isBeside = isBeside && std::abs(cell[axis] - outer[axis]) <= 1;
        if (!isBeside && lattice_.worldBox(cell).intersects(box)) rivals_.push_back(cell);
      }
      return rivals_;
    }

    std::array<double, 4> test(const Tetrahedron& t, const V3d& x) {
      ++tests_;
      return barycentric(lattice_.corners(t), x);
    }

    const PrismMap& map_;
    const Lattice& lattice_;
    const PrismBlock& block_;
    Tetrahedron current_, first_;
    bool isAt_ = false, hasFirst_ = false, isRowStart_ = true;
    Cell rivalsOf_ = {-1, -1, -1};  // the outermost cell of rivals_
    std::vector<Cell> rivals_;
    std::size_t tests_ = 0;
  };

  const PrismMap& map_;
  GridBlock block_;
  std::vector<Cell> cells_;  // inner cells first
  std::size_t inner_ = 0;    // number of cells that are not outermost
};

PrismMap::PrismMap(const Patch& patch, const LatticeBorder& border)
    : lattice_(patch, border), embedDepth_(border.embedDepth), tree_(lattice_) {}

double PrismMap::estimateBytes(const Patch& patch) {
  double columns = 0, rows = 0;
  for (const ParticleLayer& layer : patch.layers) {
    columns = std::max(columns, static_cast<double>(layer.columns));
    rows = std::max(rows, static_cast<double>(layer.rows));
  }
  // Bytes for each cell: its nodes, boxes and samples, and the statistics computed from the
  // samples.
  constexpr double kBytesPerCell = 1200;
  return kBytesPerCell * (columns + 1) * (rows + 1) *
         (static_cast<double>(patch.layers.size()) + 3);
}

Box3d PrismMap::aroundPoint(const V3d& x) const {
  const V3d slack(-kOnFace * tree_.size());
  return {x - slack, x + slack};
}

bool PrismMap::find(const V3d& x, Tetrahedron& t) const {
  bool found = false;
  tree_.visit(aroundPoint(x), [&](const Cell& cell) {
    const bool isOuter = lattice_.isOutermost(cell);
    if (isOuter && found) return false;
    for (int order = 0; order < 6; ++order) {
      if (!isInside(barycentric(lattice_.corners({cell, order}), x))) continue;
      t = {cell, order};
      found = true;
      return !isOuter;
    }
    return false;
  });
  return found;
}

V3d PrismMap::operator()(const V3d& x) const {
  Tetrahedron t;
  if (!find(x, t)) return V3d(kNaN);
  return mix(lattice_.textureCorners(t), barycentric(lattice_.corners(t), x));
}

M33d PrismMap::jacobian(const V3d& x) const {
  Tetrahedron t;
  if (!find(x, t)) return {kNaN, kNaN, kNaN, kNaN, kNaN, kNaN, kNaN, kNaN, kNaN};
  return slopes(lattice_.corners(t), lattice_.textureCorners(t));
}

std::unique_ptr<BlockMap> PrismMap::restrictTo(const GridBlock& block, double) const {
  return std::make_unique<PrismBlock>(*this, block);
}

bool PrismMap::holdsTexture(const V3d& uvw) const {
  return std::min(uvw.x, uvw.y) >= 0 && std::max(uvw.x, uvw.y) <= 1 &&
         uvw.z >= -std::max(0.0, embedDepth_) && uvw.z <= 1 + std::max(0.0, -embedDepth_);
}

std::vector<MapSample> PrismMap::samples() const {
  std::vector<MapSample> result;
  result.reserve(6 * lattice_.cellCount());
  const Cell cells = lattice_.cells();
  constexpr std::array<double, 4> kMiddle = {0.25, 0.25, 0.25, 0.25};
  for (int k = 0; k < cells[2]; ++k)
    for (int j = 0; j < cells[1]; ++j)
      for (int i = 0; i < cells[0]; ++i)
        for (int order = 0; order < 6; ++order) {
          const Tetrahedron t{{i, j, k}, order};
          const Lattice::Corners world = lattice_.corners(t), texture = lattice_.textureCorners(t);
          const V3d uvw = mix(texture, kMiddle);
          if (!holdsTexture(uvw)) continue;
          result.push_back({mix(world, kMiddle), uvw, slopes(world, texture)});
        }
  return result;
}

std::size_t PrismMap::countOverlaps(std::span<const MapSample> samples, MapSample& first) const {
  constexpr double kElsewhere = 1e-6;  // distance in u, v, w that rounding cannot explain
  std::size_t count = 0;
  for (const MapSample& sample : samples) {
    const V3d found = (*this)(sample.position);
    if (!((found - sample.uvw).length() > kElsewhere) || !holdsTexture(found)) continue;
    if (count++ == 0) first = sample;
  }
  return count;
}

V3d PrismMap::toPatch(const V3d& uvw) const {
  Tetrahedron t;
  if (!lattice_.locate(uvw, t)) return V3d(kNaN);
  return mix(lattice_.corners(t), barycentric(lattice_.textureCorners(t), uvw));
}

ForwardFrame PrismMap::frame(const V3d& uvw) const {
  Tetrahedron t;
  if (!lattice_.locate(uvw, t)) return {V3d(kNaN), {V3d(kNaN), V3d(kNaN), V3d(kNaN)}};
  const Lattice::Corners world = lattice_.corners(t), texture = lattice_.textureCorners(t);
  ForwardFrame result{mix(world, barycentric(texture, uvw)), {}};
  // Each step of the tetrahedron's path changes one texture coordinate.
  const auto& axes = Lattice::kOrders[static_cast<std::size_t>(t.order)];
  for (std::size_t step = 0; step < 3; ++step) {
    const int axis = axes[step];
    result.slopes[static_cast<std::size_t>(axis)] =
        (world[step + 1] - world[step]) / (texture[step + 1][axis] - texture[step][axis]);
  }
  return result;
}

}  // namespace mapping
