#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "levelset/deform/cage/cage.h"
#include "levelset/deform/cage/cage_bounds.h"
#include "levelset/deform/cage/cage_kernels.h"
#include "levelset/deform/cage/domain_cells.h"
#include "levelset/geometry/closest_on_triangle.h"
#include "levelset/mesh_sign/self_intersections.h"

namespace levelset {
namespace {

using cage::BallBounds;
using cage::DomainCells;
using Imath::V3d;

/// Boxes are halved until the lower bound is at least this share of the least value found.
constexpr double kBracket = 0.25;
/// Limits of the halvings and of the boxes that are bounded.
constexpr int kMostCageLevels = DomainCells::kLevels + 6;
constexpr std::size_t kMostCageBoxes = 300'000;
/// Memory of a box and of the eight that it becomes.
constexpr std::size_t kBytesOfHalved = 9 * sizeof(DomainCells::Cube);
/// Level from which a box that reaches the cage is too close to it.
constexpr int kNearCageLevel = DomainCells::kLevels + 3;
/// Largest distance between the image of a result and the position, over the diagonal of the cage.
constexpr double kCageResidual = 1e-11;
// Steps shrink by a factor of up to 0.85 in boxes where the map stretches one direction most.
constexpr int kLeafSteps = 300;

/// A box of the octree in which the map is proven to be injective.
struct CageLeaf {
  V3d centre, image;
  double edge = 0;
  double reach = 0;  ///< radius of a ball around `image` that contains the image of the box
};

class CageInverse final : public DeformationInverse {
 public:
  CageInverse(const CageDeformation& cage, DomainCells cells, std::vector<CageLeaf> leaves)
      : cage_(cage), cells_(std::move(cells)), leaves_(std::move(leaves)) {
    Imath::Box3d box;
    for (const V3d& p : cage.rest()) box.extendBy(p);
    size_ = box.size().length();
    box.extendBy(cage.bounds());
    tolerance_ = kCageResidual * box.size().length();
  }

  [[nodiscard]] std::optional<V3d> near(const V3d& position, const V3d& guess) const override {
    const auto found = NewtonInverse{tolerance_, tolerance_, 0.1 * size_}.find(
        [&](const V3d& p) { return cage_.jet(p); }, position, guess);
    if (found && cells_.contains(*found)) return found;
    // All boxes whose images may contain the position. In such a box the Jacobian differs from that
    // at the centre by less than its least stretch, so the iteration converges if there is a point.
    for (const CageLeaf& leaf : leaves_) {
      if (!((position - leaf.image).length2() <= leaf.reach * leaf.reach)) continue;
      if (const auto inside = inLeaf(leaf, position)) return inside;
    }
    return {};
  }

 private:
  /// Newton's method with the Jacobian at the centre of the box.
  [[nodiscard]] std::optional<V3d> inLeaf(const CageLeaf& leaf, const V3d& position) const {
    const DeformationJet centre = cage_.jet(leaf.centre);
    const double half = 0.5 * leaf.edge * (1 + 1e-6);
    V3d p = leaf.centre;
    for (int step = 0; step < kLeafSteps; ++step) {
      const V3d off = position - cage_.at(p);
      if (off.length() <= tolerance_) {
        const V3d from = p - leaf.centre;
        if (std::max({std::abs(from.x), std::abs(from.y), std::abs(from.z)}) <= half) return p;
        return {};
      }
      p += newtonMove(centre, off);
      if (!((p - leaf.centre).length() <= 2 * leaf.edge)) return {};
    }
    return {};
  }

  CageDeformation cage_;
  DomainCells cells_;
  std::vector<CageLeaf> leaves_;
  double size_ = 0, tolerance_ = 0;
};

/// Tests the deformed triangles for intersections that the triangles did not have before.
void testOverlaps(const CageDeformation& cage, const DeformationDomain& domain,
                  FoldCertificate& certificate, const Progress& progress) {
  std::vector<V3d> moved(domain.points.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, moved.size(), 64), [&](const auto& range) {
    for (std::size_t n = range.begin(); n != range.end(); ++n) moved[n] = cage.at(domain.points[n]);
  });
  const auto after = convert::findSelfIntersections(domain.triangles, moved, progress);
  if (after.empty()) return;
  const auto before = convert::findSelfIntersections(domain.triangles, domain.points, progress);
  const std::set<convert::TrianglePair> known(before.begin(), before.end());
  for (const convert::TrianglePair& pair : after) {
    if (known.count(pair) > 0) continue;
    const auto& [a, b, c] = domain.triangles[pair.first];
    certificate.overlaps = true;
    certificate.overlapPlace = (moved[a] + moved[b] + moved[c]) / 3;
    return;
  }
}

/// Finds a point whose distance from the cage is at most the margin of the domain, or that lies on
/// the other side of the cage than the first one.
std::optional<V3d> pointNearCage(const CageDeformation& cage, const DeformationDomain& domain) {
  if (domain.points.empty()) return {};
  const bool isInside = cage.contains(domain.points[domain.triangles[0][0]]);
  std::vector<std::uint8_t> isNear(domain.points.size(), 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, isNear.size(), 64), [&](const auto& range) {
    for (std::size_t n = range.begin(); n != range.end(); ++n) {
      const V3d& p = domain.points[n];
      bool isTooNear = cage.contains(p) != isInside;
      for (const cage::CageTriangle& part : cage.parts()) {
        if (isTooNear) break;
        const V3d foot =
            closestOnTriangle(p, part.corners[0], part.corners[1], part.corners[2]).point;
        isTooNear = !((foot - p).length() > domain.margin);
      }
      isNear[n] = isTooNear;
    }
  });
  for (const auto& t : domain.triangles)
    for (const std::uint32_t n : t)
      if (isNear[n]) return domain.points[n];
  return {};
}

/// The Jacobian at points, of a cloud, which has no surface.
FoldCertificate certifyPoints(const CageDeformation& cage, const std::vector<V3d>& points) {
  FoldCertificate certificate{.verdict = FoldVerdict::Certified,
                              .pieces = cage.triangles().size(),
                              .boxes = points.size(),
                              .subject = "cage"};
  std::vector<double> values(points.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 64), [&](const auto& range) {
    for (std::size_t n = range.begin(); n != range.end(); ++n)
      values[n] = cage.jet(points[n]).determinant();
  });
  if (points.empty()) return certificate;
  const auto least = std::min_element(values.begin(), values.end());
  certificate.leastLow = certificate.leastHigh = *least;
  certificate.place = points[static_cast<std::size_t>(least - values.begin())];
  if (!(*least > 0)) certificate.verdict = FoldVerdict::Folds;
  return certificate;
}

}  // namespace

CertifiedDeformation CageDeformation::certify(const DeformationDomain& domain,
                                              const CertifyOptions& options) const {
  const Progress& progress = options.progress;
  if (domain.triangles.empty()) {
    CertifiedDeformation result;
    result.certificate = certifyPoints(*this, domain.points);
    return result;
  }
  report(progress, 0);
  FoldCertificate certificate{.pieces = triangles().size(), .subject = "cage"};
  certificate.leastHigh = std::numeric_limits<double>::infinity();
  certificate.leastLow = std::numeric_limits<double>::infinity();
  if (const auto near = pointNearCage(*this, domain)) {
    certificate.place = *near;
    certificate.isNearCage = true;
    certificate.leastHigh = jet(*near).determinant();
    certificate.leastLow = -std::numeric_limits<double>::infinity();
    return {certificate};
  }
  const bool isGreen = coordinates() == CageCoordinates::Green;
  DomainCells cells(domain);
  std::vector<CageLeaf> leaves;
  std::vector<DomainCells::Cube> open = {{}};
  bool isOutside = false;
  double openLeast = std::numeric_limits<double>::infinity();
  std::optional<std::pair<V3d, bool>> undecided;  // first box without a bound, and if near the cage
  for (int level = 0; !open.empty(); ++level) {
    const bool isLast =
        level == kMostCageLevels || certificate.boxes + 8 * open.size() > kMostCageBoxes;
    requireMemory(static_cast<double>(leaves.size() * sizeof(CageLeaf)) +
                      static_cast<double>(open.size() * (sizeof(BallBounds) + kBytesOfHalved)),
                  options.maxMemory);
    std::vector<BallBounds> bounds(open.size());
    std::vector<std::uint8_t> isBeyond(open.size(), 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, open.size(), 8), [&](const auto& range) {
      for (std::size_t n = range.begin(); n != range.end(); ++n) {
        const V3d centre = cells.centreOf(open[n]);
        bounds[n] = cage::ballBounds(*this, centre, 0.5 * std::sqrt(3.0) * cells.edgeOf(open[n]));
        isBeyond[n] = isGreen && bounds[n].isBounded && !contains(centre);
      }
    });
    certificate.boxes += open.size();
    // Centres of cubes above the lowest level may lie beside the domain.
    for (std::size_t n = 0; n < open.size(); ++n) {
      const V3d centre = cells.centreOf(open[n]);
      if (isBeyond[n] && !isOutside) {
        isOutside = true;
        undecided = {centre, true};
      }
      if (level < DomainCells::kLevels && !cells.contains(centre)) continue;
      if (isGreen && !bounds[n].isBounded) continue;  // perhaps outside, where there is no map
      const double value = bounds[n].centre.determinant();
      if (value < certificate.leastHigh) {
        certificate.leastHigh = value;
        certificate.place = centre;
      }
    }
    report(progress, std::min(0.8, 0.1 * level));
    if (isOutside) break;
    std::vector<DomainCells::Cube> next;
    for (std::size_t n = 0; n < open.size(); ++n) {
      const BallBounds& b = bounds[n];
      const bool isSettled = b.isBounded && b.least > 0 &&
                             (b.least >= kBracket * std::max(certificate.leastHigh, 0.0) || isLast);
      if (isSettled) {
        certificate.leastLow = std::min(certificate.leastLow, b.least);
        const double edge = cells.edgeOf(open[n]);
        leaves.push_back({cells.centreOf(open[n]), b.centre.position, edge,
                          0.5 * std::sqrt(3.0) * edge * b.stretch});
      } else if (isLast || (level >= kNearCageLevel && b.isNearCage)) {
        openLeast = std::min(openLeast, b.least);
        if (!undecided) undecided = {cells.centreOf(open[n]), b.isNearCage};
      } else {
        for (unsigned child = 0; child < 8; ++child) {
          DomainCells::Cube cube{level + 1, {}};
          for (std::size_t axis = 0; axis < 3; ++axis)
            cube.at[axis] = 2 * open[n].at[axis] + (child >> axis & 1u);
          if (cells.touches(cube)) next.push_back(cube);
        }
      }
    }
    open = std::move(next);
    if (certificate.leastHigh <= 0 || (undecided && undecided->second)) break;
  }
  certificate.leastLow = std::min(certificate.leastLow, openLeast);
  if (certificate.leastHigh <= 0) {
    certificate.verdict = FoldVerdict::Folds;
    certificate.leastLow = -std::numeric_limits<double>::infinity();
  } else if (undecided) {
    certificate.place = undecided->first;
    certificate.isNearCage = undecided->second;
  } else {
    certificate.verdict = FoldVerdict::Certified;
    testOverlaps(*this, domain, certificate, subProgress(progress, 0.8, 1));
  }
  report(progress, 1);
  CertifiedDeformation result{certificate};
  if (certificate.isInjective())
    result.inverse = std::make_shared<CageInverse>(*this, std::move(cells), std::move(leaves));
  return result;
}

}  // namespace levelset
