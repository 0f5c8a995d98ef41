#include "apps/pipeline/run/planner.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/pipeline/values/refusal.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/files/band_parts_writer.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress.h"

namespace pipeline {
namespace {

/// Name of an action, with its --as name.
std::string labelOf(const Node& node) {
  return node.op->name + (node.name.empty() ? "" : " @" + node.name);
}

std::string reasonFor(const Graph& graph, std::size_t index, const std::vector<char>& runs) {
  const Node& node = graph.nodes[index];
  if (!runs[index]) return "left out: no requested result depends on it";
  std::vector<std::string> takers;
  for (std::size_t i = index + 1; i < graph.nodes.size(); ++i) {
    const Node& other = graph.nodes[i];
    const bool takes = std::count(other.inputs.begin(), other.inputs.end(), index) > 0 ||
                       std::any_of(other.named.begin(), other.named.end(),
                                   [&](const auto& named) { return named.second == index; });
    if (runs[i] && takes) takers.push_back(labelOf(other));
  }
  std::vector<std::string> files;
  if (node.op->targets) files = node.op->targets(Invocation(*node.op, node.options));
  const auto joined = [](const std::vector<std::string>& all) {
    std::string text;
    for (const std::string& one : all) text += (text.empty() ? "" : ", ") + one;
    return text;
  };
  if (!files.empty()) return "writes " + joined(files);
  if (!takers.empty()) return "needed by " + joined(takers);
  return node.makes() ? "ends the chain" : "requested";
}

std::string roiText(const RegionOfInterest& roi, const Plan& plan) {
  std::string text;
  if (roi.halfWidth < plan.halfWidth)
    text += fmt::format("; half width {:.3g} of {:.3g} voxels", roi.halfWidth, plan.halfWidth);
  if (!levelset::isEverywhere(roi.region)) {
    const Imath::Box3d& box = roi.region;
    text += fmt::format("; only {:.4g},{:.4g},{:.4g} to {:.4g},{:.4g},{:.4g}", box.min.x, box.min.y,
                        box.min.z, box.max.x, box.max.y, box.max.z);
  }
  return text;
}

/// Size of a terrain, or the box of one that becomes a volume.
std::string groundText(const Node& node, const Plan& plan,
                       const std::vector<std::optional<Plan>>& plans) {
  if (plan.kind == Kind::Terrain && plan.samples.x > 0)
    return fmt::format("; {}x{} samples", plan.samples.x, plan.samples.y);
  const bool isVolume = plan.kind == Kind::Band || plan.kind == Kind::Surface;
  const bool isOfGround = std::any_of(node.inputs.begin(), node.inputs.end(), [&](std::size_t i) {
    return plans[i] && plans[i]->kind == Kind::Terrain;
  });
  const Imath::Box3d& box = plan.bounds;
  if (!isVolume || !isOfGround || box.isEmpty()) return "";
  return fmt::format("; a volume from {:.4g},{:.4g},{:.4g} to {:.4g},{:.4g},{:.4g}", box.min.x,
                     box.min.y, box.min.z, box.max.x, box.max.y, box.max.z);
}

/// Estimated bytes of a value within its region of interest; 0 if unknown.
double bytesOf(const std::optional<Plan>& plan, const RegionOfInterest& roi) {
  if (!plan) return 0;
  if (plan->kind == Kind::Mesh || plan->kind == Kind::Points || plan->kind == Kind::Molecule)
    return plan->bytes();
  const bool isTold = (plan->kind == Kind::Band && plan->voxelSize > 0) ||
                      plan->kind == Kind::Field || plan->kind == Kind::Volume ||
                      plan->kind == Kind::Adaptive || plan->kind == Kind::Segmentation ||
                      plan->kind == Kind::Terrain;
  return isTold ? restricted(*plan, roi).bytes() : 0;
}

/// Decides if an operator computes its complete result, which is then cropped to the region of
/// interest. These are the operators that read all of their operands.
bool ignoresRoi(const Node& node) {
  return !node.inputs.empty() && !node.op->regionOfInterest && !node.op->makesParts;
}

/// Largest memory of the values held at once. A value lives until its last consumer has run.
struct Peak {
  double bytes = 0;
  std::size_t node = 0;  ///< node whose result reaches the peak
};

Peak findPeak(const Graph& graph, const std::vector<char>& runs,
              const std::vector<std::optional<Plan>>& plans,
              const std::vector<RegionOfInterest>& regions,
              const std::vector<double>& worked = {}) {
  std::vector<std::size_t> uses = countUses(graph, runs);
  const auto bytes = [&](std::size_t i) { return bytesOf(plans[i], regions[i]); };
  double held = 0;
  Peak peak;
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (!runs[i]) continue;
    double released = 0, largest = 0;
    const auto release = [&](std::size_t input) {
      if (--uses[input] > 0) return;
      released += bytes(input);
      largest = std::max(largest, bytes(input));
    };
    for (const std::size_t input : graph.nodes[i].inputs) release(input);
    for (const auto& [option, input] : graph.nodes[i].named) release(input);
    const double made = ignoresRoi(graph.nodes[i]) ? bytesOf(plans[i], {}) : bytes(i);
    // The last consumer of a value may modify it in place, so its result reuses the memory of the
    // largest value that is released.
    double during = held + std::max(0.0, made - largest);
    if (!worked.empty()) during = held + made + worked[i];
    if (during > peak.bytes) peak = {during, i};
    held += bytes(i) - released;
    if (uses[i] == 0) held -= bytes(i);
  }
  return peak;
}

/// Formats an estimated time with few digits.
std::string inSeconds(double seconds) {
  return seconds < 100 ? fmt::format("{:.2g} s", seconds) : fmt::format("{:.0f} s", seconds);
}

/// Estimated cost of a node; empty if the plan of an operand or of the result is unknown.
std::optional<Cost> costOf(const Graph& graph, std::size_t i,
                           const std::vector<std::optional<Plan>>& plans,
                           const std::vector<RegionOfInterest>& regions) {
  const Node& node = graph.nodes[i];
  if (!node.op->cost) return {};
  Invocation invocation(*node.op, node.options);
  for (const std::size_t input : node.inputs) {
    if (!plans[input]) return {};
    invocation.operands.emplace_back(restricted(*plans[input], regions[input]));
  }
  if (node.makes()) {
    if (!plans[i]) return {};
    invocation.planned = ignoresRoi(node) ? *plans[i] : restricted(*plans[i], regions[i]);
  }
  return node.op->cost(invocation);
}

}  // namespace

Plan planOf(Invocation& invocation) {
  const Operator& op = invocation.op();
  if (op.plan) return op.plan(invocation);
  Plan plan = invocation.operands.at(0).plan();
  if (op.resultKind) plan.kind = op.resultKind(invocation);
  return plan;
}

ValuePlans planValues(const Graph& graph, const std::vector<char>& runs, std::size_t maxMemory,
                      const std::function<std::optional<Plan>(std::size_t)>& mesh) {
  ValuePlans all{std::vector<std::optional<Plan>>(graph.nodes.size()),
                 std::vector<std::exception_ptr>(graph.nodes.size())};
  std::vector<std::optional<Plan>>& plans = all.plans;
  const auto writers = findWritersRead(graph, runs);
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    const Node& node = graph.nodes[i];
    if (!runs[i] || !node.makes() || writers[i]) continue;
    if (const auto given = graph.given.find(i); given != graph.given.end()) {
      plans[i] = given->second.plan();
      continue;
    }
    if (node.inputs.empty() && (node.kind == Kind::Mesh || node.kind == Kind::Points)) {
      plans[i] = mesh(i);
      continue;
    }
    Invocation invocation(*node.op, node.options);
    // Planning a scene or a patch from a file means reading the file, which costs as much as
    // running the node.
    const bool isHeavy =
        node.inputs.empty() && (node.kind == Kind::Patch || node.kind == Kind::Scene);
    bool isKnown = (node.op->plan || !node.inputs.empty()) && !isHeavy && !readsOnce(node);
    const auto know = [&](std::size_t input) {
      isKnown = isKnown && plans[input];
      return isKnown ? Value(*plans[input]) : Value(Plan{});
    };
    for (const std::size_t input : node.inputs) {
      invocation.operands.push_back(know(input));
      invocation.operandNames.push_back(graph.nodes[input].name);
    }
    for (const auto& [option, input] : node.named) invocation.named.emplace(option, know(input));
    if (!isKnown) continue;
    // These plans are of complete values, which need not fit into memory. checkMemoryFor() checks
    // the regions of interest.
    const bool isRead =
        std::any_of(node.op->params.begin(), node.op->params.end(), [&](const Param& param) {
          return param.type == ParamType::Path && node.options.contains(param.name);
        });
    if (isRead) invocation.maxMemory = maxMemory;
    invocation.dryRun = true;
    try {
      plans[i] = planOf(invocation);
    } catch (const levelset::Cancelled&) {
      throw;
    } catch (const levelset::Error&) {
      all.failures[i] = std::current_exception();
    }
  }
  return all;
}

void checkMemoryFor(const Graph& graph, const std::vector<char>& runs,
                    const std::vector<std::optional<Plan>>& plans,
                    const std::vector<RegionOfInterest>& regions, std::size_t maxMemory) {
  for (std::size_t i = 0; i < plans.size(); ++i)
    if (plans[i])
      levelset::withContext(graph.nodes[i].op->name, [&] {
        levelset::requireMemory(restricted(*plans[i], regions[i]).bytes(), maxMemory);
      });
  const Peak peak = findPeak(graph, runs, plans, regions);
  if (peak.bytes > static_cast<double>(maxMemory))
    levelset::withContext(graph.nodes[peak.node].op->name + " and the values held beside it",
                          [&] { levelset::requireMemory(peak.bytes, maxMemory); });
}

double estimatePeak(const Graph& graph, const std::vector<char>& runs,
                    const std::vector<std::optional<Plan>>& plans,
                    const std::vector<RegionOfInterest>& regions) {
  std::vector<double> worked(graph.nodes.size(), 0);
  for (std::size_t i = 0; i < worked.size(); ++i) {
    if (!runs[i] || graph.given.contains(i)) continue;
    if (const std::optional<Cost> cost = costOf(graph, i, plans, regions)) worked[i] = cost->bytes;
  }
  return findPeak(graph, runs, plans, regions, worked).bytes;
}

namespace {

/// Decides if a part of the result needs only a part of each band before it.
/// @param write  action that writes the result
bool readsPartsOnly(const Graph& graph, std::size_t write,
                    const std::vector<std::optional<Plan>>& plans) {
  const std::size_t result = graph.nodes[write].inputs[0];
  Graph part = graph;
  part.nodes.resize(write);
  part.results = {result};
  const Imath::V3d corner = plans[result]->bounds.min;
  const Imath::V3d size(levelset::kPartCell * plans[result]->voxelSize);
  const std::vector<char> runs = neededNodes(part);
  const std::vector<RegionOfInterest> regions =
      regionsOfInterest(part, runs, plans, 1, Imath::Box3d(corner - size, corner));
  for (std::size_t i = 0; i < write; ++i)
    if (runs[i] && part.nodes[i].kind == Kind::Band && levelset::isEverywhere(regions[i].region))
      return false;
  return true;
}

}  // namespace

double bytesForWriting(const Plan& plan) {
  // 200 bytes for a block, which has about 170 active voxels.
  return 1.2 * plan.activeVoxels();
}

std::optional<std::size_t> findPartedWrite(const Graph& graph, const std::vector<char>& runs,
                                           const std::vector<std::optional<Plan>>& plans,
                                           const std::vector<RegionOfInterest>& regions,
                                           std::size_t maxMemory) {
  const auto limit = static_cast<double>(levelset::memoryLeft(maxMemory));
  if (!graph.results.empty() || !(estimatePeak(graph, runs, plans, regions) > limit)) return {};
  const auto isBand = [&](std::size_t node) { return graph.nodes[node].kind == Kind::Band; };
  std::optional<std::size_t> last;
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (!runs[i]) continue;
    if (last) return {};
    const Node& node = graph.nodes[i];
    const std::vector<std::size_t>& inputs = node.inputs;
    if (!node.makes()) {
      const Invocation write(*node.op, node.options);
      if (node.op->name != "write" || write.text("file") == "-" || !isBand(inputs[0])) return {};
      if (!levelset::isVdbFormat(write.text(write.given("format") ? "format" : "file"))) return {};
      const std::optional<Plan>& result = plans[inputs[0]];
      if (!result || bytesForWriting(*result) > limit / 2) return {};
      last = i;
    } else if (isBand(i)) {
      const auto bands = std::count_if(inputs.begin(), inputs.end(), isBand);
      if (bands > 1 || !node.named.empty() || !plans[i]) return {};
      if (bands == 1 ? node.op->distancePasses == 0 : ignoresRoi(node)) return {};
    }
  }
  return last && readsPartsOnly(graph, *last, plans) ? last : std::nullopt;
}

void explain(const Graph& graph, std::size_t maxMemory, bool fullValues,
             const std::function<void(const std::string&)>& print) {
  const std::vector<char> runs = neededNodes(graph);
  const ValuePlans all =
      planValues(graph, runs, maxMemory, [&](std::size_t i) -> std::optional<Plan> {
        const Node& node = graph.nodes[i];
        Invocation invocation(*node.op, node.options);
        invocation.maxMemory = maxMemory;
        invocation.dryRun = true;
        try {
          return planOf(invocation);
        } catch (const levelset::Error& error) {
          rethrowAs(node.op->name, error, node.location);
        }
      });
  const std::vector<std::optional<Plan>>& plans = all.plans;
  std::vector<RegionOfInterest> regions(graph.nodes.size());
  if (!fullValues) regions = regionsOfInterest(graph, runs, plans);
  std::string text;
  double seconds = 0;
  std::vector<double> worked(graph.nodes.size(), 0);  // working memory of each node, bytes
  std::vector<std::string> untimed;
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    const Node& node = graph.nodes[i];
    text += fmt::format("{:<20} {}", labelOf(node), reasonFor(graph, i, runs));
    if (plans[i]) {
      const Plan plan = restricted(*plans[i], regions[i]);
      text += roiText(regions[i], *plans[i]) + groundText(node, plan, plans);
      if (plan.kind == Kind::Band && plan.voxelSize > 0)
        text += fmt::format("; about {:.3g} voxels of {:.4g}, {:.3g} MB", plan.activeVoxels(),
                            plan.voxelSize, plan.bytes() * 1e-6);
      if (plan.triangles > 0)
        text +=
            fmt::format("; about {:.3g} triangles, {:.3g} MB", plan.triangles, plan.bytes() * 1e-6);
    } else if (runs[i] && node.makes()) {
      text += "; its size is unknown until it is computed";
    }
    if (runs[i]) {
      if (const std::optional<Cost> cost = costOf(graph, i, plans, regions)) {
        seconds += cost->seconds;
        worked[i] = cost->bytes;
        if (cost->seconds > 0) text += "; " + inSeconds(cost->seconds);
        if (cost->bytes > 0) text += fmt::format(", working memory {:.3g} MB", cost->bytes * 1e-6);
      } else {
        untimed.push_back(node.op->name);
      }
    }
    text += "\n";
  }
  std::sort(untimed.begin(), untimed.end());
  untimed.erase(std::unique(untimed.begin(), untimed.end()), untimed.end());
  text += fmt::format(
      "at most about {:.3g} MB of values are held at once, {:.3g} MB with working memory; about {} "
      "on one core{}\n",
      findPeak(graph, runs, plans, regions).bytes * 1e-6,
      findPeak(graph, runs, plans, regions, worked).bytes * 1e-6, inSeconds(seconds),
      untimed.empty() ? ""
                      : fmt::format(", plus {}, whose time is unknown", fmt::join(untimed, ", ")));
  const bool mayBeParted = !fullValues && findPartedWrite(graph, runs, plans, regions, maxMemory);
  if (mayBeParted)
    text += "this exceeds the memory limit, so the result would be computed in parts\n";
  print(text);
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (!all.failures[i]) continue;
    try {
      std::rethrow_exception(all.failures[i]);
    } catch (const levelset::Error& error) {
      rethrowAs(graph.nodes[i].op->name, error, graph.nodes[i].location);
    }
  }
  if (!mayBeParted) checkMemoryFor(graph, runs, plans, regions, maxMemory);
}

}  // namespace pipeline
