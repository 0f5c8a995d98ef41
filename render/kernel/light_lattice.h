#pragma once

#include <cstddef>
#include <vector>

#include "render/hit.h"
#include "render/scene/scene.h"
#include "render/shading/shading.h"

namespace render {

/// A rectangle of pixels.
struct PixelBox {
  int left, top, right, bottom;  ///< right and bottom are exclusive
};

/// Light at a lattice of points of the picture, which is interpolated where it varies smoothly. It
/// replaces most of the light rays of colour samples. In a cell of the lattice, light is
/// interpolated if the surface at its corners is smooth and the light at its corners is similar
/// (irradiance caching [Ward88], here in the picture plane). Elsewhere the caller traces light
/// rays.
class LightLattice {
 public:
  /// A point of the lattice, in pixels of the picture.
  struct Point {
    double x, y;
  };
  /// Surface and light at a lattice point.
  struct Node {
    Hit hit;
    PointLight light;
  };
  /// The light of a sample, as far as the lattice knows it.
  struct Estimate {
    PointLight light;
    bool isSkyKnown = false, isKeyKnown = false;
  };

  /// Creates an empty lattice, which knows nothing.
  LightLattice() = default;
  /// Creates the part of the picture's lattice that covers a box of pixels. The lattice does not
  /// depend on the box.
  /// @param spacing  distance of the lattice points, pixels, at least 1
  LightLattice(const PixelBox& box, int width, int height, int spacing);

  [[nodiscard]] bool isEmpty() const { return points_.empty(); }
  [[nodiscard]] const std::vector<Point>& points() const { return points_; }
  /// Stores the surface and light at the lattice points. @param nodes  one for each of points()
  void setNodes(std::vector<Node> nodes);

  /// True when the key light is partly hidden: one shadow ray then says nothing about its share.
  [[nodiscard]] static bool isPenumbra(const PointLight& light) {
    constexpr double kClear = 0.03;
    return light.key > kClear && light.key < 1 - kClear;
  }

  /// Estimates the light at a hit. @param pixelX, pixelY  pixel of the sample, in the box
  /// @param x, y  position of the sample in the picture, pixels
  [[nodiscard]] Estimate at(int pixelX, int pixelY, double x, double y, const Hit& hit) const;

 private:
  struct Cell {
    bool isSmooth = false, isSkyKnown = false, isKeyKnown = false;
    double size = 0;  ///< longest diagonal between the corners' positions, world units
  };
  [[nodiscard]] std::size_t nodeAt(std::size_t column, std::size_t row) const {
    return row * columns_.size() + column;
  }
  [[nodiscard]] Cell cellBetween(std::size_t column, std::size_t row) const;

  int spacing_ = 1, firstColumn_ = 0, firstRow_ = 0;
  std::vector<double> columns_, rows_;
  std::vector<Point> points_;
  std::vector<Node> nodes_;
  std::vector<Cell> cells_;
};

}  // namespace render
