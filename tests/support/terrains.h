#pragma once

#include <Imath/ImathVec.h>

#include <random>

#include "levelset/terrain/height_field.h"

namespace support {

/// Height field with the heights f(x, y), centred at the origin.
template <typename Heights>
levelset::HeightField terrainOf(int columns, int rows, Imath::V2d spacing, const Heights& f) {
  levelset::HeightField field{.columns = columns, .rows = rows, .spacing = spacing};
  field.origin = {-(columns - 1) * spacing.x / 2, -(rows - 1) * spacing.y / 2};
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Imath::V2d p = field.position(column, row);
      field.heights.push_back(static_cast<float>(f(p.x, p.y)));
    }
  return field;
}

/// Independent heights from 0 to 1. @param missing  share of the samples without data
inline levelset::HeightField randomTerrain(int columns, int rows, double missing, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  return terrainOf(columns, rows, {1, 1}, [&](double, double) {
    const double height = unit(random);
    return unit(random) < missing ? static_cast<double>(levelset::kMissingHeight) : height;
  });
}

}  // namespace support
