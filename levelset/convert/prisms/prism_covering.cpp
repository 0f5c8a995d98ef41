#include "levelset/convert/prisms/prism_covering.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/geometry/perpendicular.h"

namespace levelset::convert {
namespace {

using Imath::V2d;
using Imath::V3d;
using Imath::V3f;

constexpr std::uint32_t kNoFace = std::numeric_limits<std::uint32_t>::max();
constexpr double kUnbounded = std::numeric_limits<double>::infinity();
/// Height of a triangle, relative to its longest edge, below which its normal is not reliable.
constexpr double kThinFace = 1e-5;
/// Length of the sum of two unit normals below which the faces are folded onto each other.
constexpr double kFolded = 0.1;
/// Sine of the angle between a direction and a face below which the direction counts as parallel.
constexpr double kSteepRay = 0.05;
/// Slope above which a plane is moved outwards by the reach instead.
constexpr double kLargestSlope = 1.5;
/// Tolerance of the comparisons of unit vectors.
constexpr double kUnitError = 1e-9;
/// Generous bounds of the rounding error of planes whose vectors are `float`: a length in voxels,
/// and a part of the reach and of the longest edge.
constexpr double kPlaneMargin = 1e-4, kRelativeMargin = 1e-6;
/// Number of faces at a vertex above which the vertex counts as irregular: the time of its cone
/// grows with the square of this number.
constexpr std::size_t kMostRingFaces = 256;

/// Normal of a triangle and outward directions at its edges, all of unit length.
struct FaceFrame {
  V3d normal{0};
  std::array<V3d, 3> outward{};
  bool isThin = true;
};

FaceFrame faceFrameOf(const std::array<V3d, 3>& corner) {
  FaceFrame frame;
  const V3d cross = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  std::size_t longest = 0;
  std::array<double, 3> squared{};
  for (std::size_t k = 0; k < 3; ++k) {
    squared[k] = (corner[(k + 1) % 3] - corner[k]).length2();
    if (squared[k] > squared[longest]) longest = k;
  }
  const double area = cross.length();
  frame.isThin = !(area > kThinFace * squared[longest]);
  if (frame.isThin) {
    const V3d along = corner[(longest + 1) % 3] - corner[longest];
    frame.normal =
        anyPerpendicular(along.length2() > 0 ? along.normalized() : V3d(1, 0, 0)).normalized();
    for (V3d& outward : frame.outward) outward = V3d(0);
    return frame;
  }
  frame.normal = cross / area;
  for (std::size_t k = 0; k < 3; ++k) {
    const V3d outward = (corner[(k + 1) % 3] - corner[k]).cross(frame.normal);
    frame.outward[k] = outward / outward.length();
  }
  return frame;
}

/// Requirements of the cone at a vertex on the prism of one adjacent face.
struct CornerShare {
  enum class Side : std::uint8_t { None, Front, Back, Whole };
  std::array<float, 3> ratio{};  // outward part over height of the steepest direction, each edge
  Side side = Side::None;
};

/// An arc of directions in a plane, of at most half a turn, from `low` counter-clockwise to `high`.
class Arc {
 public:
  /// Leaves the directions u with g · u ≤ 0.
  void clip(const V2d& g) {
    if (isEmpty_ || g.length2() < kUnitError * kUnitError) return;  // equal directions
    const V2d from(-g.y, g.x), to(g.y, -g.x);  // where g · u turns negative, and positive again
    if (isWhole_) {
      low_ = from, high_ = to, middle_ = -g;
      isWhole_ = false, isHalf_ = true;
      return;
    }
    const double atLow = g.dot(low_), atHigh = g.dot(high_);
    if (isHalf_ && atLow <= 0 && atHigh <= 0) {  // both are 0: the same half plane or the opposite
      isEmpty_ = g.dot(middle_) > 0;
      return;
    }
    if (atLow > 0 && atHigh > 0) isEmpty_ = true;
    if (isEmpty_ || (atLow <= 0 && atHigh <= 0)) return;
    (atLow > 0 ? low_ : high_) = atLow > 0 ? from : to;
    isHalf_ = false;
  }
  [[nodiscard]] bool isEmpty() const { return isEmpty_; }
  /// True when the arc is empty, or so short that the planes' margin exceeds it.
  [[nodiscard]] bool isNegligible() const {
    return isEmpty_ || (!isWide() && low().cross(high()) < kUnitError && low().dot(high()) > 0);
  }
  /// True when no half plane has been clipped, or only one: the cone contains a line.
  [[nodiscard]] bool isWide() const { return isWhole_ || isHalf_; }
  [[nodiscard]] V2d low() const { return low_.normalized(); }
  [[nodiscard]] V2d high() const { return high_.normalized(); }

 private:
  V2d low_{0}, high_{0}, middle_{0};
  bool isWhole_ = true, isHalf_ = false, isEmpty_ = false;
};

/// Builds the prisms of a mesh in passes over its triangles and vertices.
class CoveringBuilder {
 public:
  explicit CoveringBuilder(const LocalMesh& mesh)
      : mesh_(mesh),
        frames_(mesh.triangles.size()),
        neighbours_(mesh.triangles.size()),
        shares_(mesh.triangles.size()) {
    collectCorners();
    forTriangles([&](std::uint32_t t) {
      frames_[t] = faceFrameOf({mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2)});
    });
    forTriangles([&](std::uint32_t t) {
      for (std::uint32_t k = 0; k < 3; ++k) neighbours_[t][k] = neighbourAcross(t, k);
    });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.points.size()),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        Ring ring;
                        for (std::size_t v = range.begin(); v < range.end(); ++v)
                          shareCone(static_cast<std::uint32_t>(v), ring);
                      });
  }

  /// @return true when the prism is the whole neighbourhood of the triangle
  bool build(std::uint32_t t, double reach, PrismCovering::Prism& prism) const {
    const FaceFrame& frame = frames_[t];
    bool isWhole = frame.isThin;
    for (const CornerShare& share : shares_[t])
      isWhole = isWhole || share.side == CornerShare::Side::Whole;
    std::array<double, 3> front{}, back{};  // slopes
    if (isWhole) {
      front.fill(kUnbounded);
      back.fill(kUnbounded);
    } else {
      for (std::size_t k = 0; k < 3; ++k) addEdge(t, k, front, back);
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const CornerShare& share = shares_[t][corner];
        if (share.side == CornerShare::Side::None) continue;
        std::array<double, 3>& slopes = share.side == CornerShare::Side::Front ? front : back;
        const std::size_t opposite = (corner + 1) % 3;
        const double height =
            (mesh_.corner(t, opposite) - mesh_.corner(t, corner)).dot(frame.outward[opposite]);
        for (std::size_t k = 0; k < 3; ++k) {
          const double slope = share.ratio[k] - (k == opposite ? height / reach : 0);
          slopes[k] = std::max(slopes[k], slope);
        }
      }
    }
    setHalf(front, reach, prism.front);
    setHalf(back, reach, prism.back);
    prism.normal = V3f(frame.normal);
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      prism.outward[k] = V3f(frame.outward[k]);
      longest = std::max(longest, (mesh_.corner(t, (k + 1) % 3) - mesh_.corner(t, k)).length());
    }
    const double relative = frame.isThin ? kThinFace : kRelativeMargin;
    prism.margin = static_cast<float>(kPlaneMargin + kRelativeMargin * reach + relative * longest);
    return isWhole;
  }

 private:
  struct Ring {
    std::vector<std::uint32_t> faces, corners;  // counter-clockwise; index of the vertex in a face
    std::vector<V3d> spokes;                    // direction to the vertex after it in each face
    std::vector<Arc> arcs;
    std::vector<std::array<V3d, 2>> axes;  // of the plane of each arc
  };

  template <typename F>
  void forTriangles(const F& f) const {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh_.triangles.size()),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t t = range.begin(); t < range.end(); ++t)
                          f(static_cast<std::uint32_t>(t));
                      });
  }

  static void setHalf(const std::array<double, 3>& slopes, double reach,
                      PrismCovering::Half& half) {
    for (std::size_t k = 0; k < 3; ++k) {
      const bool isMoved = slopes[k] > kLargestSlope;
      half.slope[k] = isMoved ? 0 : static_cast<float>(slopes[k]);
      half.shift[k] = isMoved ? static_cast<float>(reach) : 0;
    }
  }

  /// Lists the corners of triangles at each vertex: corner k of triangle t as 3 t + k.
  void collectCorners() {
    first_.assign(mesh_.points.size() + 1, 0);
    for (const Triangle& t : mesh_.triangles)
      for (const std::uint32_t v : t) ++first_[v + 1];
    for (std::size_t v = 0; v < mesh_.points.size(); ++v) first_[v + 1] += first_[v];
    corners_.resize(3 * mesh_.triangles.size());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        corners_[next[mesh_.triangles[t][k]]++] = static_cast<std::uint32_t>(3 * t + k);
  }

  /// Returns the triangle that traverses edge k of t in the opposite direction, if the edge has no
  /// other faces.
  std::uint32_t neighbourAcross(std::uint32_t t, std::uint32_t k) const {
    const std::uint32_t from = mesh_.triangles[t][k], to = mesh_.triangles[t][(k + 1) % 3];
    const auto count = [&](std::uint32_t v) { return first_[v + 1] - first_[v]; };
    const std::uint32_t at = count(from) <= count(to) ? from : to, other = at == from ? to : from;
    std::uint32_t result = kNoFace;
    for (std::size_t i = first_[at]; i < first_[at + 1]; ++i) {
      const std::uint32_t face = corners_[i] / 3, corner = corners_[i] % 3;
      if (face == t) continue;
      const Triangle& vertices = mesh_.triangles[face];
      const bool isNext = vertices[(corner + 1) % 3] == other,
                 isLast = vertices[(corner + 2) % 3] == other;
      if (!isNext && !isLast) continue;
      const bool isOpposite = at == to ? isNext : isLast;
      if (result != kNoFace || !isOpposite) return kNoFace;
      result = face;
    }
    return result;
  }

  /// Adds to the slopes the wedge of points that edge k is closest to.
  void addEdge(std::uint32_t t, std::size_t k, std::array<double, 3>& front,
               std::array<double, 3>& back) const {
    const FaceFrame& frame = frames_[t];
    const std::uint32_t other = neighbours_[t][k];
    if (other != kNoFace && frames_[other].isThin) return;  // the neighbour covers the whole wedge
    const V3d bisector = other == kNoFace ? V3d(0) : frame.normal + frames_[other].normal;
    if (bisector.length() < kFolded) {
      for (std::size_t j = 0; j < 3; ++j)
        if (j == k || frame.outward[k].dot(frame.outward[j]) > kUnitError)
          front[j] = back[j] = kUnbounded;
      return;
    }
    const double height = bisector.dot(frame.normal), across = bisector.dot(frame.outward[k]);
    const double ratio = across / height;
    // The wedge is in front of the face if the edge is convex, and else behind it.
    std::array<double, 3>& slopes = across > 0 ? front : back;
    for (std::size_t j = 0; j < 3; ++j)
      slopes[j] = std::max(slopes[j],
                           std::abs(ratio) * (j == k ? 1 : frame.outward[k].dot(frame.outward[j])));
  }

  /// Finds the faces around a vertex. Returns false unless they form one closed ring of regular
  /// faces.
  bool findRing(std::uint32_t vertex, Ring& ring) const {
    ring.faces.clear();
    ring.corners.clear();
    ring.spokes.clear();
    const std::size_t count = first_[vertex + 1] - first_[vertex];
    if (count < 3 || count > kMostRingFaces) return false;
    const std::uint32_t start = corners_[first_[vertex]] / 3;
    std::uint32_t face = start, corner = corners_[first_[vertex]] % 3;
    do {
      if (frames_[face].isThin || ring.faces.size() == count) return false;
      ring.faces.push_back(face);
      ring.corners.push_back(corner);
      const V3d spoke = mesh_.corner(face, (corner + 1) % 3) - mesh_.points[vertex];
      ring.spokes.push_back(spoke / spoke.length());
      face = neighbours_[face][(corner + 2) % 3];
      if (face == kNoFace) return false;
      corner = 0;
      while (mesh_.triangles[face][corner] != vertex) ++corner;
    } while (face != start);
    return ring.faces.size() == count;
  }

  /// Divides the cone of points that a vertex is closest to, {p : spoke · p ≤ 0 for all spokes},
  /// between the adjacent faces. The cone is bounded by arcs of the planes perpendicular to spokes.
  /// With an axis inside the cone, each arc spans a sector, which the two faces at the spoke share.
  void shareCone(std::uint32_t vertex, Ring& ring) {
    if (first_[vertex] == first_[vertex + 1]) return;
    if (!findRing(vertex, ring)) return markWhole(vertex);
    const std::size_t count = ring.faces.size();
    ring.arcs.assign(count, Arc());
    ring.axes.resize(count);
    V3d axis(0);
    for (std::size_t j = 0; j < count; ++j) {
      const V3d bisector =
          frames_[ring.faces[j]].normal + frames_[ring.faces[(j + count - 1) % count]].normal;
      if (bisector.length() < kFolded) return markWhole(vertex);
      const V3d u = bisector.normalized(), v = ring.spokes[j].cross(u);
      ring.axes[j] = {u, v};
      Arc& arc = ring.arcs[j];
      for (std::size_t i = 0; i < count && !arc.isEmpty(); ++i)
        if (i != j) arc.clip(V2d(ring.spokes[i].dot(u), ring.spokes[i].dot(v)));
      if (arc.isNegligible()) continue;
      if (arc.isWide()) return markWhole(vertex);
      axis += direction(ring, j, arc.low()) + direction(ring, j, arc.high());
    }
    if (axis.length() < kUnitError) return;  // no cone, or one without an inside
    axis.normalize();
    for (std::size_t j = 0; j < count; ++j) {
      const Arc& arc = ring.arcs[j];
      if (arc.isNegligible()) continue;
      // Directions on the side of v belong to the face before the spoke.
      const V2d low = arc.low(), high = arc.high();
      const std::size_t before = (j + count - 1) % count;
      if (low.y >= 0 && high.y >= 0) {
        addSector(ring, before, axis, direction(ring, j, low), direction(ring, j, high));
      } else if (low.y <= 0 && high.y <= 0) {
        addSector(ring, j, axis, direction(ring, j, low), direction(ring, j, high));
      } else {
        const V3d middle = ring.axes[j][0] * (low.x + high.x > 0 ? 1 : -1);
        addSector(ring, low.y > 0 ? before : j, axis, direction(ring, j, low), middle);
        addSector(ring, low.y > 0 ? j : before, axis, middle, direction(ring, j, high));
      }
    }
  }

  static V3d direction(const Ring& ring, std::size_t j, const V2d& inPlane) {
    return ring.axes[j][0] * inPlane.x + ring.axes[j][1] * inPlane.y;
  }

  void addSector(const Ring& ring, std::size_t i, const V3d& axis, const V3d& from, const V3d& to) {
    const FaceFrame& frame = frames_[ring.faces[i]];
    CornerShare& share = shares_[ring.faces[i]][ring.corners[i]];
    if (share.side == CornerShare::Side::Whole) return;
    const double side = axis.dot(frame.normal) < 0 ? -1 : 1;
    share.side = side > 0 ? CornerShare::Side::Front : CornerShare::Side::Back;
    for (const V3d& ray : {axis, from, to}) {
      const double height = side * ray.dot(frame.normal);
      if (height < -kUnitError) share.side = CornerShare::Side::Whole;
      for (std::size_t k = 0; k < 3; ++k) {
        const double across = ray.dot(frame.outward[k]);
        double ratio = height > kSteepRay ? across / height : 0;
        if (height <= kSteepRay && across > kUnitError) ratio = kUnbounded;
        share.ratio[k] = std::max(share.ratio[k], static_cast<float>(ratio));
      }
    }
  }

  /// Makes the prism of one face at an irregular vertex whole. It then contains all points that the
  /// vertex is closest to.
  void markWhole(std::uint32_t vertex) {
    for (std::size_t i = first_[vertex]; i < first_[vertex + 1]; ++i)
      if (frames_[corners_[i] / 3].isThin) return;  // it is whole already
    const std::uint32_t corner = corners_[first_[vertex]];
    shares_[corner / 3][corner % 3].side = CornerShare::Side::Whole;
  }

  const LocalMesh& mesh_;
  std::vector<std::size_t> first_;  // of each vertex in corners_
  std::vector<std::uint32_t> corners_;
  std::vector<FaceFrame> frames_;
  std::vector<std::array<std::uint32_t, 3>> neighbours_;  // across each edge; kNoFace: irregular
  std::vector<std::array<CornerShare, 3>> shares_;
};

}  // namespace

PrismCovering::PrismCovering(const LocalMesh& mesh, double reach)
    : reach_(reach), prisms_(mesh.triangles.size()) {
  const CoveringBuilder builder(mesh);
  std::vector<char> isWhole(prisms_.size());
  tbb::parallel_for(std::size_t{0}, prisms_.size(), [&](std::size_t t) {
    isWhole[t] = builder.build(static_cast<std::uint32_t>(t), reach, prisms_[t]);
  });
  whole_ = static_cast<std::size_t>(std::count(isWhole.begin(), isWhole.end(), 1));
}

PrismPlanes::PrismPlanes(const std::array<V3d, 3>& corners, const PrismCovering::Prism& prism,
                         double reach)
    : prism_(&prism),
      reach_(reach),
      slack_(static_cast<double>(prism.margin)),
      normal_(prism.normal),
      level_(normal_.dot(corners[0])) {
  for (std::size_t k = 0; k < 3; ++k) {
    outward_[k] = V3d(prism.outward[k]);
    edgeLevel_[k] = outward_[k].dot(corners[k]);
  }
}

PrismPlanes::HalfPlanes PrismPlanes::half(bool isFront) const {
  const double side = isFront ? 1 : -1;
  const PrismCovering::Half& half = isFront ? prism_->front : prism_->back;
  HalfPlanes planes;
  planes[0] = {normal_ * -side, slack_ - side * level_};
  planes[1] = {normal_ * side, reach_ + slack_ + side * level_};
  for (std::size_t k = 0; k < 3; ++k) {
    const double slope = side * static_cast<double>(half.slope[k]);
    planes[2 + k] = {outward_[k] - normal_ * slope,
                     edgeLevel_[k] - slope * level_ + static_cast<double>(half.shift[k]) + slack_};
  }
  return planes;
}

bool PrismPlanes::contains(const V3d& point) const {
  for (const bool isFront : {true, false}) {
    const HalfPlanes planes = half(isFront);
    if (std::all_of(planes.begin(), planes.end(),
                    [&](const Plane& plane) { return plane.normal.dot(point) <= plane.limit; }))
      return true;
  }
  return false;
}

bool PrismPlanes::mayTouch(const V3d& centre, double halfEdge) const {
  const auto across = [&](const V3d& v) {
    return halfEdge * (std::abs(v.x) + std::abs(v.y) + std::abs(v.z));
  };
  const double height = normal_.dot(centre) - level_, radius = across(normal_) + slack_;
  if (std::abs(height) > reach_ + radius) return false;
  for (const bool isFront : {true, false}) {
    const double side = isFront ? 1 : -1;
    if (side * height < -radius) continue;
    const PrismCovering::Half& half = isFront ? prism_->front : prism_->back;
    bool touches = true;
    for (std::size_t k = 0; k < 3 && touches; ++k) {
      const double slope = side * static_cast<double>(half.slope[k]);
      const V3d lean = outward_[k] - normal_ * slope;
      touches = outward_[k].dot(centre) - edgeLevel_[k] - slope * height -
                    static_cast<double>(half.shift[k]) <=
                across(lean) + slack_;
    }
    if (touches) return true;
  }
  return false;
}

}  // namespace levelset::convert
