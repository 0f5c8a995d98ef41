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
  /// True when the extinction is 0 at all values from `low` to `high`.
  [[nodiscard]] bool isEmptyBetween(double low, double high) const;
  /// Numbers of the pieces between the points for the kernel, see render/shaders/transfer.glsl.
  [[nodiscard]] std::vector<double> pieceNumbers() const;
  [[nodiscard]] int pieceCount() const { return static_cast<int>(pieces_.size()); }

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
