#pragma once

#include <cstddef>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <vector>

/// Bounds on the figures of the suite. A bound states what was measured, and its limit follows from
/// that, so that every limit is at most three times the figure that it guards.
namespace regress {

enum class Budget { Quick, Full };

enum class Sense { AtMost, AtLeast };

/// A limit on one of our figures in the worst placement.
struct Bound {
  enum class Kind {
    Measured,  ///< `stated`: the magnitude measured; limit: kMargin times that, or `ceiling`
    Order,     ///< `stated`: the order of convergence measured; limit: kOrderMargin below that, or
               ///< `least`
    Rounding,  ///< `stated`: a multiple of the machine epsilon of float, which is the limit
    Required,  ///< `stated`: the limit itself, which follows from a requirement
    Unmeasured,  ///< `stated`: the limit itself, of a run too long to measure; never stale
  };
  /// Limit over measured figure.
  static constexpr double kMargin = 1.5;
  /// Measured order minus limit.
  static constexpr double kOrderMargin = 0.3;
  /// Largest limit over the figure found in a run. A limit above that guards nothing: the bound is
  /// stale, and fails.
  static constexpr double kLoosest = 3;
  /// Largest order found minus limit.
  static constexpr double kLoosestOrder = 1;

  std::string variant = {};
  std::string figure = {};  ///< a column, see columns.h
  Kind kind = Kind::Measured;
  double stated = 0;
  int resolution = 0;                 ///< voxels per unit of length; 0: every one
  Sense sense = Sense::AtMost;        ///< of Required; follows from the kind for the others
  std::optional<Budget> budget = {};  ///< the budget that the bound is for; empty: both
  double ceiling = std::numeric_limits<double>::infinity();  ///< largest limit of Measured
  double least = -std::numeric_limits<double>::infinity();   ///< smallest limit of Order

  [[nodiscard]] double limit() const;
  [[nodiscard]] bool isMet(double found) const;
  /// True for a bound that is met so easily that it guards nothing: the stated figure is out of
  /// date.
  [[nodiscard]] bool isStale(double found) const;
  [[nodiscard]] bool isFor(Budget run) const { return !budget || *budget == run; }
};

/// A figure measured at one resolution, in one budget or in both.
struct MeasuredAt {
  int resolution;
  double figure;
  std::optional<Budget> budget = {};
};

/// The bounds of a case, built row by row. Resolutions of the full budget have figures of five
/// placements; those of the quick budget may have figures of one, so a resolution of both budgets
/// has two entries where these differ by more than the margin.
class Bounds {
 public:
  /// Magnitudes at most Bound::kMargin times the measured ones. A resolution whose figure is not
  /// stated fails.
  Bounds& measured(const std::string& variant, const std::string& figure,
                   std::initializer_list<MeasuredAt> figures);
  /// Lowers the limits of the measured figures added last to a promise that is tighter than the
  /// margin.
  /// @param resolution  0: every one
  Bounds& ceiling(double limit, int resolution = 0);
  /// Orders of convergence at least Bound::kOrderMargin below the measured ones.
  /// @param least  promised order; the limits are not below it
  Bounds& order(const std::string& variant, const std::string& figure,
                std::initializer_list<MeasuredAt> figures,
                double least = -std::numeric_limits<double>::infinity());
  /// A magnitude at rounding level: at most `multiple` times the machine epsilon of float.
  /// @param resolution  0: every one
  Bounds& rounding(const std::string& variant, const std::string& figure, double multiple,
                   int resolution = 0);
  /// A figure that is exactly zero at every resolution.
  Bounds& zero(const std::string& variant, const std::string& figure);
  /// A limit that follows from a requirement, not from a measurement.
  Bounds& required(const std::string& variant, const std::string& figure, double limit,
                   int resolution = 0, Sense sense = Sense::AtMost);
  /// A limit of a run of the full budget that is too long to measure.
  Bounds& unmeasured(const std::string& variant, const std::string& figure, double limit,
                     std::initializer_list<int> resolutions);

  [[nodiscard]] const std::vector<Bound>& all() const { return all_; }
  operator std::vector<Bound>() const { return all_; }  // NOLINT(google-explicit-constructor)

 private:
  std::vector<Bound> all_;
  std::size_t last_ = 0;  ///< index of the first bound of the last call of measured()
};

/// A figure of a stated outcome, judged as a bound is.
/// @return true where `found` is within the limit of `measured` and the limit is not stale
[[nodiscard]] bool isAsMeasured(double found, double measured);

/// @return true where `found` is at most `multiple` times the machine epsilon of float
[[nodiscard]] bool isRounding(double found, double multiple);

}  // namespace regress
