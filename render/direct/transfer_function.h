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
/// constant beyond the first and the last. Their integrals over the value have closed forms, which
/// pre-integrated volume rendering uses [Engel01].
class TransferFunction {
 public:
  /// @param points  at least one, in any order
  /// @param voxel  length of a voxel, world units; it converts opacities to extinctions
  ///        −ln(1 − opacity) / voxel
  /// @throws levelset::UsageError for no point, two points of one value, numbers that are not
  ///         finite, opacities outside [0, 1), or negative colours
  TransferFunction(std::vector<TransferPoint> points, double voxel);

  /// The points, ordered by value.
  [[nodiscard]] const std::vector<TransferPoint>& points() const { return points_; }
  /// Extinction at a value: absorbed share of the light per length, per world unit.
  [[nodiscard]] double extinction(double value) const;
  /// Emitted light at a value: colour × extinction, per world unit.
  [[nodiscard]] Imath::V3d emission(double value) const;
  /// Integrals over the value, from the first point on.
  struct Integral {
    double extinction = 0;
    Imath::V3d emission = Imath::V3d(0);
  };
  [[nodiscard]] Integral integral(double value) const;
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

 private:
  struct Piece {  // from a point to the next one
    double low = 0, width = 0;
    double slope = 0;                 // of the extinction, over the value
    double extinction = 0, rise = 0;  // at `low`; difference at the next point
    Imath::V3d colour, turn;          // the same of the colour
    Integral before;                  // integral up to `low`
    [[nodiscard]] Integral upTo(double value) const;
  };
  [[nodiscard]] const Piece& pieceAt(double value) const;
  [[nodiscard]] static double extinctionIn(const Piece& piece, double value);

  std::vector<TransferPoint> points_;
  std::vector<double> extinctions_;  // of the points, per world unit
  std::vector<Piece> pieces_;        // the first and the last extend to infinity
};

/// Parses "VALUE:OPACITY" or "VALUE:OPACITY/RED,GREEN,BLUE" for each point, separated by blanks.
/// @throws levelset::UsageError for any other text
[[nodiscard]] std::vector<TransferPoint> parseTransfer(const std::string& text);
/// The text that parseTransfer() reads, with at most four digits.
[[nodiscard]] std::string transferText(const std::vector<TransferPoint>& points);
/// A transfer function for a volume of which only the histogram is known: values below Otsu's first
/// limit are invisible, those above the last one are the most opaque.
[[nodiscard]] std::vector<TransferPoint> suggestedTransfer(
    const levelset::VolumeHistogram& histogram);

}  // namespace render
