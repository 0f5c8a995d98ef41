#include "levelset/eikonal/sharp_patches.h"

#include <openvdb/tools/Morphology.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <unordered_map>

#include "levelset/eikonal/interpolant.h"
#include "levelset/meshing/sharp_surface.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;

// Second differences of unit slope beyond which a grid point may lie beside an edge, voxels.
constexpr double kSharpBend = 0.15;
// The interpolant of a cell sees an edge up to this many cells away, and the bisectors of its
// faces.
constexpr int kZone = 3;
// Of a feature: largest distance from the planes of its faces, voxels.
constexpr double kMisfit = 0.1;
// Between these distances from a feature, in voxels, the surface must be as flat as its faces …
constexpr double kRingBegin = 0.8, kRingEnd = 2.3;
// … which is when all but this part of it turns away from them by less than this part of the angle
// between them. On a round surface the normal goes on turning.
constexpr double kOddPart = 0.15, kTurn = 0.35;
// Edges that end this near to each other, in voxels, end in one corner, …
constexpr double kCornerRing = 2.7;
// … which is at most this far from one of them, …
constexpr double kCornerReach = 1.3;
// … if their faces do not meet in a line: determinant of the faces' matrix, 1 for a cube's.
constexpr double kCornerDeterminant = 0.05;
constexpr double kOneCorner = 0.8;  // tips nearer than this are the same corner, voxels
constexpr double kOneNormalCosine = 0.96;
// Between features of one edge, voxels; and how far beside it a vertex may be that fills the gap.
constexpr double kShortestGap = 0.7, kLongestGap = 3, kBesideEdge = 0.9;

/// Is there a sharp bend at a grid point beside the surface?
bool bends(const DenseBlock& block, double limit) {
  constexpr int kSteps[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) {
        const float here = block.at(x, y, z);
        float bend = 0;
        bool beside = false;
        for (const auto& s : kSteps) {
          const float a = block.at(x - s[0], y - s[1], z - s[2]),
                      b = block.at(x + s[0], y + s[1], z + s[2]);
          beside = beside || (a < 0) != (here < 0) || (b < 0) != (here < 0);
          bend = std::max(bend, std::abs(a + b - 2 * here));
        }
        if (beside && static_cast<double>(bend) > limit) return true;
      }
  return false;
}

/// The leaves where the field bends beside the surface, and all around them.
FloatGrid::Ptr bentPart(const FloatGrid& field, const std::optional<CoordBBox>& within) {
  std::vector<const LeafNode*> leaves;
  for (auto it = field.tree().cbeginLeaf(); it; ++it)
    if (!within || within->hasOverlap(it->getNodeBoundingBox())) leaves.push_back(it.getLeaf());
  std::vector<char> isBent(leaves.size(), 0);
  const double limit = kSharpBend * field.voxelSize()[0];
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
    const FloatGrid::ConstAccessor accessor(field.tree());
    const auto block = std::make_unique<DenseBlock>();
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      block->load(accessor, leaves[i]->origin());
      isBent[i] = bends(*block, limit);
    }
  });
  auto part = FloatGrid::create(field.background());
  part->setTransform(field.transform().copy());
  auto target = part->getAccessor();
  auto source = field.getConstAccessor();
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    if (!isBent[i]) continue;
    for (int k = 0; k < 27; ++k) {
      const Coord origin =
          leaves[i]->origin().offsetBy(8 * (k / 9 - 1), 8 * (k / 3 % 3 - 1), 8 * (k % 3 - 1));
      if (target.probeConstLeaf(origin)) continue;
      if (const LeafNode* leaf = source.probeConstLeaf(origin))
        target.addLeaf(new LeafNode(*leaf));
      else
        target.addTile(1, origin, source.getValue(origin), false);
    }
  }
  return part;
}

/// The triangles at each vertex of a mesh.
class Fans {
 public:
  explicit Fans(const IndexMesh& mesh) : begin_(mesh.positions.size() + 1) {
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t v : triangle) ++begin_[v + 1];
    for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
    triangles_.resize(mesh.triangles.size() * 3);
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      for (const std::uint32_t v : mesh.triangles[t]) triangles_[next[v]++] = t;
  }
  [[nodiscard]] std::span<const std::uint32_t> at(std::uint32_t vertex) const {
    return {triangles_.data() + begin_[vertex], begin_[vertex + 1] - begin_[vertex]};
  }

 private:
  std::vector<std::size_t> begin_;
  std::vector<std::uint32_t> triangles_;
};

/// Triangles connected to a vertex and nearer than `radius`.
std::vector<std::uint32_t> trianglesNear(const SharpMesh& mesh, const Fans& fans,
                                         std::uint32_t vertex, double radius) {
  const Vec3d centre = mesh.positions[vertex];
  std::vector<std::uint32_t> vertices{vertex}, found;
  for (std::size_t i = 0; i < vertices.size(); ++i)
    for (const std::uint32_t t : fans.at(vertices[i])) {
      if (std::find(found.begin(), found.end(), t) != found.end()) continue;
      found.push_back(t);
      for (const std::uint32_t v : mesh.triangles[t])
        if ((mesh.positions[v] - centre).lengthSqr() < radius * radius &&
            std::find(vertices.begin(), vertices.end(), v) == vertices.end())
          vertices.push_back(v);
    }
  return found;
}

/// Finds the corners in whose cell no value changes its sign, so that the mesh has no vertex there:
/// the tip where the faces of edges that end beside each other meet. The nearest of their vertices
/// is moved to it, along its own edge; the triangles beyond then lie in the third face.
class Corners {
 public:
  Corners(SharpMesh& mesh, const Fans& fans) : mesh_(mesh), fans_(fans) {
    for (std::uint32_t i = 0; i < mesh.features.size(); ++i)
      featureOf_[mesh.features[i].vertex] = i;
  }

  void run() {
    std::vector<Tip> tips(mesh_.features.size());
    tbb::parallel_for(std::size_t{0}, tips.size(),
                      [&](std::size_t i) { tips[i] = find(mesh_.features[i]); });
    // All around a corner find it, each a little elsewhere: the nearest vertex is moved.
    std::vector<std::pair<double, std::size_t>> nearest;
    for (std::size_t i = 0; i < tips.size(); ++i)
      if (tips[i].found)
        nearest.emplace_back((tips[i].position - mesh_.positions[tips[i].feature.vertex]).length(),
                             i);
    std::sort(nearest.begin(), nearest.end());
    Taken taken;
    for (const auto& [distance, i] : nearest) {
      if (isTaken(taken, tips[i].position)) continue;
      taken[Coord::floor(tips[i].position)].push_back(tips[i].position);
      mesh_.positions[mesh_.features[i].vertex] = tips[i].position;
      mesh_.features[i] = tips[i].feature;
    }
  }

 private:
  struct Tip {
    bool found = false;
    Vec3d position;
    SharpFeature feature;
  };

  using Taken = std::unordered_map<Coord, std::vector<Vec3d>, std::hash<Coord>>;
  static bool isTaken(const Taken& taken, const Vec3d& tip) {
    for (int k = 0; k < 27; ++k) {
      const auto cell = taken.find(Coord::floor(tip).offsetBy(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1));
      if (cell == taken.end()) continue;
      for (const Vec3d& other : cell->second)
        if ((other - tip).lengthSqr() < kOneCorner * kOneCorner) return true;
    }
    return false;
  }

  [[nodiscard]] std::vector<std::uint32_t> featuresNear(std::uint32_t vertex) const {
    std::vector<std::uint32_t> found;
    for (const std::uint32_t t : trianglesNear(mesh_, fans_, vertex, kCornerRing))
      for (const std::uint32_t v : mesh_.triangles[t]) {
        const auto feature = featureOf_.find(v);
        if (feature != featureOf_.end() &&
            std::find(found.begin(), found.end(), feature->second) == found.end())
          found.push_back(feature->second);
      }
    return found;
  }

  [[nodiscard]] Tip find(const SharpFeature& feature) const {
    Tip tip;
    const Vec3d start = mesh_.positions[feature.vertex];
    const std::vector<std::uint32_t> around = featuresNear(feature.vertex);
    std::vector<std::pair<Vec3d, double>> faces;  // offsets from `start`
    for (const std::uint32_t i : around) {
      const SharpFeature& other = mesh_.features[i];
      if (other.misfit > kMisfit) continue;
      for (std::size_t k = 0; k < other.normalCount; ++k)
        addFace(faces, other.normals[k],
                other.normals[k].dot(mesh_.positions[other.vertex] - start));
    }
    if (faces.size() < 3 || faces.size() > tip.feature.normals.size()) return tip;
    const std::optional<Vec3d> meeting = intersect(faces);
    if (!meeting || meeting->length() > kCornerReach) return tip;
    tip.position = start + *meeting;
    tip.feature.vertex = feature.vertex;
    for (const auto& [normal, offset] : faces) {
      tip.feature.normals[tip.feature.normalCount++] = normal;
      tip.feature.misfit = std::max(tip.feature.misfit, std::abs(normal.dot(*meeting) - offset));
    }
    tip.found = tip.feature.misfit <= kMisfit;
    return tip;
  }

  static void addFace(std::vector<std::pair<Vec3d, double>>& faces, const Vec3d& normal,
                      double offset) {
    for (const auto& [other, otherOffset] : faces)
      if (other.dot(normal) > kOneNormalCosine) return;
    faces.emplace_back(normal, offset);
  }

  static std::optional<Vec3d> intersect(const std::vector<std::pair<Vec3d, double>>& faces) {
    openvdb::math::Mat3d matrix = openvdb::math::Mat3d::zero();
    Vec3d right(0);
    for (const auto& [n, offset] : faces) {
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) matrix[r][c] += n[r] * n[c];
      right += n * offset;
    }
    if (matrix.det() < kCornerDeterminant) return {};
    return matrix.inverse() * right;
  }

  SharpMesh& mesh_;
  const Fans& fans_;
  std::unordered_map<std::uint32_t, std::uint32_t> featureOf_;  ///< by vertex
};

/// Fills gaps along edges: a cell on an edge that shows one of the two faces only has its vertex on
/// that face, and the triangles there cut the edge off. Of the vertices beside a gap between two
/// features of one edge, the nearest is moved onto the edge, which leaves its triangles in the
/// faces.
class EdgeGaps {
 public:
  EdgeGaps(SharpMesh& mesh, const Fans& fans) : mesh_(mesh), fans_(fans) {
    for (std::uint32_t i = 0; i < mesh.features.size(); ++i)
      featureOf_[mesh.features[i].vertex] = i;
  }

  void run() {
    std::vector<Move> moves(mesh_.features.size());
    tbb::parallel_for(std::size_t{0}, moves.size(),
                      [&](std::size_t i) { moves[i] = find(mesh_.features[i]); });
    for (std::size_t i = 0; i < moves.size(); ++i) {
      if (!moves[i].found || featureOf_.count(moves[i].vertex)) continue;
      mesh_.positions[moves[i].vertex] = moves[i].position;
      featureOf_[moves[i].vertex] = static_cast<std::uint32_t>(mesh_.features.size());
      SharpFeature feature = mesh_.features[i];
      feature.vertex = moves[i].vertex;
      mesh_.features.push_back(feature);
    }
  }

 private:
  struct Move {
    bool found = false;
    std::uint32_t vertex = 0;
    Vec3d position;
  };

  [[nodiscard]] bool isOnSameEdge(const SharpFeature& edge, const SharpFeature& other) const {
    if (other.misfit > kMisfit) return false;
    for (std::size_t i = 0; i < 2; ++i) {
      const auto last = other.normals.begin() + static_cast<std::ptrdiff_t>(other.normalCount);
      if (std::none_of(other.normals.begin(), last,
                       [&](const Vec3d& n) { return n.dot(edge.normals[i]) > kOneNormalCosine; }))
        return false;
    }
    return true;
  }

  /// The gap that begins at a feature, in the direction of the cross product of its faces.
  [[nodiscard]] Move find(const SharpFeature& edge) const {
    if (edge.normalCount != 2 || edge.misfit > kMisfit) return {};
    const Vec3d start = mesh_.positions[edge.vertex];
    const Vec3d along = edge.normals[0].cross(edge.normals[1]).unit();
    const std::vector<std::uint32_t> triangles =
        trianglesNear(mesh_, fans_, edge.vertex, kLongestGap);
    double gap = kLongestGap;
    forEachVertex(triangles, [&](std::uint32_t v) {
      const auto feature = featureOf_.find(v);
      if (feature == featureOf_.end() || !isOnSameEdge(edge, mesh_.features[feature->second]))
        return;
      const double ahead = (mesh_.positions[v] - start).dot(along);
      if (ahead > 1e-3) gap = std::min(gap, ahead);
    });
    if (gap < kShortestGap || gap == kLongestGap) return {};
    Move move;
    double best = kBesideEdge;
    forEachVertex(triangles, [&](std::uint32_t v) {
      if (featureOf_.count(v)) return;
      const Vec3d offset = mesh_.positions[v] - start;
      const double ahead = offset.dot(along), beside = (offset - along * ahead).length();
      if (ahead < gap / 6 || ahead > gap * 5 / 6 ||
          std::pair(beside, v) >= std::pair(best, move.found ? move.vertex : 0u))
        return;
      best = beside;
      move = {true, v, start + along * ahead};
    });
    return move;
  }

  template <typename Visit>
  void forEachVertex(const std::vector<std::uint32_t>& triangles, const Visit& visit) const {
    for (const std::uint32_t t : triangles)
      for (const std::uint32_t v : mesh_.triangles[t]) visit(v);
  }

  SharpMesh& mesh_;
  const Fans& fans_;
  std::unordered_map<std::uint32_t, std::uint32_t> featureOf_;  ///< by vertex
};

/// Does the surface around a feature lie in the planes of its faces?
bool isConfirmed(const SharpMesh& mesh, const Fans& fans, const SharpFeature& feature) {
  if (feature.misfit > kMisfit) return false;
  double widest = 1;
  for (std::size_t i = 0; i < feature.normalCount; ++i)
    for (std::size_t j = 0; j < i; ++j)
      widest = std::min(widest, feature.normals[i].dot(feature.normals[j]));
  const double turn = std::cos(kTurn * std::acos(std::max(-1.0, widest)));
  double area = 0, odd = 0;
  for (const std::uint32_t t : trianglesNear(mesh, fans, feature.vertex, kRingEnd)) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3d p = mesh.positions[a];
    const Vec3d middle = (p + mesh.positions[b] + mesh.positions[c]) / 3;
    if ((middle - mesh.positions[feature.vertex]).length() < kRingBegin) continue;
    const Vec3d normal = (mesh.positions[b] - p).cross(mesh.positions[c] - p);
    const double size = normal.length();
    double best = -1;
    for (std::size_t i = 0; i < feature.normalCount; ++i)
      best = std::max(best, std::abs(normal.dot(feature.normals[i])));
    area += size;
    if (best < turn * size) odd += size;
  }
  return odd <= kOddPart * area;
}

}  // namespace

SharpPatches::SharpPatches(const FloatGrid& field, const std::optional<CoordBBox>& within) {
  const FloatGrid::Ptr part = bentPart(field, within);
  if (part->tree().leafCount() == 0) return;
  const CellSurface surface(*part);
  SharpMesh mesh = sharpSurface(surface, *part);
  const Fans fans(mesh);
  Corners(mesh, fans).run();
  EdgeGaps(mesh, fans).run();

  // === Where an edge is sure
  std::vector<char> confirmed(mesh.features.size(), 0);
  tbb::parallel_for(std::size_t{0}, confirmed.size(), [&](std::size_t i) {
    confirmed[i] = isConfirmed(mesh, fans, mesh.features[i]);
  });
  for (std::size_t i = 0; i < confirmed.size(); ++i)
    if (confirmed[i]) zone_.setValueOn(Coord::floor(mesh.positions[mesh.features[i].vertex]));
  if (zone_.empty()) return;
  openvdb::tools::dilateActiveValues(zone_, kZone, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::IGNORE_TILES);

  // === What is used there
  border_.topologyUnion(zone_);
  openvdb::tools::dilateActiveValues(border_, 1, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::IGNORE_TILES);
  for (const SharpFeature& feature : mesh.features) {
    const Vec3d position = mesh.positions[feature.vertex];
    if (zone_.isValueOn(Coord::floor(position))) features_.push_back(position);
  }
  const openvdb::tree::ValueAccessor<const openvdb::MaskTree> zone(zone_);
  std::vector<TriangleTree::Triangle> triangles;
  for (const auto& [a, b, c] : mesh.triangles) {
    const TriangleTree::Triangle t{mesh.positions[a], mesh.positions[b], mesh.positions[c]};
    if (std::any_of(t.begin(), t.end(),
                    [&](const Vec3d& p) { return zone.isValueOn(Coord::floor(p)); }))
      triangles.push_back(t);
  }
  surface_ = TriangleTree(std::move(triangles));
}

}  // namespace levelset::eikonal
