#pragma once

// Cages for tests of deformations.

#include <array>
#include <map>

#include "levelset/mesh.h"

namespace support {

/// A box whose faces are grids of n × n squares, each of two triangles, facing outwards.
inline levelset::TriMesh boxCage(const Imath::V3d& low, const Imath::V3d& high, unsigned n) {
  levelset::TriMesh mesh;
  std::map<std::array<unsigned, 3>, std::uint32_t> numbers;
  const auto vertex = [&](const std::array<unsigned, 3>& at) {
    const auto [entry, isNew] =
        numbers.try_emplace(at, static_cast<std::uint32_t>(mesh.positions.size()));
    if (isNew)
      mesh.positions.push_back(low + (high - low) * Imath::V3d(at[0], at[1], at[2]) / double(n));
    return entry->second;
  };
  for (unsigned axis = 0; axis < 3; ++axis)
    for (const unsigned side : {0u, n})
      for (unsigned i = 0; i < n; ++i)
        for (unsigned j = 0; j < n; ++j) {
          std::array<std::uint32_t, 4> corners{};
          for (unsigned k = 0; k < 4; ++k) {
            std::array<unsigned, 3> at{};
            at[axis] = side;
            at[(axis + 1) % 3] = i + (k == 1 || k == 2);
            at[(axis + 2) % 3] = j + (k >= 2);
            corners[k] = vertex(at);
          }
          if (side == 0) std::swap(corners[1], corners[3]);
          mesh.triangles.push_back({corners[0], corners[1], corners[2]});
          mesh.triangles.push_back({corners[0], corners[2], corners[3]});
        }
  return mesh;
}

}  // namespace support
