#pragma once

// Private to direct volume rendering: data of a DirectVolume for the kernel.

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <array>
#include <vector>

#include "levelset/volumes/volume.h"

namespace render {

struct VolumeShading;

// Indices in LightNumbers: constants of the kernel (render/shaders/direct.glsl).
inline constexpr int kScaleSlope = 0;
inline constexpr int kScaleIntercept = 1;
inline constexpr int kPieceTolerance = 2;
inline constexpr int kPiecesPerDepth =
    3;                                  ///< linear pieces for each unit of optical depth, at least
inline constexpr int kLeastPassed = 4;  ///< a ray ends below this transmittance
inline constexpr int kPlainGradient =
    5;  ///< such gradients count half as a surface, per world unit
inline constexpr int kAmbientLight = 6;
inline constexpr int kToLight = 7;
inline constexpr int kWorldToIndex = 10;  ///< linear part, by rows
inline constexpr int kLightNumbers = 19;
using LightNumbers = std::array<double, kLightNumbers>;

struct LightTables {
  levelset::Volume volume;
  Imath::V3i blocks{0}, groups{0};            ///< along each axis
  std::vector<char> hasExtinction = {};       ///< of blocks, ordered by x, y, z
  std::vector<char> groupHasExtinction = {};  ///< of groups of 8³ blocks
  int pieceCount = 0;
  std::vector<double> pieces = {};  ///< of the transfer function, see transfer.glsl
  double tolerance = 0, plainGradient = 0;
  Imath::M44d worldToIndex = {};
};

/// @param shading  null: colours do not depend on the gradient
[[nodiscard]] LightNumbers lightNumbers(const LightTables& tables, const VolumeShading* shading);

/// A ray in index space, clipped to the grid.
struct LightStart {
  Imath::V3d from{0}, step{0};  ///< position at the distance 0; its derivative by the distance
  double t = 0, end = 0;        ///< distances, world units
  Imath::V3i cell{0};           ///< at t
  bool isInside = false;        ///< false: the ray misses the grid
};

}  // namespace render
