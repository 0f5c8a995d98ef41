#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

/// Images with named channels, written as EXR (all channels) or PNG (R G B A through a tone curve).
namespace render {

struct Image {
  int width = 0, height = 0;
  std::map<std::string, std::vector<float>> channels;         ///< width × height, row major, top row first
  std::map<std::string, std::vector<std::uint32_t>> ids;      ///< UINT channels
  std::map<std::string, std::string> attributes;              ///< written to the EXR header as strings
  std::map<std::string, std::vector<float>> matrices;         ///< 16 floats: M44f attributes

  Image() = default;
  Image(int width_, int height_) : width(width_), height(height_) {}
  std::vector<float>& addChannel(const std::string& name, float fill = 0);
};

/// EXR: 32-bit float, ZIP, reproducible bytes. PNG: sRGB, 8 bits, with alpha. By extension, or `format`.
/// Written beside the target and renamed. @throws levelset::IoError, levelset::UsageError
void writeImage(const std::filesystem::path& path, const Image& image, const std::string& format = {});

/// @throws levelset::IoError, levelset::InvalidInput
[[nodiscard]] Image readExr(const std::filesystem::path& path);

}  // namespace render
