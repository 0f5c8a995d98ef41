#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <functional>
#include <utility>

#include "mapping/patches/patch.h"

/// Patches whose particles are where a formula puts them.
namespace support {

/// Particles at place(u, v, w), on levels of those counts.
inline mapping::Patch patchAt(const std::function<Imath::V3d(const Imath::V3d&)>& place,
                              std::size_t columns, std::size_t rows, std::size_t levels,
                              double height = 1) {
  mapping::Patch patch;
  patch.height = height;
  for (std::size_t k = 0; k < levels; ++k) {
    mapping::ParticleLevel level;
    level.columns = columns;
    level.rows = rows;
    level.w = static_cast<double>(k) / static_cast<double>(levels - 1);
    level.height = height * level.w;
    for (std::size_t j = 0; j < rows; ++j)
      for (std::size_t i = 0; i < columns; ++i)
        level.positions.push_back(
            place({static_cast<double>(i) / static_cast<double>(columns - 1),
                   static_cast<double>(j) / static_cast<double>(rows - 1), level.w}));
    patch.levels.push_back(std::move(level));
  }
  const mapping::ParticleLevel& surface = patch.levels.front();
  patch.corners = {surface.at(0, 0), surface.at(columns - 1, 0), surface.at(columns - 1, rows - 1),
                   surface.at(0, rows - 1)};
  patch.spacing = mapping::meanSpacing(patch);
  return patch;
}

}  // namespace support
