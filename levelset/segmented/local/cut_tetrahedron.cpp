#include "levelset/segmented/local/cut_tetrahedron.h"

#include <Imath/ImathVec.h>

#include <algorithm>
#include <utility>

namespace levelset {
namespace {

using CutNode = CutTetrahedron::Node;
using Imath::V3i;

constexpr std::array<std::array<std::uint8_t, 2>, 6> kCutEdges = CutTetrahedron::kEdges;

/// Line across a face between two nodes.
struct CutLine {
  std::array<CutNode, 2> nodes;
};

/// Makes the surfaces of one set of crossed edges.
class TetrahedronCutter {
 public:
  TetrahedronCutter(std::uint32_t crossed, bool hasCorner)
      : crossed_(crossed), hasCorner_(hasCorner) {}

  CutTetrahedron run() {
    drawLines();
    for (CutNode first = 0; first < kCutEdges.size(); ++first)
      if ((crossed_ >> first & 1) && !isDone_[first]) addPart(first);
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool isEdge(CutNode node) const { return node < CutTetrahedron::kFirstFace; }

  void drawLines() {
    for (std::uint8_t opposite = 0; opposite < 4; ++opposite) {
      std::vector<CutNode> found;
      for (CutNode e = 0; e < kCutEdges.size(); ++e)
        if ((crossed_ >> e & 1) && kCutEdges[e][0] != opposite && kCutEdges[e][1] != opposite)
          found.push_back(e);
      const auto face = static_cast<CutNode>(CutTetrahedron::kFirstFace + opposite);
      if (found.size() == 2) lines_.push_back({{found[0], found[1]}});
      if (!holdsFaceNode(static_cast<std::uint32_t>(found.size()))) continue;
      result_.hasFaceNode[opposite] = true;
      isJunction_[face] = found.size() == 3;
      for (const CutNode e : found) lines_.push_back({{e, face}});
    }
  }

  /// Adds the surfaces that are connected with an edge.
  void addPart(CutNode first) {
    std::vector<CutNode> nodes = {first};
    std::vector<CutLine> lines;
    isDone_[first] = true;
    for (std::size_t n = 0; n < nodes.size(); ++n)
      for (const CutLine& line : lines_)
        for (std::size_t end = 0; end < 2; ++end) {
          if (line.nodes[end] != nodes[n]) continue;
          const CutNode other = line.nodes[1 - end];
          if (isDone_[other]) continue;
          isDone_[other] = true;
          nodes.push_back(other);
        }
    for (const CutLine& line : lines_)
      if (std::find(nodes.begin(), nodes.end(), line.nodes[0]) != nodes.end())
        lines.push_back(line);
    std::vector<CutNode> rims, junctions;
    for (const CutNode node : nodes)
      if (!isEdge(node)) (isJunction_[node] ? junctions : rims).push_back(node);
    if (junctions.empty() && (rims.empty() || !hasCorner_)) return addPath(lines, first, rims);
    if (junctions.size() == 2 && rims.empty()) return addThree(lines, junctions);
    addFan(lines, rims, junctions);
  }

  /// Follows lines over edges until a node that is no edge, or until the path closes.
  static std::vector<CutNode> follow(const std::vector<CutLine>& lines, CutNode start,
                                     CutNode next) {
    std::vector<CutNode> path = {start, next};
    while (path.back() < CutTetrahedron::kFirstFace) {
      const CutNode at = path.back(), before = path[path.size() - 2];
      CutNode after = before;
      for (const CutLine& line : lines)
        for (std::size_t end = 0; end < 2; ++end)
          if (line.nodes[end] == at && line.nodes[1 - end] != before) after = line.nodes[1 - end];
      if (after == start || after == before) break;
      path.push_back(after);
    }
    return path;
  }

  /// One sheet that ends in two faces, or a closed polygon.
  void addPath(const std::vector<CutLine>& lines, CutNode first, const std::vector<CutNode>& rims) {
    const CutNode start = rims.empty() ? first : rims[0];
    for (const CutLine& line : lines)
      for (std::size_t end = 0; end < 2; ++end)
        if (line.nodes[end] == start) {
          addPolygon(follow(lines, start, line.nodes[1 - end]));
          if (!rims.empty()) result_.rims.push_back({rims[0], rims[1]});
          return;
        }
  }

  /// Three sheets along a junction from face to face.
  void addThree(const std::vector<CutLine>& lines, const std::vector<CutNode>& junctions) {
    for (const CutLine& line : lines)
      for (std::size_t end = 0; end < 2; ++end)
        if (line.nodes[end] == junctions[0])
          addPolygon(follow(lines, junctions[0], line.nodes[1 - end]));
    result_.junctions.push_back({{junctions[0], junctions[1]}, oppositeOf(junctions[0])});
  }

  /// All lines joined with a node inside.
  void addFan(const std::vector<CutLine>& lines, const std::vector<CutNode>& rims,
              const std::vector<CutNode>& junctions) {
    result_.hasInside = true;
    result_.isJunctionPoint = junctions.size() > 2;
    for (const CutLine& line : lines)
      addPolygon({line.nodes[0], line.nodes[1], CutTetrahedron::kInside});
    for (const CutNode node : rims) result_.rims.push_back({node, CutTetrahedron::kInside});
    for (const CutNode node : junctions)
      result_.junctions.push_back({{node, CutTetrahedron::kInside}, oppositeOf(node)});
  }

  static std::uint8_t oppositeOf(CutNode face) {
    return static_cast<std::uint8_t>(face - CutTetrahedron::kFirstFace);
  }

  /// Corners of a tetrahedron of a grid cell, in 12ths of it. The other ones are mirrored.
  static V3i cornerPlace(std::uint8_t corner) {
    return {corner > 0 ? 12 : 0, corner > 1 ? 12 : 0, corner > 2 ? 12 : 0};
  }
  static V3i place(CutNode node) {
    if (node == CutTetrahedron::kInside)
      return (cornerPlace(0) + cornerPlace(1) + cornerPlace(2) + cornerPlace(3)) / 4;
    if (node < CutTetrahedron::kFirstFace)
      return (cornerPlace(kCutEdges[node][0]) + cornerPlace(kCutEdges[node][1])) / 2;
    V3i sum(0);
    for (std::uint8_t corner = 0; corner < 4; ++corner)
      if (corner != oppositeOf(node)) sum += cornerPlace(corner);
    return sum / 3;
  }

  void addPolygon(std::vector<CutNode> nodes) {
    // Corners on both sides. Edges that follow each other share a corner, on the same side.
    std::array<std::uint8_t, 2> sides{};
    V3i direction(0);
    bool isFirst = true;
    std::array<std::uint8_t, 2> last{};
    for (const CutNode node : nodes) {
      if (!isEdge(node)) continue;
      std::array<std::uint8_t, 2> ends = kCutEdges[node];
      if (isFirst)
        sides = ends;
      else if (ends[0] == last[1] || ends[1] == last[0])
        std::swap(ends[0], ends[1]);
      isFirst = false;
      last = ends;
      direction += cornerPlace(ends[1]) - cornerPlace(ends[0]);
    }
    V3i normal(0);
    const V3i origin = place(nodes[0]);
    for (std::size_t n = 1; n + 1 < nodes.size(); ++n)
      normal += (place(nodes[n]) - origin).cross(place(nodes[n + 1]) - origin);
    if ((normal ^ direction) < 0) std::reverse(nodes.begin(), nodes.end());
    result_.polygons.push_back({std::move(nodes), sides[0], sides[1]});
  }

  std::uint32_t crossed_;
  bool hasCorner_;
  std::vector<CutLine> lines_;
  std::array<bool, CutTetrahedron::kInside> isDone_{}, isJunction_{};
  CutTetrahedron result_;
};

std::vector<CutTetrahedron> allCuts() {
  std::vector<CutTetrahedron> cuts;
  for (std::uint32_t n = 0; n < 128; ++n)
    cuts.push_back(TetrahedronCutter(n & 63, (n & 64) != 0).run());
  return cuts;
}

}  // namespace

const CutTetrahedron& cutTetrahedron(std::uint32_t crossed, bool hasCorner) {
  static const std::vector<CutTetrahedron> cuts = allCuts();
  return cuts[(crossed & 63) + (hasCorner ? 64 : 0)];
}

}  // namespace levelset
