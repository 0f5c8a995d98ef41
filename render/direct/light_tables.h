#pragma once

// Private to direct volume rendering: data of a DirectVolume for the kernel.

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <array>
#include <vector>

#include "levelset/volumes/volume.h"

namespace render {

struct VolumeShading;

/// Indices in LightNumbers: constants of the kernel (render/shaders/direct.glsl).
enum LightNumber {
  kScaleSlope,
  kScaleIntercept,
  kPieceTolerance,
  kPiecesPerDepth,  ///< linear pieces for each unit of optical depth, at least
  kLeastPassed,     ///< a ray ends below this transmittance
  kPlainGradient,   ///< gradients of this size count half as a surface, per world unit
  kAmbientLight,
  kToLight,
  kWorldToIndex = kToLight + 3,  ///< linear part, by rows
  kLightNumbers = kWorldToIndex + 9
};
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
