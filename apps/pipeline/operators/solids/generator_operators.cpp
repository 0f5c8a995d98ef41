#include <fmt/core.h>

#include <array>
#include <cmath>
#include <functional>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/height_file.h"
#include "levelset/error.h"
#include "mapping/generators/gyroid.h"
#include "mapping/generators/heightmap.h"
#include "mapping/generators/hexagons.h"
#include "mapping/generators/knurl.h"
#include "mapping/generators/ring.h"
#include "mapping/generators/scales.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::NarrowBand;
using levelset::ShapeOptions;

/// A texture generator with its parameters, lengths in world units: its extent, the boxes of its
/// tile and of its solid, and the functions that check the parameters and build the solid.
struct Generator {
  levelset::ShapeExtent extent;
  mapping::TileBox box;
  std::function<void(double voxelSize, const ShapeOptions&)> check;
  std::function<NarrowBand(double voxelSize, const ShapeOptions&)> make;
};
using Generate = Generator (*)(Invocation&);

mapping::Tiling tilingOf(Invocation& in) {
  return {.columns = in.integerAs<int>("columns"),
          .rows = in.integerAs<int>("rows"),
          .overlap = in.length("overlap")};
}

/// Returns a length, or an empty value for `auto`.
std::optional<double> lengthUnlessAuto(Invocation& in, const char* name) {
  if (in.text(name) == "auto") return {};
  return in.length(name);
}

void noteOddRows(Invocation& in, const mapping::Tiling& tiling) {
  if (tiling.rows % 2 == 0) return;
  in.notes.notes.push_back(
      fmt::format("{} rows: every second row is shifted, so the pattern repeats along y only with "
                  "an even number of rows",
                  tiling.rows));
}

Generator knurl(Invocation& in) {
  mapping::Knurl knurl;
  const std::string pattern = in.text("pattern");
  if (pattern == "diagonal") knurl.pattern = mapping::KnurlPattern::Diagonal;
  if (pattern == "straight") knurl.pattern = mapping::KnurlPattern::Straight;
  knurl.pitch = in.length("pitch");
  knurl.flankAngle = in.radians("flanks");
  knurl.grooveAngle = in.radians("angle");
  knurl.depth = lengthUnlessAuto(in, "depth").value_or(0);
  knurl.base = lengthUnlessAuto(in, "base")
                   .value_or(knurl.depth > 0 ? knurl.depth : mapping::sharpDepth(knurl));
  knurl.tiling = tilingOf(in);
  const V3d center = in.point("center");
  return {mapping::knurlExtent(knurl, center), mapping::knurlBox(knurl, center),
          [=](double voxel, const auto& options) {
            mapping::checkKnurl(knurl, center, voxel, options);
          },
          [=](double voxel, const auto& options) {
            return mapping::makeKnurl(knurl, center, voxel, options);
          }};
}

Generator scales(Invocation& in) {
  mapping::Scales scales;
  scales.length = in.length("length");
  scales.width = lengthUnlessAuto(in, "width").value_or(scales.length * 0.7);
  scales.thickness = in.length("thickness");
  scales.tilt = in.radians("tilt");
  scales.step = lengthUnlessAuto(in, "step").value_or(0);
  scales.tip = lengthUnlessAuto(in, "tip").value_or(0);
  scales.rounding = in.length("rounding");
  scales.base = lengthUnlessAuto(in, "base").value_or(scales.length * 0.2);
  scales.tiling = tilingOf(in);
  noteOddRows(in, scales.tiling);
  const V3d center = in.point("center");
  return {mapping::scalesExtent(scales, center), mapping::scalesBox(scales, center),
          [=](double voxel, const auto& options) {
            mapping::checkScales(scales, center, voxel, options);
          },
          [=](double voxel, const auto& options) {
            return mapping::makeScales(scales, center, voxel, options);
          }};
}

Generator hexagons(Invocation& in) {
  mapping::Hexagons hexagons;
  if (in.text("kind") == "honeycomb") hexagons.kind = mapping::HexagonKind::Honeycomb;
  hexagons.size = in.length("size");
  hexagons.gap = lengthUnlessAuto(in, "gap").value_or(hexagons.size * 0.2);
  hexagons.height = lengthUnlessAuto(in, "height").value_or(hexagons.size * 0.4);
  hexagons.base = lengthUnlessAuto(in, "base").value_or(hexagons.size * 0.2);
  hexagons.rounding = in.length("rounding");
  hexagons.tiling = tilingOf(in);
  noteOddRows(in, hexagons.tiling);
  const V3d center = in.point("center");
  return {mapping::hexagonsExtent(hexagons, center), mapping::hexagonsBox(hexagons, center),
          [=](double voxel, const auto& options) {
            mapping::checkHexagons(hexagons, center, voxel, options);
          },
          [=](double voxel, const auto& options) {
            return mapping::makeHexagons(hexagons, center, voxel, options);
          }};
}

Generator ring(Invocation& in) {
  mapping::Ring ring;
  ring.radius = in.length("radius");
  ring.tube = lengthUnlessAuto(in, "tube").value_or(ring.radius * 0.16);
  if (in.given("section")) {
    const std::vector<double> section = in.lengths("section");
    ring.section = Imath::V2d(section[0], section[1]);
  }
  if (in.given("lean")) ring.lean = in.radians("lean");
  ring.columns = in.integerAs<int>("columns");
  ring.rows = in.integerAs<int>("rows");
  if (in.given("spacing")) {
    const std::vector<double> spacing = in.lengths("spacing");
    ring.spacing = Imath::V2d(spacing[0], spacing[1]);
  }
  ring.clearance = in.length("clearance");
  const V3d center = in.point("center");
  return {
      mapping::ringExtent(ring, center), mapping::ringBox(ring, center),
      [=](double voxel, const auto& options) { mapping::checkRing(ring, center, voxel, options); },
      [=](double voxel, const auto& options) {
        return mapping::makeRing(ring, center, voxel, options);
      }};
}

Generator gyroid(Invocation& in) {
  mapping::Gyroid gyroid;
  if (in.text("kind") == "network") gyroid.kind = mapping::GyroidKind::Network;
  gyroid.cell = in.length("cell");
  gyroid.thickness = lengthUnlessAuto(in, "thickness").value_or(gyroid.cell * 0.1);
  gyroid.cells = {in.integerAs<int>("columns"), in.integerAs<int>("rows"),
                  in.integerAs<int>("layers")};
  const V3d center = in.point("center");
  return {mapping::gyroidExtent(gyroid, center), mapping::gyroidBox(gyroid, center),
          [=](double voxel, const auto& options) {
            mapping::checkGyroid(gyroid, center, voxel, options);
          },
          [=](double voxel, const auto& options) {
            return mapping::makeGyroid(gyroid, center, voxel, options);
          }};
}

mapping::Heightmap heightmapOf(Invocation& in) {
  mapping::Heightmap heightmap;
  const std::vector<double> size = in.lengths("size");
  heightmap.size = {size[0], size[1]};
  heightmap.height = in.length("height");
  heightmap.base = lengthUnlessAuto(in, "base").value_or(heightmap.height / 2);
  if (in.text("interpolation") == "linear")
    heightmap.interpolation = mapping::HeightInterpolation::Linear;
  heightmap.grid = readHeights(in.text("image"), in.flag("invert"), in.maxMemory);
  return heightmap;
}

Generator heightmap(Invocation& in) {
  mapping::Heightmap heightmap = heightmapOf(in);
  const V3d center = in.point("center");
  const levelset::ShapeExtent extent = mapping::heightmapExtent(heightmap, center);
  const mapping::TileBox box = mapping::heightmapBox(heightmap, center);
  const auto shared = std::make_shared<const mapping::Heightmap>(std::move(heightmap));
  return {extent, box,
          [=](double voxel, const auto& options) {
            mapping::checkHeightmap(*shared, center, voxel, options);
          },
          [=](double voxel, const auto& options) {
            return mapping::makeHeightmap(*shared, center, voxel, options);
          }};
}

/// Returns the texture generator and the voxel size. Adds a note if the tile is smaller than the
/// solid.
std::pair<Generator, double> describeTexture(Invocation& in, Generate generate) {
  if (in.asksVoxelSize() && in.given("voxel")) in.setReference(in.length("voxel"), 0);
  Generator generator = generate(in);
  const V3d size = generator.extent.bounds.size();
  const double voxel = in.voxelSize(std::max({size.x, size.y, size.z}));
  const Imath::Box3d& tile = generator.box.tile;
  if (tile.min != generator.box.whole.min) {
    in.notes.notes.push_back(
        fmt::format("the pattern repeats with the tile --texture-box \"{},{},{} {},{},{}\"",
                    tile.min.x, tile.min.y, tile.min.z, tile.max.x, tile.max.y, tile.max.z));
  }
  return {std::move(generator), voxel};
}

ShapeOptions generatorOptions(const Invocation& in) {
  return {.halfWidth = in.number("half-width"), .maxMemory = in.maxMemory, .progress = in.progress};
}

template <Generate generate>
Value makeTexture(Invocation& in) {
  const auto [generator, voxel] = describeTexture(in, generate);
  return Value(generator.make(voxel, generatorOptions(in)));
}

Value heightmapSheet(Invocation& in) {
  if (in.asksVoxelSize() && in.given("voxel")) in.setReference(in.length("voxel"), 0);
  const mapping::Heightmap map = heightmapOf(in);  // read once, since the picture may be a pipe
  const V3d center = in.point("center");
  const V3d size = mapping::heightmapExtent(map, center).bounds.size();
  const double voxel = in.voxelSize(std::max({size.x, size.y, size.z}));
  return Value(mapping::heightmapSheet(map, center, voxel, generatorOptions(in)));
}

template <Generate generate>
Plan planTextureSolid(Invocation& in) {
  const auto [generator, voxel] = describeTexture(in, generate);
  generator.check(voxel, generatorOptions(in));
  return {.kind = Kind::Band,
          .bounds = generator.extent.bounds,
          .area = generator.extent.area,
          .voxelSize = voxel,
          .halfWidth = in.number("half-width")};
}

Param size(const char* name, const char* doc) {
  return {.name = name,
          .type = ParamType::Length,
          .doc = doc,
          .range = Range::Positive,
          .required = true};
}
Param size(const char* name, const char* doc, const char* fallback, Range range) {
  return {.name = name,
          .type = ParamType::Length,
          .doc = doc,
          .fallback = fallback,
          .range = range,
          .allowsAuto = std::string(fallback) == "auto"};
}
Param degrees(const char* name, const char* doc, const char* fallback) {
  return {.name = name, .type = ParamType::Degrees, .doc = doc, .fallback = fallback};
}
Param count(const char* name, const char* doc, const char* fallback = "4") {
  return {.name = name,
          .type = ParamType::Integer,
          .doc = doc,
          .fallback = fallback,
          .range = Range::Positive};
}
Param choice(const char* name, const char* doc, std::vector<std::string> choices) {
  return {.name = name,
          .type = ParamType::Choice,
          .doc = doc,
          .fallback = choices.front(),
          .choices = choices};
}
Param pair(const char* name, const char* doc, bool isRequired = false) {
  return {.name = name,
          .type = ParamType::Lengths,
          .doc = doc,
          .range = Range::Positive,
          .required = isRequired,
          .count = 2};
}

std::vector<Param> tiled(std::vector<Param> params) {
  params.push_back(count("columns", "number of columns of the pattern in a tile, along x"));
  params.push_back(count("rows", "number of rows of the pattern in a tile, along y"));
  params.push_back(size("overlap",
                        "length by which the pattern continues beyond each side of the tile", "0",
                        Range::NonNegative));
  return params;
}

/// Checks the voxel size and the numbers of tiles before anything runs.
void validateGenerator(const Invocation& in) {
  requireVoxelSize(in);
  for (const char* name : {"columns", "rows", "layers"})
    if (in.given(name)) (void)in.integerAs<int>(name);
}

template <Generate generate>
Operator generator(const char* name, const char* summary, const char* details, const char* example,
                   std::vector<Param> params) {
  params.push_back({.name = "center",
                    .type = ParamType::Point,
                    .doc = "centre of the bounding box of the solid",
                    .fallback = "0,0,0"});
  params.push_back(voxelParam());
  params.push_back(resolutionParam());
  params.push_back(halfWidthParam());
  return {.name = name,
          .group = "Textures",
          .summary = summary,
          .details = details,
          .example = example,
          .params = std::move(params),
          .run = makeTexture<generate>,
          .plan = planTextureSolid<generate>,
          .validate = validateGenerator};
}

}  // namespace

Operator knurlOperator() {
  return generator<knurl>(
      "knurl", "make a plate with knurled grooves",
      "V-grooves in the top of a plate, as knurling wheels press them. The tile repeats across its "
      "sides. A column and row of diamonds is pitch / cos(angle) wide and pitch / sin(angle) long; "
      "one of straight grooves is a pitch wide and long.",
      "levelsmith knurl --pitch 2 --columns 3 --rows 2 --voxel 0.1 ! measure",
      tiled({choice("pattern", "arrangement of the grooves", {"diamond", "diagonal", "straight"}),
             size("pitch", "distance between neighbouring grooves, perpendicular to them"),
             size("depth",
                  "depth of the grooves; 'auto': the depth at which the crests between them become "
                  "sharp",
                  "auto", Range::Positive),
             degrees("flanks", "angle between the two flanks of a groove", "90"),
             degrees("angle",
                     "angle between the grooves and the y axis; without effect on straight grooves",
                     "30"),
             size("base",
                  "thickness of the plate below the grooves; 'auto': the depth of the grooves",
                  "auto", Range::NonNegative)}));
}

Operator scalesOperator() {
  return generator<scales>(
      "scales", "make a plate of overlapping scales",
      "Rows of tongues along x with tips towards +y. Every second row is shifted by half a width, "
      "so an even number of rows continues across the tile's sides.",
      "levelsmith scales --length 3 --columns 2 --rows 4 --voxel 0.1 ! measure",
      tiled(
          {size("length", "length of a scale"),
           size("width", "width of a scale; 'auto': 0.7 of its length", "auto", Range::Positive),
           size("thickness",
                "thickness of a scale that has a gap under its tip; 0: scales are solid down to "
                "the plate",
                "0", Range::NonNegative),
           degrees("tilt", "angle between a scale and the plate", "20"),
           size("step", "distance between rows; 'auto': half the length of a scale", "auto",
                Range::Positive),
           size("tip",
                "length of the pointed tip of a scale; 'auto': half the width, which makes a half "
                "circle",
                "auto", Range::Positive),
           size("rounding", "rounding radius of the edges of the scales", "0", Range::NonNegative),
           size("base", "thickness of the plate; 'auto': 0.2 of the length of a scale", "auto",
                Range::NonNegative)}));
}

Operator hexagonsOperator() {
  return generator<hexagons>(
      "hexagons", "make a plate of raised hexagons, or a honeycomb",
      "Rows of hexagons along x with flats across x. Every second row is shifted by half a "
      "spacing, so an even number of rows continues across the tile's sides.",
      "levelsmith hexagons --size 2 --kind honeycomb --columns 3 --rows 2 --voxel 0.1 ! measure",
      tiled({choice(
                 "kind",
                 "raised: pillars with gaps between them; honeycomb: walls between hexagonal cells",
                 {"raised", "honeycomb"}),
             size("size", "width of a hexagon across its flats"),
             size("gap",
                  "gap between hexagons, or thickness of the honeycomb's walls; 'auto': 0.2 of the "
                  "size",
                  "auto", Range::Positive),
             size("height", "height above the plate; 'auto': 0.4 of the size", "auto",
                  Range::Positive),
             size("base", "thickness of the plate, 0: none; 'auto': 0.2 of the size", "auto",
                  Range::NonNegative),
             size("rounding",
                  "rounding radius of the upper edges, and of the upright edges of raised hexagons",
                  "0", Range::NonNegative)}));
}

Operator ringOperator() {
  return generator<ring>(
      "ring", "make a ring, or a sheet of chain mail",
      "More than one column or row is European 4-in-1 chain mail: each ring links two rings of the "
      "row before and two of the row behind, and no rings touch. The defaults of spacing and lean "
      "leave the largest distance between wires.",
      "levelsmith ring --radius 3 --columns 2 --rows 3 --voxel 0.15 ! measure",
      {size("radius", "radius of a ring, from its centre to the middle of the wire"),
       size("tube", "radius of round wire; 'auto': 0.16 of the radius of the ring", "auto",
            Range::Positive),
       pair("section",
            "cross-section of flat wire, in place of --tube: width across the ring, and height "
            "along its axis"),
       {.name = "lean",
        .type = ParamType::Degrees,
        .doc = "angle of the rings about x, with the opposite sign in every second row; default: 0 "
               "for one ring, for chain mail the angle with the largest distance between wires"},
       count("columns", "number of rings along x", "1"),
       count("rows", "number of rings along y", "1"),
       pair("spacing",
            "distance between the rings of a row, and distance between rows; default: the spacing "
            "with the largest distance between wires"),
       size("clearance", "required distance between wires; at least two voxels in any case", "0",
            Range::NonNegative)});
}

Operator gyroidOperator() {
  return generator<gyroid>(
      "gyroid", "make a box of gyroid walls or struts",
      "The surface sin x cos y + sin y cos z + sin z cos x = 0, thickened by its true distance and "
      "cut off by the box of its cells, where small parts may come loose (`keep` drops them).",
      "levelsmith gyroid --cell 5 --columns 1 --rows 1 --layers 1 --voxel 0.2 ! measure",
      {choice("kind", "sheet: a wall between two labyrinths; network: the struts of one labyrinth",
              {"sheet", "network"}),
       size("cell", "edge of a cubic cell"),
       size("thickness", "thickness of walls, or of struts at their thinnest; 'auto': 0.1 cell",
            "auto", Range::Positive),
       count("columns", "number of cells along x", "2"),
       count("rows", "number of cells along y", "2"),
       count("layers", "number of cells along z", "1")});
}

Operator heightmapOperator() {
  Operator op = generator<heightmap>(
      "heightmap", "make a plate whose top is a picture",
      "A grey PNG (black and transparent are low, white is high) or lines of numbers (the least is "
      "low, the largest is high). The first row lies at the largest y.",
      "levelsmith heightmap --image <(printf '0 1 0\\n1 2 1\\n0 1 0\\n') --size 4,4 --height 1 "
      "--voxel 0.1 ! measure",
      {{.name = "image",
        .type = ParamType::Path,
        .doc = "grey .png, or text file of numbers, with the heights",
        .required = true},
       pair("size",
            "size along x and y: distance from the first to the last column, and from the first to "
            "the last row, of pixels",
            true),
       size("height", "height of white pixels above black ones"),
       size("base", "thickness of the plate below black pixels; 'auto': half the height", "auto",
            Range::NonNegative),
       choice("interpolation", "interpolation between pixels", {"cubic", "linear"}),
       {.name = "invert", .type = ParamType::Flag, .doc = "black is high, white is low"},
       {.name = "sheet",
        .type = ParamType::Flag,
        .doc =
            "return only the top, as an open mesh with a vertex every voxel, for 'surface-band'"}});
  op.resultKind = [](const Invocation& in) { return in.flag("sheet") ? Kind::Mesh : Kind::Band; };
  op.run = [](Invocation& in) {
    return in.flag("sheet") ? heightmapSheet(in) : makeTexture<heightmap>(in);
  };
  op.plan = [](Invocation& in) {
    Plan plan = planTextureSolid<heightmap>(in);
    if (in.flag("sheet")) plan.kind = Kind::Mesh;
    return plan;
  };
  op.validate = [](const Invocation& in) {
    in.requireVoxelSize();
    if (in.flag("sheet") && in.given("half-width"))
      throw levelset::UsageError(
          "heightmap: --sheet makes a mesh, which has no half width; leave --half-width out");
  };
  return op;
}

}  // namespace pipeline
