#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "levelset/progress.h"
#include "render/hit.h"

/// What colours a surface, beside the light that falls on it.
namespace render {

enum class Style {
  Lit,            ///< the solid's colour by the lights, with shadows
  Tone,           ///< from cool to warm, as technical drawings have it [Gooch98]
  Mean,           ///< mean curvature by colour, lit
  Gauss,          ///< Gauss curvature by colour, lit
  Principal,      ///< both principal curvatures by a table of two entries, lit
  Accessibility,  ///< the solid's colour, dark where a ball of some size cannot touch [Miller94]
  Ink,            ///< silhouettes, ridges and valleys on paper [Kindlmann03]
  Matcap          ///< a picture of a shaded ball, by the normal
};

/// "lit", "tone", "mean", "gauss", "principal", "accessibility", "ink", "matcap"
[[nodiscard]] const char* styleName(Style style);
inline constexpr std::array kStyles = {Style::Lit,   Style::Tone,      Style::Mean,
                                       Style::Gauss, Style::Principal, Style::Accessibility,
                                       Style::Ink,   Style::Matcap};

/// A picture of colours, linear.
struct ColourImage {
  int width = 0, height = 0;
  std::vector<Imath::C3f> pixels;  ///< the first row on top

  /// Between the four pixels around it. @param x, y  from 0 to 1, (0, 0) the upper left corner
  [[nodiscard]] Imath::C3f at(double x, double y) const;
};

/// Reads a PNG with colours by the sRGB curve; alpha is left aside.
/// @throws levelset::IoError when it cannot be opened; InvalidInput for what is no PNG or is
///         damaged; ResourceLimit, before it allocates, for more than 2^26 pixels, or one that
///         passes `maxMemory`
[[nodiscard]] ColourImage readColourPng(const std::filesystem::path& path,
                                        std::size_t maxMemory = levelset::kNoMemoryLimit);

/// Of a colour by the sRGB curve, 0 to 1.
[[nodiscard]] float linearFromSrgb(float x);

struct StyleOptions {
  Style style = Style::Lit;
  /// Per world unit: what is shown half way to the end of a colour map, and what is a ridge or a
  /// valley. 0: 40 over the diagonal of the surfaces' box.
  double curvatureRange = 0;
  double lineWidth = 2;                            ///< pixels: of silhouettes
  std::shared_ptr<const ColourImage> matcap = {};  ///< for Style::Matcap
};

/// Are there shadows in it?
[[nodiscard]] bool usesLights(Style style);

/// Colours of curvatures, linear. @param range  as StyleOptions::curvatureRange, positive
[[nodiscard]] Imath::C3f meanColour(const CurvatureSample& sample, double range);
[[nodiscard]] Imath::C3f gaussColour(const CurvatureSample& sample, double range);
[[nodiscard]] Imath::C3f principalColour(const CurvatureSample& sample, double range);
/// 1 where all balls of radius 1 / range touch, towards 0 where only small ones do.
[[nodiscard]] double accessibilityOf(const CurvatureSample& sample, double range);

/// How much of a silhouette's line a point is, from 0 to 1: lines of an even width whatever the
/// curvature along the view [Kindlmann03].
/// @param cosine  between normal and view, from 0 to 1
/// @param width   of the line on the surface's scale, world units
[[nodiscard]] double silhouetteOf(double cosine, double viewCurvature, double width);

}  // namespace render
