#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/regress/case.h"
#include "apps/regress/errors.h"
#include "levelset/error.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace regress {

inline constexpr const char* kOurs = "levelsmith";
/// Index of the only placement that the quick budget runs above the coarsest resolution. It aligns
/// the object with no grid point.
inline constexpr int kQuickPhase = 3;

/// One problem with an exact answer: a variant of a case at one sample, and the exact solid.
struct Subject {
  std::string variant;
  Sample at;
  Truth truth;
};

/// Collects the results of a case.
class Recorder {
 public:
  Recorder(const Case& of, Budget budget, levelset::Progress progress);

  [[nodiscard]] bool isQuick() const { return budget_ == Budget::Quick; }
  /// Returns the samples of the budget: all placements at every resolution. The quick budget has
  /// all placements at the coarsest resolution, and only kQuickPhase at the others.
  [[nodiscard]] std::vector<Sample> samples() const;
  /// Returns true if OpenVDB's tool runs on the sample, too. In the quick budget it runs at
  /// kQuickPhase up to the resolution `finest`, in the full budget at the first `phases`
  /// placements.
  [[nodiscard]] bool wantsPeer(const Sample& at, int finest, int phases = 5) const;

  /// Returns true if work that is repeated many times runs on the sample: on every sample of the
  /// full budget, in the quick budget only at kQuickPhase of the coarsest resolution.
  [[nodiscard]] bool wantsRepeats(const Sample& at) const;

  /// Runs and times `work`, compares its result with the truth and adds a row. An exception becomes
  /// a row with its message and no figures.
  /// @return the result, so that set() can add figures; empty after an exception
  std::optional<levelset::NarrowBand> measure(const Subject& subject, const std::string& tool,
                                              const std::function<levelset::NarrowBand()>& work);
  /// Measures work without a closed form: the result is compared with a reference band.
  void measure(const std::string& variant, const Sample& at, const levelset::NarrowBand& reference,
               const std::string& tool, const std::function<levelset::NarrowBand()>& work);
  /// Adds a row of figures that the case has measured itself.
  void row(const std::string& variant, const std::string& tool, const Sample& at, Figures figures);
  /// Returns a figure of the newest row.
  [[nodiscard]] double newest(const std::string& column) const {
    return result_.rows.back().figures.at(column);
  }
  void set(const std::string& column, double value) { result_.rows.back().figures[column] = value; }

  /// Adds the outcome of the statement that `work` throws a levelset::Error with the exit code
  /// `code`.
  void expectRefusal(const std::string& variant, levelset::ExitCode code,
                     const std::function<void()>& work);
  /// Adds the outcome of a statement. `work` returns true if the statement holds, and a text with
  /// the findings. If `work` throws, the statement fails.
  void expect(const std::string& variant, const std::string& expected,
              const std::function<std::pair<bool, std::string>()>& work);

  /// Lets the caller cancel. Long work calls it many times.
  /// @throws Cancelled
  void tick();

  [[nodiscard]] CaseResult finish();

 private:
  std::optional<levelset::NarrowBand> measure(
      const std::string& variant, const Sample& at, const std::string& tool,
      const std::function<levelset::NarrowBand()>& work,
      const std::function<void(const levelset::NarrowBand&, Figures&)>& look);

  Budget budget_;
  levelset::Progress progress_;
  CaseResult result_;
};

/// Summarizes rows: the worst figures of all placements for each variant, tool and resolution, with
/// observed orders of convergence.
[[nodiscard]] std::vector<Row> summarize(const std::vector<Row>& rows);

/// Compares the summaries of Levelsmith's runs with the bounds of the case. A bound fails if the
/// figure misses the limit, if the stated figure is out of date, or if no row has its variant and
/// resolution. A bound at a resolution that only the other budget runs is skipped. If a case bounds
/// errors of the band or of the surface, no grid point and no zero along the rays may be missing,
/// unless it also bounds their share.
[[nodiscard]] std::vector<Judgement> judge(const Case& of, const std::vector<Row>& summary,
                                           Budget budget);

}  // namespace regress
