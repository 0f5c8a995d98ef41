#pragma once

#include <optional>
#include <type_traits>

/// Descriptions of an operator's options. An options struct describes its members once, to any
/// visitor; command line, help, JSON, Python and validation follow from that description.
///
/// struct SmoothCsgOptions {
///   double radius = 0;
///   template <class Visitor>
///   static void describe(Visitor& visit) {
///     visit("radius", &SmoothCsgOptions::radius,
///           {.help = "radius of the rounding", .unit = OptionUnit::Length, .required = true});
///   }
/// };
///
/// The type of the member gives the type of the option: double, int, bool (a flag), V3d (a point,
/// or three lengths), Box3d, M44d, std::string, std::vector<double> (one or three numbers),
/// std::vector<V3d> (points), ScalarField, NamedVelocity, Length, VoxelSize (--voxel and
/// --resolution), Mask (--mask, --mask-min, --mask-max and --mask-invert), and std::optional of
/// these. A member of any other type takes a table of its values as the third argument:
/// visit("side", &Options::side, {{"in", ShellSide::In}, {"out", ShellSide::Out}}, {...}).
/// The default is the initial value of the member; an empty std::optional has none.
namespace levelset {

enum class OptionUnit {
  None,    ///< a pure number, or the unit that the help text names
  Length,  ///< world units; the command line also takes voxels (2vx) and percent (1%)
};

enum class OptionRange { Any, Positive, NonNegative };

struct OptionInfo {
  const char* help = "";  ///< one line, a noun phrase or a condition
  OptionUnit unit = OptionUnit::None;
  OptionRange range = OptionRange::Any;
  bool required = false;
  int position = -1;                 ///< ≥ 0: place at which the value may stand without its name
  bool allowsVoxels = true;          ///< Length: may be given in voxels
  const char* formerName = nullptr;  ///< a name that scripts used before; it keeps working
};

/// Length whose default is a number of voxels. The command line resolves it to world units.
struct Length {
  double number = 0;
  bool isVoxels = false;

  [[nodiscard]] static Length voxels(double number) { return {number, true}; }
  [[nodiscard]] static Length world(double number) { return {number, false}; }
  /// World units on a grid of that voxel size.
  [[nodiscard]] double in(double voxelSize) const { return isVoxels ? number * voxelSize : number; }
};

/// Voxel size of a new band: an edge length, or a number of voxels along the longest side of the
/// object. The command line resolves a resolution to an edge length.
struct VoxelSize {
  double edge = 0;                     ///< world units; 0: follows from `resolution`
  std::optional<int> resolution = {};  ///< > 0

  /// @param longestSide  of the object, world units
  [[nodiscard]] double of(double longestSide) const {
    return edge > 0 || !resolution ? edge : longestSide / *resolution;
  }
};

/// The options struct of an operator without options.
struct NoOptions {
  template <class Visitor>
  static void describe(Visitor&) {}
};

/// Half width of an operator's result, which is that of its operand by default.
inline constexpr OptionInfo kResultHalfWidth{
    .help = "half width of the result, in voxels; default: that of the operand",
    .range = OptionRange::Positive};

/// Half width of a new band.
inline constexpr OptionInfo kNewHalfWidth{.help = "extent of the band on each side, in voxels",
                                          .range = OptionRange::Positive};

}  // namespace levelset
