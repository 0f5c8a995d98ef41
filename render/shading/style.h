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

/// Shading styles: how a surface gets its colour, apart from the light.
namespace render {

enum class Style {
  Lit,  ///< the solid's colour under the key light and the sky light, with shadows
  /// A cool to a warm tone, by the angle between normal and key light, as in technical drawings
  /// [Gooch98].
  Tone,
  Mean,   ///< mean curvature by colour, with light and shadows
  Gauss,  ///< Gauss curvature by colour, with light and shadows
  /// Both principal curvatures by a two-dimensional colour table, with light and shadows.
  Principal,
  Accessibility,  ///< the solid's colour, darker in concave regions that large balls cannot touch
                  ///< [Miller94]
  Ink,            ///< silhouettes, ridges and valleys as lines on the colour of paper [Kindlmann03]
  Matcap,  ///< colours from a picture of a shaded ball, looked up by the normal in camera space
  /// Dark and bright stripes: reflections of parallel lines at infinity in a mirroring surface. The
  /// stripes break where the normal jumps, and bend where the curvature jumps [Kalbe11].
  ReflectionLines,
  /// A principal direction by colour, with light and shadows: red, green and blue are the
  /// squares of its coordinates, as for nerve fibres [Pajevic99].
  Directions,
  /// Streaks along the lines of curvature, the curves along a principal direction, by line integral
  /// convolution in the picture [Cabral93]; with light and shadows.
  CurvatureLines
};

/// Name of a style: "lit", "tone", "mean", "gauss", "principal", "accessibility", "ink", "matcap",
/// "reflection-lines", "directions", "curvature-lines".
[[nodiscard]] const char* styleName(Style style);
inline constexpr std::array kStyles = {
    Style::Lit,           Style::Tone, Style::Mean,   Style::Gauss,           Style::Principal,
    Style::Accessibility, Style::Ink,  Style::Matcap, Style::ReflectionLines, Style::Directions,
    Style::CurvatureLines};

/// A colour picture with linear values.
struct ColourImage {
  int width = 0, height = 0;
  std::vector<Imath::C3f> pixels;  ///< top row first

  /// Interpolates bilinearly between pixels. @param x, y  position, from 0 to 1; (0, 0) is the
  /// upper left corner
  [[nodiscard]] Imath::C3f at(double x, double y) const;
};

/// Reads a PNG with sRGB colours; alpha is ignored.
/// @throws levelset::IoError when the file cannot be opened
/// @throws levelset::InvalidInput when it is not a PNG or is damaged
/// @throws levelset::ResourceLimit, before memory is allocated, for more than 2^26 pixels, or for
/// memory above `maxMemory` bytes
[[nodiscard]] ColourImage readColourPng(const std::filesystem::path& path,
                                        std::size_t maxMemory = levelset::kNoMemoryLimit);

/// Linear value of an sRGB component, both 0 to 1.
[[nodiscard]] float linearFromSrgb(float x);

/// Options of a style.
struct StyleOptions {
  Style style = Style::Lit;
  /// Curvature scale, per world unit. A curvature of this size has the colour half way from the
  /// middle to the end of a colour map. Lines of ridges and valleys in Style::Ink begin at it. 0
  /// stands for 40 divided by the diagonal of the bounding box of the surfaces.
  double curvatureRange = 0;
  double lineWidth = 2;      ///< width of silhouette lines, or of streaks, pixels
  int reflectionLines = 32;  ///< number of lines, for Style::ReflectionLines
  /// Principal direction of Style::Directions and Style::CurvatureLines: 1, that of k1, or 2, that
  /// of k2.
  int direction = 1;
  std::shared_ptr<const ColourImage> matcap = {};  ///< picture of a shaded ball, for Style::Matcap
};

/// True when the style shows a principal direction, StyleOptions::direction.
[[nodiscard]] bool showsDirections(Style style);

/// Curvature range of a style for a picture. @param diagonal  of the bounding box of the surfaces,
/// world units
[[nodiscard]] double curvatureRangeOf(const StyleOptions& options, double diagonal);

/// True when the style uses shadow rays and ambient occlusion rays.
[[nodiscard]] bool usesLights(Style style);

/// Linear colours for mean, Gauss and principal curvatures. @param range  as
/// StyleOptions::curvatureRange, positive
[[nodiscard]] Imath::C3f meanColour(const CurvatureSample& sample, double range);
[[nodiscard]] Imath::C3f gaussColour(const CurvatureSample& sample, double range);
[[nodiscard]] Imath::C3f principalColour(const CurvatureSample& sample, double range);
/// Weight of the principal directions at a point, from 0 to 1. It is 0 at umbilics, where k1 = k2
/// and the directions are undefined, and up to a difference k1 − k2 of range/200; it is 1 from
/// range/20 on.
[[nodiscard]] double directionWeight(double k1, double k2, double range);
/// Linear colour for a direction of a line, which has no sign. @param line  unit vector
/// @param weight  from 0 (neutral colour) to 1
[[nodiscard]] Imath::C3f directionColour(const Imath::V3d& line, double weight);
/// Accessibility of a surface point, from 0 to 1. It is 1 where the surface is not concave. It is
/// 1/2 where the largest ball that can touch the point from outside has the radius 1 / range, and
/// less where only smaller balls can touch it.
[[nodiscard]] double accessibilityOf(const CurvatureSample& sample, double range);

/// Brightness of the stripes in a direction, 0 to 1. There are `lines` bright lines parallel to the
/// axis `up`, at equal angles around it.
/// @param direction  direction of the reflected ray, unit length
/// @param up, side  unit vectors at a right angle
[[nodiscard]] double reflectionLineAt(const Imath::V3d& direction, const Imath::V3d& up,
                                      const Imath::V3d& side, int lines);

/// Linear colour of a mirroring surface that reflects parallel lines, see reflectionLineAt().
/// @param normal  unit normal, towards the eye
/// @param direction  unit direction of the view ray
[[nodiscard]] Imath::C3f reflectionLinesColour(const Imath::V3d& normal,
                                               const Imath::V3d& direction, const Imath::V3d& up,
                                               const Imath::V3d& side, int lines);

/// Weight of a silhouette line at a point: 1 on the line, 0 beside it. The curvature along the view
/// is used to keep the line width constant [Kindlmann03].
/// @param cosine  cosine of the angle between normal and direction to the eye, from 0 to 1
/// @param width  width of the line on the surface, world units
[[nodiscard]] double silhouetteOf(double cosine, double viewCurvature, double width);

}  // namespace render
