#pragma once

// Private to the ray casting of segmented fields: render/shaders/interfaces.glsl as a C++ class.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "render/segmented/interface_tables.h"

namespace render {

#define VAR double
#define IN(Type) const Type&
#define INOUT(Type) Type&
#define CONST_INT static constexpr int
#define CONST_DOUBLE static constexpr double

struct InterfaceKernel {
  using uint = std::uint32_t;

  const InterfaceTables& tables;
  double background;
  int pointsX, pointsY, pointsZ, groupsY, groupsZ;
  bool wantsGradients, hasSheets;

  InterfaceKernel(const InterfaceTables& tables_, bool wantsGradients_)
      : tables(tables_),
        background(tables_.background),
        pointsX(tables_.points.x),
        pointsY(tables_.points.y),
        pointsZ(tables_.points.z),
        groupsY(tables_.groups.y),
        groupsZ(tables_.groups.z),
        wantsGradients(wantsGradients_),
        hasSheets(tables_.sheets != nullptr) {}

  /// Number n of an array. @pre the array has it
  template <typename Number>
  [[nodiscard]] static Number loaded(const FieldArray& array, int n) {
    Number number;
    std::memcpy(&number, array.data + sizeof(Number) * static_cast<std::size_t>(n), sizeof(Number));
    return number;
  }
  [[nodiscard]] int groupEntry(int n) const {
    return tables.groupEntries[static_cast<std::size_t>(n)];
  }
  [[nodiscard]] int tableEntry(int n) const { return tables.table[static_cast<std::size_t>(n)]; }
  [[nodiscard]] uint maskWord(int n) const { return tables.masks[static_cast<std::size_t>(n)]; }
  [[nodiscard]] uint blockWord(int n) const { return loaded<uint>(tables.blocks, n); }
  [[nodiscard]] uint wordAt(int n) const { return loaded<uint>(tables.words, n); }
  [[nodiscard]] int paletteLabel(int n) const {
    return loaded<levelset::RegionLabel>(tables.palettes, n);
  }
  [[nodiscard]] double distanceAt(int n) const {
    return static_cast<double>(loaded<float>(tables.distances, n));
  }
  [[nodiscard]] uint extraKey(int n) const { return loaded<uint>(tables.extras, 2 * n); }
  [[nodiscard]] double extraValue(int n) const {
    return static_cast<double>(loaded<float>(tables.extras, 2 * n + 1));
  }
  [[nodiscard]] bool isShown(int label) const { return tables.isShown(label); }
  [[nodiscard]] uint sheetCellWord(int n) const {
    return tables.sheetCells[static_cast<std::size_t>(n)];
  }
  [[nodiscard]] int sheetEntry(int n) const {
    return tables.sheetLists[static_cast<std::size_t>(n)];
  }
  [[nodiscard]] int sheetCorner(int n) const {
    return tables.sheetTriangles[static_cast<std::size_t>(n)];
  }
  [[nodiscard]] double sheetVertex(int n) const {
    return tables.sheetVertices[static_cast<std::size_t>(n)];
  }
  [[nodiscard]] double sheetNormal(int n) const {
    return static_cast<double>(tables.sheetNormals[static_cast<std::size_t>(n)]);
  }
  [[nodiscard]] static int bitsIn(uint x) {
    x -= x >> 1 & 0x55555555u;
    x = (x & 0x33333333u) + (x >> 2 & 0x33333333u);
    x = (x + (x >> 4)) & 0x0f0f0f0fu;
    return static_cast<int>(x * 0x01010101u >> 24);
  }
  [[nodiscard]] static double floor(double a) { return std::floor(a); }

#include "render/shaders/grid_walk.glsl"
#include "render/shaders/sheets.glsl"
// follows sheets.glsl
#include "render/shaders/interfaces.glsl"

  [[nodiscard]] static CrossingRay rayOf(const InterfaceStart& start) {
    CrossingRay ray{};
    ray.fromX = start.from.x;
    ray.fromY = start.from.y;
    ray.fromZ = start.from.z;
    ray.stepX = start.step.x;
    ray.stepY = start.step.y;
    ray.stepZ = start.step.z;
    ray.t = start.t;
    ray.end = start.end;
    ray.x = start.cell.x;
    ray.y = start.cell.y;
    ray.z = start.cell.z;
    ray.label = start.label;
    ray.checks = start.label < 0 ? 1 : 0;
    ray.state = kGoing;
    ray.begin = start.begin;
    ray.sheet.triangle = -1;
    return ray;
  }
};

#undef VAR
#undef IN
#undef INOUT
#undef CONST_INT
#undef CONST_DOUBLE

}  // namespace render
