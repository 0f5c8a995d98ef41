#include "levelset/isosurface/filtered_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/isosurface/filtered_descent.h"

namespace levelset {
namespace {

using openvdb::Mat3d;
using openvdb::Vec3d;

// Memory of a piece with its part of the search tree, bytes.
constexpr double kBytesPerFilteredPiece = 68 + PieceTree::bytesPerItem();

/// Point of the parallelogram first + s u + t v, 0 ≤ s, t ≤ 1, that is closest to a position.
std::array<double, 2> closestOnParallelogram(const Vec3d& first, const Vec3d& u, const Vec3d& v,
                                             const Vec3d& position) {
  const Vec3d d = position - first;
  const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), du = d.dot(u), dv = d.dot(v);
  const double determinant = uu * vv - uv * uv;
  const double s = (du * vv - dv * uv) / determinant, t = (dv * uu - du * uv) / determinant;
  if (s >= 0 && s <= 1 && t >= 0 && t <= 1) return {s, t};
  std::array<double, 2> best{};
  double least = std::numeric_limits<double>::infinity();
  const auto look = [&](double a, double b) {
    const double squared = (d - a * u - b * v).lengthSqr();
    if (squared >= least) return;
    least = squared;
    best = {a, b};
  };
  for (const double side : {0.0, 1.0}) {
    look(side, std::clamp((dv - side * uv) / vv, 0.0, 1.0));
    look(std::clamp((du - side * uv) / uu, 0.0, 1.0), side);
  }
  return best;
}

}  // namespace

FilteredSurface::FilteredSurface(const Volume& volume, VolumeFilter filter, const ValueRange& range,
                                 double voxelSize, double halfWidth, std::size_t maxMemory,
                                 const Progress& progress)
    : volume_(volume, filter),
      frame_(volume.grid(), voxelSize, halfWidth),
      metric_(frame_.axes * frame_.axes.transpose()),
      voxelSize_(voxelSize),
      limits_(range),
      unit_(volume.highest() - volume.lowest()),
      bounds_(boundsOf(filter)) {
  for (int axis = 0; axis < 3; ++axis) last_[axis] = volume.size()[axis] - 1;
  report_.cells = collectSlabs(volume.size().z - 1, kBytesPerFilteredPiece, maxMemory,
                               subProgress(progress, 0, 0.9), pieces_,
                               [this](int k, SlabOfPieces& out) { collectSlab(k, out); });
  collectFaces();
  report_.pieces = pieces_.size();
  tree_ = treeOf(*this, pieces_.size());
  levelset::report(progress, 1);
}

double FilteredSurface::depthAt(const Vec3d& index) const {
  const double value = valueAt(index);
  double depth = functionAt(0, value);
  for (int n = 1; n < limits_.count; ++n) depth = std::min(depth, functionAt(n, value));
  return depth;
}

void FilteredSurface::bound(std::size_t item, Vec3d& low, Vec3d& high) const {
  if (item >= pieces_.size()) {
    const Face& face = faces_[item - pieces_.size()];
    low = Vec3d(face.low[0], face.low[1], face.low[2]);
    high = Vec3d(face.high[0], face.high[1], face.high[2]);
    return;
  }
  const Piece& piece = pieces_[item];
  low = Vec3d(std::numeric_limits<double>::max());
  high = -low;
  for (std::size_t c = 0; c < 8; ++c) {
    const Vec3d p = frame_.place(Vec3d(piece.first[0], piece.first[1], piece.first[2]) +
                                 static_cast<double>(piece.edge) * Box::offset(c));
    low = openvdb::math::minComponent(low, p);
    high = openvdb::math::maxComponent(high, p);
  }
}

double FilteredSurface::squaredBound(const Piece& piece, const Vec3d& position) const {
  Vec3d low, high;
  bound(static_cast<std::size_t>(&piece - pieces_.data()), low, high);
  double outside = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = std::max({low[axis] - position[axis], position[axis] - high[axis], 0.0});
    outside += d * d;
  }
  // The piece lies in a ball, and between two planes parallel to the tangent plane.
  const Vec3d way = position - frame_.place(Vec3d(piece.start[0], piece.start[1], piece.start[2]));
  const Vec3d normal(piece.normal[0], piece.normal[1], piece.normal[2]);
  const double across = way.dot(normal);
  const double beside = std::sqrt(std::max(0.0, way.lengthSqr() - across * across));
  const double bend = static_cast<double>(piece.bend), radius = static_cast<double>(piece.radius);
  const double above = std::max(0.0, std::abs(across) - bend);
  const double aside = std::max(0.0, beside - radius);
  return std::max(outside, above * above + aside * aside);
}

double FilteredSurface::squaredToFaces(const Vec3d& position, double best) const {
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto edge = [&](int n) {
      return last_[n] * Vec3d(frame_.axes(n, 0), frame_.axes(n, 1), frame_.axes(n, 2));
    };
    for (const double side : {0.0, last_[axis]}) {
      Vec3d index(0.0);
      index[axis] = side;
      const Vec3d first = frame_.place(index);
      const auto [s, t] = closestOnParallelogram(first, edge(u), edge(v), position);
      const double squared = (position - first - s * edge(u) - t * edge(v)).lengthSqr();
      if (squared >= best) continue;
      index[u] = s * last_[u];
      index[v] = t * last_[v];
      if (depthAt(index) > 0) best = squared;
    }
  }
  return best;
}

double FilteredSurface::distance(const Vec3d& position, double most, Hint& hint) const {
  // A piece that bends little has one closest point only.
  constexpr float kLittleBend = 0.2f;
  const Vec3d target = frame_.index(position);
  double best = squaredToFaces(position, most * most);
  std::optional<Foot> foot;
  int function = -1;
  const auto take = [&](const std::optional<Foot>& found, int of) {
    if (!found) return;
    // Also a distance that is not the least leads later searches, which need not go there again.
    if (!foot || found->squared < foot->squared) {
      foot = found;
      function = of;
    }
    best = std::min(best, found->squared);
  };
  if (hint.function >= 0)
    take(Descent(*this, hint.function, target).run(hint.index, nullptr), hint.function);
  tree_.visit(toImath(position), best, [&](const BoxItem& item) {
    const Piece& piece = pieces_[item.index];
    if (squaredBound(piece, position) >= best) return;
    const bool bendsLittle = piece.bend < kLittleBend * piece.radius;
    const Foot* known =
        foot && foot->isMinimum && bendsLittle && function == piece.function ? &*foot : nullptr;
    if (known) {
      bool isHere = true;
      for (int axis = 0; axis < 3; ++axis) {
        const double low = static_cast<double>(piece.first[static_cast<std::size_t>(axis)]);
        isHere = isHere && known->index[axis] >= low &&
                 known->index[axis] <= low + static_cast<double>(piece.edge);
      }
      if (isHere) return;
    }
    take(Descent(*this, piece.function, target)
             .run(Vec3d(piece.start[0], piece.start[1], piece.start[2]), known),
         piece.function);
  });
  if (foot) hint = {function, foot->index};
  return std::sqrt(best);
}

bool FilteredSurface::isInside(const Vec3d& position) const {
  const Vec3d index = frame_.index(position);
  for (int axis = 0; axis < 3; ++axis)
    if (!(index[axis] >= 0 && index[axis] <= last_[axis])) return false;
  return depthAt(index) > 0;
}

}  // namespace levelset
