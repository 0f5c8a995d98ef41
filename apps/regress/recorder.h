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
/// Placement that the quick budget uses alone at finer resolutions. It is aligned with no grid
/// point.
inline constexpr int kQuickPhase = 3;

/// One piece of work with an exact answer.
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
  /// Samples of every resolution and placement. The quick budget has all placements at the coarsest
  /// resolution only, and kQuickPhase at the others.
  [[nodiscard]] std::vector<Sample> samples() const;
  /// True where OpenVDB's tool runs, too. In the quick budget it runs at kQuickPhase up to
  /// `finest`, in the full budget at the first `phases` placements.
  [[nodiscard]] bool wantsPeer(const Sample& at, int finest, int phases = 5) const;

  /// True where work that is repeated many times runs: at every sample of the full budget, at the
  /// coarsest resolution of the quick budget.
  [[nodiscard]] bool wantsRepeats(const Sample& at) const;

  /// Runs and times `work`, compares its result with the truth and adds a row. A refusal becomes a
  /// row with its message.
  /// @return the result, so that set() can add figures; empty if refused
  std::optional<levelset::NarrowBand> measure(const Subject& subject, const std::string& tool,
                                              const std::function<levelset::NarrowBand()>& work);
  /// Measures work without a closed form: the result is compared with a finer band.
  void measure(const std::string& variant, const Sample& at, const levelset::NarrowBand& reference,
               const std::string& tool, const std::function<levelset::NarrowBand()>& work);
  /// Adds a row without a band.
  void row(const std::string& variant, const std::string& tool, const Sample& at, Figures figures);
  /// Figure of the newest row.
  [[nodiscard]] double newest(const std::string& column) const {
    return result_.rows.back().figures.at(column);
  }
  void set(const std::string& column, double value) { result_.rows.back().figures[column] = value; }

  /// Adds the outcome that `work` is refused with this exit class.
  void expectRefusal(const std::string& variant, levelset::ExitCode code,
                     const std::function<void()>& work);
  /// Adds the outcome of a statement. `work` returns true where the statement holds, and a text of
  /// the findings. A refusal fails the statement.
  void expect(const std::string& variant, const std::string& expected,
              const std::function<std::pair<bool, std::string>()>& work);

  [[nodiscard]] CaseResult finish();

 private:
  void tick();
  std::optional<levelset::NarrowBand> measure(
      const std::string& variant, const Sample& at, const std::string& tool,
      const std::function<levelset::NarrowBand()>& work,
      const std::function<void(const levelset::NarrowBand&, Figures&)>& look);

  Budget budget_;
  levelset::Progress progress_;
  CaseResult result_;
};

/// Summarizes rows: the worst placement for each variant, tool and resolution, with observed
/// orders.
[[nodiscard]] std::vector<Row> summarize(const std::vector<Row>& rows);

/// Compares our summaries with the bounds of the case. A bound fails where the figure misses the
/// limit, where the stated figure is out of date, and where no row fits. A bound at a resolution of
/// the other budget alone is left to that budget. A case that bounds errors of the band or of the
/// surface must miss no grid point and no zero, unless it states the share of those.
[[nodiscard]] std::vector<Judgement> judge(const Case& of, const std::vector<Row>& summary,
                                           Budget budget);

}  // namespace regress
