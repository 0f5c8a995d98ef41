#pragma once

#include <Imath/ImathVec.h>

#include <vector>

#include "render/images/image.h"

namespace render {

class PictureView;

/// Inputs of the kernel of effects, render/shaders/effects/screen.glsl.
struct ScreenTables {
  int width = 0, height = 0;
  bool isPerspective = true;
  /// Four floats for each pixel: depth (−1 where no surface is seen), and the unit normal in camera
  /// space, towards the eye.
  std::vector<float> pixels;
  std::vector<double> numbers;  ///< constants of the kernel, then its sets of rays
};

/// Functions of the kernel. Each computes one number for every pixel.
enum class ScreenPass {
  OutlineStrength,  ///< weight of lines by Sobel's masks
  Outline,          ///< weight with the width of the lines, from OutlineStrength
  OpenShare,        ///< share of the sky that is open
  KeyShare,         ///< share of the key light that arrives
  Smooth            ///< mean over squares of pixels, from OpenShare or KeyShare
};

/// Processor that runs passes of the kernel. All have the same bits.
class ScreenRunner {
 public:
  virtual ~ScreenRunner() = default;
  /// @param earlier  result of the pass before, one number for each pixel; may be empty for passes
  ///         that do not use it
  [[nodiscard]] virtual std::vector<float> run(const ScreenTables& tables, ScreenPass pass,
                                               const std::vector<float>& earlier) const = 0;
};

/// Runs passes on all threads of the processor.
class CpuScreenRunner : public ScreenRunner {
 public:
  [[nodiscard]] std::vector<float> run(const ScreenTables& tables, ScreenPass pass,
                                       const std::vector<float>& earlier) const override;
};

/// Outlines by Sobel's masks on depth and normals.
struct OutlineNumbers {
  double width = 2;              ///< width of the lines, pixels, at most kWidestOutline
  int spacing = 1;               ///< distance of the samples of the masks, pixels
  double step = 0;               ///< jump of depth that is an outline, world units
  double crease = 0.6981317008;  ///< angle between normals that is a crease, radians; π: no creases
};
inline constexpr double kWidestOutline = 120;  // also of halos

/// Ambient occlusion by rays in the picture.
struct OcclusionNumbers {
  double radius = 1;         ///< length of the rays, world units
  double occluderDepth = 1;  ///< extent of the surfaces behind those that are seen, world units
};

/// Soft shadows of a key light, by rays in the picture.
struct ShadowNumbers {
  Imath::V3d toLight{-0.4, 0.7, 0.6};  ///< as Light::direction: x right, y up, z towards the eye
  double softness = 0.15;              ///< half angle of the cone of light directions, radians
  double length = 1;                   ///< length of the rays, world units
  double occluderDepth = 1;
};

// Layers by the kernel: one number from 0 to 1 for each pixel. They throw levelset::InvalidInput
// for a picture without the layer N.

/// Weight of the outlines.
[[nodiscard]] std::vector<float> outlineLayer(const PictureView& view, const OutlineNumbers& of,
                                              const ScreenRunner& runner);
/// Share of the sky that is open, as the layer light.sky of 'render --light-layers'.
[[nodiscard]] std::vector<float> occlusionLayer(const PictureView& view, const OcclusionNumbers& of,
                                                const ScreenRunner& runner);
/// Share of the key light that arrives, as the layer light.key of 'render --light-layers'.
[[nodiscard]] std::vector<float> shadowLayer(const PictureView& view, const ShadowNumbers& of,
                                             const ScreenRunner& runner);

}  // namespace render
