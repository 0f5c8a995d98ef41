#pragma once

#include <cstddef>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <vector>

/// Bounds on the figures of the suite. A bound states the measured figure, and its limit follows
/// from that figure, so that every limit is at most three times the figure that it guards.
namespace regress {

enum class Budget { Quick, Full };

enum class Sense { AtMost, AtLeast };

/// A limit on a figure of Levelsmith in the worst placement of the object relative to the grid
/// points.
struct Bound {
  enum class Kind {
    Measured,  ///< `stated` is the measured magnitude; the limit is kMargin times it, or `ceiling`
               ///< if that is smaller
    Order,     ///< `stated` is the measured order of convergence; the limit is kOrderMargin below
               ///< it, or `least` if that is larger
    Rounding,  ///< `stated` times the machine epsilon of float is the limit
    Required,  ///< `stated` is the limit itself, which follows from a requirement
  };
  /// Ratio of the limit to the measured figure, for Kind::Measured.
  static constexpr double kMargin = 1.5;
  /// Measured order of convergence minus the limit on it, for Kind::Order.
  static constexpr double kOrderMargin = 0.3;
  /// Largest accepted ratio of the limit to the figure found in a run. A looser limit guards
  /// nothing: the bound is stale, and fails.
  static constexpr double kLoosest = 3;
  /// Largest accepted difference of the order found in a run and its limit. Beyond it the bound is
  /// stale, and fails.
  static constexpr double kLoosestOrder = 1;

  std::string variant = {};
  std::string figure = {};  ///< name of a column of results.csv, such as "surface_l1_vx"
  Kind kind = Kind::Measured;
  double stated = 0;
  int resolution = 0;  ///< resolution at which the bound holds, voxels per unit of length; 0: all
  Sense sense = Sense::AtMost;  ///< direction of a Required limit; for the other kinds it follows
                                ///< from the kind
  std::optional<Budget> budget = {};  ///< budget in which the bound is tested; empty: both
  double ceiling =
      std::numeric_limits<double>::infinity();  ///< upper limit of limit() for Kind::Measured
  double least =
      -std::numeric_limits<double>::infinity();  ///< lower limit of limit() for Kind::Order

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

/// The bounds of a case, added figure by figure. The full budget runs five placements at each
/// resolution, the quick budget often only one. So a resolution that both budgets run has two
/// entries if their worst figures differ by more than the margin.
class Bounds {
 public:
  /// Adds bounds on a magnitude, which must be at most Bound::kMargin times the measured one. A
  /// resolution that runs without an entry in `figures` fails.
  Bounds& measured(const std::string& variant, const std::string& figure,
                   std::initializer_list<MeasuredAt> figures);
  /// Caps the limits of the last call of measured(): none of them exceeds `limit`, a promised
  /// accuracy that is tighter than the margin.
  /// @param resolution  resolution whose limit is lowered; 0: all
  Bounds& ceiling(double limit, int resolution = 0);
  /// Adds bounds on an order of convergence, which must be at most Bound::kOrderMargin below the
  /// measured one.
  /// @param least  promised order; the limits are not below it
  Bounds& order(const std::string& variant, const std::string& figure,
                std::initializer_list<MeasuredAt> figures,
                double least = -std::numeric_limits<double>::infinity());
  /// Adds a bound on a magnitude at rounding level: at most `multiple` times the machine epsilon of
  /// float.
  /// @param resolution  resolution at which the bound holds; 0: all
  Bounds& rounding(const std::string& variant, const std::string& figure, double multiple,
                   int resolution = 0);
  /// Adds a bound on a figure that must be exactly zero at every resolution.
  Bounds& zero(const std::string& variant, const std::string& figure);
  /// Adds a limit that follows from a requirement, not from a measurement.
  Bounds& required(const std::string& variant, const std::string& figure, double limit,
                   int resolution = 0, Sense sense = Sense::AtMost);

  [[nodiscard]] const std::vector<Bound>& all() const { return all_; }
  operator std::vector<Bound>() const { return all_; }  // NOLINT(google-explicit-constructor)

 private:
  std::vector<Bound> all_;
  std::size_t last_ = 0;  ///< index of the first bound of the last call of measured()
};

/// Compares a figure of an outcome with the measured figure, by the rules of Bound::Kind::Measured.
/// @return true if `found` is within the limit that follows from `measured`, and the limit is not
///         stale
[[nodiscard]] bool isAsMeasured(double found, double measured);

/// @return true if the magnitude of `found` is at most `multiple` times the machine epsilon of
///         float
[[nodiscard]] bool isRounding(double found, double multiple);

}  // namespace regress
