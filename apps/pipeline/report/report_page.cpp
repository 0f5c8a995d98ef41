#include "apps/pipeline/report/report_page.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "apps/html_text.h"
#include "apps/pipeline/report/versions.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using apps::escapedHtml;

constexpr const char* kPageHead = R"HTML(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>levelsmith report</title>
<style>
:root { color-scheme: light dark; --ground: #fbfaf8; --card: #fff; --ink: #23211e; --faint: #6c675f; --line: #e2ded6;
  --share: #dce8f4; --good: #1f6b3a; --good-ground: #e4f3e8; --bad: #9c1c14; --bad-ground: #fbe4e1; --warn: #7a4d00;
  --warn-ground: #fdf1d8; --picture: #edeae4; }
@media (prefers-color-scheme: dark) {
  :root { --ground: #1a1917; --card: #232120; --ink: #eae6df; --faint: #a49e94; --line: #3b3835; --share: #243a50;
    --good: #8fd8a6; --good-ground: #1d3325; --bad: #ffaca3; --bad-ground: #47201c; --warn: #f2c879; --warn-ground: #3d3016;
    --picture: #312e2b; }
}
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 92rem; padding: 1.5rem 1.25rem 4rem; font: 15px/1.45 system-ui, sans-serif;
  background: var(--ground); color: var(--ink); }
h1 { margin: 0; font-size: 1.7rem; } h1 small { font-size: 1rem; font-weight: normal; color: var(--faint); }
h2 { margin: 2rem 0 .6rem; font-size: 1.15rem; }
code, pre { font: 13px/1.45 ui-monospace, monospace; unicode-bidi: isolate; }
code { overflow-wrap: anywhere; }
pre { overflow: auto; max-height: 32rem; margin: .4rem 0; padding: .7rem .9rem; background: var(--ground);
  border: 1px solid var(--line); border-radius: 6px; }
.verdict { display: inline-block; margin: .8rem 0; padding: .35rem .8rem; border-radius: 6px; overflow-wrap: anywhere; }
.good { background: var(--good-ground); color: var(--good); }
.bad { background: var(--bad-ground); color: var(--bad); }
.warn { background: var(--warn-ground); color: var(--warn); padding: .1rem .5rem; border-radius: 4px; overflow-wrap: anywhere; }
.totals { display: flex; flex-wrap: wrap; gap: .6rem 2.2rem; margin: .4rem 0; }
.totals dt { color: var(--faint); font-size: 12px; } .totals dd { margin: 0; font-size: 1.15rem; }
.scroll { overflow-x: auto; background: var(--card); border: 1px solid var(--line); border-radius: 8px; }
table { width: 100%; border-collapse: collapse; }
caption { text-align: left; padding: .6rem .8rem; color: var(--faint); font-size: 13px; }
th, td { padding: .45rem .8rem; text-align: left; vertical-align: top; }
thead th { font-size: 12px; font-weight: 600; color: var(--faint); white-space: nowrap; }
tbody { border-top: 1px solid var(--line); }
tbody th { font-weight: normal; min-width: 14rem; max-width: 30rem; }
.n { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
.w { white-space: nowrap; } .narrow { display: inline-block; max-width: 100%; }
.faint { color: var(--faint); font-size: 13px; }
.picture { width: 176px; padding-right: 0; }
.picture img { display: block; background: var(--picture); border-radius: 6px; }
.tag { display: inline-block; padding: 0 .45rem; border: 1px solid var(--line); border-radius: 9px; color: var(--faint);
  font-size: 12px; }
.more td { padding-top: 0; font-size: 13px; }
.more ul, .plain { list-style: none; margin: 0; padding: 0; } .more li, .plain li { margin: .15rem 0; }
summary { cursor: pointer; color: var(--faint); }
</style>
</head>
<body>
)HTML";

/// Returns the meaning of an exit code.
const char* meaningOf(int exitCode) {
  switch (static_cast<levelset::ExitCode>(exitCode)) {
    case levelset::ExitCode::Done:
      return "done";
    case levelset::ExitCode::Usage:
      return "the command line is wrong";
    case levelset::ExitCode::Input:
      return "the input data is not usable";
    case levelset::ExitCode::Resource:
      return "memory or another limit would be exceeded";
    case levelset::ExitCode::Numeric:
      return "a numeric check failed";
    case levelset::ExitCode::File:
      return "a file cannot be read or written";
    case levelset::ExitCode::Interrupted:
      return "interrupted";
  }
  return "failed";
}

// === Numbers

std::string figure(double value, int digits = 4) {
  return std::isfinite(value) ? fmt::format("{:.{}g}", value, digits) : "–";
}

std::string secondsText(double seconds) {
  return std::isfinite(seconds) ? fmt::format("{:.2f}", seconds) : "–";
}

std::string megabytes(double bytes) {
  return std::isfinite(bytes) ? fmt::format("{:.0f}", bytes * 1e-6) : "–";
}

/// Formats 1234567 as 1,234,567.
std::string grouped(double count) {
  const std::string digits = fmt::format("{:.0f}", count);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ',';
    text += digits[i];
  }
  return text;
}

std::string pointText(const Imath::V3d& p) {
  return fmt::format("{:.6g}, {:.6g}, {:.6g}", p.x, p.y, p.z);
}

/// Formats a half width in voxels and in world units.
std::string widthText(double voxels, double voxelSize) {
  return fmt::format("±{} vx = ±{}", figure(voxels), figure(voxels * voxelSize));
}

// === Actions

/// Quotes a text so that a shell reads it as one word.
std::string quotedWord(const std::string& text) {
  const std::string plain = "_-./,:=@%+";
  const bool isPlain = !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) {
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
           plain.find(c) != std::string::npos;
  });
  if (isPlain) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

/// Formats a step as on the command line. A positional option is written without its name if all
/// positional options before it are given.
std::string actionText(const StepReport& step) {
  const Operator* op = findOperator(step.action);
  std::map<int, std::string> places;
  if (op)
    for (const Param& param : op->params)
      if (const auto it = step.parameters.find(param.name);
          param.position >= 0 && it != step.parameters.end() && !it->second.starts_with("--"))
        places[param.position] = param.name;
  std::string text = step.action;
  std::vector<std::string> placed;
  for (const auto& [position, name] : places) {
    if (position != static_cast<int>(placed.size())) break;
    placed.push_back(name);
    text += fmt::format(" {}", quotedWord(step.parameters.at(name)));
  }
  for (const auto& [name, value] : step.parameters) {
    if (std::find(placed.begin(), placed.end(), name) != placed.end()) continue;
    const Param* param = op ? op->find(name) : nullptr;
    if (param && param->type == ParamType::Flag)
      text += fmt::format(" --{}", name);
    else
      text +=
          fmt::format(" --{}{}{}", name, value.starts_with("--") ? '=' : ' ', quotedWord(value));
  }
  return text;
}

/// Formats a JSON text with indentation; other texts stay unchanged.
std::string prettyJson(const std::string& text) {
  const auto json = nlohmann::ordered_json::parse(text, nullptr, false);
  return json.is_discarded()
             ? text
             : json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string folded(const std::string& title, const std::string& text) {
  return fmt::format("<details><summary>{}</summary><pre>{}</pre></details>", title,
                     escapedHtml(text));
}

// === Steps

class StepTable {
 public:
  explicit StepTable(const RunReport& report) : report_(report) {
    for (const StepReport& step : report.steps) {
      wall_ += step.wallSeconds;
      if (!step.thumbnail.png.empty() || !step.thumbnail.missing.empty()) hasPictures_ = true;
    }
  }

  [[nodiscard]] std::string html() const {
    std::string text = fmt::format(
        "<div class=\"scroll\"><table>\n<caption>{}</caption>\n<thead><tr>{}<th "
        "scope=\"col\">action</th><th scope=\"col\" class=\"n\">wall s</th><th scope=\"col\" "
        "class=\"n\">CPU s</th><th scope=\"col\" class=\"n\">peak MB</th><th scope=\"col\" "
        "class=\"n\">size</th><th scope=\"col\" class=\"n\">voxel size</th><th scope=\"col\">half "
        "width</th><th scope=\"col\">region of interest</th><th scope=\"col\">error "
        "estimate</th></tr></thead>\n",
        report_.dryRun ? "Predicted result of each step"
                       : "Result and cost of each step, in the order of the graph",
        hasPictures_ ? "<th scope=\"col\">result</th>" : "");
    for (std::size_t i = 0; i < report_.steps.size(); ++i) text += row(report_.steps[i], i);
    return text + "</table></div>\n";
  }

 private:
  [[nodiscard]] std::string row(const StepReport& step, std::size_t index) const {
    const std::string more = moreOf(step);
    std::string text = "<tbody>\n<tr>";
    if (hasPictures_)
      text += fmt::format("<td class=\"picture\"{}>{}</td>", more.empty() ? "" : " rowspan=\"2\"",
                          pictureOf(step, index));
    text += "<th scope=\"rowgroup\">" + headOf(step) + "</th>";
    // The bar behind the wall time shows the share of this step in the wall time of all steps.
    const double share = wall_ > 0 && step.wallSeconds > 0 ? 100 * step.wallSeconds / wall_ : 0;
    if (step.isCached || report_.dryRun)
      text += "<td class=\"n\">–</td><td class=\"n\">–</td><td class=\"n\">–</td>";
    else
      text += fmt::format(
          "<td class=\"n\" style=\"background:linear-gradient(to left,var(--share) "
          "{:.1f}%,transparent 0)\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>",
          share, secondsText(step.wallSeconds), secondsText(step.cpuSeconds),
          megabytes(step.peakBytes));
    const bool isBand = step.voxelSize > 0;
    text += fmt::format(
        "<td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"w\">{}</td><td "
        "class=\"w\">{}</td><td>{}</td></tr>\n",
        sizeOf(step), isBand ? figure(step.voxelSize, 6) : "",
        isBand ? widthText(step.halfWidth, step.voxelSize) : "", neededOf(step), errorsOf(step));
    if (!more.empty()) text += "<tr class=\"more\"><td colspan=\"9\">" + more + "</td></tr>\n";
    return text + "</tbody>\n";
  }

  static std::string pictureOf(const StepReport& step, std::size_t index) {
    if (step.resultKind.empty()) return "";
    if (step.thumbnail.png.empty()) {
      const std::string reason =
          step.thumbnail.missing.empty() ? "not requested" : step.thumbnail.missing;
      return "<span class=\"faint\">no picture: " + escapedHtml(reason) + "</span>";
    }
    return fmt::format(
        "<img src=\"data:image/png;base64,{}\" width=\"{}\" height=\"{}\" alt=\"{}\">",
        apps::base64(step.thumbnail.png), kThumbnailWidth, kThumbnailHeight,
        escapedHtml(fmt::format("the {} of step {}, {}", step.resultKind, index + 1, step.action)));
  }

  static std::string headOf(const StepReport& step) {
    std::string text = "<code>" + escapedHtml(actionText(step)) + "</code>";
    std::string tags;
    const auto tag = [&](const std::string& words) {
      tags += " <span class=\"tag\">" + escapedHtml(words) + "</span>";
    };
    if (!step.resultName.empty()) tag("@" + step.resultName);
    if (!step.resultKind.empty()) tag(step.resultKind);
    if (step.isCached) tag("from an earlier run");
    if (!step.location.empty()) tag(step.location);
    return tags.empty() ? text : text + "<br>" + tags.substr(1);
  }

  [[nodiscard]] std::string sizeOf(const StepReport& step) const {
    if (step.voxelSize > 0)
      return report_.dryRun ? "about " + figure(step.activeVoxels, 3) + " active voxels"
                            : grouped(step.activeVoxels) + " active voxels";
    if (step.triangles > 0) return grouped(static_cast<double>(step.triangles)) + " triangles";
    return "";
  }

  static std::string neededOf(const StepReport& step) {
    if (step.roi.isWhole()) return step.voxelSize > 0 ? "all" : "";
    std::string text;
    if (!std::isinf(step.roi.halfWidth))
      text = step.voxelSize > 0 ? widthText(step.roi.halfWidth, step.voxelSize)
                                : fmt::format("±{} vx", figure(step.roi.halfWidth));
    if (levelset::isEverywhere(step.roi.region)) return text;
    if (!text.empty()) text += "<br>";
    const Imath::Box3d& box = step.roi.region;
    return text + fmt::format("<span class=\"faint\">the box from {}<br>to {}</span>",
                              pointText(box.min), pointText(box.max));
  }

  static std::string errorsOf(const StepReport& step) {
    std::string text;
    for (const ErrorEstimate& error : step.notes.errors)
      text += fmt::format("{}{}: {}{}", text.empty() ? "" : "<br>", escapedHtml(error.measure),
                          figure(error.value, 2),
                          error.unit.empty() ? "" : " " + escapedHtml(error.unit));
    return text;
  }

  /// Formats the warnings, notes, resolved lengths, certificate, details and default options of a
  /// step as HTML.
  static std::string moreOf(const StepReport& step) {
    std::string items, folds;
    for (const std::string& warning : step.notes.warnings)
      items += "<li><span class=\"warn\">" + escapedHtml(warning) + "</span></li>";
    for (const std::string& note : step.notes.notes) items += "<li>" + escapedHtml(note) + "</li>";
    for (const Resolved& length : step.notes.lengths)
      items += fmt::format(
          "<li><code>{}</code> = {}{}{}</li>", escapedHtml(length.param), figure(length.world, 6),
          length.voxels ? " = " + figure(*length.voxels) + " vx" : "",
          length.written.empty() ? ""
                                 : " <span class=\"faint\">written <code>" +
                                       escapedHtml(length.written) + "</code></span>");
    if (!step.notes.certificateJson.empty())
      folds += folded("certificate", prettyJson(step.notes.certificateJson));
    if (!step.notes.detailsJson.empty())
      folds += folded("details", prettyJson(step.notes.detailsJson));
    if (!step.defaults.empty()) {
      std::string lines;
      for (const auto& [name, value] : step.defaults) lines += "--" + name + " " + value + "\n";
      folds += folded("options with their default values", lines);
    }
    return (items.empty() ? "" : "<ul>" + items + "</ul>") + folds;
  }

  const RunReport& report_;
  double wall_ = 0;
  bool hasPictures_ = false;
};

// === Sections of the page beside the table of steps

std::string headingOf(const RunReport& report) {
  std::string text = fmt::format(
      "<header>\n<h1>levelsmith <small>{}</small></h1>\n<p class=\"verdict {}\">{}exit code {}: "
      "{}{}</p>\n",
      LEVELSMITH_VERSION, report.exitCode == 0 && report.error.empty() ? "good" : "bad",
      report.dryRun ? "dry run, nothing was computed; " : "", report.exitCode,
      meaningOf(report.exitCode),
      report.error.empty() ? "" : "<br><strong>" + escapedHtml(report.error) + "</strong>");
  double wall = 0, cpu = 0, peak = 0;
  std::size_t warnings = report.warnings.size();
  for (const StepReport& step : report.steps) {
    wall += step.wallSeconds;
    cpu += step.cpuSeconds;
    peak = std::max(peak, step.peakBytes);
    warnings += step.notes.warnings.size();
  }
  text += "<dl class=\"totals\">";
  const auto total = [&](const char* name, const std::string& value) {
    text += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>", name, value);
  };
  total("steps", fmt::format("{}", report.steps.size()));
  if (!report.dryRun) {
    total("wall time of all steps", secondsText(wall) + " s");
    total("CPU time", secondsText(cpu) + " s");
    total("peak memory", megabytes(peak) + " MB");
    if (report.tolerance && !report.tolerance->rounds.empty()) {
      double tried = 0;
      for (const ToleranceRound& round : report.tolerance->rounds) tried += round.seconds;
      total("wall time of all voxel sizes tried", secondsText(tried) + " s");
    }
  }
  total("warnings", fmt::format("{}", warnings));
  return text + "</dl>\n</header>\n";
}

std::string listOf(const char* title, const std::vector<std::string>& lines, const char* mark) {
  if (lines.empty()) return "";
  std::string text = fmt::format("<h2>{}</h2>\n<ul class=\"plain\">\n", title);
  for (const std::string& line : lines)
    text += fmt::format("<li><span{}>{}</span></li>\n", mark, escapedHtml(line));
  return text + "</ul>\n";
}

std::string creaseText(const ToleranceOutput& output) {
  return output.crease > 0 ? fmt::format("{}, {}&nbsp;% of the surface", figure(output.crease, 3),
                                         figure(100 * output.creaseShare, 2))
                           : "none";
}

std::string toleranceOutputs(const ToleranceReport& tolerance) {
  std::string text =
      "<div class=\"scroll\"><table>\n<caption>Largest error requested and achieved, away from "
      "creases that the field cannot represent, world units</caption>\n<thead><tr><th "
      "scope=\"col\">result</th><th scope=\"col\" class=\"n\">requested</th><th scope=\"col\" "
      "class=\"n\">achieved</th><th scope=\"col\">reached</th><th scope=\"col\">by</th><th "
      "scope=\"col\">near creases</th><th scope=\"col\" "
      "class=\"n\">order</th></tr></thead>\n<tbody>\n";
  for (const ToleranceOutput& output : tolerance.outputs)
    text += fmt::format(
        "<tr><th scope=\"row\"><code>{}</code></th><td class=\"n\">{}</td><td "
        "class=\"n\">{}</td><td><span class=\"verdict {}\" "
        "style=\"margin:0\">{}</span></td><td>{}</td><td>{}</td><td class=\"n\">{}</td></tr>\n",
        escapedHtml(output.name), figure(output.requested), figure(output.achieved, 3),
        output.isReached() ? "good" : "bad", output.isReached() ? "yes" : "no",
        output.isMeasured ? "measurement" : "estimate", creaseText(output),
        figure(output.order, 3));
  return text + "</tbody>\n</table></div>\n";
}

std::string toleranceRounds(const ToleranceReport& tolerance) {
  std::string text =
      "<div class=\"scroll\" style=\"margin-top:1rem\"><table>\n<caption>Voxel sizes "
      "tried</caption>\n<thead><tr><th scope=\"col\">voxel size</th><th scope=\"col\" "
      "class=\"n\">wall s</th><th scope=\"col\">outcome</th></tr></thead>\n<tbody>\n";
  for (const ToleranceRound& round : tolerance.rounds) {
    std::string found;
    for (const ToleranceOutput& output : round.outputs)
      found +=
          fmt::format("<li>error of <code>{}</code> {}, near creases: {}</li>",
                      escapedHtml(output.name), figure(output.achieved, 3), creaseText(output));
    if (!round.failure.empty())
      found += "<li><span class=\"warn\">" + escapedHtml(round.failure) + "</span></li>";
    text += fmt::format(
        "<tr><th scope=\"row\">{}{}</th><td class=\"n\">{}</td><td>{}</td></tr>\n",
        figure(round.voxelSize),
        round.voxelSize == tolerance.voxelSize ? " <span class=\"tag\">kept</span>" : "",
        secondsText(round.seconds), found.empty() ? "" : "<ul class=\"plain\">" + found + "</ul>");
  }
  return text + "</tbody>\n</table></div>\n";
}

std::string toleranceSection(const ToleranceReport& tolerance) {
  std::string text = fmt::format("<h2>Tolerance</h2>\n<p>Requested: <code>{}</code>. ",
                                 escapedHtml(tolerance.written));
  if (tolerance.modelVoxelSize > 0)
    text += fmt::format("The error models chose voxels of {} before the run",
                        figure(tolerance.modelVoxelSize));
  else
    text += "The error models could not predict the voxel size";
  for (std::size_t i = 0; i < tolerance.models.size(); ++i)
    text += fmt::format("{}<code>{}</code>", i == 0 ? "; they are fitted to " : ", ",
                        escapedHtml(tolerance.models[i]));
  text += ".</p>\n";
  if (!tolerance.limit.empty())
    text += "<p><span class=\"warn\">" + escapedHtml(tolerance.limit) + "</span></p>\n";
  if (!tolerance.outputs.empty()) text += toleranceOutputs(tolerance);
  if (!tolerance.rounds.empty()) text += toleranceRounds(tolerance);
  return text;
}

std::string versionTable() {
  std::string text =
      "<h2>Versions</h2>\n<div class=\"scroll narrow\"><table>\n<caption>Parts of the "
      "program</caption>\n<thead><tr><th scope=\"col\">part</th><th "
      "scope=\"col\">version</th></tr></thead>\n<tbody>\n";
  for (const auto& [name, version] : programVersions())
    text += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escapedHtml(name),
                        escapedHtml(version));
  return text + "</tbody>\n</table></div>\n";
}

std::string graphSection(const RunReport& report) {
  if (report.graphJson.empty()) return "";
  return fmt::format(
      "<h2>The graph</h2>\n<p>The graph computes the same results again: <a "
      "download=\"graph.json\" "
      "href=\"data:application/json;base64,{}\">save it</a> as <code>graph.json</code>, then "
      "<code>levelsmith run graph.json</code>. File names are as the user wrote them. Options of "
      "the run, such as <code>--max-memory</code>, are not part of the graph.</p>\n"
      "<details><summary>graph.json</summary><pre>{}</pre></details>\n",
      apps::base64(report.graphJson), escapedHtml(report.graphJson));
}

}  // namespace

std::string reportPage(const RunReport& report) {
  std::string page = kPageHead + headingOf(report) + "<main>\n";
  page += listOf("Warnings", report.warnings, " class=\"warn\"");
  if (report.tolerance) page += toleranceSection(*report.tolerance);
  if (!report.steps.empty()) page += "<h2>Steps</h2>\n" + StepTable(report).html();
  page += listOf("Left out, because no requested result depends on it", report.leftOut, "");
  return page + graphSection(report) + versionTable() + "</main>\n</body>\n</html>\n";
}

}  // namespace pipeline
