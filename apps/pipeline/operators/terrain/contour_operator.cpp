#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <string>

#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/text_file.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/terrain/contour_lines.h"

namespace pipeline {
namespace {

using levelset::ContourLine;
using levelset::HeightField;

std::string contourFormat(const Invocation& in) {
  std::string format = in.given("format")
                           ? "." + in.text("format")
                           : std::filesystem::path(in.text("file")).extension().string();
  std::transform(format.begin(), format.end(), format.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return format == ".geojson" || format == ".svg" ? format.substr(1) : std::string();
}

/// Lines as features of GeoJSON. Closed lines end with their first point.
std::string geoJson(const std::vector<ContourLine>& lines) {
  std::string text = "{\"type\": \"FeatureCollection\", \"features\": [";
  const auto out = std::back_inserter(text);
  const char* between = "\n";
  for (const ContourLine& line : lines) {
    fmt::format_to(out,
                   "{}{{\"type\": \"Feature\", \"properties\": {{\"height\": {}}}, \"geometry\": "
                   "{{\"type\": \"LineString\", \"coordinates\": [",
                   between, line.height);
    between = ",\n";
    const auto add = [&](const Imath::V2d& p, bool isFirst) {
      fmt::format_to(out, "{}[{},{},{}]", isFirst ? "" : ",", p.x, p.y, line.height);
    };
    for (std::size_t n = 0; n < line.points.size(); ++n) add(line.points[n], n == 0);
    if (line.isClosed) add(line.points[0], false);
    text += "]}}";
  }
  return text + "\n]}\n";
}

/// Lines as a picture of 1000 units on its longer side, with north at the top.
std::string contourSvg(const std::vector<ContourLine>& lines, const HeightField& terrain) {
  const Imath::V2d low = terrain.origin,
                   high = terrain.position(terrain.columns - 1, terrain.rows - 1);
  const Imath::V2d size = high - low;
  const double scale = 1000 / std::max({size.x, size.y, 1e-300});
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.2f} {:.2f}\">\n"
      "<g fill=\"none\" stroke=\"black\" stroke-width=\"1\">\n",
      size.x * scale, size.y * scale);
  const auto out = std::back_inserter(text);
  for (const ContourLine& line : lines) {
    fmt::format_to(out, "<path data-height=\"{}\" d=\"", line.height);
    for (std::size_t n = 0; n < line.points.size(); ++n) {
      const Imath::V2d p = line.points[n];
      fmt::format_to(out, "{}{:.2f} {:.2f}", n == 0 ? "M" : "L", (p.x - low.x) * scale,
                     (high.y - p.y) * scale);
    }
    text += line.isClosed ? "Z\"/>\n" : "\"/>\n";
  }
  return text + "</g>\n</svg>\n";
}

Value drawContours(Invocation& in) {
  const HeightField& terrain = in.operands[0].terrain();
  const std::vector<double> heights =
      levelset::contourHeights(terrain, in.number("interval"), in.number("base"));
  const std::vector<ContourLine> lines = levelset::contourLines(
      terrain, heights, {.maxMemory = in.maxMemory, .progress = in.progress});
  std::size_t points = 0, closed = 0;
  for (const ContourLine& line : lines) {
    points += line.points.size();
    closed += line.isClosed;
  }
  // A point takes up to 75 letters.
  levelset::requireMemory(static_cast<double>(points) * 100, in.maxMemory);
  writeText(in.text("file"),
            contourFormat(in) == "svg" ? contourSvg(lines, terrain) : geoJson(lines), "contours");
  in.notes.detailsJson = Json{
      {"heights", heights.size()},
      {"lines", lines.size()},
      {"closed", closed},
      {"points", points}}.dump();
  in.notes.notes.push_back(
      fmt::format("contours: {} lines, {} of them closed", lines.size(), closed));
  if (lines.empty())
    in.notes.warnings.push_back(fmt::format(
        "contours: no line crosses the terrain, so {} has none; give a smaller --interval or "
        "another --base",
        in.text("file")));
  return in.operands[0];
}

void validateContours(const Invocation& in) {
  if (contourFormat(in).empty())
    throw levelset::UsageError(
        fmt::format("contours: '{}' is of no known format; use geojson or svg",
                    in.given("format") ? in.text("format") : in.text("file")));
}

}  // namespace

Operator contoursOperator() {
  return {
      .name = "contours",
      .group = "Terrain",
      .summary = "write the contour lines of a terrain (geojson, svg)",
      .details =
          "Lines are at the heights base + n × interval. They are closed, or end at the border of "
          "the "
          "data. Higher ground is on their left. Each line of GeoJSON has its height as a property "
          "and as the third coordinate. The terrain stays on the stack.",
      .example =
          "levelsmith read <(printf 'ncols 3\\nnrows 3\\nxllcorner 0\\nyllcorner 0\\ncellsize "
          "1\\n0 1 0\\n1 2 1\\n0 1 0\\n') --format asc ! contours lines.svg "
          "--interval "
          "0.5",
      .params = {{.name = "file",
                  .type = ParamType::Path,
                  .doc = "file to write, or - for standard output",
                  .required = true,
                  .position = 0},
                 {.name = "interval",
                  .type = ParamType::Number,
                  .doc = "difference of height between lines",
                  .range = Range::Positive,
                  .required = true},
                 {.name = "base",
                  .type = ParamType::Number,
                  .doc = "height from which the intervals count",
                  .fallback = "0"},
                 {.name = "format",
                  .type = ParamType::Text,
                  .doc = "format of the file: geojson or svg; default: by its extension"}},
      .operands = {{Kind::Terrain}},
      .flow = Flow::PassesThrough,
      .run = drawContours,
      .validate = validateContours,
      .targets = [](const Invocation& in) { return std::vector{in.text("file")}; },
      .usesStandardOutput =
          [](const Invocation& in) { return levelset::isStandardOutput(in.text("file")); },
  };
}

}  // namespace pipeline
