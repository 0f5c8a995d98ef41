#include "apps/viewer/editing/patch_design.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "apps/viewer/text/point_text.h"
#include "levelset/grids/sample.h"
#include "mapping/generators/hexagons.h"
#include "mapping/generators/knurl.h"
#include "mapping/generators/scales.h"
#include "mapping/surface/geodesic.h"

namespace viewer {
namespace {

using Imath::V2d;
using Imath::V3d;

// The patterns have unit length, pitch or size, and the defaults of their actions otherwise, to the
// last bit.
double radiansOf(double degrees) {
  return degrees * std::numbers::pi / 180;
}

mapping::Scales scalesWith(const mapping::Tiling& tiling) {
  return {.length = 1, .width = 0.7, .tilt = radiansOf(20), .base = 0.2, .tiling = tiling};
}

mapping::Knurl knurlWith(const mapping::Tiling& tiling) {
  mapping::Knurl knurl;
  knurl.flankAngle = radiansOf(90);
  knurl.grooveAngle = radiansOf(30);
  knurl.base = mapping::sharpDepth(knurl);
  knurl.tiling = tiling;
  return knurl;
}

mapping::Hexagons hexagonsWith(const mapping::Tiling& tiling) {
  return {.size = 1, .gap = 0.2, .height = 0.4, .base = 0.2, .tiling = tiling};
}

Imath::Box3d tileOf(TextureKind kind, const mapping::Tiling& tiling) {
  const V3d centre(0);
  switch (kind) {
    case TextureKind::Knurl:
      return mapping::knurlBox(knurlWith(tiling), centre).tile;
    case TextureKind::Hexagons:
      return mapping::hexagonsBox(hexagonsWith(tiling), centre).tile;
    default:
      return mapping::scalesBox(scalesWith(tiling), centre).tile;
  }
}

mapping::Tiling tilingOn(const PatchDesign& design, const V2d& size) {
  const V3d period = tileOf(design.texture, {}).size();
  const double rows = design.columns * period.x / period.y * size.y / size.x;
  constexpr double kMostRows = 1000;
  return {.columns = design.columns,
          .rows = 2 * static_cast<int>(std::clamp(std::round(rows / 2), 1.0, kMostRows / 2))};
}

}  // namespace

const char* textureName(TextureKind kind) {
  switch (kind) {
    case TextureKind::Scales:
      return "scales";
    case TextureKind::Knurl:
      return "knurl";
    case TextureKind::Hexagons:
      return "hexagons";
    default:
      return "none";
  }
}

void orderCorners(const levelset::NarrowBand& base, PatchDesign& design) {
  const bool hasSidePoints = std::any_of(design.sides.begin(), design.sides.end(),
                                         [](const auto& side) { return !side.empty(); });
  if (!design.isWhole() || hasSidePoints) return;
  std::vector<V3d>& corners = design.corners;
  const V3d centre = std::accumulate(corners.begin(), corners.end(), V3d(0)) / 4.0;
  const levelset::BandSampler sampler(base);
  V3d normal(0);
  for (const V3d& corner : corners) normal += sampler.normal(corner);
  const V3d first = corners[0] - centre, side = normal.cross(first);
  const auto angleOf = [&](const V3d& corner) {
    const V3d arm = corner - centre;
    const double angle =
        std::atan2(arm.dot(side) / std::max(normal.length(), 1e-300), arm.dot(first));
    return angle < 0 ? angle + 2 * std::numbers::pi : angle;
  };
  std::stable_sort(corners.begin() + 1, corners.end(),
                   [&](const V3d& a, const V3d& b) { return angleOf(a) < angleOf(b); });
}

V2d sizeOf(const PatchPaths& sides) {
  std::array<double, 4> lengths;
  for (std::size_t i = 0; i < 4; ++i) lengths[i] = mapping::pathLength(sides[i]);
  return {0.5 * (lengths[0] + lengths[2]), 0.5 * (lengths[1] + lengths[3])};
}

double heightOf(const PatchDesign& design, const V2d& size) {
  constexpr double kPlain = 1.0 / 7;
  const double mean = std::sqrt(size.x * size.y);
  if (design.texture == TextureKind::None) return asWritten(design.relief * kPlain * mean);
  const V3d tile = tileOf(design.texture, tilingOn(design, size)).size();
  return asWritten(design.relief * tile.z * mean / std::sqrt(tile.x * tile.y));
}

TextureTile makeTexture(const PatchDesign& design, const V2d& size, double voxelSize,
                        const levelset::Progress& progress) {
  const mapping::Tiling tiling = tilingOn(design, size);
  const V3d tile = tileOf(design.texture, tiling).size();
  const double stretch = std::min(size.x / tile.x, size.y / tile.y);
  // Coarser voxels do not resolve the notches and grooves of a pattern of unit length.
  constexpr double kCoarsest = 0.08;
  const double voxel = asWritten(std::min(voxelSize / stretch, kCoarsest));
  const levelset::ShapeOptions options{.progress = progress};
  const V3d centre(0);
  const std::string counts =
      fmt::format("--columns {} --rows {} --voxel {:.8g}", tiling.columns, tiling.rows, voxel);
  switch (design.texture) {
    case TextureKind::Knurl:
      return {"knurl --pitch 1 " + counts,
              mapping::makeKnurl(knurlWith(tiling), centre, voxel, options)};
    case TextureKind::Hexagons:
      return {"hexagons --size 1 " + counts,
              mapping::makeHexagons(hexagonsWith(tiling), centre, voxel, options)};
    default:
      return {"scales --length 1 " + counts,
              mapping::makeScales(scalesWith(tiling), centre, voxel, options)};
  }
}

std::string patchAction(const PatchDesign& design, double height) {
  const auto listOf = [](const std::vector<V3d>& points) {
    std::string list;
    for (const V3d& point : points) {
      if (!list.empty()) list += ' ';
      list += pointText(point);
    }
    return list;
  };
  std::string text = fmt::format("patch --corners \"{}\"", listOf(design.corners));
  for (std::size_t side = 0; side < 4; ++side)
    if (!design.sides[side].empty())
      text += fmt::format(" --side{} \"{}\"", side, listOf(design.sides[side]));
  return text + fmt::format(" --height {:.8g}", height);
}

}  // namespace viewer
