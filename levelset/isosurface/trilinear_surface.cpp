#include "levelset/isosurface/trilinear_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "levelset/isosurface/volume_frame.h"

namespace levelset::trilinear {
namespace {

// A sample that equals the isovalue counts as outside by this share of the range of the values. It
// moves the surface by less than single precision resolves, and no sample lies on it.
constexpr float kOutside = 0x1p-24f;
// Memory of a piece with its part of the search tree, bytes.
constexpr double kBytesPerPiece = sizeof(Piece) + PieceTree::bytesPerItem();

bool crosses(const std::array<float, 8>& corner) {
  int positive = 0;
  for (const float value : corner) positive += value > 0;
  return positive != 0 && positive != 8;
}

/// Values of the function on the 3³ points of the piece with half the spacing, x slowest.
std::array<float, 27> refined(const std::array<float, 8>& corner) {
  std::array<float, 27> fine{};
  const auto at = [&](int x, int y, int z) -> float& {
    return fine[static_cast<std::size_t>(9 * x + 3 * y + z)];
  };
  for (int n = 0; n < 8; ++n)
    at(n & 4 ? 2 : 0, n & 2 ? 2 : 0, n & 1 ? 2 : 0) = corner[static_cast<std::size_t>(n)];
  for (int a = 0; a < 3; a += 2)
    for (int b = 0; b < 3; b += 2) at(a, b, 1) = (at(a, b, 0) + at(a, b, 2)) / 2;
  for (int a = 0; a < 3; a += 2)
    for (int c = 0; c < 3; ++c) at(a, 1, c) = (at(a, 0, c) + at(a, 2, c)) / 2;
  for (int b = 0; b < 3; ++b)
    for (int c = 0; c < 3; ++c) at(1, b, c) = (at(0, b, c) + at(2, b, c)) / 2;
  return fine;
}

std::array<float, 8> subcell(const std::array<float, 27>& fine, int octant) {
  std::array<float, 8> corner{};
  const int x = octant >> 2, y = (octant >> 1) & 1, z = octant & 1;
  for (int n = 0; n < 8; ++n)
    corner[static_cast<std::size_t>(n)] =
        fine[static_cast<std::size_t>(9 * (x + (n >> 2)) + 3 * (y + ((n >> 1) & 1)) + z + (n & 1))];
  return corner;
}

int levelOf(float edge) {
  return edge > 0.75f ? 0 : edge > 0.375f ? 1 : edge > 0.1875f ? 2 : 3;
}

}  // namespace

TrilinearSurface::TrilinearSurface(const Volume& volume, const ValueRange& range, double voxelSize,
                                   double halfWidth, std::size_t maxMemory,
                                   const Progress& progress)
    : volume_(volume),
      limits_(range),
      unit_(volume.highest() - volume.lowest()),
      voxelSize_(voxelSize) {
  placeFrame(halfWidth);
  report_.cells =
      collectSlabs(volume.size().z - 1, kBytesPerPiece, maxMemory, subProgress(progress, 0, 0.7),
                   pieces_, [this](int k, SlabOfPieces& out) { collectSlab(k, out); });
  collectFaces(maxMemory);
  report_.pieces = pieces_.size();
  tree_ = treeOf(*this, itemCount());
  levelset::report(progress, 1);
}

void TrilinearSurface::placeFrame(double halfWidth) {
  const VolumeFrame frame(volume_.grid(), voxelSize_, halfWidth);
  base_ = frame.base;
  origin_ = frame.origin;
  axes_ = frame.axes;
  toIndex_ = frame.toIndex;
  const Mat3d metric = axes_ * axes_.transpose();
  for (int level = 0; level < kMostLevels; ++level) {
    const double edge = 1.0 / (1 << level);
    metric_[static_cast<std::size_t>(level)] = metric * (edge * edge);
    inverse_[static_cast<std::size_t>(level)] = (metric * (edge * edge)).inverse(0.0);
  }
}

float TrilinearSurface::functionAt(int n, double stored) const {
  const auto at = static_cast<std::size_t>(n);
  const auto value =
      static_cast<float>(limits_.sign[at] * (volume_.scale()(stored) - limits_.limit[at]) / unit_);
  return value == 0 ? -kOutside : value;
}

void TrilinearSurface::collectSlab(int k, SlabOfPieces& out) const {
  const Imath::V3i size = volume_.size();
  // Stored numbers of the rows (j, k), (j, k + 1), (j + 1, k) and (j + 1, k + 1).
  std::array<std::vector<float>, 4> rows;
  for (std::vector<float>& row : rows) row.resize(static_cast<std::size_t>(size.x));
  volume_.storedRow(0, k, rows[2]);
  volume_.storedRow(0, k + 1, rows[3]);
  for (int j = 0; j + 1 < size.y; ++j) {
    std::swap(rows[0], rows[2]);
    std::swap(rows[1], rows[3]);
    volume_.storedRow(j + 1, k, rows[2]);
    volume_.storedRow(j + 1, k + 1, rows[3]);
    for (std::size_t i = 0; i + 1 < static_cast<std::size_t>(size.x); ++i) {
      std::array<float, 8> stored{};
      for (std::size_t row = 0; row < 4; ++row) {
        stored[row] = rows[row][i];
        stored[4 + row] = rows[row][i + 1];
      }
      const auto [low, high] = std::minmax_element(stored.begin(), stored.end());
      if (*low == *high) continue;
      for (int n = 0; n < limits_.count; ++n) {
        // The function is monotonic in the stored number.
        if ((functionAt(n, static_cast<double>(*low)) > 0) ==
            (functionAt(n, static_cast<double>(*high)) > 0))
          continue;
        Corners corner{};
        for (std::size_t c = 0; c < 8; ++c)
          corner[c] = functionAt(n, static_cast<double>(stored[c]));
        ++out.cells;
        split(corner, {static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)}, 0,
              out.pieces);
      }
    }
  }
}

void TrilinearSurface::split(const Corners& corner, const std::array<float, 3>& first, int level,
                             std::vector<Piece>& out) const {
  const float edge = 1.0f / static_cast<float>(1 << level);
  const Cubic f(corner);
  if (level + 1 == kMostLevels || !f.isBent()) {
    Piece piece{.corner = corner, .first = first, .edge = edge, .low = {}, .high = {}};
    setBounds(piece);
    out.push_back(piece);
    return;
  }
  const std::array<float, 27> fine = refined(corner);
  for (int octant = 0; octant < 8; ++octant) {
    const Corners part = subcell(fine, octant);
    if (!crosses(part)) continue;
    split(part,
          {first[0] + (octant & 4 ? edge / 2 : 0), first[1] + (octant & 2 ? edge / 2 : 0),
           first[2] + (octant & 1 ? edge / 2 : 0)},
          level + 1, out);
  }
}

void TrilinearSurface::setBounds(Piece& piece) const {
  Vec3d low(std::numeric_limits<double>::max()), high = -low;
  const std::array<float, 27> fine = refined(piece.corner);
  const double half = static_cast<double>(piece.edge) / 2;
  for (int octant = 0; octant < 8; ++octant) {
    if (!crosses(subcell(fine, octant))) continue;
    for (int n = 0; n < 8; ++n) {
      Vec3d index;
      for (int axis = 0; axis < 3; ++axis) {
        const int bit = 2 - axis;
        index[axis] = static_cast<double>(piece.first[static_cast<std::size_t>(axis)]) +
                      half * ((octant >> bit & 1) + (n >> bit & 1));
      }
      const Vec3d p = place(index);
      low = openvdb::math::minComponent(low, p);
      high = openvdb::math::maxComponent(high, p);
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    piece.low[static_cast<std::size_t>(axis)] =
        std::nextafter(static_cast<float>(low[axis]), -INFINITY);
    piece.high[static_cast<std::size_t>(axis)] =
        std::nextafter(static_cast<float>(high[axis]), INFINITY);
  }
}

void TrilinearSurface::collectFaces(std::size_t maxMemory) {
  const Imath::V3i size = volume_.size();
  for (int axis = 0; axis < 3; ++axis)
    for (const bool isHigh : {false, true}) {
      for (int b = 0; b + 1 < size[(axis + 2) % 3]; ++b)
        for (int a = 0; a + 1 < size[(axis + 1) % 3]; ++a) addFace(axis, isHigh, a, b);
      requireMemory(static_cast<double>(pieces_.size() + faces_.size()) * 2 * kBytesPerPiece,
                    maxMemory);
    }
  for (const BorderFace& face : faces_) report_.closedArea += coveredArea(face);
  report_.closedArea *= voxelSize_ * voxelSize_;
}

void TrilinearSurface::addFace(int axis, bool isHigh, int a, int b) {
  const Imath::V3i size = volume_.size();
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  Imath::V3i first(0);
  first[axis] = isHigh ? size[axis] - 1 : 0;
  first[u] = a;
  first[v] = b;
  BorderFace face;
  face.functions = limits_.count;
  for (int n = 0; n < limits_.count; ++n) {
    bool anyPositive = false;
    for (int c = 0; c < 4; ++c) {
      Imath::V3i at = first;
      at[u] += c >> 1;
      at[v] += c & 1;
      const float value = functionAt(n, volume_.stored(volume_.index(at.x, at.y, at.z)));
      face.corner[static_cast<std::size_t>(n)][static_cast<std::size_t>(c)] = value;
      anyPositive = anyPositive || value > 0;
    }
    if (!anyPositive) return;
  }
  face.first = place(Vec3d(first.x, first.y, first.z));
  face.u = Vec3d(axes_(u, 0), axes_(u, 1), axes_(u, 2));
  face.v = Vec3d(axes_(v, 0), axes_(v, 1), axes_(v, 2));
  if (!(coveredArea(face) > 0)) return;
  for (int n = 0; n < 3; ++n) {
    const double low = face.first[n] + std::min(face.u[n], 0.0) + std::min(face.v[n], 0.0);
    const double high = face.first[n] + std::max(face.u[n], 0.0) + std::max(face.v[n], 0.0);
    face.low[static_cast<std::size_t>(n)] = std::nextafter(static_cast<float>(low), -INFINITY);
    face.high[static_cast<std::size_t>(n)] = std::nextafter(static_cast<float>(high), INFINITY);
  }
  faces_.push_back(face);
}

void TrilinearSurface::bound(std::size_t item, Vec3d& low, Vec3d& high) const {
  const bool isPiece = item < pieces_.size();
  const auto& from = isPiece ? pieces_[item].low : faces_[item - pieces_.size()].low;
  const auto& to = isPiece ? pieces_[item].high : faces_[item - pieces_.size()].high;
  low = Vec3d(from[0], from[1], from[2]);
  high = Vec3d(to[0], to[1], to[2]);
}

double TrilinearSurface::squaredTo(std::size_t item, const Vec3d& position, const Vec3d& index,
                                   double best) const {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  Vec3d low, high;
  bound(item, low, high);
  double outside = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = std::max({low[axis] - position[axis], position[axis] - high[axis], 0.0});
    outside += d * d;
  }
  if (outside > best) return kInfinite;
  if (item >= pieces_.size()) return squaredDistance(faces_[item - pieces_.size()], position);
  const Piece& piece = pieces_[item];
  const Cubic f(piece.corner);
  const double edge = static_cast<double>(piece.edge);
  Vec3d target;
  for (int axis = 0; axis < 3; ++axis)
    target[axis] =
        (index[axis] - static_cast<double>(piece.first[static_cast<std::size_t>(axis)])) / edge;
  const auto level = static_cast<std::size_t>(levelOf(piece.edge));
  return squaredDistance(f, metric_[level], inverse_[level], target, best);
}

double TrilinearSurface::distance(const Vec3d& position, double most, Hint& hint) const {
  const Vec3d index = (position - origin_) * toIndex_;
  double best = most * most;
  const auto look = [&](std::size_t item) {
    const double squared = squaredTo(item, position, index, best);
    if (squared >= best) return;
    best = squared;
    hint.item = item;
  };
  if (hint.item < itemCount()) look(hint.item);
  tree_.visit(toImath(position), best, [&](const BoxItem& item) {
    if (item.index != hint.item) look(item.index);
  });
  return std::sqrt(best);
}

bool TrilinearSurface::isInside(const Vec3d& position) const {
  const Vec3d index = (position - origin_) * toIndex_;
  const Imath::V3i size = volume_.size();
  Imath::V3i cell;
  Vec3d t;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(index[axis] >= 0 && index[axis] <= size[axis] - 1)) return false;
    cell[axis] = std::min(static_cast<int>(index[axis]), size[axis] - 2);
    t[axis] = index[axis] - cell[axis];
  }
  std::array<double, 8> stored{};
  for (std::size_t n = 0; n < 8; ++n)
    stored[n] = volume_.stored(volume_.index(cell.x + static_cast<int>(n >> 2),
                                             cell.y + static_cast<int>(n >> 1 & 1),
                                             cell.z + static_cast<int>(n & 1)));
  for (int function = 0; function < limits_.count; ++function) {
    Corners corner{};
    for (std::size_t n = 0; n < 8; ++n) corner[n] = functionAt(function, stored[n]);
    if (!(Cubic(corner).value(t) > 0)) return false;
  }
  return true;
}

}  // namespace levelset::trilinear
