#pragma once

// Private to direct volume rendering: render/shaders/grid_walk.glsl, transfer.glsl and direct.glsl
// as C++ classes.

#include <cmath>
#include <cstddef>
#include <vector>

#include "levelset/volumes/volume_numbers.h"
#include "render/direct/light_tables.h"

namespace render {

#define VAR double
#define IN(Type) const Type&
#define INOUT(Type) Type&
#define CONST_INT static constexpr int
#define INVERSE(n) (double(1) / double(n))

/// Transfer function of the kernel.
struct TransferKernel {
  const double* pieces;  ///< numbers of the pieces, see transfer.glsl
  int pieceCount;

  TransferKernel(const std::vector<double>& numbers, int count)
      : pieces(numbers.data()), pieceCount(count) {}
  [[nodiscard]] double pieceNumber(int n) const { return pieces[n]; }
  static double nextAbove(double a) { return std::nextafter(a, HUGE_VAL); }
  static double nextBelow(double a) { return std::nextafter(a, 0.0); }

#include "render/shaders/grid_walk.glsl"
#include "render/shaders/rounded_root.glsl"
#include "render/shaders/transfer.glsl"
};

/// Kernel of direct volume rendering, for a type of stored numbers.
template <typename Number>
struct LightKernel : TransferKernel {
  const LightTables& tables;
  const char* numbers;
  std::ptrdiff_t rowBytes, sliceBytes;
  int pointsX, pointsY, pointsZ, blocksY, blocksZ, groupsY, groupsZ;
  LightNumbers constants;
  double scaleSlope, scaleIntercept, tolerance, piecesPerDepth, leastPassed, plainGradient;
  bool isShaded;
  double ambientLight, toLightX, toLightY, toLightZ;

  LightKernel(const LightTables& tables_, const VolumeShading* shading)
      : TransferKernel(tables_.pieces, tables_.pieceCount),
        tables(tables_),
        numbers(tables_.volume.numbers()),
        rowBytes(static_cast<std::ptrdiff_t>(sizeof(Number)) * tables_.volume.size().x),
        sliceBytes(rowBytes * tables_.volume.size().y),
        pointsX(tables_.volume.size().x),
        pointsY(tables_.volume.size().y),
        pointsZ(tables_.volume.size().z),
        blocksY(tables_.blocks.y),
        blocksZ(tables_.blocks.z),
        groupsY(tables_.groups.y),
        groupsZ(tables_.groups.z),
        constants(lightNumbers(tables_, shading)),
        scaleSlope(constants[kScaleSlope]),
        scaleIntercept(constants[kScaleIntercept]),
        tolerance(constants[kPieceTolerance]),
        piecesPerDepth(constants[kPiecesPerDepth]),
        leastPassed(constants[kLeastPassed]),
        plainGradient(constants[kPlainGradient]),
        isShaded(shading != nullptr),
        ambientLight(constants[kAmbientLight]),
        toLightX(constants[kToLight]),
        toLightY(constants[kToLight + 1]),
        toLightZ(constants[kToLight + 2]) {}

  [[nodiscard]] double numberAt(int x, int y, int z) const {
    return static_cast<double>(levelset::loadNumber<Number>(
        numbers + x * static_cast<std::ptrdiff_t>(sizeof(Number)) + y * rowBytes + z * sliceBytes));
  }
  [[nodiscard]] double worldToIndex(int n) const {
    return constants[static_cast<std::size_t>(kWorldToIndex + n)];
  }
  [[nodiscard]] static double rootOf(double a) { return std::sqrt(a); }
  [[nodiscard]] bool blockHasExtinction(int n) const {
    return tables.hasExtinction[static_cast<std::size_t>(n)] != 0;
  }
  [[nodiscard]] bool groupHasExtinction(int n) const {
    return tables.groupHasExtinction[static_cast<std::size_t>(n)] != 0;
  }

#include "render/shaders/direct.glsl"

  [[nodiscard]] static VolumeRay rayOf(const LightStart& start) {
    return {start.from.x,
            start.from.y,
            start.from.z,
            start.step.x,
            start.step.y,
            start.step.z,
            start.t,
            start.end,
            1,
            0,
            0,
            0,
            start.cell.x,
            start.cell.y,
            start.cell.z,
            0};
  }
};

#undef VAR
#undef IN
#undef INOUT
#undef CONST_INT
#undef INVERSE

}  // namespace render
