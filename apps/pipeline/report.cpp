#include "apps/pipeline/report.h"

#include <fmt/core.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/pipeline/refusal.h"
#include "levelset/error.h"
#include "levelset/file_target.h"

namespace pipeline {
namespace {

using Json = nlohmann::ordered_json;

Json toJson(const StepReport& step) {
  Json json;
  json["action"] = step.action;
  if (!step.resultName.empty()) json["name"] = step.resultName;
  json["parameters"] = step.parameters;
  json["defaults"] = step.defaults;
  for (const Resolved& length : step.notes.lengths) {
    Json& entry = json["resolved"][length.param];
    entry["written"] = length.written;
    entry["world"] = length.world;
    if (length.voxels) entry["voxels"] = *length.voxels;
  }
  json["wall_s"] = step.wallSeconds;
  json["cpu_s"] = step.cpuSeconds;
  json["peak_bytes"] = step.peakBytes;
  if (!step.resultKind.empty()) {
    Json& result = json["result"];
    result["kind"] = step.resultKind;
    if (step.voxelSize > 0) {
      result["voxel_size"] = step.voxelSize;
      result["half_width"] = step.halfWidth;
      result["active_voxels"] = step.activeVoxels;
    }
    if (step.triangles > 0) result["triangles"] = step.triangles;
  }
  if (!step.notes.certificateJson.empty())
    json["certificate"] = Json::parse(step.notes.certificateJson);
  if (!step.notes.detailsJson.empty()) json["details"] = Json::parse(step.notes.detailsJson);
  json["errors"] = Json::array();
  for (const ErrorEstimate& error : step.notes.errors)
    json["errors"].push_back(
        {{"measure", error.measure}, {"value", error.value}, {"unit", error.unit}});
  json["warnings"] = step.notes.warnings;
  json["notes"] = step.notes.notes;
  return json;
}

std::string escaped(const std::string& text) {
  std::string result;
  for (char c : text) {
    if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '&')
      result += "&amp;";
    else
      result += c;
  }
  return result;
}

std::string writtenAs(const StepReport& step) {
  std::string text = step.action;
  for (const auto& [name, value] : step.parameters)
    text += value == "true" ? " --" + name : " --" + name + " " + value;
  return text;
}

std::string errorText(const StepReport& step) {
  std::string text;
  for (const ErrorEstimate& error : step.notes.errors) {
    if (!text.empty()) text += ", ";
    text += fmt::format("{} {:.2g}{}{}", error.measure, error.value, error.unit.empty() ? "" : " ",
                        error.unit);
  }
  return text;
}

/// In small letters.
std::string extensionOf(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

bool isHtml(const std::filesystem::path& path) {
  return extensionOf(path) == ".html" || extensionOf(path) == ".htm";
}

}  // namespace

std::string reportJson(const RunReport& report) {
  Json json;
  json["version"] = LEVELSMITH_VERSION;
  json["exit_code"] = report.exitCode;
  if (report.dryRun) json["dry_run"] = true;
  if (!report.error.empty()) json["error"] = report.error;
  json["steps"] = Json::array();
  for (const StepReport& step : report.steps) json["steps"].push_back(toJson(step));
  json["warnings"] = report.warnings;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string reportHtml(const RunReport& report) {
  std::string page =
      "<!doctype html><meta charset=\"utf-8\"><title>levelsmith report</title>\n"
      "<style>body{font:15px sans-serif;margin:2em}table{border-collapse:collapse}"
      "td,th{padding:.3em .8em;border-bottom:1px solid #ccc;text-align:left;vertical-align:top}"
      "td.n{text-align:right;font-variant-numeric:tabular-nums}</style>\n"
      "<h1>levelsmith</h1>\n<table><tr><th>action<th>wall s<th>CPU s<th>peak MB<th>active "
      "voxels<th>error<th>notes\n";
  for (const StepReport& step : report.steps) {
    std::string notes;
    for (const Resolved& length : step.notes.lengths) {
      notes += escaped(fmt::format("{} = {:.6g}", length.param, length.world));
      if (length.voxels) notes += fmt::format(" ({:.4g} vx)", *length.voxels);
      notes += "<br>";
    }
    for (const std::string& text : step.notes.notes) notes += escaped(text) + "<br>";
    for (const std::string& text : step.notes.warnings) notes += "<b>" + escaped(text) + "</b><br>";
    page += fmt::format(
        "<tr><td><code>{}</code><td class=n>{:.2f}<td class=n>{:.2f}<td class=n>{:.0f}<td "
        "class=n>{:.0f}<td>{}<td>{}\n",
        escaped(writtenAs(step)), step.wallSeconds, step.cpuSeconds, step.peakBytes * 1e-6,
        step.activeVoxels, escaped(errorText(step)), notes);
  }
  page += "</table>\n";
  for (const std::string& warning : report.warnings) page += "<p>" + escaped(warning) + "</p>\n";
  if (!report.error.empty()) page += "<p><b>" + escaped(report.error) + "</b></p>\n";
  return page;
}

void checkReportTarget(const Chain& chain) {
  const auto wanted = chain.globals.find("report");
  if (wanted == chain.globals.end()) return;
  for (const Action& action : chain.actions) {
    if (!action.op->targets) continue;
    for (const std::string& target : action.op->targets(Invocation(*action.op, action.options))) {
      if (!levelset::isSameFile(target, wanted->second)) continue;
      throw levelset::UsageError(
          fmt::format("--report: '{}' is what '{}' writes too; use another file for one of them",
                      wanted->second, action.op->name));
    }
  }
  const std::filesystem::path path = wanted->second;
  const std::string extension = extensionOf(path);
  std::error_code ignored;
  const bool isDevice = std::filesystem::is_other(path, ignored);
  if (!isDevice && !extension.empty() && extension != ".json" && !isHtml(path))
    throw levelset::UsageError(fmt::format(
        "--report: '{}' is no kind of report; name a .json or .html file", wanted->second));
  try {
    const levelset::FileTarget probe(wanted->second);
  } catch (const levelset::Error& error) {
    refuseAs("--report", error);
  }
}

void writeReport(const std::filesystem::path& path, const RunReport& report) {
  const std::string text = isHtml(path) ? reportHtml(report) : reportJson(report);
  try {
    levelset::FileTarget target(path);
    std::FILE* file = std::fopen(target.path().c_str(), "wb");
    if (!file) throw levelset::IoError(fmt::format("cannot write '{}'", path.string()));
    const bool whole = std::fwrite(text.data(), 1, text.size(), file) == text.size();
    if (std::fclose(file) != 0 || !whole)
      throw levelset::IoError(
          fmt::format("'{}' cannot be written to the end; is the disk full?", path.string()));
    target.commit();
  } catch (const levelset::Error& error) {
    refuseAs("--report", error);
  }
}

std::string stepLine(const StepReport& step, bool dryRun) {
  std::string line = fmt::format("{:<14}", step.action);
  if (!dryRun)
    line += fmt::format(" {:7.2f} s ({:.2f} s CPU), peak {:.0f} MB", step.wallSeconds,
                        step.cpuSeconds, step.peakBytes * 1e-6);
  if (step.voxelSize > 0) {
    line += fmt::format("; {:.3g} active voxels of {:.4g}{}", step.activeVoxels, step.voxelSize,
                        dryRun ? fmt::format(", about {:.3g} MB", step.activeVoxels * 12e-6) : "");
  }
  if (step.triangles > 0) line += fmt::format("; {} triangles", step.triangles);
  for (const Resolved& length : step.notes.lengths) {
    line += fmt::format("; {} = {:.6g}", length.param, length.world);
    if (length.voxels) line += fmt::format(" ({:.4g} vx)", *length.voxels);
  }
  if (const std::string errors = errorText(step); !errors.empty()) line += "; " + errors;
  return line;
}

}  // namespace pipeline
