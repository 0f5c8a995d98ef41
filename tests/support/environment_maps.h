#pragma once

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string>

#include "render/images/image.h"

/// Environments with closed forms.
namespace support {

/// EXR of the light from all directions, for --environment. The file exists as long as the object.
class EnvironmentFile {
 public:
  /// @param light  linear light from a unit direction
  explicit EnvironmentFile(const std::function<Imath::V3d(const Imath::V3d&)>& light,
                           int height = 256)
      : file_(std::filesystem::temp_directory_path() /
              ("levelsmith-environment-" + std::to_string(::getpid()) + "-" +
               std::to_string(++count()) + ".exr")) {
    render::Image map(2 * height, height);
    for (const char* name : {"R", "G", "B"}) map.addChannel(name);
    for (int y = 0; y < map.height; ++y)
      for (int x = 0; x < map.width; ++x) {
        const double longitude = ((x + 0.5) / map.width - 0.5) * 2 * std::numbers::pi,
                     latitude = (0.5 - (y + 0.5) / map.height) * std::numbers::pi;
        const Imath::V3d found =
            light({std::cos(latitude) * std::sin(longitude), std::sin(latitude),
                   -std::cos(latitude) * std::cos(longitude)});
        for (int c = 0; c < 3; ++c)
          map.channels[std::string(1, "RGB"[c])][static_cast<std::size_t>(y * map.width + x)] =
              static_cast<float>(found[c]);
      }
    render::writeImage(file_, map);
  }
  ~EnvironmentFile() { std::filesystem::remove(file_); }
  EnvironmentFile(const EnvironmentFile&) = delete;
  EnvironmentFile& operator=(const EnvironmentFile&) = delete;

  [[nodiscard]] std::string name() const { return file_.string(); }

 private:
  static int& count() {
    static int number = 0;
    return number;
  }
  std::filesystem::path file_;
};

/// Light that tells the direction it comes from: (1 + direction) / 2. Its file has interpolation
/// errors up to 1.5e-4.
inline Imath::V3d directionLight(const Imath::V3d& direction) {
  return (Imath::V3d(1) + direction) * 0.5;
}

}  // namespace support
