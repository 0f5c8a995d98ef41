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
/// The placement, aligned with nothing, that stands for all where the quick budget has no time.
inline constexpr int kQuickPhase = 3;

/// One piece of work with an exact answer.
struct Subject {
  std::string variant;
  Sample at;
  Truth truth;
};

/// What a case writes its results into.
class Recorder {
 public:
  Recorder(const Case& of, Budget budget, levelset::Progress progress);

  [[nodiscard]] bool isQuick() const { return budget_ == Budget::Quick; }
  /// Every resolution with every placement; in the quick budget, all placements at the coarsest
  /// resolution and kQuickPhase at the others.
  [[nodiscard]] std::vector<Sample> samples() const;
  /// True where OpenVDB's tool runs too: at kQuickPhase in the quick budget, and only up to
  /// `finest`; at `phases` placements in the full one.
  [[nodiscard]] bool wantsPeer(const Sample& at, int finest, int phases = 5) const;

  /// True where work that is repeated many times is done: everywhere in the full budget, at the
  /// coarsest resolution in the quick one.
  [[nodiscard]] bool wantsRepeats(const Sample& at) const;

  /// Runs and times `work`, compares what it returns with the truth and adds a row. A refusal
  /// becomes a row that says so.
  /// @return the result, for more figures by set(); empty if refused
  std::optional<levelset::NarrowBand> measure(const Subject& subject, const std::string& tool,
                                              const std::function<levelset::NarrowBand()>& work);
  /// The same where there is no closed form: the result is compared with a finer band.
  void measure(const std::string& variant, const Sample& at, const levelset::NarrowBand& reference,
               const std::string& tool, const std::function<levelset::NarrowBand()>& work);
  /// Adds a row without a band to look at.
  void row(const std::string& variant, const std::string& tool, const Sample& at, Figures figures);
  /// One more figure of the newest row.
  [[nodiscard]] double newest(const std::string& column) const {
    return result_.rows.back().figures.at(column);
  }
  void set(const std::string& column, double value) { result_.rows.back().figures[column] = value; }

  /// States that `work` is refused with this exit class.
  void expectRefusal(const std::string& variant, levelset::ExitCode code,
                     const std::function<void()>& work);
  /// States that something holds. `work` returns what it found, and true if that is as expected;
  /// a refusal is not.
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

/// The worst placement for each variant, tool and resolution, with observed orders.
[[nodiscard]] std::vector<Row> summarize(const std::vector<Row>& rows);

/// Compares our summaries with the bounds of the case. A bound fails where the figure misses the
/// limit, where the stated figure is out of date, and where no row fits. A bound at a resolution of
/// the other budget alone is left to that budget. A case that bounds errors of the band or of the
/// surface must miss no grid point and no zero, unless it states the share of those.
[[nodiscard]] std::vector<Judgement> judge(const Case& of, const std::vector<Row>& summary,
                                           Budget budget);

}  // namespace regress
