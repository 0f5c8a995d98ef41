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
/// std::vector<V3d> (points), ScalarField, Attribute, NamedVelocity, NormalSpeed, Length, VoxelSize
/// (--voxel and
/// --resolution), Mask (--mask, --mask-min, --mask-max and --mask-invert), and std::optional of
/// these. Any member may take a table of names and values as the third argument; a member of
/// another type must:
/// visit("side", &Options::side, {{"in", ShellSide::In}, {"out", ShellSide::Out}}, {...}).
/// The default is the initial value of the member; an empty std::optional has none.
namespace levelset {

enum class OptionUnit {
  None,    ///< a pure number, or the unit that the help text names
  Length,  ///< world units; the command line also takes voxels (2vx) and percent (1%)
};

enum class OptionRange { Any, Positive, NonNegative };

struct OptionInfo {
  const char* help = "";  ///< help text: one line, a noun phrase or a condition
  OptionUnit unit = OptionUnit::None;
  OptionRange range = OptionRange::Any;
  bool required = false;
  /// ≥ 0: index of the value among the arguments that are given without an option's name; −1: the
  /// value needs the option's name.
  int position = -1;
  bool allowsVoxels = true;          ///< true: a length may also be given in voxels
  const char* formerName = nullptr;  ///< former option name in old scripts; null: none
};

/// Length in world units or in voxels, for options whose default is a number of voxels. The command
/// line resolves it to world units.
struct Length {
  double number = 0;
  bool isVoxels = false;  ///< true: `number` is in voxels; false: in world units

  [[nodiscard]] static Length voxels(double number) { return {number, true}; }
  [[nodiscard]] static Length world(double number) { return {number, false}; }
  /// Length in world units on a grid of the given voxel size.
  [[nodiscard]] double in(double voxelSize) const { return isVoxels ? number * voxelSize : number; }
};

/// Voxel size of a new band: an edge length, or a number of voxels along the longest side of the
/// object. The command line resolves a resolution to an edge length.
struct VoxelSize {
  double edge = 0;  ///< edge length of a voxel, world units; 0: follows from `resolution`
  std::optional<int> resolution = {};  ///< number of voxels along the object's longest side, > 0

  /// Edge length of a voxel, world units.
  /// @param longestSide  longest side of the object, world units
  [[nodiscard]] double of(double longestSide) const {
    return edge > 0 || !resolution ? edge : longestSide / *resolution;
  }
};

/// Options of an operator without options.
struct NoOptions {
  template <class Visitor>
  static void describe(Visitor&) {}
};

/// Description of the option `half-width` of an operator on a band.
inline constexpr OptionInfo kResultHalfWidth{
    .help = "half width of the result, in voxels; default: that of the operand",
    .range = OptionRange::Positive};

/// Description of the option `half-width` of an operator that creates a band.
inline constexpr OptionInfo kNewHalfWidth{.help =
                                              "half width of the band: distance from the surface "
                                              "to the end of the band on each side, in voxels",
                                          .range = OptionRange::Positive};

}  // namespace levelset
