#include <fmt/core.h>

#include <chrono>

#include "apps/pipeline/cache/cache.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/units.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::UsageError;

bool isShrink(const Invocation& in) {
  return in.text("verb") == "gc";
}

void validateCache(const Invocation& in) {
  if (isShrink(in) != in.given("max-size"))
    throw UsageError(isShrink(in)
                         ? "cache: gc needs --max-size, the total size of the results to keep, as "
                           "in --max-size 2G"
                         : "cache: --max-size applies only to gc; leave it out, or write gc");
  std::error_code ignored;
  if (!std::filesystem::is_directory(std::filesystem::path(in.text("folder")) / "results", ignored))
    throw levelset::IoError(
        fmt::format("cache: '{}' contains no results of earlier runs; name the folder of the "
                    "global option --cache",
                    in.text("folder")));
}

std::string ageOf(std::int64_t used) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const double seconds =
      static_cast<double>(std::chrono::duration_cast<std::chrono::seconds>(now).count()) -
      static_cast<double>(used) * 1e-9;
  if (seconds < 120) return fmt::format("{:.0f} s", seconds);
  if (seconds < 7200) return fmt::format("{:.0f} min", seconds / 60);
  if (seconds < 172800) return fmt::format("{:.0f} h", seconds / 3600);
  return fmt::format("{:.0f} d", seconds / 86400);
}

Value manageCache(Invocation& in) {
  const Cache cache(in.text("folder"));
  std::size_t gone = 0;
  if (isShrink(in)) gone = cache.shrink(parseBytes(in.text("max-size"), in.where("max-size")));
  const std::vector<Cache::Entry> entries = cache.list();
  std::uint64_t bytes = 0;
  for (const Cache::Entry& entry : entries) bytes += entry.bytes;
  if (asksJson(in)) {
    Json json = {{"entries", entries.size()}, {"bytes", bytes}, {"removed", gone}};
    json["results"] = Json::array();
    for (const Cache::Entry& entry : entries)
      json["results"].push_back({{"key", entry.key},
                                 {"action", entry.action},
                                 {"bytes", entry.bytes},
                                 {"used", static_cast<double>(entry.used) * 1e-9}});
    in.output = printed(json);
    return Value(Plan{});
  }
  if (!isShrink(in))
    for (const Cache::Entry& entry : entries)
      in.output += fmt::format("{}  {:<14} {:>10.3f} MB  {} ago\n", entry.key, entry.action,
                               static_cast<double>(entry.bytes) * 1e-6, ageOf(entry.used));
  in.output +=
      fmt::format("{} results, {:.1f} MB", entries.size(), static_cast<double>(bytes) * 1e-6);
  if (isShrink(in)) in.output += fmt::format("; {} were removed", gone);
  in.output += "\n";
  return Value(Plan{});
}

}  // namespace

Operator cacheOperator() {
  return {
      .name = "cache",
      .group = "Results of earlier runs",
      .summary =
          "list the results that the global option --cache stored in a folder, or remove the least "
          "recently used ones (gc)",
      .details =
          "Each result is stored under a key, a hash of the program, the action, its options and "
          "the content of its operands and files. So a stored result never becomes wrong, but it "
          "may not be needed again. Several programs may use the folder at the same time.",
      .example = "levelsmith --cache kept sphere --radius 1 --voxel 0.1 ! offset 0.2 ! measure",
      .params = {{.name = "verb",
                  .type = ParamType::Choice,
                  .doc = "list: list the results; gc: remove the least recently used results",
                  .choices = {"list", "gc"},
                  .required = true,
                  .position = 0},
                 {.name = "folder",
                  .type = ParamType::Path,
                  .doc = "folder of the global option --cache",
                  .required = true,
                  .position = 1},
                 {.name = "max-size",
                  .type = ParamType::Bytes,
                  .doc = "with gc: total size of the results to keep, as 2G; the least recently "
                         "used results are removed"},
                 jsonParam()},
      .isRepeatable = false,
      .flow = Flow::PassesThrough,
      .run = manageCache,
      .plan = [](Invocation&) { return Plan{}; },
      .validate = validateCache,
      .usesStandardOutput = asksJson,
  };
}

}  // namespace pipeline
