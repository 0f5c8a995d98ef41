#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "render/direct/transfer_function.h"

namespace viewer {

/// Edits a transfer function with the mouse, in a box above the histogram. Positions are shares of
/// the box: x from the lowest value of the volume (0) to the highest (1), y from the bottom (0) to
/// the top (1). The height of a point is the root of its opacity, so that small opacities can be
/// told apart.
class TransferEditor {
 public:
  /// Largest opacity of a point.
  static constexpr double kMostOpaque = 0.99;

  TransferEditor() = default;
  /// @param points  at least one, with different values
  /// @param low, high  values at the sides of the box, low < high
  TransferEditor(std::vector<render::TransferPoint> points, double low, double high);

  /// The points, ordered by value.
  [[nodiscard]] const std::vector<render::TransferPoint>& points() const { return points_; }
  /// Number of the selected point.
  [[nodiscard]] std::optional<std::size_t> selected() const { return selected_; }
  [[nodiscard]] double xOf(const render::TransferPoint& point) const;
  [[nodiscard]] static double yOf(const render::TransferPoint& point);

  /// Selects the nearest point within a reach, or adds one with the colour there, and starts to
  /// drag it. @param reachX, reachY  largest distance from a point
  void press(double x, double y, double reachX, double reachY);
  /// Moves the dragged point. It stays between its neighbours.
  void moveTo(double x, double y);
  void release() { isDragging_ = false; }
  [[nodiscard]] bool isDragging() const { return isDragging_; }
  /// Removes the nearest point within a reach. The last point stays.
  void removeAt(double x, double y, double reachX, double reachY);
  /// Changes the linear colour of the selected point.
  void setColour(const Imath::C3f& colour);

 private:
  [[nodiscard]] std::optional<std::size_t> nearest(double x, double y, double reachX,
                                                   double reachY) const;
  [[nodiscard]] Imath::C3f colourAt(double value) const;

  std::vector<render::TransferPoint> points_;
  double low_ = 0, high_ = 1;
  std::optional<std::size_t> selected_;
  bool isDragging_ = false;
};

}  // namespace viewer
