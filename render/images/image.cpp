#include "render/images/image.h"

#include <ImathBox.h>
#include <ImathMatrix.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>
#include <fmt/core.h>
#include <png.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <mutex>

#include "levelset/error.h"
#include "levelset/file_target.h"
#include "render/camera.h"
#include "render/images/exr_header.h"

namespace render {
namespace {

using levelset::InvalidInput;
using levelset::IoError;

// === Images are encoded in memory first. OpenEXR seeks in its output, which pipes do not support.
// Besides, all disk errors then occur in writeBytes().

class MemoryStream : public Imf::OStream {
 public:
  MemoryStream() : Imf::OStream("memory") {}
  void write(const char* data, int size) override {
    const std::size_t end = position_ + static_cast<std::size_t>(size);
    if (end > bytes.size()) bytes.resize(end);
    std::memcpy(bytes.data() + position_, data, static_cast<std::size_t>(size));
    position_ = end;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }

  std::vector<char> bytes;

 private:
  std::size_t position_ = 0;
};

void writeBytes(const std::filesystem::path& path, const std::vector<char>& bytes) {
  levelset::FileTarget target(path);
  const auto fail = [&] {
    throw IoError(fmt::format("{}: {}; free some space or choose another folder", path.string(),
                              std::strerror(errno)));
  };
  std::FILE* file = std::fopen(target.path().c_str(), "wb");
  if (!file) fail();
  const bool isWritten = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  const int error = errno;
  if (std::fclose(file) != 0) fail();
  if (!isWritten) {
    errno = error;
    fail();
  }
  target.commit();
}

void requireWhole(const Image& image) {
  if (image.width <= 0 || image.height <= 0) {
    throw InvalidInput(fmt::format("the image has {}x{} pixels, but needs at least one",
                                   image.width, image.height));
  }
  const auto check = [&](const std::string& name, std::size_t size) {
    if (size == image.pixelCount()) return;
    throw InvalidInput(
        fmt::format("channel {} has {} values for {}x{} pixels; give one value for each pixel",
                    name, size, image.width, image.height));
  };
  for (const auto& [name, values] : image.channels) check(name, values.size());
  for (const auto& [name, values] : image.ids) check(name, values.size());
  for (const auto& [name, matrix] : image.matrices) {
    if (matrix.size() == 16) continue;
    throw InvalidInput(fmt::format("matrix {} has {} numbers; give 16", name, matrix.size()));
  }
}

// === EXR

template <typename T>
Imf::Slice sliceOf(Imf::PixelType type, const T* data, int width, int minX = 0, int minY = 0) {
  return Imf::Slice::Make(type, data, Imath::V2i(minX, minY), width, 1, sizeof(T),
                          sizeof(T) * static_cast<std::size_t>(width));
}

/// Starts OpenEXR's threads. They code blocks of lines, which can take longer than the picture.
/// Returns the number of threads for one file, within the limit of the process.
int codingThreads() {
  const auto allowed = static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  static std::mutex starting;
  const std::scoped_lock lock(starting);
  if (allowed > 1 && Imf::globalThreadCount() < allowed) Imf::setGlobalThreadCount(allowed);
  return allowed > 1 ? allowed : 0;
}

std::vector<char> encodeExr(const Image& image) {
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer frame;
  for (const auto& [name, values] : image.channels) {
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    frame.insert(name, sliceOf(Imf::FLOAT, values.data(), image.width));
  }
  for (const auto& [name, values] : image.ids) {
    header.channels().insert(name, Imf::Channel(Imf::UINT));
    frame.insert(name, sliceOf(Imf::UINT, values.data(), image.width));
  }
  for (const auto& [name, value] : image.attributes)
    header.insert(name, Imf::StringAttribute(value));
  for (const auto& [name, m] : image.matrices) {
    header.insert(
        name, Imf::M44fAttribute(Imath::M44f(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8],
                                             m[9], m[10], m[11], m[12], m[13], m[14], m[15])));
  }
  MemoryStream stream;
  {
    Imf::OutputFile file(stream, header, codingThreads());
    file.setFrameBuffer(frame);
    file.writePixels(image.height);
  }
  return std::move(stream.bytes);
}

// === PNG

// Linear colours up to this value are displayed without compression.
constexpr double kKnee = 0.6;

std::uint8_t toByte(double unit) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(unit, 0.0, 1.0)));
}

std::vector<char> encodePng(int width, int height, const std::vector<std::uint8_t>& pixels) {
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(width);
  png.height = static_cast<png_uint_32>(height);
  png.format = PNG_FORMAT_RGBA;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::vector<char> bytes(size);
  if (!png_image_write_to_memory(&png, bytes.data(), &size, 0, pixels.data(), 0, nullptr))
    throw IoError(fmt::format("the image cannot be encoded as PNG: {}", png.message));
  bytes.resize(size);
  return bytes;
}

// === Reading

Image readOpenExr(Imf::InputFile& file, const std::string& name, std::size_t maxMemory) {
  const Imf::Header& header = file.header();
  const Imath::Box2i window = header.dataWindow();
  // checkExrHeader() has limited the corners of the window, so these differences do not overflow.
  const int width = window.max.x - window.min.x + 1, height = window.max.y - window.min.y + 1;
  double channelCount = 0;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) ++channelCount;
  levelset::requireMemory(static_cast<double>(width) * height * channelCount * sizeof(float),
                          maxMemory);
  Image image(width, height);
  Imf::FrameBuffer frame;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    const Imf::Channel& channel = it.channel();
    if (channel.xSampling != 1 || channel.ySampling != 1) {
      throw InvalidInput(
          fmt::format("channel {} of {} is subsampled; write it at full "
                      "resolution",
                      it.name(), name));
    }
    if (channel.type == Imf::UINT) {
      auto& values = image.ids[it.name()];
      values.resize(image.pixelCount());
      frame.insert(it.name(),
                   sliceOf(Imf::UINT, values.data(), image.width, window.min.x, window.min.y));
    } else {
      frame.insert(it.name(), sliceOf(Imf::FLOAT, image.addChannel(it.name()).data(), image.width,
                                      window.min.x, window.min.y));
    }
  }
  for (auto it = header.begin(); it != header.end(); ++it) {
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute()))
      image.attributes[it.name()] = text->value();
    if (const auto* matrix = dynamic_cast<const Imf::M44fAttribute*>(&it.attribute())) {
      const float* first = matrix->value().getValue();
      image.matrices[it.name()].assign(first, first + 16);
    }
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  return image;
}

}  // namespace

std::vector<float>& Image::addChannel(const std::string& name, float fill) {
  std::vector<float>& channel = channels[name];
  channel.assign(pixelCount(), fill);
  return channel;
}

// Linear up to kKnee, then a smooth approach to 1, so that highlights do not clip. The sRGB curve
// is applied last.
double displayOfLinear(double linear) {
  if (!(linear > 0)) return 0;
  const double x = linear <= kKnee
                       ? linear
                       : kKnee + (1 - kKnee) * (1 - std::exp(-(linear - kKnee) / (1 - kKnee)));
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

double linearOfDisplay(double display) {
  constexpr double kBrightest = 0.9985;  // the curve reaches 1 at infinity
  const double shown = std::clamp(display, 0.0, kBrightest);
  const double x =
      shown <= 12.92 * 0.0031308 ? shown / 12.92 : std::pow((shown + 0.055) / 1.055, 2.4);
  return x <= kKnee ? x : kKnee - (1 - kKnee) * std::log(1 - (x - kKnee) / (1 - kKnee));
}

std::string imageFormat(const std::filesystem::path& path, const std::string& format) {
  std::string kind = format;
  if (kind.empty() && path.has_extension()) kind = path.extension().string().substr(1);
  std::transform(kind.begin(), kind.end(), kind.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return kind == "exr" || kind == "png" ? kind : "";
}

std::vector<std::uint8_t> displayColours(const Image& image) {
  const std::vector<float>* colour[3];
  const char* names[3] = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) {
    const auto found = image.channels.find(names[c]);
    if (found == image.channels.end()) {
      throw levelset::UsageError(fmt::format(
          "a PNG needs the channel {}, which this image does not have; write an EXR", names[c]));
    }
    colour[c] = &found->second;
  }
  const auto alpha = image.channels.find("A");
  std::vector<std::uint8_t> pixels(4 * image.pixelCount());
  for (std::size_t i = 0; i < image.pixelCount(); ++i) {
    const double a = alpha == image.channels.end() ? 1 : static_cast<double>(alpha->second[i]);
    for (std::size_t c = 0; c < 3; ++c)
      pixels[4 * i + c] =
          a > 0 ? toByte(displayOfLinear(static_cast<double>((*colour[c])[i]) / a)) : 0;
    pixels[4 * i + 3] = toByte(std::isfinite(a) ? a : 0);
  }
  return pixels;
}

std::vector<char> pngBytes(const Image& image) {
  requireWhole(image);
  return encodePng(image.width, image.height, displayColours(image));
}

void writePng(const std::filesystem::path& path, int width, int height,
              const std::vector<std::uint8_t>& colours) {
  writeBytes(path, encodePng(width, height, colours));
}

void writeImage(const std::filesystem::path& path, const Image& image, const std::string& format) {
  const std::string kind = imageFormat(path, format);
  if (kind.empty()) {
    throw levelset::UsageError(
        fmt::format("{} has no supported format; use the extension .exr or .png, or give the "
                    "format",
                    path.string()));
  }
  requireWhole(image);
  std::vector<char> bytes;
  try {
    bytes = kind == "exr" ? encodeExr(image) : pngBytes(image);
  } catch (const levelset::Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {  // thrown by OpenEXR
    throw IoError(fmt::format("{}: {}", path.string(), error.what()));
  }
  writeBytes(path, bytes);
}

Image readExr(const std::filesystem::path& path, std::size_t maxMemory) {
  const std::string name = path.string();
  std::error_code ignored;
  errno = 0;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> probe(std::fopen(path.c_str(), "rb"),
                                                        &std::fclose);
  if (!probe || std::filesystem::is_directory(path, ignored)) {
    throw IoError(
        fmt::format("{}: {}; check the path", name, probe ? "is a folder" : std::strerror(errno)));
  }
  try {
    checkExrHeader(path, maxMemory);
    Imf::InputFile file(name.c_str(), codingThreads());
    return readOpenExr(file, name, maxMemory);
  } catch (const levelset::Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw levelset::ResourceLimit(
        fmt::format("{} does not fit in memory; free memory, or use a smaller image", name));
  } catch (const std::exception& error) {
    throw InvalidInput(fmt::format("{} is not a readable EXR image: {}; copy or draw it again",
                                   name, error.what()));
  }
}

}  // namespace render
