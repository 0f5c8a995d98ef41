#pragma once

// Isosurfaces of volumes that are difficult for ray casters.

#include <algorithm>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "levelset/volumes/synthetic.h"
#include "render/volumes/volume_surface.h"
#include "tests/support/volumes.h"

namespace support {

/// A sheared and mirrored map with three spacings, for grids of 30 points on each axis.
inline Imath::M44d obliqueMap() {
  const Imath::M44d linear(-0.05, 0.02, 0, 0, 0.01, 0.09, 0, 0, 0.02, -0.01, 0.06, 0, 0, 0, 0, 1);
  const Imath::V3d middle = Imath::V3d(14.5) * linear;
  return linear * Imath::M44d().setTranslation(-middle);
}

/// Noise of whole numbers from 0 to 255 around a ball, as bytes.
inline levelset::Volume noisyBytes(int size) {
  std::mt19937 random(3);
  const auto bytes = std::make_shared<std::vector<unsigned char>>();
  const double middle = 0.5 * (size - 1);
  for (int k = 0; k < size; ++k)
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i) {
        const double d =
            100 - 8 * ((Imath::V3d(i, j, k) - Imath::V3d(middle)).length() - 0.3 * size);
        const int noise = static_cast<int>(random() % 61) - 30;
        bytes->push_back(
            static_cast<unsigned char>(std::clamp(static_cast<int>(d) + noise, 0, 255)));
      }
  return {{Imath::V3i(size), Imath::M44d()},
          levelset::VolumeType::U8,
          {},
          {bytes, reinterpret_cast<const char*>(bytes->data())}};
}

/// Surfaces that are difficult for ray casters, with their names.
inline std::vector<std::pair<std::string, render::VolumeSurface>> volumeSurfaces() {
  const auto ball = [](const Imath::V3d& p) { return 0.6 - p.length(); };
  const auto shiftedBall = [](const Imath::V3d& p) { return 0.6 - (p - Imath::V3d(1)).length(); };
  return {{"waves", {levelset::marschnerLobb(41), 0.5}},
          {"values that equal the isovalue", {noisyBytes(24), 100}},
          {"sheared ball", {sampled({Imath::V3i(30), obliqueMap()}, ball), 0}},
          {"ball", {levelset::sphereVolume(33, 0.6), 0}},
          {"torus", {levelset::torusVolume(30, 0.6, 0.25), 0.01}},
          {"noise", {noisyBytes(24), 100.5}},
          {"noise, inside below", {noisyBytes(24), 100, render::VolumeInside::Below}},
          {"three spacings",
           {sampled({Imath::V3i(40, 25, 12), Imath::M44d().setScale(Imath::V3d(0.05, 0.08, 0.17))},
                    shiftedBall),
            0.02}}};
}

}  // namespace support
