#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "apps/regress/recorder.h"

namespace regress {
namespace {

/// What is not there has no error: a figure of it that is judged wherever errors are, unless the
/// case has a bound of its own for it, and says why.
struct Presence {
  const char* figure;
  const char* errors[2];  ///< how the names of the figures begin that say nothing of it
  double most;
};
constexpr Presence kPresences[] = {{"missing_band", {"band_", "order_band"}, 0},
                                   {"missed_hits", {"surface_l", "order_surface"}, kMostMissed}};

bool isCost(const std::string& column) {
  return column == "cpu_s";
}

/// Largest magnitude, sign kept; costs are averaged.
Row worstOf(const std::vector<const Row*>& placements) {
  Row worst = *placements.front();
  worst.phase = -1;
  for (auto& [column, value] : worst.figures) {
    double sum = 0;
    for (const Row* row : placements) {
      const auto it = row->figures.find(column);
      if (it == row->figures.end()) continue;
      sum += it->second;
      if (std::abs(it->second) > std::abs(value) || std::isnan(it->second)) value = it->second;
    }
    if (isCost(column)) value = sum / static_cast<double>(placements.size());
  }
  for (const Row* row : placements)
    if (!row->failure.empty()) worst.failure = row->failure;
  return worst;
}

double figure(const Row& row, const char* column) {
  const auto it = row.figures.find(column);
  return it == row.figures.end() ? 0 : std::abs(it->second);
}

/// The order that two resolutions show. Where the finer error is at the limit of float there is
/// none to see.
void addOrder(const char* name, double coarse, double fine, double floor, const Row& before,
              Row& row) {
  if (!(coarse > 0) || !(fine > floor)) return;
  row.figures[name] = std::log(coarse / fine) / std::log(static_cast<double>(row.resolution) /
                                                         static_cast<double>(before.resolution));
}

void addOrders(const Row& before, Row& row) {
  const auto band = [](const Row& r, const char* measure) {
    const std::string name = measure;
    return std::max(figure(r, ("band_in_" + name).c_str()),
                    figure(r, ("band_out_" + name).c_str()));
  };
  const double floor = 2e-6 * figure(row, "voxel_size");
  addOrder("order_band_l1", band(before, "l1"), band(row, "l1"), floor, before, row);
  addOrder("order_band_linf", band(before, "linf"), band(row, "linf"), floor, before, row);
  addOrder("order_surface", figure(before, "surface_l1"), figure(row, "surface_l1"), floor, before,
           row);
  addOrder("order_volume", figure(before, "volume_error"), figure(row, "volume_error"), 1e-7,
           before, row);
}

}  // namespace

std::vector<Row> summarize(const std::vector<Row>& rows) {
  // In the order in which they came first.
  std::vector<std::vector<const Row*>> groups;
  for (const Row& row : rows) {
    const auto it = std::find_if(groups.begin(), groups.end(), [&](const auto& group) {
      return group[0]->variant == row.variant && group[0]->tool == row.tool &&
             group[0]->resolution == row.resolution;
    });
    if (it == groups.end())
      groups.push_back({&row});
    else
      it->push_back(&row);
  }
  std::vector<Row> summary;
  for (const auto& group : groups) {
    // A refused placement has no figures: start from one that has.
    std::vector<const Row*> placements = group;
    std::stable_partition(placements.begin(), placements.end(),
                          [](const Row* row) { return row->failure.empty(); });
    Row worst = worstOf(placements);
    for (auto before = summary.rbegin(); before != summary.rend(); ++before) {
      if (before->variant != worst.variant || before->tool != worst.tool) continue;
      addOrders(*before, worst);
      break;
    }
    summary.push_back(std::move(worst));
  }
  return summary;
}

namespace {

void judgePresence(const Case& of, const Row& row, const Presence& presence,
                   std::vector<Judgement>& judgements) {
  const auto found = row.figures.find(presence.figure);
  if (found == row.figures.end()) return;
  const auto isBounded = [&](const auto& fits) {
    return std::any_of(of.bounds.begin(), of.bounds.end(), [&](const Bound& bound) {
      return bound.variant == row.variant && fits(bound.figure) &&
             (bound.resolution == 0 || bound.resolution == row.resolution);
    });
  };
  if (isBounded([&](const std::string& figure) { return figure == presence.figure; })) return;
  if (!isBounded([&](const std::string& figure) {
        return std::any_of(std::begin(presence.errors), std::end(presence.errors),
                           [&](const char* start) { return figure.starts_with(start); });
      }))
    return;
  judgements.push_back({{row.variant, presence.figure, presence.most, row.resolution},
                        row.resolution,
                        found->second,
                        found->second <= presence.most,
                        {}});
}

}  // namespace

std::vector<Judgement> judge(const Case& of, const std::vector<Row>& summary, Budget budget) {
  std::vector<Judgement> judgements;
  for (const Bound& bound : of.bounds) {
    bool met = false;
    for (const Row& row : summary) {
      if (row.tool != kOurs || row.variant != bound.variant ||
          (bound.resolution && row.resolution != bound.resolution))
        continue;
      met = true;
      Judgement& j = judgements.emplace_back(Judgement{bound, row.resolution, 0, false, {}});
      const auto it = row.figures.find(bound.figure);
      if (!row.failure.empty() || it == row.figures.end()) {
        j.remark = row.failure.empty() ? "the figure was not measured" : row.failure;
        continue;
      }
      j.found = it->second;
      j.passed =
          bound.sense == Sense::AtMost ? std::abs(j.found) <= bound.limit : j.found >= bound.limit;
    }
    const std::vector<int>& resolutions = budget == Budget::Full ? of.full : of.quick;
    const auto has = [&](const std::vector<int>& some) {
      return std::find(some.begin(), some.end(), bound.resolution) != some.end();
    };
    // A bound on a resolution of the other budget is looked at there.
    if (!met && (bound.resolution == 0 || has(resolutions) || !(has(of.full) || has(of.quick))))
      judgements.push_back({bound, bound.resolution, 0, false, "there is no such row"});
  }
  for (const Row& row : summary)
    if (row.tool == kOurs)
      for (const Presence& presence : kPresences) judgePresence(of, row, presence, judgements);
  // A refusal is a failure whether or not a bound looks at it.
  for (const Row& row : summary)
    if (row.tool == kOurs && !row.failure.empty() &&
        std::none_of(judgements.begin(), judgements.end(), [&](const Judgement& j) {
          return j.bound.variant == row.variant && j.resolution == row.resolution && !j.passed;
        }))
      judgements.push_back({{row.variant, "cpu_s", 0, row.resolution, Sense::AtMost},
                            row.resolution,
                            0,
                            false,
                            row.failure});
  return judgements;
}

}  // namespace regress
