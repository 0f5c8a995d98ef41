#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <string>
#include <utility>

#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
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

/// Writes lines to a file one by one, so that memory does not grow with their number.
class ContourWriter {
 public:
  ContourWriter(const std::filesystem::path& path, bool isSvg, const HeightField& terrain)
      : path_(path), target_(path), isSvg_(isSvg) {
    file_ = std::fopen(target_.path().c_str(), "wb");
    if (!file_) fail();
    const Imath::V2d low = terrain.origin,
                     high = terrain.position(terrain.columns - 1, terrain.rows - 1);
    corner_ = {low.x, high.y};
    scale_ = 1000 / std::max({high.x - low.x, high.y - low.y, 1e-300});
    if (isSvg)
      text_ = fmt::format(
          "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.2f} {:.2f}\">\n"
          "<g fill=\"none\" stroke=\"black\" stroke-width=\"1\">\n",
          (high.x - low.x) * scale_, (high.y - low.y) * scale_);
    else
      text_ = "{\"type\": \"FeatureCollection\", \"features\": [";
  }
  ~ContourWriter() {
    if (file_) std::fclose(file_);
  }
  ContourWriter(const ContourWriter&) = delete;
  ContourWriter& operator=(const ContourWriter&) = delete;

  void add(const ContourLine& line) {
    if (isSvg_)
      addSvg(line);
    else
      addJson(line);
    ++lines;
    points += line.points.size();
    closed += line.isClosed;
    if (text_.size() > kBuffer) flush();
  }

  void finish() {
    text_ += isSvg_ ? "</g>\n</svg>\n" : "\n]}\n";
    flush();
    if (std::fclose(std::exchange(file_, nullptr)) != 0) fail();
    target_.commit();
  }

  std::size_t lines = 0, points = 0, closed = 0;

 private:
  static constexpr std::size_t kBuffer = std::size_t{1} << 20;

  [[noreturn]] void fail() const {
    throw levelset::IoError(fmt::format("{}: {}; free some space or choose another folder",
                                        path_.string(), std::strerror(errno)));
  }
  void flush() {
    if (std::fwrite(text_.data(), 1, text_.size(), file_) != text_.size()) fail();
    text_.clear();
  }

  /// Adds a feature of GeoJSON. A closed line ends with its first point.
  void addJson(const ContourLine& line) {
    const auto out = std::back_inserter(text_);
    fmt::format_to(out,
                   "{}{{\"type\": \"Feature\", \"properties\": {{\"height\": {}}}, \"geometry\": "
                   "{{\"type\": \"LineString\", \"coordinates\": [",
                   lines == 0 ? "\n" : ",\n", line.height);
    const auto add = [&](const Imath::V2d& p, bool isFirst) {
      fmt::format_to(out, "{}[{},{},{}]", isFirst ? "" : ",", p.x, p.y, line.height);
    };
    for (std::size_t n = 0; n < line.points.size(); ++n) add(line.points[n], n == 0);
    if (line.isClosed) add(line.points[0], false);
    text_ += "]}}";
  }

  /// Adds a path in a picture of 1000 units on its longer side, with north at the top.
  void addSvg(const ContourLine& line) {
    const auto out = std::back_inserter(text_);
    fmt::format_to(out, "<path data-height=\"{}\" d=\"", line.height);
    for (std::size_t n = 0; n < line.points.size(); ++n) {
      const Imath::V2d p = line.points[n];
      fmt::format_to(out, "{}{:.2f} {:.2f}", n == 0 ? "M" : "L", (p.x - corner_.x) * scale_,
                     (corner_.y - p.y) * scale_);
    }
    text_ += line.isClosed ? "Z\"/>\n" : "\"/>\n";
  }

  std::filesystem::path path_;
  levelset::FileTarget target_;
  std::FILE* file_ = nullptr;
  bool isSvg_;
  Imath::V2d corner_;
  double scale_ = 1;
  std::string text_;
};

Value drawContours(Invocation& in) {
  const HeightField& terrain = in.operands[0].terrain();
  const std::vector<double> heights =
      levelset::contourHeights(terrain, in.number("interval"), in.number("base"));
  ContourWriter writer(in.text("file"), contourFormat(in) == "svg", terrain);
  levelset::forEachContourLine(terrain, heights, [&](const ContourLine& line) { writer.add(line); },
                               {.maxMemory = in.maxMemory, .progress = in.progress});
  writer.finish();
  in.notes.detailsJson = Json{
      {"heights", heights.size()},
      {"lines", writer.lines},
      {"closed", writer.closed},
      {"points",
       writer.points}}.dump();
  in.notes.notes.push_back(
      fmt::format("contours: {} lines, {} of them closed", writer.lines, writer.closed));
  if (writer.lines == 0)
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
