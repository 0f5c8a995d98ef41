#include "levelset/meshing/cells/cell_table.h"

#include <cassert>
#include <limits>
#include <vector>

namespace levelset {
namespace {

using Offset = std::array<int, 3>;

int cornerAt(const Offset& o) {
  return cornerOf(o[0], o[1], o[2]);
}

int edgeBetween(const Offset& a, const Offset& b) {
  std::size_t axis = 0;
  while (a[axis] == b[axis]) ++axis;
  return static_cast<int>(axis) * 4 + a[(axis + 1) % 3] * 2 + a[(axis + 2) % 3];
}

/// Returns the corners of a face, counter-clockwise seen from outside the cell.
std::array<Offset, 4> faceLoop(std::size_t axis, int side) {
  constexpr int kLoop[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  std::array<Offset, 4> loop;
  for (std::size_t i = 0; i < 4; ++i) {
    const int* step = kLoop[side ? i : 3 - i];
    loop[i][axis] = side;
    loop[i][(axis + 1) % 3] = step[0];
    loop[i][(axis + 2) % 3] = step[1];
  }
  return loop;
}

/// Returns next[e]: the edge that follows e on its polygon; −1: e is not crossed.
std::array<int, 12> linkEdges(int pattern) {
  std::array<int, 12> next;
  next.fill(-1);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      const auto loop = faceLoop(axis, side);
      const auto inside = [&](std::size_t i) { return (pattern >> cornerAt(loop[i & 3])) & 1; };
      for (std::size_t i = 0; i < 4; ++i) {
        if (inside(i) || !inside(i + 1)) continue;
        std::size_t last = i + 1;  // last corner of the run of inside corners from i + 1
        while (inside(last + 1)) ++last;
        next[static_cast<std::size_t>(edgeBetween(loop[i], loop[(i + 1) & 3]))] =
            edgeBetween(loop[last & 3], loop[(last + 1) & 3]);
      }
    }
  }
  return next;
}

bool shareFace(int a, int b) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto side = [axis](int edge) {
      return edgeAxis(edge) == static_cast<int>(axis) ? -1 : edgeOffset(edge)[axis];
    };
    if (side(a) >= 0 && side(a) == side(b)) return true;
  }
  return false;
}

double squaredDistance(int a, int b) {
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto middle = [axis](int edge) {
      return edgeAxis(edge) == static_cast<int>(axis) ? 0.5 : edgeOffset(edge)[axis];
    };
    sum += (middle(a) - middle(b)) * (middle(a) - middle(b));
  }
  return sum;
}

/// Splits a polygon into triangles with the shortest diagonals. No diagonal may lie in a face of
/// the cell: the cell beyond the face could use the same diagonal, and four triangles would meet at
/// it. cost() and emit() treat the part of the polygon from vertex `first` to vertex `last`.
class PolygonSplit {
 public:
  explicit PolygonSplit(const std::vector<int>& polygon) : polygon_(polygon) {}

  double cost(std::size_t first, std::size_t last) const {
    if (last < first + 2) return 0;
    return best(first, last).second;
  }

  void emit(std::size_t first, std::size_t last, CellCase& out) const {
    if (last < first + 2) return;
    const std::size_t middle = best(first, last).first;
    out.triangles[out.triangleCount++] = {static_cast<std::uint8_t>(polygon_[first]),
                                          static_cast<std::uint8_t>(polygon_[middle]),
                                          static_cast<std::uint8_t>(polygon_[last])};
    emit(first, middle, out);
    emit(middle, last, out);
  }

 private:
  static constexpr double kForbidden = 1e6;

  double side(std::size_t i, std::size_t j) const {
    if (j == i + 1 || (i == 0 && j + 1 == polygon_.size())) return 0;
    return shareFace(polygon_[i], polygon_[j]) ? kForbidden
                                               : squaredDistance(polygon_[i], polygon_[j]);
  }

  std::pair<std::size_t, double> best(std::size_t first, std::size_t last) const {
    std::pair<std::size_t, double> result(first + 1, std::numeric_limits<double>::max());
    for (std::size_t middle = first + 1; middle < last; ++middle) {
      const double total =
          side(first, middle) + side(middle, last) + cost(first, middle) + cost(middle, last);
      if (total < result.second) result = {middle, total};
    }
    assert(result.second < kForbidden);
    return result;
  }

  const std::vector<int>& polygon_;
};

CellCase makeCase(int pattern) {
  CellCase result;
  result.cycleOfEdge.fill(-1);
  const std::array<int, 12> next = linkEdges(pattern);
  std::size_t used = 0;
  for (std::size_t start = 0; start < 12; ++start) {
    if (next[start] < 0 || result.cycleOfEdge[start] >= 0) continue;
    std::vector<int> polygon;
    auto edge = start;
    do {
      polygon.push_back(static_cast<int>(edge));
      result.cycleEdges[used++] = static_cast<std::uint8_t>(edge);
      result.cycleOfEdge[edge] = static_cast<std::int8_t>(result.cycleCount);
      edge = static_cast<std::size_t>(next[edge]);
    } while (edge != start);
    result.cycleLength[result.cycleCount++] = static_cast<std::uint8_t>(polygon.size());
    PolygonSplit(polygon).emit(0, polygon.size() - 1, result);
  }
  return result;
}

}  // namespace

const std::array<CellCase, 256>& cellTable() {
  static const std::array<CellCase, 256> table = [] {
    std::array<CellCase, 256> cases;
    for (int pattern = 0; pattern < 256; ++pattern) {
      cases[static_cast<std::size_t>(pattern)] = makeCase(pattern);
    }
    return cases;
  }();
  return table;
}

}  // namespace levelset
