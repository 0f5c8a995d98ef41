#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "levelset/progress.h"

/// Images with named channels, written as EXR (all channels) or PNG (R G B A through a tone curve).
/// Colour is linear with premultiplied alpha, as OpenEXR has it.
namespace render {

/// Diagonal of the box of what is drawn, world units: what positions in single precision are
/// relative to.
inline constexpr const char* kExtentAttribute = "ls:extent";

struct Image {
  int width = 0, height = 0;  ///< pixels
  /// Each width × height, row major, top row first.
  std::map<std::string, std::vector<float>> channels;
  std::map<std::string, std::vector<std::uint32_t>> ids;  ///< UINT channels
  std::map<std::string, std::string> attributes;          ///< written to the EXR header as strings
  std::map<std::string, std::vector<float>> matrices;     ///< 16 floats, by rows: M44f attributes

  Image() = default;
  Image(int width_, int height_) : width(width_), height(height_) {}
  [[nodiscard]] std::size_t pixelCount() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  std::vector<float>& addChannel(const std::string& name, float fill = 0);
};

/// "exr" or "png" by `format` or the extension of `path`, in any case; empty for others.
[[nodiscard]] std::string imageFormat(const std::filesystem::path& path,
                                      const std::string& format = {});

/// Writes beside the target and renames when whole; the bytes depend on the image alone.
/// EXR: every channel, 32 bits, ZIP, no date. PNG: R G B (and A, opaque without one), 8 bits: alpha
/// is divided out, a shoulder bends what is above 0.6 towards 1, then the sRGB curve.
/// @param format  "exr" or "png"; empty: by the extension of `path`
/// @throws levelset::UsageError for another format, or a PNG of an image without R G B
/// @throws levelset::InvalidInput for an image whose channels do not fit its size
/// @throws levelset::IoError when it cannot be written
void writeImage(const std::filesystem::path& path, const Image& image,
                const std::string& format = {});

/// What a PNG shows of an image: red, green, blue and alpha of 8 bits for each pixel, as above.
/// @throws levelset::UsageError for an image without R G B
[[nodiscard]] std::vector<std::uint8_t> displayColours(const Image& image);

/// The bytes of the PNG that writeImage() writes.
/// @throws levelset::UsageError for an image without R G B; InvalidInput as writeImage()
[[nodiscard]] std::vector<char> pngBytes(const Image& image);

/// Writes such colours as they are, likewise. @pre four for each pixel, at least one pixel
/// @throws levelset::IoError when it cannot be written
void writePng(const std::filesystem::path& path, int width, int height,
              const std::vector<std::uint8_t>& colours);

/// Reads channels of 16 or 32 bits of the first part, string and M44f attributes.
/// @throws levelset::IoError when the file cannot be opened
/// @throws levelset::InvalidInput when it is no EXR, damaged, or subsampled
/// @throws levelset::ResourceLimit for more than 2^28 pixels, or what passes `maxMemory`
[[nodiscard]] Image readExr(const std::filesystem::path& path,
                            std::size_t maxMemory = levelset::kNoMemoryLimit);

}  // namespace render
