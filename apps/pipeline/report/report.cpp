#include "apps/pipeline/report/report.h"

#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/report/report_page.h"
#include "apps/pipeline/report/versions.h"
#include "apps/pipeline/values/refusal.h"
#include "apps/pipeline/values/text_file.h"
#include "levelset/error.h"
#include "levelset/file_target.h"

namespace pipeline {
namespace {

using Json = nlohmann::ordered_json;

Json toJson(const StepReport& step) {
  Json json;
  json["action"] = step.action;
  if (!step.resultName.empty()) json["name"] = step.resultName;
  if (!step.location.empty()) json["place"] = step.location;
  json["parameters"] = step.parameters;
  json["defaults"] = step.defaults;
  for (const Resolved& length : step.notes.lengths) {
    Json& entry = json["resolved"][length.param];
    entry["written"] = length.written;
    entry["world"] = length.world;
    if (length.voxels) entry["voxels"] = *length.voxels;
  }
  if (step.isCached) json["known"] = true;
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
    if (!std::isinf(step.roi.halfWidth)) result["needed"]["half_width"] = step.roi.halfWidth;
    if (!levelset::isEverywhere(step.roi.region)) {
      const auto& [low, high] = step.roi.region;
      result["needed"]["region"] = {{low.x, low.y, low.z}, {high.x, high.y, high.z}};
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

Json toJson(const ToleranceOutput& output) {
  return {{"name", output.name},
          {"requested", output.requested},
          {"achieved", output.achieved},
          {"measured", output.isMeasured},
          {"reached", output.isReached()},
          {"crease_error", output.crease},
          {"crease_share", output.creaseShare},
          {"order", output.order}};
}

Json toJson(const ToleranceReport& tolerance) {
  Json json;
  json["written"] = tolerance.written;
  json["reached"] = tolerance.isReached();
  if (tolerance.modelVoxelSize > 0) json["model_voxel_size"] = tolerance.modelVoxelSize;
  json["models"] = tolerance.models;
  if (tolerance.voxelSize > 0) json["voxel_size"] = tolerance.voxelSize;
  json["outputs"] = Json::array();
  for (const ToleranceOutput& output : tolerance.outputs) json["outputs"].push_back(toJson(output));
  json["rounds"] = Json::array();
  for (const ToleranceRound& round : tolerance.rounds) {
    Json entry = {{"voxel_size", round.voxelSize}, {"wall_s", round.seconds}};
    entry["outputs"] = Json::array();
    for (const ToleranceOutput& output : round.outputs) entry["outputs"].push_back(toJson(output));
    if (!round.failure.empty()) entry["failure"] = round.failure;
    json["rounds"].push_back(entry);
  }
  if (!tolerance.limit.empty()) json["limit"] = tolerance.limit;
  return json;
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

/// Extension in lower case.
std::string extensionOf(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

}  // namespace

std::string reportJson(const RunReport& report) {
  Json json;
  json["version"] = LEVELSMITH_VERSION;
  for (const auto& [name, version] : programVersions()) json["versions"][name] = version;
  json["exit_code"] = report.exitCode;
  if (report.dryRun) json["dry_run"] = true;
  if (!report.error.empty()) json["error"] = report.error;
  if (!report.graphJson.empty()) json["graph"] = Json::parse(report.graphJson);
  json["steps"] = Json::array();
  for (const StepReport& step : report.steps) json["steps"].push_back(toJson(step));
  if (report.tolerance) json["tolerance"] = toJson(*report.tolerance);
  json["left_out"] = report.leftOut;
  json["warnings"] = report.warnings;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

bool isPage(const std::filesystem::path& path) {
  return extensionOf(path) == ".html" || extensionOf(path) == ".htm";
}

void checkRunTargets(const Graph& graph) {
  std::vector<std::pair<std::string, std::string>> wanted;  // option and file
  for (const char* option : {"report", "save-graph"})
    if (const auto it = graph.globals.find(option); it != graph.globals.end())
      wanted.emplace_back(std::string("--") + option, it->second);
  if (wanted.size() == 2 && levelset::isSameFile(wanted[0].second, wanted[1].second))
    throw levelset::UsageError(
        fmt::format("--save-graph: --report writes '{}' too; use another file for one of them",
                    wanted[1].second));
  for (const auto& [option, file] : wanted) {
    for (const Node& node : graph.nodes) {
      if (!node.op->targets) continue;
      for (const std::string& target : node.op->targets(Invocation(*node.op, node.options))) {
        if (!levelset::isSameFile(target, file)) continue;
        throw levelset::UsageError(
            fmt::format("{}: the action '{}' writes '{}' too; use another file for one of them",
                        option, node.op->name, file));
      }
    }
    const std::filesystem::path path = file;
    const std::string extension = extensionOf(path);
    std::error_code ignored;
    const bool isDevice = std::filesystem::is_other(path, ignored);
    const bool isReport = option == "--report";
    if (!isDevice && (!extension.empty() || !isReport) && extension != ".json" &&
        !(isReport && isPage(path)))
      throw levelset::UsageError(
          fmt::format("{}: '{}' has no known extension for a {}; use a .json{} file", option, file,
                      isReport ? "report" : "graph", isReport ? " or .html" : ""));
    try {
      const levelset::FileTarget probe(file);
    } catch (const levelset::Error& error) {
      rethrowAs(option, error);
    }
  }
}

void writeReport(const std::filesystem::path& path, const RunReport& report) {
  writeText(path, isPage(path) ? reportPage(report) : reportJson(report), "--report");
}

std::vector<std::string> toleranceLines(const ToleranceReport& tolerance) {
  std::vector<std::string> lines;
  for (const ToleranceRound& round : tolerance.rounds) {
    std::string line =
        fmt::format("tolerance: voxels of {:.4g}, {:.2f} s", round.voxelSize, round.seconds);
    for (const ToleranceOutput& output : round.outputs)
      line += fmt::format("; error of {} {:.3g}", output.name, output.achieved);
    lines.push_back(line + (round.failure.empty() ? "" : "; " + round.failure));
  }
  for (const ToleranceOutput& output : tolerance.outputs) {
    std::string line =
        fmt::format("tolerance: {}: {:.4g} requested, {:.3g} {} with voxels of {:.4g}", output.name,
                    output.requested, output.achieved,
                    output.isReached() ? "achieved" : "achieved (not enough)", tolerance.voxelSize);
    if (output.crease > 0)
      line +=
          fmt::format("; near creases, which the field cannot represent, {:.3g}", output.crease);
    lines.push_back(line);
  }
  if (tolerance.outputs.empty())
    lines.push_back(
        tolerance.modelVoxelSize > 0
            ? fmt::format("tolerance: the error models choose voxels of {:.4g} for the first run",
                          tolerance.modelVoxelSize)
            : "tolerance: the error models cannot predict the voxel size of the first run");
  return lines;
}

std::string stepLine(const StepReport& step, bool dryRun) {
  std::string line = fmt::format("{:<14}", step.action);
  if (step.isCached)
    line += " from an earlier run";
  else if (!dryRun)
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
