#include <fmt/core.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "apps/regress/output/page.h"
#include "apps/regress/output/plots.h"
#include "apps/regress/output/write_text.h"
#include "apps/regress/suite.h"
#include "apps/regress/truth/columns.h"
#include "levelset/error.h"
#include "levelset/file_target.h"

namespace regress {

void writeText(const std::filesystem::path& path, const std::string& text) {
  levelset::FileTarget target(path);
  {
    std::ofstream out(target.path(), std::ios::binary);
    out << text;
    if (!out.flush())
      throw levelset::IoError(
          fmt::format("regress: '{}' cannot be written; is the disk full?", path.string()));
  }
  target.commit();
}

namespace {

using Json = nlohmann::ordered_json;

Json toJson(const Row& row) {
  Json json{{"variant", row.variant}, {"tool", row.tool}, {"resolution", row.resolution}};
  if (row.phase >= 0) json["phase"] = row.phase;
  for (const Column& column : columns()) {
    const auto it = row.figures.find(column.name);
    if (it == row.figures.end()) continue;
    if (std::isfinite(it->second))
      json[column.name] = it->second;
    else
      json[column.name] = nullptr;
  }
  if (!row.failure.empty()) json["failure"] = row.failure;
  return json;
}

const char* kindName(Bound::Kind kind) {
  switch (kind) {
    case Bound::Kind::Measured:
      return "measured";
    case Bound::Kind::Order:
      return "order";
    case Bound::Kind::Rounding:
      return "rounding";
    case Bound::Kind::Required:
      break;
  }
  return "required";
}

Json toJson(const Judgement& j) {
  Json json{{"variant", j.bound.variant},
            {"figure", j.bound.figure},
            {"sense", j.bound.sense == Sense::AtMost ? "at most" : "at least"},
            {"kind", kindName(j.bound.kind)},
            {"stated", j.bound.stated},
            {"limit", j.bound.limit()},
            {"resolution", j.resolution},
            {"found", j.found},
            {"passed", j.passed}};
  if (!j.remark.empty()) json["remark"] = j.remark;
  return json;
}

Json toJson(const CaseResult& result) {
  Json json{{"name", result.of->name},         {"group", result.of->group},
            {"title", result.of->title},       {"definition", result.of->definition},
            {"citation", result.of->citation}, {"cpu_s", result.cpuSeconds}};
  for (const auto& [key, rows] : {std::pair{"summary", &result.summary}, {"rows", &result.rows}}) {
    json[key] = Json::array();
    for (const Row& row : *rows) json[key].push_back(toJson(row));
  }
  json["bounds"] = Json::array();
  for (const Judgement& j : result.judgements) json["bounds"].push_back(toJson(j));
  json["outcomes"] = Json::array();
  for (const Outcome& o : result.outcomes)
    json["outcomes"].push_back({{"variant", o.variant},
                                {"expected", o.expected},
                                {"found", o.found},
                                {"passed", o.passed}});
  return json;
}

std::string jsonText(const SuiteResult& result) {
  Json json{{"version", LEVELSMITH_VERSION},
            {"budget", result.budget == Budget::Quick ? "quick" : "full"},
            {"cpu_s", result.cpuSeconds}};
  json["columns"] = Json::array();
  for (const Column& c : columns())
    json["columns"].push_back({{"name", c.name}, {"heading", c.heading}, {"meaning", c.meaning}});
  json["failures"] = failures(result);
  json["cases"] = Json::array();
  for (const CaseResult& c : result.cases) json["cases"].push_back(toJson(c));
  return json.dump(1) + "\n";
}

std::string quoted(const std::string& text) {
  std::string result(1, '"');
  for (const char c : text) result.append(c == '"' ? 2 : 1, c);
  result += '"';
  return result;
}

std::string csvText(const SuiteResult& result) {
  std::string text = "case,variant,tool,resolution,phase";
  for (const Column& column : columns()) text += fmt::format(",{}", column.name);
  text += ",failure\n";
  for (const CaseResult& c : result.cases) {
    for (const Row& row : c.rows) {
      text += fmt::format("{},{},{},{},{}", quoted(c.of->name), quoted(row.variant),
                          quoted(row.tool), row.resolution, row.phase);
      for (const Column& column : columns()) {
        const auto it = row.figures.find(column.name);
        text += it == row.figures.end() ? "," : fmt::format(",{:.9g}", it->second);
      }
      text += fmt::format(",{}\n", row.failure.empty() ? row.failure : quoted(row.failure));
    }
  }
  return text;
}

}  // namespace

void makeFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder))
    throw levelset::IoError(fmt::format("regress: the folder '{}' cannot be created: {}",
                                        folder.string(),
                                        error ? error.message() : "a file is in its place"));
}

std::vector<std::string> writeResults(const SuiteResult& result,
                                      const std::filesystem::path& folder, bool withPlots) {
  makeFolder(folder);
  writeText(folder / "results.json", jsonText(result));
  writeText(folder / "results.csv", csvText(result));
  const Plots plots = withPlots ? makePlots(folder) : Plots{};
  writeText(folder / "index.html", pageText(result, plots.names));
  return plots.notes;
}

}  // namespace regress
