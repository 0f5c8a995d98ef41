#include "mapping/generators/knurl.h"

#include <cmath>
#include <numbers>

#include "levelset/convert/mesh_to_band.h"
#include "mapping/generators/generator_vdb.h"
#include "mapping/generators/relief_mesh.h"

namespace mapping {
namespace {

using Imath::V2d;
using Imath::V3d;
using levelset::ShapeExtent;
using levelset::ShapeOptions;

double depthOf(const Knurl& knurl) {
  return knurl.depth > 0 ? knurl.depth : sharpDepth(knurl);
}

V2d knurlPeriod(const Knurl& knurl) {
  if (knurl.pattern == KnurlPattern::Straight) return V2d(knurl.pitch);
  return {knurl.pitch / std::cos(knurl.grooveAngle), knurl.pitch / std::sin(knurl.grooveAngle)};
}

void requireKnurl(const Knurl& knurl, const V3d& center) {
  requirePositive(knurl.pitch, "the pitch");
  requireNonNegative(knurl.depth, "the depth");
  requireNonNegative(knurl.base, "the base");
  requireAngle(knurl.flankAngle, 0, std::numbers::pi, "the angle between the flanks");
  if (knurl.pattern != KnurlPattern::Straight)
    requireAngle(knurl.grooveAngle, 0, std::numbers::pi / 2, "the angle of the grooves");
  requireTiling(knurl.tiling);
  requireFinite(center, "the centre");
  if (knurl.depth > sharpDepth(knurl) * (1 + 1e-9)) {
    throw levelset::UsageError(
        fmt::format("the depth is {:.6g}, but at this pitch and flank angle the crests are "
                    "sharp at {:.6g}; give a smaller depth or a smaller flank angle",
                    knurl.depth, sharpDepth(knurl)));
  }
}

/// Profile of the top face across the grooves, as heights at four stations per pitch. The stations
/// are the bottom of a groove, the edge of the crest, the middle between two grooves, and the edge
/// of the crest before the next groove. Stations are numbered continuously over all grooves, so
/// that neighbouring grooves compute the same bits for a shared station.
class GrooveStations {
 public:
  explicit GrooveStations(const Knurl& knurl)
      : pitch_(knurl.pitch),
        depth_(depthOf(knurl)),
        // Half width of a groove at the height of the crests. Sharp crests leave no flat strip
        // between the grooves.
        mouth_(std::min(depth_ * std::tan(knurl.flankAngle / 2), knurl.pitch / 2)),
        isSharp_(mouth_ > knurl.pitch / 2 * (1 - 1e-9)) {}

  [[nodiscard]] double position(long station) const {
    const long groove = station >> 2, rest = station & 3;
    if (rest == 0) return static_cast<double>(groove) * pitch_;
    if (rest == 2 || isSharp_) return (static_cast<double>(groove) + 0.5) * pitch_;
    return rest == 1 ? static_cast<double>(groove) * pitch_ + mouth_
                     : static_cast<double>(groove + 1) * pitch_ - mouth_;
  }
  /// Height of a station above the crests, world units: −depth at the bottom of a groove, zero on
  /// the crests.
  [[nodiscard]] double height(long station) const { return (station & 3) == 0 ? -depth_ : 0; }

 private:
  double pitch_, depth_, mouth_;
  bool isSharp_;
};

/// Indices of the first and last groove of one family that may meet a box. Grooves are counted
/// along the family's normal: (cos a, −sin a) or (cos a, sin a), with the groove angle a.
struct GrooveRange {
  long first, last;
};

GrooveRange groovesOver(const Imath::Box2d& box, const V2d& normal, double pitch) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const double x : {box.min.x, box.max.x})
    for (const double y : {box.min.y, box.max.y}) {
      low = std::min(low, (V2d(x, y) ^ normal) / pitch);
      high = std::max(high, (V2d(x, y) ^ normal) / pitch);
    }
  return {static_cast<long>(std::floor(low)) - 1, static_cast<long>(std::ceil(high)) + 1};
}

/// Adds the flat faces of a groove to the relief: its two flanks and half of the flat crest on each
/// side. They extend from −`length` to `length` along the groove.
void addGroove(const Knurl& knurl, const GrooveStations& stations, long groove, double length,
               ReliefMesh& relief) {
  const double angle = knurl.pattern == KnurlPattern::Straight ? 0 : knurl.grooveAngle;
  const V2d normal(std::cos(angle), -std::sin(angle)), along(-normal.y, normal.x);
  const auto corner = [&](long station, double t) {
    const V2d p = normal * stations.position(station) + along * t;
    return V3d(p.x, p.y, stations.height(station));
  };
  for (long station = 4 * groove - 2; station < 4 * groove + 2; ++station)
    relief.add({corner(station, -length), corner(station + 1, -length), corner(station + 1, length),
                corner(station, length)});
}

/// Adds the flat faces around the crossing of two grooves to the relief. Each of the four quadrants
/// between the grooves has a flank of each groove, and the flat crest between both flanks.
void addCrossing(const Knurl& knurl, const GrooveStations& stations, long first, long second,
                 ReliefMesh& relief) {
  const double c = 2 * std::cos(knurl.grooveAngle), s = 2 * std::sin(knurl.grooveAngle);
  const auto corner = [&](long i, long j) {
    const double a = stations.position(4 * first + i), b = stations.position(4 * second + j);
    return V3d((a + b) / c, (b - a) / s,
               std::min(stations.height(4 * first + i), stations.height(4 * second + j)));
  };
  const auto add = [&](std::vector<std::array<long, 2>> loop, bool isTurned) {
    std::vector<V3d> corners;
    for (const auto& [i, j] : loop) corners.push_back(corner(i, j));
    if (isTurned) std::reverse(corners.begin(), corners.end());
    relief.add(std::move(corners));
  };
  for (const long i : {-1, 1})
    for (const long j : {-1, 1}) {
      const bool isTurned = i != j;
      add({{0, 0}, {i, j}, {i, 2 * j}, {0, 2 * j}}, isTurned);
      add({{0, 0}, {2 * i, 0}, {2 * i, j}, {i, j}}, isTurned);
      add({{i, j}, {2 * i, j}, {2 * i, 2 * j}, {i, 2 * j}}, isTurned);
    }
}

double crossingCount(const Knurl& knurl, const TileBox& box) {
  const V3d size = box.whole.size();
  const double reach = (size.x + size.y) / knurl.pitch + 4;
  return knurl.pattern == KnurlPattern::Diamond ? reach * reach : reach;
}

levelset::TriMesh knurlMesh(const Knurl& knurl, const V3d& center, const ShapeOptions& options) {
  const TileBox box = knurlBox(knurl, center);
  // Bytes for each crossing of two grooves, or for each single groove: 24 triangles with their
  // vertices, edges and map entries.
  constexpr double kBytesPerCrossing = 6000;
  levelset::requireMemory(crossingCount(knurl, box) * kBytesPerCrossing, options.maxMemory);
  // The relief is built in a frame whose x and y start at a corner of the tile, where the first
  // grooves of both families meet, and whose z is 0 at the crests.
  const V3d corner = box.tile.min;
  const Imath::Box2d rectangle(V2d(box.whole.min.x - corner.x, box.whole.min.y - corner.y),
                               V2d(box.whole.max.x - corner.x, box.whole.max.y - corner.y));
  ReliefMesh relief(rectangle, 1e-9 * knurl.pitch);
  const GrooveStations stations(knurl);
  const double angle = knurl.pattern == KnurlPattern::Straight ? 0 : knurl.grooveAngle;
  const GrooveRange firsts =
      groovesOver(rectangle, V2d(std::cos(angle), -std::sin(angle)), knurl.pitch);
  const GrooveRange seconds =
      groovesOver(rectangle, V2d(std::cos(angle), std::sin(angle)), knurl.pitch);
  const double length = rectangle.min.length() + rectangle.max.length();
  for (long i = firsts.first; i <= firsts.last; ++i) {
    levelset::report(options.progress, 0);
    if (knurl.pattern != KnurlPattern::Diamond) {
      addGroove(knurl, stations, i, length, relief);
      continue;
    }
    for (long j = seconds.first; j <= seconds.last; ++j) addCrossing(knurl, stations, i, j, relief);
  }
  const double depth = depthOf(knurl);
  levelset::TriMesh mesh = std::move(relief).close(-depth - knurl.base);
  for (V3d& p : mesh.positions) p += V3d(corner.x, corner.y, box.tile.max.z);
  return mesh;
}

}  // namespace

double sharpDepth(const Knurl& knurl) {
  return knurl.pitch / 2 / std::tan(knurl.flankAngle / 2);
}

TileBox knurlBox(const Knurl& knurl, const V3d& center) {
  requireKnurl(knurl, center);
  return tileBox(knurl.tiling, knurlPeriod(knurl), -depthOf(knurl) - knurl.base, 0, center);
}

ShapeExtent knurlExtent(const Knurl& knurl, const V3d& center) {
  const Imath::Box3d bounds = knurlBox(knurl, center).whole;
  const V3d size = bounds.size();
  const double steepest = 1 / std::sin(knurl.flankAngle / 2);
  return {bounds, size.x * size.y * (1 + steepest) + 2 * (size.x + size.y) * size.z};
}

void checkKnurl(const Knurl& knurl, const V3d& center, double voxelSize,
                const ShapeOptions& options) {
  const ShapeExtent extent = knurlExtent(knurl, center);
  levelset::checkShape(extent, voxelSize, options);
  requireResolved(knurl.pitch, voxelSize, "the pitch");
}

levelset::NarrowBand makeKnurl(const Knurl& knurl, const V3d& center, double voxelSize,
                               const ShapeOptions& options) {
  checkKnurl(knurl, center, voxelSize, options);
  levelset::report(options.progress, 0);
  return levelset::meshToBand(knurlMesh(knurl, center, options), voxelSize,
                              {.halfWidth = options.halfWidth,
                               .sign = levelset::SignMode::Closed,
                               .searchSelfIntersections = false,
                               .maxMemory = options.maxMemory,
                               .progress = options.progress})
      .band;
}

}  // namespace mapping
