#include "render/images/exr_header.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <string>

#include "levelset/error.h"
#include "render/camera.h"

// The layout of an EXR file is defined in "OpenEXR File Layout". Numbers are little endian. A
// header is a list of attributes, each with name, type, size and value. An empty name ends the
// list.

namespace render {
namespace {

using levelset::InvalidInput;

constexpr std::uint32_t kExrMagic = 20000630;
constexpr std::uint32_t kManyParts = 0x1000;
constexpr std::size_t kLongestName = 255;
// Largest accepted size of an attribute of the header, bytes. The largest attributes in use are
// preview pictures.
constexpr std::size_t kMostAttributeBytes = 1 << 24;
/// ZIP compresses by a factor of at most about 1000. A header that announces many more pixels than
/// the file can hold at this factor is damaged.
constexpr double kMaxCompression = 5000;
/// Number of lines in a chunk for each compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A,
/// DWAA, DWAB.
constexpr std::array<double, 10> kChunkLines = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
constexpr std::size_t kZip = 3;
/// Largest number of lines in a chunk for any compression. The file stores an offset of kChunkBytes
/// bytes for each chunk.
constexpr double kMostLines = 256;
constexpr double kChunkBytes = 8;

const std::map<std::string, std::size_t> kSizes = {
    {"box2f", 16},      {"box2i", 16},   {"chromaticities", 32},
    {"compression", 1}, {"double", 8},   {"envmap", 1},
    {"float", 4},       {"int", 4},      {"keycode", 28},
    {"lineOrder", 1},   {"m33d", 72},    {"m33f", 36},
    {"m44d", 128},      {"m44f", 64},    {"rational", 8},
    {"tiledesc", 9},    {"timecode", 8}, {"v2d", 16},
    {"v2f", 8},         {"v2i", 8},      {"v3d", 24},
    {"v3f", 12},        {"v3i", 12},     {"deepImageState", 1}};

/// Reads and checks the headers of an EXR file, without its pixels.
class ExrHeaderReader {
 public:
  ExrHeaderReader(const std::filesystem::path& path, std::size_t maxMemory)
      : name_(path.string()),
        maxMemory_(static_cast<double>(maxMemory)),
        in_(path, std::ios::binary),
        left_(static_cast<std::size_t>(std::filesystem::file_size(path))),
        fileBytes_(static_cast<double>(left_)) {}

  void check() {
    if (number() != kExrMagic) refuse("its first bytes are not those of an EXR");
    const bool hasManyParts = (number() & kManyParts) != 0;
    while (checkPart() && hasManyParts) {
    }
  }

 private:
  /// Pixel layout that one header describes.
  struct Part {
    double width = 0, height = 0, channels = 0;
    double tileWidth = 0, tileHeight = 0;  // pixels; 0: the part is stored in scan lines
    std::size_t compression = kZip;        // index in kChunkLines; ZIP is OpenEXR's default
  };

  /// Checks one header. Returns false for the empty header that ends the list of headers in a
  /// multi-part file.
  bool checkPart() {
    Part part;
    bool isEmpty = true;
    for (std::string name = text(); !name.empty(); name = text()) {
      isEmpty = false;
      const std::string type = text();
      const std::uint32_t size = number();
      if (size > left_)
        refuse(fmt::format("its attribute '{}' of {} bytes extends beyond the end of the file",
                           name, size));
      if (size > kMostAttributeBytes)
        refuse(fmt::format("its attribute '{}' has {} bytes, more than the limit of 16 MB", name,
                           size));
      const std::string value = bytes(size);
      checkSize(name, type, value);
      if (name == "dataWindow" && type == "box2i") readWindow(value, part);
      if (name == "tiles" && type == "tiledesc") readTiles(value, part);
      if (name == "compression" && type == "compression")
        part.compression = static_cast<unsigned char>(value[0]);
      if (type == "chlist") {
        const double count = channelCount(value);
        if (name == "channels") part.channels = count;
      }
      if (name == "chunkCount" && type == "int") requireChunks(numberAt(value, 0));
    }
    if (!isEmpty) checkPixels(part);
    return !isEmpty;
  }

  void readWindow(const std::string& value, Part& part) const {
    const auto corner = [&](std::size_t i) {
      return static_cast<double>(static_cast<std::int32_t>(numberAt(value, i)));
    };
    part.width = corner(2) - corner(0) + 1;
    part.height = corner(3) - corner(1) + 1;
    constexpr double kFarthest =
        1 << 30;  // limit of coordinates, pixels; the difference of two corners fits into 32 bits
    for (std::size_t i = 0; i < 4; ++i)
      if (std::abs(corner(i)) > kFarthest)
        refuse(fmt::format("its data window has a corner at {:.0f}, beyond the limit of 2^30",
                           corner(i)));
  }

  void readTiles(const std::string& value, Part& part) const {
    part.tileWidth = numberAt(value, 0);
    part.tileHeight = numberAt(value, 1);
    if (part.tileWidth < 1 || part.tileHeight < 1) refuse("its tiles have a width or height of 0");
  }

  /// Counts the channels in the value of a channel list attribute. Each channel has a name and 16
  /// bytes; an empty name ends the list.
  [[nodiscard]] double channelCount(const std::string& value) const {
    double count = 0;
    std::size_t at = 0;
    for (; at < value.size() && value[at] != '\0'; ++count) {
      const std::size_t end = value.find('\0', at);
      if (end == std::string::npos || end - at > kLongestName) break;
      at = end + 1 + 16;
    }
    if (at + 1 != value.size() || value[at] != '\0') refuse("its list of channels has no end");
    return count;
  }

  /// Checks that the stated size of an attribute fits its type. OpenEXR reads as many bytes as the
  /// type requires, whatever the stated size. It then mistakes the remaining bytes for the next
  /// attribute.
  void checkSize(const std::string& name, const std::string& type, const std::string& value) const {
    const auto known = kSizes.find(type);
    bool isRight = known == kSizes.end() || known->second == value.size();
    if (type == "preview")
      isRight =
          8 + 4.0 * numberAt(value, 0) * numberAt(value, 1) == static_cast<double>(value.size());
    if (type == "stringvector") {
      std::size_t at = 0;
      while (at + 4 <= value.size()) {
        const std::size_t length = numberAt(value.substr(at, 4), 0);
        if (length > value.size() - at - 4) break;
        at += 4 + length;
      }
      isRight = at == value.size();
    }
    if (type == "floatvector") isRight = value.size() % 4 == 0;
    if (!isRight)
      refuse(fmt::format("its attribute '{}' has {} bytes, the wrong size for its type {}", name,
                         value.size(), type));
  }

  void checkPixels(const Part& part) const {
    const double pixels = part.width * part.height;
    if (!(part.width >= 1 && part.height >= 1)) refuse("it has no pixels");
    if (!(pixels <= kMaxPixels)) {
      throw levelset::ResourceLimit(
          fmt::format("{} has {:.0f}x{:.0f} pixels, which "
                      "exceeds the limit of {:.0f} pixels",
                      name_, part.width, part.height, kMaxPixels));
    }
    if (pixels * std::max(1.0, part.channels) * 2 > fileBytes_ * kMaxCompression) {
      throw InvalidInput(
          fmt::format("{} announces {:.0f}x{:.0f} pixels in {:.0f} channels, "
                      "more than its {:.0f} bytes can hold; copy it again",
                      name_, part.width, part.height, part.channels, fileBytes_));
    }
    if (part.tileWidth > 0) {
      // OpenEXR stores complete tiles, even if only a part of a tile lies in the picture.
      if (part.tileWidth > 2 * part.width + 64 || part.tileHeight > 2 * part.height + 64)
        refuse(fmt::format(
            "its tiles of {:.0f}x{:.0f} pixels are larger than the image of {:.0f}x{:.0f} pixels",
            part.tileWidth, part.tileHeight, part.width, part.height));
      requireChunks(pixels / (part.tileWidth * part.tileHeight));
      requireChunkMemory(part, part.tileWidth * part.tileHeight);
    } else {
      requireChunks(part.height / kMostLines);
      const bool isKnown = part.compression < kChunkLines.size();
      requireChunkMemory(part, part.width * (isKnown ? kChunkLines[part.compression] : kMostLines));
    }
  }

  /// Checks the memory of a chunk of `pixels` pixels. OpenEXR holds a chunk both packed and
  /// unpacked, at full size even if the chunk has fewer lines.
  void requireChunkMemory(const Part& part, double pixels) const {
    const double bytes = 2 * 4 * pixels * part.channels;
    if (bytes <= maxMemory_) return;
    throw levelset::ResourceLimit(
        fmt::format("{} has chunks of {:.3g} MB, which exceed the limit of {:.3g} MB; "
                    "raise --max-memory",
                    name_, bytes * 1e-6, maxMemory_ * 1e-6));
  }

  void requireChunks(double count) const {
    if (count * kChunkBytes > fileBytes_)
      refuse(fmt::format("it announces {:.0f} chunks, more than the file can hold", count));
  }

  // === Reading of bytes, numbers and texts

  std::string bytes(std::size_t count) {
    if (count > left_) refuse("the file ends within the header");
    std::string result(count, '\0');
    in_.read(result.data(), static_cast<std::streamsize>(count));
    if (!in_) refuse("the file ends within the header");
    left_ -= count;
    return result;
  }
  std::uint32_t number() { return numberAt(bytes(4), 0); }
  std::string text() {
    std::string result;
    for (char c = bytes(1)[0]; c != '\0'; c = bytes(1)[0]) {
      result += c;
      if (result.size() > kLongestName) refuse("a name in its header has no end");
    }
    return result;
  }
  [[nodiscard]] std::uint32_t numberAt(const std::string& value, std::size_t index) const {
    std::uint32_t result = 0;
    if (value.size() < 4 * index + 4) refuse("an attribute has fewer bytes than its type requires");
    for (std::size_t i = 4; i-- > 0;)
      result = result << 8 | static_cast<unsigned char>(value[4 * index + i]);
    return result;
  }
  [[noreturn]] void refuse(const std::string& what) const {
    throw InvalidInput(
        fmt::format("{} is not a readable EXR image: {}; copy it again", name_, what));
  }

  std::string name_;
  double maxMemory_;
  std::ifstream in_;
  std::size_t left_;
  double fileBytes_;
};

}  // namespace

void checkExrHeader(const std::filesystem::path& path, std::size_t maxMemory) {
  ExrHeaderReader(path, maxMemory).check();
}

}  // namespace render
