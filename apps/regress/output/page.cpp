#include "apps/regress/output/page.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "apps/html_text.h"
#include "apps/regress/truth/columns.h"

namespace regress {
namespace {

using apps::escapedHtml;

constexpr const char* kHead = R"HTML(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Level-set regression suite</title>
<style>
body { font: 15px/1.45 sans-serif; margin: 2em auto; max-width: 1500px; padding: 0 1em; color: #222; }
table { border-collapse: collapse; margin: 0.6em 0 1.4em; font-size: 13px; }
th, td { border: 1px solid #ccc; padding: 2px 7px; text-align: right; white-space: nowrap; }
th { background: #f2f2f2; } td.t { text-align: left; white-space: normal; }
.bad { background: #fbd3d0; } .good { background: #e2f3e0; }
.plots { display: flex; flex-wrap: wrap; gap: 1em; } .plots img { width: 460px; }
.scroll { overflow-x: auto; }
</style></head><body>
)HTML";

std::string number(double value) {
  if (!std::isfinite(value)) return "–";
  if (value == 0) return "0";
  return std::abs(value) >= 1e6 ? fmt::format("{:.3e}", value) : fmt::format("{:.4g}", value);
}

/// Returns the columns in which at least one row has a figure.
std::vector<const Column*> used(const std::vector<Row>& rows) {
  std::vector<const Column*> list;
  for (const Column& column : columns())
    if (std::any_of(rows.begin(), rows.end(),
                    [&](const Row& row) { return row.figures.contains(column.name); }))
      list.push_back(&column);
  return list;
}

void appendSummary(const CaseResult& result, std::string& html) {
  if (result.summary.empty()) return;
  const std::vector<const Column*> list = used(result.summary);
  html += "<div class=\"scroll\"><table><tr><th>variant</th><th>tool</th><th>resolution</th>";
  for (const Column* column : list)
    html += fmt::format("<th title=\"{}\">{}</th>", escapedHtml(column->meaning),
                        escapedHtml(column->heading));
  html += "</tr>\n";
  for (const Row& row : result.summary) {
    html += fmt::format("<tr><td class=\"t\">{}</td><td class=\"t\">{}</td><td>{}</td>",
                        escapedHtml(row.variant), escapedHtml(row.tool), row.resolution);
    if (!row.failure.empty()) {
      html += fmt::format("<td class=\"t bad\" colspan=\"{}\">{}</td></tr>\n", list.size(),
                          escapedHtml(row.failure));
      continue;
    }
    for (const Column* column : list) {
      const auto it = row.figures.find(column->name);
      html +=
          fmt::format("<td>{}</td>", it == row.figures.end() ? std::string() : number(it->second));
    }
    html += "</tr>\n";
  }
  html += "</table></div>\n";
}

/// Formats the measured figure of a bound, or the kind of a bound without one.
std::string stated(const Bound& bound) {
  switch (bound.kind) {
    case Bound::Kind::Measured:
    case Bound::Kind::Order:
      return number(bound.stated);
    case Bound::Kind::Rounding:
      return fmt::format("{:g} ε", bound.stated);
    case Bound::Kind::Required:
      break;
  }
  return "required";
}

void appendBounds(const CaseResult& result, std::string& html) {
  if (result.judgements.empty()) return;
  html +=
      "<table><tr><th>variant</th><th>figure</th><th>resolution</th><th>stated "
      "figure</th><th>limit</th><th>found</th></tr>\n";
  for (const Judgement& j : result.judgements)
    html += fmt::format(
        "<tr class=\"{}\"><td class=\"t\">{}</td><td "
        "class=\"t\">{}</td><td>{}</td><td>{}</td><td>{} {}</td>"
        "<td>{}</td></tr>\n",
        j.passed ? "good" : "bad", escapedHtml(j.bound.variant), j.bound.figure, j.resolution,
        stated(j.bound), j.bound.sense == Sense::AtMost ? "≤" : "≥", number(j.bound.limit()),
        j.remark.empty() ? number(j.found) : escapedHtml(j.remark));
  html += "</table>\n";
}

void appendOutcomes(const CaseResult& result, std::string& html) {
  if (result.outcomes.empty()) return;
  html += "<table><tr><th>input</th><th>stated outcome</th><th>found</th></tr>\n";
  for (const Outcome& o : result.outcomes)
    html += fmt::format(
        "<tr class=\"{}\"><td class=\"t\">{}</td><td class=\"t\">{}</td><td "
        "class=\"t\">{}</td></tr>\n",
        o.passed ? "good" : "bad", escapedHtml(o.variant), escapedHtml(o.expected),
        escapedHtml(o.found));
  html += "</table>\n";
}

}  // namespace

std::string pageText(const SuiteResult& result, const std::vector<std::string>& plots) {
  std::string html = kHead;
  const std::vector<std::string> failed = failures(result);
  html += fmt::format(
      "<h1>Level-set regression suite</h1>\n<p>levelsmith {}, {} budget, {:.0f} CPU seconds. "
      "Figures are the worst over all positions of the object relative to the grid points; CPU "
      "seconds are the mean. Lengths are in voxels unless a heading says otherwise; the resolution "
      "is in voxels per unit of length. Times have no bounds. <a "
      "href=\"results.json\">results.json</a> and <a href=\"results.csv\">results.csv</a> contain "
      "every run.</p>\n",
      LEVELSMITH_VERSION, result.budget == Budget::Quick ? "quick" : "full", result.cpuSeconds);
  html += failed.empty()
              ? "<p class=\"good\">Every bound is met.</p>\n"
              : fmt::format("<p class=\"bad\">{} bounds are missed:</p><ul>\n", failed.size());
  for (const std::string& sentence : failed)
    html += fmt::format("<li>{}</li>\n", escapedHtml(sentence));
  if (!failed.empty()) html += "</ul>\n";
  html += "<h2>Error against run time</h2>\n<div class=\"plots\">\n";
  for (const std::string& name : plots)
    html += fmt::format("<a href=\"{0}.svg\"><img src=\"{0}.png\" alt=\"{0}\"></a>\n", name);
  html += plots.empty() ? "<p>There are no plots: --no-plots was given, or plots.py could not draw "
                          "them.</p></div>\n"
                        : "</div>\n";
  for (const CaseResult& c : result.cases) {
    html += fmt::format(
        "<h2 id=\"{0}\">{0}: {1}</h2>\n<p>{2}</p>\n<p>Source: {3}. {4:.1f} CPU seconds, including "
        "the measurement of errors.</p>\n",
        escapedHtml(c.of->name), escapedHtml(c.of->title), escapedHtml(c.of->definition),
        escapedHtml(c.of->citation), c.cpuSeconds);
    appendBounds(c, html);
    appendOutcomes(c, html);
    appendSummary(c, html);
  }
  return html + "</body></html>\n";
}

}  // namespace regress
