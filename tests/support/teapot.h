#pragma once

// The Utah teapot as Bézier surfaces. Its user defines LEVELSMITH_DATA_DIR.

#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/support/bezier_scenes.h"

namespace bezier_scenes {

/// The 32 patches of the teapot in data/models; none if the file is missing.
inline BezierVolume teapot() {
  std::ifstream stream(LEVELSMITH_DATA_DIR "/models/TeapotBufferGeometry.js");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const auto numbersAfter = [&](const char* name) {
    std::vector<double> numbers;
    const std::size_t begin = text.find(name);
    if (begin == std::string::npos) return numbers;
    const std::size_t end = text.find("];", begin);
    std::string list = text.substr(text.find('[', begin) + 1, end - text.find('[', begin) - 1);
    for (std::size_t at = list.find("/*"); at != std::string::npos; at = list.find("/*"))
      list.erase(at, list.find("*/", at) + 2 - at);
    for (std::size_t at = list.find("- "); at != std::string::npos; at = list.find("- "))
      list.erase(at + 1, 1);
    std::size_t at = 0;
    while (at < list.size()) {
      const char* start = list.c_str() + at;
      char* stop = nullptr;
      const double value = std::strtod(start, &stop);
      if (stop == start) {
        ++at;
        continue;
      }
      numbers.push_back(value);
      at += static_cast<std::size_t>(stop - start);
    }
    return numbers;
  };
  const std::vector<double> patches = numbersAfter("teapotPatches"),
                            vertices = numbersAfter("teapotVertices");
  BezierVolume volume;
  for (std::size_t first = 0; first + 16 <= patches.size(); first += 16) {
    std::vector<V3d> points;
    for (std::size_t n = 0; n < 16; ++n) {
      const auto v = static_cast<std::size_t>(patches[first + n]);
      points.emplace_back(vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]);
    }
    volume.patches.push_back(render::surfacePatch(3, 3, points));
  }
  return volume;
}

}  // namespace bezier_scenes
