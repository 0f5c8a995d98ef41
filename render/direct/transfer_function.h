#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <string>
#include <vector>

#include "levelset/volumes/histogram.h"

namespace render {

/// Point of a transfer function.
struct TransferPoint {
  double value = 0;
  /// Share of the light that a layer of one voxel absorbs, [0, 1). A voxel is as long as the
  /// smallest spacing of the grid.
  double opacity = 0;
  Imath::C3f colour{1};  ///< linear
  bool operator==(const TransferPoint&) const = default;
};

/// Extinction and colour for each value of a volume: both are linear between the points, and
/// constant beyond the first and the last. Between two points the emitted light is a quadratic
/// polynomial of the value, so its integrals have closed forms.
class TransferFunction {
 public:
  /// @param points  at least one, in any order
  /// @param voxel  length of a voxel, world units; it converts opacities to extinctions
  ///        −ln(1 − opacity) / voxel
  /// @throws levelset::UsageError for no point, two points of one value, numbers that are not
  ///         finite, opacities outside [0, 1), negative colours, or a voxel that is not positive
  TransferFunction(std::vector<TransferPoint> points, double voxel);

  /// The points, ordered by value.
  [[nodiscard]] const std::vector<TransferPoint>& points() const { return points_; }
  /// Extinction at a value: absorbed share of the light per length, per world unit.
  [[nodiscard]] double extinction(double value) const;
  /// Emitted light at a value: colour × extinction, per world unit.
  [[nodiscard]] Imath::V3d emission(double value) const;
  /// Bounds over a range of values: the largest extinction, per world unit, and its largest change
  /// for a change of the value, per world unit and value unit.
  struct Bounds {
    double extinction = 0, slope = 0;
  };
  [[nodiscard]] Bounds boundsBetween(double low, double high) const;
  /// True when the extinction is 0 at all values from `low` to `high`.
  [[nodiscard]] bool isEmptyBetween(double low, double high) const {
    return boundsBetween(low, high).extinction == 0;
  }
  /// Part of a run of linear values that lies between two points: its share of the run, and the
  /// means of extinction and emission on it, per world unit.
  struct Part {
    double share = 0, extinction = 0;
    Imath::V3d emission = Imath::V3d(0);
  };
  /// Calls visit(Part) for the parts of a run whose values go linearly from `from` to `to`, in that
  /// order. The means are exact.
  template <typename Visit>
  void alongRun(double from, double to, const Visit& visit) const {
    const bool isRising = from <= to;
    std::size_t n = pieceAt(from);
    if (!isRising && from == pieces_[n].low && n > 0) --n;
    double at = from;
    for (;;) {
      const bool isLast = isRising ? n + 1 == pieces_.size() || pieces_[n + 1].low >= to
                                   : n == 0 || pieces_[n].low <= to;
      const double next = isLast ? to : isRising ? pieces_[n + 1].low : pieces_[n].low;
      const double share = isLast && at == from ? 1 : (next - at) / (to - from);
      if (share > 0) visit(partOf(pieces_[n], at, next, share));
      if (isLast) return;
      at = next;
      isRising ? ++n : --n;
    }
  }

 private:
  struct Piece {  // from a point to the next one
    double low = 0, width = 0;
    double extinction = 0, slope = 0;  // at `low`; change over the value
    Imath::V3d colour, turn;           // at `low`; difference at the next point
  };
  /// Number of the piece that holds a value.
  [[nodiscard]] std::size_t pieceAt(double value) const;
  [[nodiscard]] static double extinctionIn(const Piece& piece, double value);
  [[nodiscard]] static Imath::V3d emissionIn(const Piece& piece, double value);
  [[nodiscard]] static Part partOf(const Piece& piece, double from, double to, double share);

  std::vector<TransferPoint> points_;
  std::vector<Piece> pieces_;  // the first and the last extend to infinity
};

/// Parses "VALUE:OPACITY" or "VALUE:OPACITY/RED,GREEN,BLUE" for each point, separated by blanks.
/// @throws levelset::UsageError for any other text
[[nodiscard]] std::vector<TransferPoint> parseTransfer(const std::string& text);
/// The text from which parseTransfer() reads the same points.
[[nodiscard]] std::string transferText(const std::vector<TransferPoint>& points);
/// A transfer function for a volume of which only the histogram is known: values below Otsu's first
/// limit are invisible, those above the last one are the most opaque.
[[nodiscard]] std::vector<TransferPoint> suggestedTransfer(
    const levelset::VolumeHistogram& histogram);

}  // namespace render
