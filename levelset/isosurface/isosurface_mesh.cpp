#include "levelset/isosurface/isosurface_mesh.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/meshing/cells/cell_table.h"
#include "levelset/volumes/volume_numbers.h"

namespace levelset {
namespace {

using Imath::M44d;
using Imath::V3d;
using Imath::V3i;
using Word = std::uint64_t;

constexpr int kWordBits = 64;
/// Least distance of a vertex from the ends of its grid edge, as a share of the edge's length.
constexpr double kLeastShare = 1e-4;
/// Largest number of steps that find the root of a cubic on a grid edge.
constexpr int kMostRootSteps = 50;
constexpr double kRootTolerance = 1e-10;

/// Condition for stored numbers of grid points that are inside. Stored numbers fit a float exactly.
struct InsideTest {
  bool isRising =
      true;  ///< true: numbers of at least `limit` are inside; false: of at most `limit`
  float limit = 0;

  InsideTest(const VolumeScale& scale, double isovalue, bool isBelow)
      : isRising((scale.slope > 0) != isBelow) {
    const auto isInside = [&](float stored) {
      return isBelow ? scale(stored) < isovalue : scale(stored) > isovalue;
    };
    // The float of each integer, such that greater integers have greater floats.
    const auto floatOf = [](std::int32_t order) {
      return std::bit_cast<float>(order < 0 ? order ^ 0x7fffffff : order);
    };
    // Bisection between the least and the greatest finite float.
    std::int64_t outside = std::bit_cast<std::int32_t>(std::numeric_limits<float>::max());
    std::int64_t inside = -outside - 1;
    if (isRising) std::swap(outside, inside);
    while (std::abs(outside - inside) > 1) {
      const std::int64_t middle = (outside + inside) / 2;
      (isInside(floatOf(static_cast<std::int32_t>(middle))) ? inside : outside) = middle;
    }
    limit = floatOf(static_cast<std::int32_t>(inside));
  }
};

/// Signs of the grid points, one bit for each, in rows along i. With padding, the grid has one more
/// grid point outside on each side.
class SignRows {
 public:
  SignRows(const Volume& volume, const InsideTest& test, bool isPadded)
      : pad_(isPadded ? 1 : 0),
        size_(volume.size() + V3i(2 * pad_)),
        words_(static_cast<std::size_t>(size_.x / kWordBits + 2)),
        bits_(words_ * rowCount(), 0) {
    tbb::parallel_for(pad_, size_.z - pad_, [&](int k) {
      std::vector<float> row(static_cast<std::size_t>(volume.size().x));
      for (int j = pad_; j < size_.y - pad_; ++j) {
        volume.storedRow(j - pad_, k - pad_, row);
        Word* words = &bits_[words_ * rowOf(j, k)];
        if (test.isRising)
          fill(words, row, [&](float v) { return v >= test.limit; });
        else
          fill(words, row, [&](float v) { return v <= test.limit; });
      }
    });
  }

  [[nodiscard]] int pad() const { return pad_; }
  [[nodiscard]] const V3i& size() const { return size_; }
  [[nodiscard]] std::size_t words() const { return words_; }  ///< of a row; the last one is 0
  [[nodiscard]] std::size_t rowCount() const {
    return static_cast<std::size_t>(size_.y) * static_cast<std::size_t>(size_.z);
  }
  [[nodiscard]] std::size_t rowOf(int j, int k) const {
    return static_cast<std::size_t>(k) * static_cast<std::size_t>(size_.y) +
           static_cast<std::size_t>(j);
  }
  [[nodiscard]] const Word* row(int j, int k) const { return &bits_[words_ * rowOf(j, k)]; }
  [[nodiscard]] bool isInside(const V3i& p) const {
    return (row(p.y, p.z)[p.x / kWordBits] >> (p.x % kWordBits) & 1) != 0;
  }

 private:
  template <typename Test>
  void fill(Word* words, const std::vector<float>& row, const Test& test) const {
    for (std::size_t i = 0; i < row.size();) {
      const std::size_t at = i + static_cast<std::size_t>(pad_), first = at % kWordBits;
      const std::size_t count = std::min(row.size() - i, kWordBits - first);
      Word word = 0;
      for (std::size_t n = 0; n < count; ++n) word |= static_cast<Word>(test(row[i + n])) << n;
      words[at / kWordBits] |= word << first;
      i += count;
    }
  }

  int pad_;
  V3i size_;
  std::size_t words_;
  std::vector<Word> bits_;
};

/// Signs of a row at the next grid point along i.
Word shiftedWord(const Word* row, std::size_t w) {
  return row[w] >> 1 | row[w + 1] << (kWordBits - 1);
}

/// Grid edges of a row that the surface crosses, by the axis of the edge: bit i for the edge that
/// starts at grid point i.
Word crossedEdges(const SignRows& signs, int axis, int j, int k, std::size_t w) {
  const Word* row = signs.row(j, k);
  if (axis == 0) return row[w] ^ shiftedWord(row, w);  // outside beyond the end of the row
  if (axis == 1) return j + 1 < signs.size().y ? row[w] ^ signs.row(j + 1, k)[w] : 0;
  return k + 1 < signs.size().z ? row[w] ^ signs.row(j, k + 1)[w] : 0;
}

/// Numbers of the first vertex of each axis, and of the first triangle, of a row.
struct RowStart {
  std::array<std::uint64_t, 3> vertex{};
  std::uint64_t triangle = 0;
};

/// Signs at the corners of the cells along a row.
class CellRow {
 public:
  CellRow(const SignRows& signs, int j, int k)
      : rows_{signs.row(j, k), signs.row(j, k + 1), signs.row(j + 1, k), signs.row(j + 1, k + 1)},
        cells_(signs.size().x - 1) {}

  /// Calls visit(pattern of the signs, as in cell_table.h, i) for each cell that the surface
  /// crosses.
  template <typename Visit>
  void forEachCrossed(const Visit& visit) const {
    for (int first = 0; first < cells_; first += kWordBits) {
      const auto w = static_cast<std::size_t>(first / kWordBits);
      std::array<Word, 8> corner{};
      Word any = 0, all = ~Word(0);
      for (std::size_t c = 0; c < 4; ++c) {
        corner[c] = rows_[c][w];
        corner[4 + c] = shiftedWord(rows_[c], w);
        any |= corner[c] | corner[4 + c];
        all &= corner[c] & corner[4 + c];
      }
      Word crossed = any & ~all;
      if (cells_ - first < kWordBits) crossed &= (Word(1) << (cells_ - first)) - 1;
      for (; crossed != 0; crossed &= crossed - 1) {
        const int bit = std::countr_zero(crossed);
        unsigned pattern = 0;
        for (std::size_t c = 0; c < 8; ++c)
          pattern |= static_cast<unsigned>(corner[c] >> bit & 1) << c;
        visit(pattern, first + bit);
      }
    }
  }

 private:
  std::array<const Word*, 4> rows_;
  int cells_;
};

/// Numbers of the vertices on the twelve edges of a cell, while the cells of a row are visited.
class EdgeNumbers {
 public:
  /// @param rows  starts of the rows (j, k), (j, k + 1), (j + 1, k) and (j + 1, k + 1)
  explicit EdgeNumbers(const std::array<const RowStart*, 4>& rows) {
    for (std::size_t c = 0; c < 4; ++c) alongI_[c] = at(rows[c]->vertex[0]);
    alongJ_ = {at(rows[0]->vertex[1]), at(rows[1]->vertex[1])};
    alongK_ = {at(rows[0]->vertex[2]), at(rows[2]->vertex[2])};
  }

  /// Sets the numbers of the crossed edges of the next crossed cell. An edge along j or k that the
  /// surface crosses has crossed cells on both sides, so the counters miss none.
  void next(unsigned pattern) {
    const auto crosses = [&](unsigned a, unsigned b) { return (pattern >> a ^ pattern >> b) & 1; };
    for (unsigned c = 0; c < 4; ++c) {
      number[c] = alongI_[c];
      alongI_[c] += crosses(c, 4 + c);
    }
    for (unsigned k = 0; k < 2; ++k) {
      number[4 + 2 * k] = alongJ_[k];
      alongJ_[k] += crosses(k, 2 + k);
      number[5 + 2 * k] = alongJ_[k];
    }
    for (unsigned j = 0; j < 2; ++j) {
      number[8 + j] = alongK_[j];
      alongK_[j] += crosses(2 * j, 2 * j + 1);
      number[10 + j] = alongK_[j];
    }
  }

  std::array<std::uint32_t, 12> number{};  ///< by the edge's number in cell_table.h

 private:
  static std::uint32_t at(std::uint64_t number) { return static_cast<std::uint32_t>(number); }

  std::array<std::uint32_t, 4> alongI_{};
  std::array<std::uint32_t, 2> alongJ_{}, alongK_{};
};

/// Stored numbers of a volume with the derivatives that normals need. T is the stored type.
template <typename T>
class Samples {
 public:
  explicit Samples(const Volume& volume, const char* begin) : begin_(begin), size_(volume.size()) {
    stride_ = {1, size_.x, static_cast<std::ptrdiff_t>(size_.x) * size_.y};
  }

  [[nodiscard]] std::ptrdiff_t index(const V3i& p) const {
    return p.x + p.y * stride_[1] + p.z * stride_[2];
  }
  [[nodiscard]] double at(std::ptrdiff_t index) const {
    return static_cast<double>(
        loadNumber<T>(begin_ + index * static_cast<std::ptrdiff_t>(sizeof(T))));
  }
  [[nodiscard]] std::ptrdiff_t stride(int axis) const {
    return stride_[static_cast<std::size_t>(axis)];
  }

  /// Derivative along an axis at a grid point by differences of the highest order, up to four, that
  /// the border admits.
  [[nodiscard]] double derivative(int axis, const V3i& p, std::ptrdiff_t n) const {
    const std::ptrdiff_t s = stride(axis);
    const int before = p[axis], after = size_[axis] - 1 - before;
    if (before >= 2 && after >= 2)
      return (8 * (at(n + s) - at(n - s)) - (at(n + 2 * s) - at(n - 2 * s))) / 12;
    if (before >= 1 && after >= 1) return (at(n + s) - at(n - s)) / 2;
    const int inward = before == 0 ? 1 : -1;
    if (before + after < 2) return inward * (at(n + inward * s) - at(n));
    return inward * (4 * at(n + inward * s) - at(n + 2 * inward * s) - 3 * at(n)) / 2;
  }

  /// Gradient, per spacing, at a point of a grid edge.
  /// @param share  position from the edge's lower end p to its upper end
  [[nodiscard]] V3d gradient(int axis, const V3i& p, double share) const {
    const std::ptrdiff_t n = index(p), along = stride(axis);
    V3i q = p;
    ++q[axis];
    V3d g;
    for (int b = 0; b < 3; ++b) {
      const double low = derivative(b, p, n), high = derivative(b, q, n + along);
      g[b] = low + (high - low) * share;
      // The quadratic term of the interpolation, from central differences at four grid points.
      const std::ptrdiff_t s = stride(b);
      const int reach = b == axis ? 2 : 1;
      if (p[axis] < reach || p[axis] + 1 + reach >= size_[axis]) continue;
      if (b != axis && (p[b] < 1 || p[b] + 1 >= size_[b])) continue;
      const auto central = [&](std::ptrdiff_t at_) { return (at(at_ + s) - at(at_ - s)) / 2; };
      const double bend =
          (central(n - along) - central(n) - central(n + along) + central(n + 2 * along)) / 2;
      g[b] += share * (share - 1) / 2 * bend;
    }
    return g;
  }

  /// Position on a grid edge, from 0 to 1, at which the linear function has a value between those
  /// of the ends.
  [[nodiscard]] double linearShare(int axis, const V3i& p, double value) const {
    const std::ptrdiff_t n = index(p);
    const double low = at(n), high = at(n + stride(axis));
    return (value - low) / (high - low);
  }

  /// The same for the cubic through the ends with central differences as slopes: the tricubic
  /// filter on the edge. Beyond the border the samples continue by a parabola.
  [[nodiscard]] double cubicShare(int axis, const V3i& p, double value) const {
    const std::ptrdiff_t n = index(p), s = stride(axis);
    const int before = p[axis], after = size_[axis] - 2 - before;
    const double f1 = at(n) - value, f2 = at(n + s) - value;
    double share = f1 / (f1 - f2);
    if (before + after < 1) return share;
    const double held0 = before > 0 ? at(n - s) - value : 0,
                 held3 = after > 0 ? at(n + 2 * s) - value : 0;
    const double f0 = before > 0 ? held0 : 3 * f1 - 3 * f2 + held3,
                 f3 = after > 0 ? held3 : 3 * f2 - 3 * f1 + held0;
    const double c1 = (f2 - f0) / 2, c2 = f0 - 2.5 * f1 + 2 * f2 - f3 / 2,
                 c3 = (f3 - f0) / 2 + 1.5 * (f1 - f2);
    // Newton's method inside a bracket of the sign change.
    double low = 0, high = 1;
    for (int step = 0; step < kMostRootSteps; ++step) {
      const double f = f1 + share * (c1 + share * (c2 + share * c3));
      if (f == 0) break;
      ((f < 0) == (f1 < 0 || (f1 == 0 && f2 > 0)) ? low : high) = share;
      const double slope = c1 + share * (2 * c2 + share * 3 * c3);
      double next = share - f / slope;
      if (!(next > low && next < high)) next = (low + high) / 2;
      const double change = std::abs(next - share);
      share = next;
      if (change < kRootTolerance) break;
    }
    return share;
  }

 private:
  const char* begin_;
  V3i size_;
  std::array<std::ptrdiff_t, 3> stride_{};
};

class IsosurfaceMesher {
 public:
  IsosurfaceMesher(const Volume& volume, double isovalue, const IsosurfaceMeshOptions& options)
      : volume_(volume),
        options_(options),
        stored_((isovalue - volume.scale().intercept) / volume.scale().slope),
        signs_(volume, InsideTest(volume.scale(), isovalue, options.isInsideBelow),
               options.border == MeshBorder::Close),
        starts_(signs_.rowCount()) {}

  IsosurfaceMesh run() {
    result_.borderPoints = countBorder();
    if (options_.border == MeshBorder::Refuse && result_.borderPoints > 0)
      throw InvalidInput(fmt::format(
          "the solid reaches the border of the volume at {} grid points; choose another isovalue, "
          "or let the border close it",
          result_.borderPoints));
    report(options_.progress, 0.2);
    countRows();
    allocate();
    report(options_.progress, 0.4);
    forEachRow([&](int j, int k) { addTriangles(j, k); });
    report(options_.progress, 0.6);
    withStoredType(volume_.type(), [&](auto type) {
      const Samples<decltype(type)> samples(volume_, volume_.numbers());
      forEachRow([&](int j, int k) { addVertices(samples, j, k); });
    });
    report(options_.progress, 0.9);
    if (options_.border == MeshBorder::Close) weldBoxEdges();
    report(options_.progress, 1);
    return std::move(result_);
  }

 private:
  template <typename Visit>
  void forEachRow(const Visit& visit) const {
    tbb::parallel_for(0, signs_.size().z, [&](int k) {
      for (int j = 0; j < signs_.size().y; ++j) visit(j, k);
    });
  }
  [[nodiscard]] bool hasCells(int j, int k) const {
    return j + 1 < signs_.size().y && k + 1 < signs_.size().z;
  }

  [[nodiscard]] std::uint64_t countBorder() const {
    const V3i low(signs_.pad()), high = signs_.size() - V3i(1 + signs_.pad());
    std::uint64_t count = 0;
    for (int k = low.z; k <= high.z; ++k)
      for (int j = low.y; j <= high.y; ++j) {
        if (k == low.z || k == high.z || j == low.y || j == high.y) {
          const Word* row = signs_.row(j, k);
          for (std::size_t w = 0; w < signs_.words(); ++w)
            count += static_cast<std::uint64_t>(std::popcount(row[w]));
        } else {
          count += signs_.isInside({low.x, j, k});
          count += signs_.isInside({high.x, j, k});
        }
      }
    return count;
  }

  /// Edges of a row along i end at the last grid point, so the bit there is none.
  [[nodiscard]] Word crossed(int axis, int j, int k, std::size_t w) const {
    const Word word = crossedEdges(signs_, axis, j, k, w);
    if (axis != 0) return word;
    const int last = signs_.size().x - 1 - static_cast<int>(w) * kWordBits;
    return last >= kWordBits || last < 0 ? word : word & ((Word(1) << last) - 1);
  }

  void countRows() {
    const auto& table = cellTable();
    std::vector<std::uint64_t> cells(signs_.rowCount());
    forEachRow([&](int j, int k) {
      RowStart& start = starts_[signs_.rowOf(j, k)];
      for (int axis = 0; axis < 3; ++axis)
        for (std::size_t w = 0; w + 1 < signs_.words(); ++w)
          start.vertex[static_cast<std::size_t>(axis)] +=
              static_cast<std::uint64_t>(std::popcount(crossed(axis, j, k, w)));
      if (!hasCells(j, k)) return;
      CellRow(signs_, j, k).forEachCrossed([&](unsigned pattern, int) {
        start.triangle += table[pattern].triangleCount;
        ++cells[signs_.rowOf(j, k)];
      });
    });
    for (std::size_t row = 0; row < starts_.size(); ++row) {
      result_.cells += cells[row];
      for (std::uint64_t& count : starts_[row].vertex)
        vertexCount_ += std::exchange(count, vertexCount_);
      triangleCount_ += std::exchange(starts_[row].triangle, triangleCount_);
    }
  }

  void allocate() {
    if (vertexCount_ >= std::numeric_limits<std::uint32_t>::max())
      throw ResourceLimit(
          "the surface has more than 4294967294 vertices; resample the volume with a larger "
          "spacing");
    const double normals = options_.hasNormals ? sizeof(V3d) : 0;
    requireMemory(static_cast<double>(vertexCount_) * (sizeof(V3d) + normals) +
                      static_cast<double>(triangleCount_) * sizeof(result_.mesh.triangles[0]),
                  options_.maxMemory);
    result_.mesh.positions.resize(vertexCount_);
    result_.mesh.triangles.resize(triangleCount_);
    if (options_.hasNormals) result_.mesh.attributes.normals.resize(vertexCount_);
  }

  void addTriangles(int j, int k) {
    if (!hasCells(j, k)) return;
    const auto& table = cellTable();
    const auto startOf = [&](int dj, int dk) { return &starts_[signs_.rowOf(j + dj, k + dk)]; };
    EdgeNumbers edges({startOf(0, 0), startOf(0, 1), startOf(1, 0), startOf(1, 1)});
    auto* next = result_.mesh.triangles.data() + startOf(0, 0)->triangle;
    // A map that mirrors turns the triangles over.
    const std::size_t second = isMirrored_ ? 2 : 1, third = 3 - second;
    CellRow(signs_, j, k).forEachCrossed([&](unsigned pattern, int) {
      edges.next(pattern);
      const CellCase& cell = table[pattern];
      for (std::size_t t = 0; t < cell.triangleCount; ++t) {
        const auto& corners = cell.triangles[t];
        *next++ = {edges.number[corners[0]], edges.number[corners[second]],
                   edges.number[corners[third]]};
      }
    });
  }

  template <typename T>
  void addVertices(const Samples<T>& samples, int j, int k) {
    for (int axis = 0; axis < 3; ++axis) {
      std::uint64_t vertex = starts_[signs_.rowOf(j, k)].vertex[static_cast<std::size_t>(axis)];
      for (std::size_t w = 0; w + 1 < signs_.words(); ++w)
        for (Word edges = crossed(axis, j, k, w); edges != 0; edges &= edges - 1)
          addVertex(samples, axis,
                    V3i(static_cast<int>(w) * kWordBits + std::countr_zero(edges), j, k) -
                        V3i(signs_.pad()),
                    vertex++);
    }
  }

  /// @param p  lower end of the grid edge; it or the upper end may lie in the padding
  template <typename T>
  void addVertex(const Samples<T>& samples, int axis, const V3i& p, std::uint64_t vertex) {
    V3d place(p);
    V3d gradient(0);
    if (p[axis] < 0 || p[axis] + 1 >= volume_.size()[axis]) {  // on the border of the volume
      const bool isLow = p[axis] < 0;
      if (isLow) place[axis] = 0;
      gradient[axis] = isLow ? -1 : 1;
      if (isInwardNormal_) gradient *= -1;
    } else {
      const double share = std::clamp(options_.filter == VolumeFilter::Tricubic
                                          ? samples.cubicShare(axis, p, stored_)
                                          : samples.linearShare(axis, p, stored_),
                                      kLeastShare, 1 - kLeastShare);
      place[axis] += share;
      if (options_.hasNormals) gradient = samples.gradient(axis, p, share);
    }
    toWorld_.multVecMatrix(place, result_.mesh.positions[vertex]);
    if (!options_.hasNormals) return;
    V3d normal;
    for (int r = 0; r < 3; ++r)
      normal[r] = gradient[0] * toIndex_[r][0] + gradient[1] * toIndex_[r][1] +
                  gradient[2] * toIndex_[r][2];
    if (isInwardNormal_) normal = -normal;
    result_.mesh.attributes.normals[vertex] = normal.normalized();
  }

  /// Number of the vertex on a crossed edge. @param p  lower end, in the padded grid
  [[nodiscard]] std::uint32_t vertexOn(int axis, const V3i& p) const {
    std::uint64_t number = starts_[signs_.rowOf(p.y, p.z)].vertex[static_cast<std::size_t>(axis)];
    const auto last = static_cast<std::size_t>(p.x / kWordBits);
    for (std::size_t w = 0; w < last; ++w)
      number += static_cast<std::uint64_t>(std::popcount(crossed(axis, p.y, p.z, w)));
    const Word below = (Word(1) << (p.x % kWordBits)) - 1;
    number += static_cast<std::uint64_t>(std::popcount(crossed(axis, p.y, p.z, last) & below));
    return static_cast<std::uint32_t>(number);
  }

  /// A grid point on an edge of the volume's box has several vertices at its position, one for each
  /// face of the box. Joins them, and drops the triangles that lose their area.
  void weldBoxEdges() {
    std::vector<std::uint32_t> joined;  // vertices to drop, each followed by that which stays
    const V3i low(1), high = signs_.size() - V3i(2);
    const auto weld = [&](const V3i& p) {
      if (!signs_.isInside(p)) return;
      std::vector<std::uint32_t> here;
      for (int axis = 0; axis < 3; ++axis) {
        V3i before = p;
        --before[axis];
        if (p[axis] == low[axis]) here.push_back(vertexOn(axis, before));
        if (p[axis] == high[axis]) here.push_back(vertexOn(axis, p));
      }
      for (std::size_t n = 1; n < here.size(); ++n) joined.insert(joined.end(), {here[n], here[0]});
    };
    for (int axis = 0; axis < 3; ++axis) {
      const int b = (axis + 1) % 3, c = (axis + 2) % 3;
      for (const int atB : {low[b], high[b]})
        for (const int atC : {low[c], high[c]})
          // Corners of the box belong to the edges along the first axis.
          for (int n = low[axis] + (axis > 0 ? 1 : 0); n <= high[axis] - (axis > 0 ? 1 : 0); ++n) {
            V3i p;
            p[axis] = n, p[b] = atB, p[c] = atC;
            weld(p);
          }
    }
    if (!joined.empty()) join(joined);
  }

  void join(const std::vector<std::uint32_t>& joined) {
    TriMesh& mesh = result_.mesh;
    std::vector<V3d>& normals = mesh.attributes.normals;
    std::vector<std::uint32_t> number(mesh.positions.size(), 0);
    constexpr std::uint32_t kGone = std::numeric_limits<std::uint32_t>::max();
    for (std::size_t n = 0; n < joined.size(); n += 2) {
      number[joined[n]] = kGone;
      if (!normals.empty()) normals[joined[n + 1]] += normals[joined[n]];
    }
    for (std::size_t n = 0; n < joined.size() && !normals.empty(); n += 2)
      normals[joined[n + 1]].normalize();
    std::uint32_t kept = 0;
    for (std::size_t v = 0; v < number.size(); ++v) {
      if (number[v] == kGone) continue;
      mesh.positions[kept] = mesh.positions[v];
      if (!normals.empty()) normals[kept] = normals[v];
      number[v] = kept++;
    }
    mesh.positions.resize(kept);
    if (!normals.empty()) normals.resize(kept);
    for (std::size_t n = 0; n < joined.size(); n += 2) number[joined[n]] = number[joined[n + 1]];
    for (auto& t : mesh.triangles)
      for (std::uint32_t& v : t) v = number[v];
    std::erase_if(mesh.triangles,
                  [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  }

  const Volume& volume_;
  const IsosurfaceMeshOptions& options_;
  const double stored_;  // the isovalue as a stored number
  const SignRows signs_;
  std::vector<RowStart> starts_;  // [row]
  std::uint64_t vertexCount_ = 0, triangleCount_ = 0;
  const M44d toWorld_ = volume_.grid().indexToWorld;
  const M44d toIndex_ = toWorld_.inverse();
  const bool isMirrored_ = toWorld_.determinant() < 0;
  // The gradient of the stored numbers points inside.
  const bool isInwardNormal_ = (volume_.scale().slope > 0) != options_.isInsideBelow;
  IsosurfaceMesh result_;
};

void checkMesh(const Volume& volume, double isovalue, const IsosurfaceMeshOptions& options) {
  if (!std::isfinite(isovalue))
    throw UsageError(fmt::format("the isovalue is {}; give a finite number", isovalue));
  if (options.filter != VolumeFilter::Trilinear && options.filter != VolumeFilter::Tricubic)
    throw UsageError(
        fmt::format("a mesh of the filter {} is not supported; choose trilinear or tricubic, or "
                    "make a solid with 'isosurface'",
                    factsOf(options.filter).name));
  const V3i size = volume.size();
  if (std::min({size.x, size.y, size.z}) < 2)
    throw InvalidInput(fmt::format(
        "the volume has {} x {} x {} grid points, but a surface needs two along each axis; use a "
        "volume, not a slice",
        size.x, size.y, size.z));
  const bool hasInside =
      options.isInsideBelow ? volume.lowest() < isovalue : volume.highest() > isovalue;
  const bool hasOutside =
      options.isInsideBelow ? volume.highest() >= isovalue : volume.lowest() <= isovalue;
  if (!hasInside || !hasOutside)
    throw NoSurface(fmt::format(
        "{} value of the volume is inside: they go from {:.6g} to {:.6g}; choose an isovalue "
        "between them ('histogram' suggests some)",
        hasInside ? "every" : "no", volume.lowest(), volume.highest()));
}

}  // namespace

IsosurfaceMesh isosurfaceMesh(const Volume& volume, double isovalue,
                              const IsosurfaceMeshOptions& options) {
  checkMesh(volume, isovalue, options);
  // Signs of the grid points, and the numbers of the rows.
  const double points = static_cast<double>(volume.grid().pointCount());
  requireMemory(points / 7 + 64.0 * volume.size().y * volume.size().z, options.maxMemory);
  report(options.progress, 0);
  return IsosurfaceMesher(volume, isovalue, options).run();
}

}  // namespace levelset
