#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <functional>
#include <utility>

#include "mapping/patches/patch.h"

/// Patches with particles at positions from a formula.
namespace support {

/// Particles at place(u, v, w), on layers with these counts.
inline mapping::Patch patchAt(const std::function<Imath::V3d(const Imath::V3d&)>& place,
                              std::size_t columns, std::size_t rows, std::size_t layers,
                              double height = 1) {
  mapping::Patch patch;
  patch.height = height;
  for (std::size_t k = 0; k < layers; ++k) {
    mapping::ParticleLayer layer;
    layer.columns = columns;
    layer.rows = rows;
    layer.w = static_cast<double>(k) / static_cast<double>(layers - 1);
    layer.height = height * layer.w;
    for (std::size_t j = 0; j < rows; ++j)
      for (std::size_t i = 0; i < columns; ++i)
        layer.positions.push_back(
            place({static_cast<double>(i) / static_cast<double>(columns - 1),
                   static_cast<double>(j) / static_cast<double>(rows - 1), layer.w}));
    patch.layers.push_back(std::move(layer));
  }
  const mapping::ParticleLayer& surface = patch.layers.front();
  patch.corners = {surface.at(0, 0), surface.at(columns - 1, 0), surface.at(columns - 1, rows - 1),
                   surface.at(0, rows - 1)};
  patch.spacing = mapping::meanSpacing(patch);
  return patch;
}

}  // namespace support
