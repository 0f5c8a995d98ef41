#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <string>

#include "apps/regress/recorder.h"

namespace regress {
namespace {

/// Column with the share of missing values: inactive grid points, or missing and surplus zeros
/// along rays. The share must be 0 where errors are bounded, unless the case bounds the share
/// itself.
struct Presence {
  const char* figure;
  const char* errors[2];  ///< prefixes of the error columns in which missing values do not count
};
constexpr Presence kPresences[] = {{"missing_band", {"band_", "order_band"}},
                                   {"missed_hits", {"surface_l", "order_surface"}}};

bool isCost(const std::string& column) {
  return column == "cpu_s";
}

/// Combines the rows of all placements: the value of largest magnitude, with its sign, in each
/// column; the mean of the CPU seconds.
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

/// Adds the order of convergence between two resolutions. Does nothing where the finer error is at
/// the rounding level of float.
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
  // A group holds the rows of one variant, tool and resolution. Groups keep the order of their
  // first rows.
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
    // A placement that ended with an exception has no figures, so the other placements come first.
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

bool fits(const Bound& bound, const Row& row, Budget budget) {
  return bound.isFor(budget) && bound.variant == row.variant &&
         (bound.resolution == 0 || bound.resolution == row.resolution);
}

/// Adds the bound 0 on the share of missing values if the case bounds errors, but not this share.
void judgePresence(const Case& of, const Row& row, const Presence& presence, Budget budget,
                   std::vector<Judgement>& judgements) {
  const auto found = row.figures.find(presence.figure);
  if (found == row.figures.end()) return;
  const auto isBounded = [&](const auto& isWanted) {
    return std::any_of(of.bounds.begin(), of.bounds.end(), [&](const Bound& bound) {
      return fits(bound, row, budget) && isWanted(bound.figure);
    });
  };
  if (isBounded([&](const std::string& figure) { return figure == presence.figure; })) return;
  if (!isBounded([&](const std::string& figure) {
        return std::any_of(std::begin(presence.errors), std::end(presence.errors),
                           [&](const char* start) { return figure.starts_with(start); });
      }))
    return;
  const Bound none{.variant = row.variant,
                   .figure = presence.figure,
                   .kind = Bound::Kind::Required,
                   .resolution = row.resolution};
  judgements.push_back({none, row.resolution, found->second, none.isMet(found->second), {}});
}

/// Adds a failure for each figure that has measured bounds, but none at the resolution of `row`.
void judgeCompleteness(const Case& of, const Row& row, Budget budget,
                       std::vector<Judgement>& judgements) {
  std::set<std::string> bounded, stated;
  for (const Bound& bound : of.bounds) {
    if (bound.variant != row.variant) continue;
    if (bound.kind == Bound::Kind::Measured) bounded.insert(bound.figure);
    if (fits(bound, row, budget)) stated.insert(bound.figure);
  }
  for (const std::string& figure : bounded) {
    const auto found = row.figures.find(figure);
    // judgePresence() bounds a share of missing values that the case does not bound.
    const bool isShare =
        std::any_of(std::begin(kPresences), std::end(kPresences),
                    [&](const Presence& presence) { return figure == presence.figure; });
    if (isShare || stated.contains(figure) || found == row.figures.end()) continue;
    judgements.push_back(
        {{.variant = row.variant, .figure = figure, .resolution = row.resolution},
         row.resolution,
         found->second,
         false,
         "the case states no measured figure at this resolution; add one to its bounds"});
  }
}

/// Compares the figure of a row with its bound.
void judgeFigure(const Row& row, Judgement& j) {
  const auto it = row.figures.find(j.bound.figure);
  if (!row.failure.empty() || it == row.figures.end()) {
    j.remark = row.failure.empty() ? "the figure was not measured" : row.failure;
    return;
  }
  j.found = it->second;
  const bool isStale = j.bound.isStale(j.found);
  j.passed = j.bound.isMet(j.found) && !isStale;
  if (isStale && j.bound.isMet(j.found))
    j.remark = fmt::format(
        "found {:.4g}, the limit {:.4g} is too loose: the stated figure {:.4g} is out of date",
        j.found, j.bound.limit(), j.bound.stated);
}

}  // namespace

std::vector<Judgement> judge(const Case& of, const std::vector<Row>& summary, Budget budget) {
  std::vector<Judgement> judgements;
  for (const Bound& bound : of.bounds) {
    if (!bound.isFor(budget)) continue;
    bool met = false;
    for (const Row& row : summary) {
      if (row.tool != kOurs || !fits(bound, row, budget)) continue;
      met = true;
      judgeFigure(row, judgements.emplace_back(Judgement{bound, row.resolution, 0, false, {}}));
    }
    const std::vector<int>& resolutions = budget == Budget::Full ? of.full : of.quick;
    const auto has = [&](const std::vector<int>& some) {
      return std::find(some.begin(), some.end(), bound.resolution) != some.end();
    };
    // A bound at a resolution that only the other budget runs is no failure.
    if (!met && (bound.resolution == 0 || has(resolutions) || !(has(of.full) || has(of.quick))))
      judgements.push_back(
          {bound, bound.resolution, 0, false, "no row has this variant and resolution"});
  }
  for (const Row& row : summary) {
    if (row.tool != kOurs) continue;
    for (const Presence& presence : kPresences)
      judgePresence(of, row, presence, budget, judgements);
    judgeCompleteness(of, row, budget, judgements);
  }
  // A run that ended with an exception fails, even without a bound on its figures.
  for (const Row& row : summary)
    if (row.tool == kOurs && !row.failure.empty() &&
        std::none_of(judgements.begin(), judgements.end(), [&](const Judgement& j) {
          return j.bound.variant == row.variant && j.resolution == row.resolution && !j.passed;
        }))
      judgements.push_back({{.variant = row.variant,
                             .figure = "cpu_s",
                             .kind = Bound::Kind::Required,
                             .resolution = row.resolution},
                            row.resolution,
                            0,
                            false,
                            row.failure});
  return judgements;
}

}  // namespace regress
