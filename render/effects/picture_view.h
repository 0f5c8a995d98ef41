#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <initializer_list>
#include <string>

#include "render/images/image.h"

namespace render {

/// Camera and surface points of a picture, from the header and the layers of its EXR.
class PictureView {
 public:
  /// @param image  must outlive this object
  /// @throws levelset::InvalidInput for a picture without the matrices worldToCamera and
  ///         worldToNDC, or without the layer Z, and for matrices that are not those of a camera
  explicit PictureView(const Image& image);

  [[nodiscard]] const Image& image() const { return image_; }
  [[nodiscard]] bool isPerspective() const { return isPerspective_; }
  /// Width and height of a pixel: on the plane at unit depth (perspective), or in world units.
  [[nodiscard]] double stepX() const { return stepX_; }
  [[nodiscard]] double stepY() const { return stepY_; }
  /// Horizontal position of the view axis in the picture, pixels.
  [[nodiscard]] double middleX() const { return middleX_; }
  /// Unit axes of the picture, in world space.
  [[nodiscard]] const Imath::V3d& right() const { return right_; }
  [[nodiscard]] const Imath::V3d& up() const { return up_; }
  [[nodiscard]] const Imath::V3d& forward() const { return forward_; }
  /// Unit direction of the ray through the middle of a pixel, in world space.
  [[nodiscard]] Imath::V3d direction(int x, int y) const;
  /// True when a surface is seen in a pixel.
  [[nodiscard]] bool isHit(std::size_t pixel) const;
  /// Distance along the view axis, world units. @pre the pixel shows a surface
  [[nodiscard]] double depth(std::size_t pixel) const {
    return static_cast<double>((*depths_)[pixel]);
  }
  /// Diagonal of the scene, world units: that of the header, or else of the surfaces that are seen.
  [[nodiscard]] double diagonal() const { return diagonal_; }
  /// Least and largest depth of the surfaces that are seen; 0, 0 if there is none.
  [[nodiscard]] Imath::V2d depthRange() const { return depthRange_; }

 private:
  void readCamera();
  void measure();

  const Image& image_;
  const std::vector<float>* depths_ = nullptr;
  bool isPerspective_ = true;
  double stepX_ = 1, stepY_ = 1, middleX_ = 0, diagonal_ = 0;
  Imath::V2d depthRange_{0};
  Imath::V3d right_, up_, forward_;
};

/// Three channels of a picture, such as N.X, N.Y and N.Z.
class VectorLayer {
 public:
  /// @param layer  name of the layer, such as "N"
  /// @param purpose  begins the message: "the outline"
  /// @throws levelset::InvalidInput for a picture without the layer
  VectorLayer(const Image& image, const std::string& layer, const std::string& purpose);
  [[nodiscard]] Imath::V3d at(std::size_t pixel) const {
    return {static_cast<double>((*channels_[0])[pixel]),
            static_cast<double>((*channels_[1])[pixel]),
            static_cast<double>((*channels_[2])[pixel])};
  }

 private:
  const std::vector<float>* channels_[3];
};

/// Checks that a picture has channels. @throws levelset::InvalidInput if one is missing
void requireChannels(const Image& image, std::initializer_list<const char*> names,
                     const std::string& purpose);

}  // namespace render
