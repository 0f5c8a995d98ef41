#include "levelset/meshing/front/advancing_front.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>
#include <tuple>

#include "levelset/geometry/perpendicular.h"
#include "levelset/meshing/front/fill_holes.h"
#include "levelset/meshing/front/front_edges.h"

namespace levelset {
namespace {

using Foot = FrontSurface::Foot;
using Imath::V3d;

constexpr double kFullTurn = 2 * std::numbers::pi, kIdealAngle = std::numbers::pi / 3;
constexpr std::uint32_t kNewVertex = 0xffffffffu;

/// Limits of a try. Each edge that gets no triangle is tried again with looser limits.
struct Try {
  double height;       ///< height of the predicted vertex above the edge, share of the ideal one
  double reach;        ///< radius around it for vertices of the front, edge lengths
  double clearance;    ///< least distance of a new vertex from the front, edge lengths
  double leastAngle;   ///< least angle of a triangle, radians
  double leastNormal;  ///< least cosine between the normal of a triangle and those of its vertices
};
constexpr std::array<Try, 5> kTries = {{{1, 1.0, 0.6, 0.45, 0.7},
                                        {0.8, 1.4, 0.5, 0.25, 0.5},
                                        {0.6, 2.0, 0.4, 0.12, 0.3},
                                        {0.4, 2.5, 0.25, 0.05, 0.15},
                                        {0.3, 3.5, 0.15, 0.01, 0.05}}};
// A vertex of the front is preferred to a new one if the angle there is smaller by up to this,
// radians. A larger value closes gaps with fewer, worse triangles.
constexpr double kPreference = 0.2;
// Wedges above this angle are not divided evenly, radians.
constexpr double kOpenWedge = 2.6;
// Edges farther than this from the plane of a triangle belong to another part of the surface, edge
// lengths.
constexpr double kOtherSheet = 0.8;

// Least height of a triangle over an edge along a border, edge lengths. Lower ones lie beyond it.
constexpr double kBorderHeight = 0.3;

// Longest side of a triangle, in the longest edge length.
constexpr double kLongestFrontSide = 2;

/// Returns the counter-clockwise angle from one direction to another about a normal, in [0, 2π).
double turn(const V3d& normal, const V3d& from, const V3d& to) {
  const double angle =
      std::atan2(normal.dot(from.cross(to)), from.dot(to) - from.dot(normal) * to.dot(normal));
  return angle < 0 ? angle + kFullTurn : angle;
}

double angleBetween(const V3d& u, const V3d& v) {
  return std::atan2(u.cross(v).length(), u.dot(v));
}

double distanceToSegment(const V3d& p, const V3d& a, const V3d& b) {
  const V3d along = b - a;
  const double t = std::clamp((p - a).dot(along) / along.length2(), 0.0, 1.0);
  return (p - a - along * t).length();
}

/// Point in the plane of a triangle.
struct Flat {
  double x, y;
};

double cross(const Flat& o, const Flat& p, const Flat& q) {
  return (p.x - o.x) * (q.y - o.y) - (p.y - o.y) * (q.x - o.x);
}

bool segmentsMeet(const Flat& a, const Flat& b, const Flat& c, const Flat& d) {
  const double cOfAb = cross(a, b, c), dOfAb = cross(a, b, d), aOfCd = cross(c, d, a),
               bOfCd = cross(c, d, b);
  return (cOfAb > 0) != (dOfAb > 0) && (aOfCd > 0) != (bOfCd > 0);
}

/// Third vertex for a triangle at an edge of the front.
struct Candidate {
  std::uint32_t vertex = kNewVertex;
  std::uint32_t visit = 0;  ///< edge of the front that begins at the vertex
  V3d point, normal;
  double angle = 0;  ///< angle of the triangle at the vertex, radians
  bool isBorder = false;
};

class AdvancingFront {
 public:
  AdvancingFront(const FrontSurface& surface, const AdvancingFrontOptions& options)
      : surface_(surface),
        options_(options),
        cell_(kLongestFrontSide * options.longest),
        edges_(cell_),
        vertices_(cell_) {}

  bool begin(const V3d& start);
  void begin(const FrontLoops& start);
  FrontMesh run();

 private:
  bool giveTriangle(std::uint32_t edge);
  [[nodiscard]] bool isAlongBorder(std::uint32_t edge, const std::optional<Foot>& foot) const;
  void retryNearby();
  void findCandidates(std::uint32_t edge, const Try& limits);
  [[nodiscard]] double wedgeAtStart(std::uint32_t edge) const;
  [[nodiscard]] double wedgeAtEnd(std::uint32_t edge) const;
  [[nodiscard]] bool isValid(std::uint32_t edge, const Candidate& third, const Try& limits) const;
  [[nodiscard]] bool fitsBetween(std::uint32_t edge, const Candidate& third) const;
  [[nodiscard]] bool isFree(std::uint32_t edge, const Candidate& third) const;
  [[nodiscard]] bool isClear(const Candidate& third, std::uint32_t edge, const Try& limits) const;
  void addTriangle(std::uint32_t edge, const Candidate& third);
  [[nodiscard]] std::vector<std::vector<std::uint32_t>> holes() const;

  /// @param spacing  about the distance to the next vertices
  std::uint32_t addVertex(const V3d& point, const V3d& normal, bool isBorder, double spacing) {
    mesh_.positions.push_back(point);
    mesh_.normals.push_back(normal);
    isBorder_.push_back(isBorder);
    const auto vertex = static_cast<std::uint32_t>(mesh_.positions.size() - 1);
    vertices_.add(vertex, point, spacing);
    return vertex;
  }
  void push(std::uint32_t edge) {
    const FrontEdge& e = edges_[edge];
    queue_.emplace(e.level, (at(e.b) - at(e.a)).length2(), edge);
  }
  std::uint32_t addEdge(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t edge = edges_.add(a, b, at(a), at(b));
    push(edge);
    return edge;
  }
  void useTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh_.triangles.push_back({a, b, c});
    edges_.use(a, b);
    edges_.use(b, c);
    edges_.use(c, a);
  }
  [[nodiscard]] const V3d& at(std::uint32_t vertex) const { return mesh_.positions[vertex]; }
  [[nodiscard]] const V3d& normalAt(std::uint32_t vertex) const { return mesh_.normals[vertex]; }
  [[nodiscard]] bool follows(std::uint32_t edge, std::uint32_t visit) const {
    return edges_[visit].prev == edges_[edge].next;
  }

  const FrontSurface& surface_;
  const AdvancingFrontOptions& options_;
  double cell_;  ///< length of the longest edges
  FrontMesh mesh_;
  std::vector<bool> isBorder_;  ///< for each vertex
  FrontEdges edges_;
  ItemOctree vertices_;
  using Entry = std::tuple<int, double, std::uint32_t>;  ///< tries, squared length, edge
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
  // State for the present edge.
  double length_ = 0;  ///< length of new edges
  std::vector<std::uint32_t> near_;
  std::vector<Candidate> candidates_;
};

bool AdvancingFront::begin(const V3d& start) {
  const auto first = surface_.project(start);
  if (!first) return false;
  const double length = surface_.edgeLength(first->point);
  const V3d along = tangents(first->normal)[1];
  const auto second = surface_.projectBeside(first->point + along * length, first->normal);
  if (!second) return false;
  const V3d across = first->normal.cross(along);
  const auto third = surface_.projectBeside(
      first->point + along * (0.5 * length) + across * (std::sqrt(0.75) * length), first->normal);
  if (!third) return false;
  const V3d normal = (second->point - first->point).cross(third->point - first->point).normalized();
  for (const Foot* foot : {&*first, &*second, &*third}) {
    if (!(normal.dot(foot->normal) > kTries[1].leastNormal)) return false;
    if ((foot->point - first->point).length() > cell_) return false;
    addVertex(foot->point, foot->normal, foot->isBorder, length);
  }
  useTriangle(0, 1, 2);
  const std::uint32_t loop[] = {addEdge(1, 0), addEdge(0, 2), addEdge(2, 1)};
  for (std::size_t i = 0; i < 3; ++i) edges_.link(loop[i], loop[(i + 1) % 3]);
  return true;
}

void AdvancingFront::begin(const FrontLoops& start) {
  for (std::size_t v = 0; v < start.positions.size(); ++v)
    addVertex(start.positions[v], start.normals[v], false, surface_.edgeLength(start.positions[v]));
  for (const std::vector<std::uint32_t>& loop : start.loops) {
    std::vector<std::uint32_t> added;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const std::uint32_t a = loop[i], b = loop[(i + 1) % loop.size()];
      added.push_back(addEdge(a, b));
      edges_.use(b, a);
    }
    for (std::size_t i = 0; i < added.size(); ++i)
      edges_.link(added[i], added[(i + 1) % added.size()]);
  }
}

double AdvancingFront::wedgeAtStart(std::uint32_t edge) const {
  const FrontEdge& e = edges_[edge];
  const V3d& origin = at(e.a);
  const double angle = turn(normalAt(e.a), at(e.b) - origin, at(edges_[e.prev].a) - origin);
  return angle > 0 ? angle : kFullTurn;
}

double AdvancingFront::wedgeAtEnd(std::uint32_t edge) const {
  return wedgeAtStart(edges_[edge].next);
}

/// Returns true if an edge lies along a border of the surface: a new vertex would lie beside it.
bool AdvancingFront::isAlongBorder(std::uint32_t edge, const std::optional<Foot>& foot) const {
  const FrontEdge& e = edges_[edge];
  if (!isBorder_[e.a] || !isBorder_[e.b] || !foot || !foot->isBorder) return false;
  const V3d along = at(e.b) - at(e.a);
  const double height = along.cross(foot->point - at(e.a)).length() / along.length();
  return height < kBorderHeight * length_;
}

/// Finds the candidates for an edge, best ones first.
void AdvancingFront::findCandidates(std::uint32_t edge, const Try& limits) {
  const FrontEdge& e = edges_[edge];
  const V3d a = at(e.a), b = at(e.b), middle = (a + b) * 0.5;
  const double length = (b - a).length();
  const V3d along = (b - a) / length, normal = (normalAt(e.a) + normalAt(e.b)).normalized(),
            across = normal.cross(along).normalized();
  // A long edge gets longer neighbours, and a short one shorter ones, but within limits: else their
  // lengths could grow or shrink from triangle to triangle.
  const double ideal = surface_.edgeLength(middle);
  length_ = std::clamp(std::clamp(ideal, 0.6 * length, 1.6 * length), 0.6 * ideal, 1.5 * ideal);

  // === Predicted vertex. Narrow wedges are divided evenly.
  const auto share = [](double wedge) {
    return wedge > kOpenWedge ? kIdealAngle
                              : wedge / std::max(1.0, std::round(wedge / kIdealAngle));
  };
  const double atStart = share(wedgeAtStart(edge)), atEnd = share(wedgeAtEnd(edge));
  const V3d fromStart = a + (along * std::cos(atStart) + across * std::sin(atStart)) * length_,
            fromEnd = b + (across * std::sin(atEnd) - along * std::cos(atEnd)) * length_;
  const V3d predicted = middle + ((fromStart + fromEnd) * 0.5 - middle) * limits.height;

  // The edges before and after this one may be longer than the reach of the try.
  const double beside =
      std::max((at(edges_[e.prev].a) - middle).length(), (at(edges_[e.next].b) - middle).length());
  near_.clear();
  edges_.near(middle, std::max((limits.reach + 1.5) * length_, beside), near_);
  candidates_.clear();
  const auto foot = surface_.projectBeside(predicted, normal);
  if (isAlongBorder(edge, foot)) {
    edges_.setFinal(edge);
    return;
  }
  const V3d centre = foot ? foot->point : predicted;
  const auto angleAt = [&](const V3d& p) { return angleBetween(a - p, b - p); };
  for (const std::uint32_t other : near_) {
    const FrontEdge& f = edges_[other];
    if (f.a == e.a || f.a == e.b) continue;
    const V3d& p = at(f.a);
    const bool isBeside = other == e.prev || f.prev == e.next;
    if (!isBeside && (p - centre).length() > limits.reach * length_) continue;
    if (normalAt(f.a).dot(normal) < 0.1) continue;
    candidates_.push_back({f.a, other, p, normalAt(f.a), angleAt(p), isBorder_[f.a]});
  }
  if (foot && normal.dot(foot->normal) > 0.1)
    candidates_.push_back(
        {kNewVertex, 0, foot->point, foot->normal, angleAt(foot->point), foot->isBorder});
  const auto rank = [](const Candidate& c) {
    return c.angle + (c.vertex == kNewVertex ? 0 : kPreference);
  };
  std::sort(candidates_.begin(), candidates_.end(), [&](const Candidate& p, const Candidate& q) {
    return std::tuple(-rank(p), p.vertex, p.visit) < std::tuple(-rank(q), q.vertex, q.visit);
  });
}

/// Returns true if the new triangle lies in the part without triangles at each of its vertices.
bool AdvancingFront::fitsBetween(std::uint32_t edge, const Candidate& third) const {
  const FrontEdge& e = edges_[edge];
  const V3d &a = at(e.a), &b = at(e.b), &c = third.point;
  const bool isNew = third.vertex == kNewVertex;
  const bool isPrevious = !isNew && third.visit == e.prev,
             isNext = !isNew && follows(edge, third.visit);
  constexpr double kEdge = 1e-3;
  if (!isPrevious) {
    const double angle = turn(normalAt(e.a), b - a, c - a);
    if (angle < kEdge || angle > wedgeAtStart(edge) - kEdge) return false;
  }
  if (!isNext) {
    const double wedge = wedgeAtEnd(edge),
                 angle = turn(normalAt(e.b), at(edges_[e.next].b) - b, c - b);
    if (angle < kEdge || angle > wedge - kEdge) return false;
  }
  if (isNew) return true;
  // Seen from the third vertex, its loop passes from the edge `visit` to the edge before that one.
  const V3d start = at(edges_[third.visit].b) - c;
  const double wedge = wedgeAtStart(third.visit);
  const double toA = isPrevious ? 0 : turn(third.normal, start, a - c);
  const double toB = isNext ? wedge : turn(third.normal, start, b - c);
  if (!isPrevious && (toA < kEdge || toA > wedge - kEdge)) return false;
  if (!isNext && (toB < kEdge || toB > wedge - kEdge)) return false;
  return toA < toB;
}

/// Returns true if the sides of the new triangle cross no edge of the front, and no vertex of the
/// front lies in the triangle.
bool AdvancingFront::isFree(std::uint32_t edge, const Candidate& third) const {
  const FrontEdge& e = edges_[edge];
  const V3d &a = at(e.a), &b = at(e.b), &c = third.point;
  const V3d normal = (b - a).cross(c - a).normalized(), x = (b - a).normalized(),
            y = normal.cross(x);
  const auto flat = [&](const V3d& p) { return Flat{(p - a).dot(x), (p - a).dot(y)}; };
  const Flat flatA = flat(a), flatB = flat(b), flatC = flat(c);
  const double far = kOtherSheet * length_;
  const auto isOwn = [&](std::uint32_t v) { return v == e.a || v == e.b || v == third.vertex; };
  for (const std::uint32_t other : near_) {
    if (other == edge) continue;
    const FrontEdge& f = edges_[other];
    const V3d &p = at(f.a), &q = at(f.b);
    const bool hasOther =
        (normalAt(f.a).dot(normal) < 0.1 && normalAt(f.b).dot(normal) < 0.1) ||
        (std::abs((p - a).dot(normal)) > far && std::abs((q - a).dot(normal)) > far);
    if (hasOther) continue;
    const Flat flatP = flat(p), flatQ = flat(q);
    if (!isOwn(f.a) && cross(flatA, flatB, flatP) >= 0 && cross(flatB, flatC, flatP) >= 0 &&
        cross(flatC, flatA, flatP) >= 0)
      return false;
    const auto meets = [&](std::uint32_t v, const Flat& from) {
      if (f.a == v || f.b == v || f.a == third.vertex || f.b == third.vertex) return false;
      return segmentsMeet(from, flatC, flatP, flatQ);
    };
    if (meets(e.a, flatA) || meets(e.b, flatB)) return false;
  }
  return true;
}

/// Returns true if a new vertex keeps a distance from the front and from all other vertices.
bool AdvancingFront::isClear(const Candidate& third, std::uint32_t edge, const Try& limits) const {
  const double least = limits.clearance * length_;
  for (const std::uint32_t other : near_) {
    if (other == edge) continue;
    const FrontEdge& f = edges_[other];
    if (normalAt(f.a).dot(third.normal) < 0.1) continue;
    if (distanceToSegment(third.point, at(f.a), at(f.b)) < least) return false;
  }
  // The front must not come back over triangles behind it.
  return !vertices_.anyNear(third.point, least, 0, [&](std::uint32_t vertex) {
    if (normalAt(vertex).dot(third.normal) < 0.1) return false;
    const V3d to = at(vertex) - third.point;
    const double height = to.dot(third.normal);
    return std::abs(height) < least / 2 && to.length2() - height * height < least * least;
  });
}

bool AdvancingFront::isValid(std::uint32_t edge, const Candidate& third, const Try& limits) const {
  const FrontEdge& e = edges_[edge];
  const V3d &a = at(e.a), &b = at(e.b), &c = third.point;
  const double least =
      std::min({third.angle, angleBetween(b - a, c - a), angleBetween(a - b, c - b)});
  if (!(least >= limits.leastAngle)) return false;
  // The search for edges nearby relies on it.
  if (std::max((c - a).length2(), (c - b).length2()) > cell_ * cell_) return false;
  // Three points of a border may lie on a line, beyond which the surface ends.
  if (third.isBorder && isBorder_[e.a] && isBorder_[e.b] && least < kTries[1].leastAngle)
    return false;
  const V3d normal = (b - a).cross(c - a).normalized();
  for (const V3d* n : {&normalAt(e.a), &normalAt(e.b), &third.normal})
    if (!(normal.dot(*n) >= limits.leastNormal)) return false;
  if (third.vertex == kNewVertex) {
    if (!isClear(third, edge, limits)) return false;
  } else {
    const std::uint32_t v = third.vertex;
    const bool isPrevious = third.visit == e.prev, isNext = follows(edge, third.visit);
    if (edges_.isUsed(e.b, v) || edges_.isUsed(v, e.a)) return false;
    if (!isPrevious && edges_.isUsed(e.a, v)) return false;
    if (!isNext && edges_.isUsed(v, e.b)) return false;
  }
  return fitsBetween(edge, third) && isFree(edge, third);
}

void AdvancingFront::addTriangle(std::uint32_t edge, const Candidate& third) {
  const FrontEdge e = edges_[edge];
  const bool isNew = third.vertex == kNewVertex;
  const std::uint32_t c =
      isNew ? addVertex(third.point, third.normal, third.isBorder, length_) : third.vertex;
  const bool isPrevious = !isNew && third.visit == e.prev,
             isNext = !isNew && follows(edge, third.visit);
  useTriangle(e.a, e.b, c);
  // Edges of the front before and after the new ones at the third vertex.
  const std::uint32_t after = isNew ? 0 : third.visit, before = isNew ? 0 : edges_[after].prev;
  edges_.remove(edge);
  if (isPrevious && isNext) {
    edges_.remove(e.prev);
    edges_.remove(e.next);
  } else if (isPrevious) {
    const std::uint32_t added = addEdge(c, e.b);
    edges_.link(before, added);
    edges_.link(added, e.next);
    edges_.remove(e.prev);
  } else if (isNext) {
    const std::uint32_t added = addEdge(e.a, c);
    edges_.link(e.prev, added);
    edges_.link(added, after);
    edges_.remove(e.next);
  } else {
    const std::uint32_t first = addEdge(e.a, c), second = addEdge(c, e.b);
    edges_.link(e.prev, first);
    edges_.link(second, e.next);
    edges_.link(first, isNew ? second : after);
    if (!isNew) edges_.link(before, second);
  }
}

bool AdvancingFront::giveTriangle(std::uint32_t edge) {
  const Try& limits = kTries[static_cast<std::size_t>(edges_[edge].level)];
  findCandidates(edge, limits);
  for (const Candidate& third : candidates_)
    if (isValid(edge, third, limits)) {
      addTriangle(edge, third);
      return true;
    }
  return false;
}

/// Tries the stuck edges near a new triangle again.
void AdvancingFront::retryNearby() {
  for (const std::uint32_t other : near_) {
    if (!edges_[other].isActive || !edges_[other].isStuck) continue;
    edges_.setStuck(other, false);
    push(other);
  }
}

/// Returns the vertices around the holes that are left. Edges along a border bound no hole: the
/// other edges between two of them make a hole with the line between its ends.
std::vector<std::vector<std::uint32_t>> AdvancingFront::holes() const {
  std::vector<std::vector<std::uint32_t>> all;
  std::vector<bool> isSeen(edges_.count());
  for (std::uint32_t edge = 0; edge < edges_.count(); ++edge) {
    if (!edges_[edge].isActive || isSeen[edge]) continue;
    std::uint32_t start = edge;
    do {
      if (edges_[start].isFinal) break;
      start = edges_[start].next;
    } while (start != edge);
    std::vector<std::uint32_t> hole;
    for (std::uint32_t f = start; !isSeen[f]; f = edges_[f].next) {
      isSeen[f] = true;
      hole.push_back(edges_[f].a);
      if (!edges_[f].isFinal) continue;
      if (hole.size() > 2) all.push_back(hole);
      hole.clear();
    }
    if (!edges_[start].isFinal || hole.empty()) {
      if (hole.size() > 2) all.push_back(hole);
      continue;
    }
    hole.push_back(edges_[start].a);
    if (hole.size() > 2) all.push_back(hole);
  }
  return all;
}

FrontMesh AdvancingFront::run() {
  const std::size_t most = 3 * options_.expectedTriangles / 2 + 1000;
  std::size_t tries = 0;
  while (!queue_.empty()) {
    const auto [level, length, edge] = queue_.top();
    queue_.pop();
    if (!edges_[edge].isActive) continue;
    if (++tries % 1024 == 0)
      report(options_.progress, std::min(0.99, static_cast<double>(mesh_.triangles.size()) /
                                                   static_cast<double>(most)));
    if (edges_[edge].isFinal) continue;
    if (giveTriangle(edge)) {
      // A front that winds about itself does not end.
      if (mesh_.triangles.size() > most) return std::move(mesh_);
      retryNearby();
    } else if (edges_[edge].isFinal) {
      continue;
    } else if (level + 1 < static_cast<int>(kTries.size())) {
      edges_.setLevel(edge, level + 1);
      push(edge);
    } else {
      edges_.setStuck(edge, true);
    }
  }
  fillHoles(surface_, holes(), mesh_);
  return std::move(mesh_);
}

}  // namespace

FrontMesh advanceFront(const FrontSurface& surface, const V3d& start,
                       const AdvancingFrontOptions& options) {
  AdvancingFront front(surface, options);
  if (!front.begin(start)) return {};
  return front.run();
}

FrontMesh advanceFront(const FrontSurface& surface, const FrontLoops& start,
                       const AdvancingFrontOptions& options) {
  AdvancingFront front(surface, options);
  front.begin(start);
  return front.run();
}

}  // namespace levelset
