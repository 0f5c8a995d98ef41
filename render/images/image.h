#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "levelset/progress.h"

/// Images with named channels. They are written as EXR (all channels) or PNG (R G B A through a
/// tone curve). As in OpenEXR, colour is linear with premultiplied alpha.
namespace render {

/// Name of the header attribute that stores the diagonal of the scene's bounding box, world units.
/// The error of single-precision positions is relative to that diagonal.
inline constexpr const char* kExtentAttribute = "ls:extent";

/// An image with named channels.
struct Image {
  int width = 0, height = 0;  ///< pixels
  /// Channels of floats by name. Each has width × height values, row by row, top row first.
  std::map<std::string, std::vector<float>> channels;
  std::map<std::string, std::vector<std::uint32_t>>
      ids;  ///< channels of unsigned integers, with the same layout
  /// Attributes by name, written to the EXR header as strings.
  std::map<std::string, std::string> attributes;
  std::map<std::string, std::vector<float>>
      matrices;  ///< M44f attributes of the EXR header, by name; 16 floats each, row by row

  Image() = default;
  Image(int width_, int height_) : width(width_), height(height_) {}
  [[nodiscard]] std::size_t pixelCount() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  std::vector<float>& addChannel(const std::string& name, float fill = 0);
};

/// Returns "exr" or "png". Uses `format` if given, else the extension of `path`; both in upper or
/// lower case. Returns an empty text for other formats.
[[nodiscard]] std::string imageFormat(const std::filesystem::path& path,
                                      const std::string& format = {});

/// Writes an image. It is written to a temporary file in the same folder, which is then renamed to
/// `path`. The bytes of the file depend on the image alone.
///
/// EXR: all channels, 32 bits, ZIP compression, no date. PNG: R G B A, 8 bits, opaque without a
/// channel A. Alpha is divided out, values above 0.6 are compressed towards 1, and the sRGB curve
/// is applied.
/// @param format  "exr" or "png"; empty: by the extension of `path`
/// @throws levelset::UsageError for another format, or a PNG of an image without R G B
/// @throws levelset::InvalidInput for an image whose channels do not fit its size
/// @throws levelset::IoError when the file cannot be written
void writeImage(const std::filesystem::path& path, const Image& image,
                const std::string& format = {});

/// Display value in [0, 1] of a linear colour component, as in the PNG of an image.
[[nodiscard]] double displayOfLinear(double linear);
/// Linear colour component that is displayed as `display`. Values at 1 become a number that a PNG
/// of 8 bits shows as 255.
[[nodiscard]] double linearOfDisplay(double display);

/// Computes the pixels of the PNG of an image: red, green, blue and alpha of 8 bits each, as in
/// writeImage().
/// @throws levelset::UsageError for an image without R G B
[[nodiscard]] std::vector<std::uint8_t> displayColours(const Image& image);

/// Encodes the PNG that writeImage() writes.
/// @throws levelset::UsageError for an image without R G B
/// @throws levelset::InvalidInput as writeImage()
[[nodiscard]] std::vector<char> pngBytes(const Image& image);

/// Writes display colours to a PNG file.
/// @pre `colours` has four bytes for each pixel, and there is at least one pixel
/// @throws levelset::IoError when the file cannot be written
void writePng(const std::filesystem::path& path, int width, int height,
              const std::vector<std::uint8_t>& colours);

/// Reads the first part of an EXR file: channels of 16 or 32 bits, string and M44f attributes.
/// @throws levelset::IoError when the file cannot be opened
/// @throws levelset::InvalidInput when the file is not an EXR, is damaged, or has subsampled
/// channels
/// @throws levelset::ResourceLimit for more than 2^28 pixels, or for memory above `maxMemory` bytes
[[nodiscard]] Image readExr(const std::filesystem::path& path,
                            std::size_t maxMemory = levelset::kNoMemoryLimit);

}  // namespace render
