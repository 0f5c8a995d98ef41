#include "render/images/grey_image.h"

#include <fmt/core.h>
#include <png.h>

#include <cassert>
#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>

#include "levelset/error.h"
#include "levelset/file_target.h"

namespace render {
namespace {

using levelset::InvalidInput;
using levelset::IoError;

/// State of libpng. libpng returns from errors by longjmp, which skips destructors, so the state
/// must not belong to the functions that call libpng.
struct PngReader {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string error;

  PngReader() {
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, &fail, &ignore);
    if (!png) return;
    // A chunk states its length, and libpng allocates it before it reads the chunk.
    constexpr png_alloc_size_t kLongestChunk = 1 << 23;
    png_set_chunk_malloc_max(png, kLongestChunk);
    constexpr png_uint_32 kKeptTexts = 8;  // each may unpack to the longest chunk
    png_set_chunk_cache_max(png, kKeptTexts);
    info = png_create_info_struct(png);
  }
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  /// Reads the chunks before the pixels. Returns false and sets `error` when the file is damaged.
  bool readHeader(std::FILE* file) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_init_io(png, file);
    png_read_info(png, info);
    return true;
  }

  /// Sets up the conversion of the rows: samples of 16 bits, or of 8 bits for a file with at most 8
  /// bits; with alpha if the file has transparency.
  bool prepare() {
    if (setjmp(png_jmpbuf(png))) return false;
    if (png_get_bit_depth(png, info) < 8) png_set_expand_gray_1_2_4_to_8(png);
    if (png_get_valid(png, info, PNG_INFO_tRNS)) png_set_tRNS_to_alpha(png);
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
    return true;
  }

  bool readRows(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_read_image(png, rows);
    png_read_end(png, nullptr);
    return true;
  }

 private:
  static void fail(png_structp png, png_const_charp message) {
    static_cast<PngReader*>(png_get_error_ptr(png))->error = message;
    png_longjmp(png, 1);
  }
  static void ignore(png_structp, png_const_charp) {}
};

[[noreturn]] void refuseDamaged(const std::string& name, const std::string& why) {
  throw InvalidInput(fmt::format("{} is not a complete PNG image: {}; copy it again", name, why));
}

/// Sample number `index` of a row, scaled to [0, 1]. It has 8 bits, or 16 with the high byte first.
double sampleAt(const png_byte* row, std::size_t index, bool isDeep) {
  if (!isDeep) return row[index] / 255.0;
  return (row[2 * index] * 256 + row[2 * index + 1]) / 65535.0;
}

}  // namespace

void requirePngChunks(const std::filesystem::path& path) {
  std::error_code failed;
  const std::uintmax_t size = std::filesystem::file_size(path, failed);
  if (failed) return;  // not a regular file, but a pipe, which can be read only once
  std::ifstream in(path, std::ios::binary);
  constexpr std::size_t kSignature = 8;
  png_byte signature[kSignature] = {};
  in.read(reinterpret_cast<char*>(signature), kSignature);
  if (png_sig_cmp(signature, 0, kSignature) != 0) return;  // libpng says that it is no PNG
  constexpr std::uintmax_t kFrame = 12;                    // bytes of a chunk beside its data
  for (std::uintmax_t at = kSignature; at < size;) {
    unsigned char head[8] = {};  // length and type
    in.seekg(static_cast<std::streamoff>(at));
    in.read(reinterpret_cast<char*>(head), sizeof head);
    const std::uintmax_t bytes =
        static_cast<std::uintmax_t>(head[0]) << 24 | static_cast<std::uintmax_t>(head[1]) << 16 |
        static_cast<std::uintmax_t>(head[2]) << 8 | static_cast<std::uintmax_t>(head[3]);
    if (!in || size - at < kFrame || bytes > size - at - kFrame)
      refuseDamaged(path.string(),
                    fmt::format("the chunk at byte {} extends beyond the end of the file", at));
    if (std::memcmp(head + 4, "IEND", 4) == 0) return;  // libpng reads nothing behind it
    at += kFrame + bytes;
  }
}

void requirePngPixels(const std::filesystem::path& path, double width, double height) {
  constexpr double kMostPerByte =
      8 * 1040;  // largest number of pixels for a byte of the file: deflate packs at most 1032 to
                 // 1, and a byte holds 8 pixels of one bit
  std::error_code failed;
  const auto bytes = static_cast<double>(std::filesystem::file_size(path, failed));
  if (failed || width * height <= bytes * kMostPerByte) return;
  throw InvalidInput(
      fmt::format("{} announces {}x{} pixels, more than its {} bytes can hold; copy it again",
                  path.string(), width, height, bytes));
}

GreyImage readGreyPng(const std::filesystem::path& path, std::size_t maxMemory) {
  const std::string name = path.string();
  std::error_code ignored;
  errno = 0;
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             &std::fclose);
  if (!file || std::filesystem::is_directory(path, ignored)) {
    throw IoError(
        fmt::format("{}: {}; check the path", name, file ? "is a folder" : std::strerror(errno)));
  }
  PngReader reader;
  if (!reader.png || !reader.info)
    throw levelset::ResourceLimit(
        fmt::format("libpng cannot allocate memory to read {}; free memory", name));
  requirePngChunks(path);
  if (!reader.readHeader(file.get())) refuseDamaged(name, reader.error);
  const auto width = static_cast<std::size_t>(png_get_image_width(reader.png, reader.info)),
             height = static_cast<std::size_t>(png_get_image_height(reader.png, reader.info));
  if (png_get_color_type(reader.png, reader.info) & PNG_COLOR_MASK_COLOR) {
    throw InvalidInput(fmt::format(
        "{} is a colour picture, but heights need grey values; convert it to grey", name));
  }
  requirePngPixels(path, static_cast<double>(width), static_cast<double>(height));
  if (!reader.prepare()) refuseDamaged(name, reader.error);
  const std::size_t rowBytes = png_get_rowbytes(reader.png, reader.info);
  levelset::requireMemory(
      static_cast<double>(height) *
          (static_cast<double>(rowBytes) + 2.0 * sizeof(double) * static_cast<double>(width)),
      maxMemory);
  std::vector<png_byte> bytes(rowBytes * height);
  std::vector<png_bytep> rows(height);
  for (std::size_t j = 0; j < height; ++j) rows[j] = bytes.data() + j * rowBytes;
  if (!reader.readRows(rows.data())) refuseDamaged(name, reader.error);

  const bool isDeep = png_get_bit_depth(reader.png, reader.info) == 16;
  const std::size_t channels = png_get_channels(reader.png, reader.info);
  GreyImage image;
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  image.values.resize(width * height);
  if (channels == 2) image.alpha.resize(width * height);
  for (std::size_t n = 0; n < width * height; ++n) {
    const std::size_t first = n % width * channels;
    image.values[n] = sampleAt(rows[n / width], first, isDeep);
    if (channels == 2) image.alpha[n] = sampleAt(rows[n / width], first + 1, isDeep);
  }
  return image;
}

/// Also the state of libpng while it writes; errors are those of PngReader.
struct GreyPngWriter::State {
  State(const std::filesystem::path& path, int wide)
      : name(path.string()), width(wide), target(path) {
    png = png_create_write_struct(PNG_LIBPNG_VER_STRING, this, &keepError, &ignore);
    if (png) info = png_create_info_struct(png);
  }
  ~State() { png_destroy_write_struct(&png, &info); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  bool begin(int height, bool zeroIsClear) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_init_io(png, file.get());
    png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8,
                 PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    // The grey of pictures with smooth shades is near that of the pixel above.
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
    const png_color_16 clear = {};
    if (zeroIsClear) png_set_tRNS(png, info, nullptr, 1, &clear);
    png_write_info(png, info);
    return true;
  }
  bool addRow(const std::uint8_t* row) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_write_row(png, row);
    return true;
  }
  bool end() {
    if (setjmp(png_jmpbuf(png))) return false;
    png_write_end(png, nullptr);
    return true;
  }

  [[noreturn]] void fail(const std::string& why) const {
    throw IoError(fmt::format("{}: {}; free some space or choose another folder", name, why));
  }

  std::string name;
  int width;
  levelset::FileTarget target;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file{nullptr, &std::fclose};
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string error;

 private:
  static void keepError(png_structp png, png_const_charp message) {
    static_cast<State*>(png_get_error_ptr(png))->error = message;
    png_longjmp(png, 1);
  }
  static void ignore(png_structp, png_const_charp) {}
};

GreyPngWriter::GreyPngWriter(const std::filesystem::path& path, int width, int height,
                             bool zeroIsClear) {
  constexpr int kMostPixels = 1'000'000;  // of libpng, along a side
  if (width > kMostPixels || height > kMostPixels)
    throw InvalidInput(
        fmt::format("a picture of {}x{} pixels is larger than {}, the limit of PNG "
                    "files; crop it, or use fewer samples",
                    width, height, kMostPixels));
  state_ = std::make_unique<State>(path, width);
  state_->file.reset(std::fopen(state_->target.path().c_str(), "wb"));
  if (!state_->file) state_->fail(std::strerror(errno));
  if (!state_->png || !state_->info)
    throw levelset::ResourceLimit(
        fmt::format("libpng cannot allocate memory to write {}; free memory", state_->name));
  if (!state_->begin(height, zeroIsClear)) state_->fail(state_->error);
}

GreyPngWriter::~GreyPngWriter() = default;

void GreyPngWriter::add(std::span<const std::uint8_t> pixels) {
  assert(pixels.size() == static_cast<std::size_t>(state_->width));
  if (!state_->addRow(pixels.data())) state_->fail(state_->error);
}

void GreyPngWriter::commit() {
  if (!state_->end()) state_->fail(state_->error);
  if (std::fclose(state_->file.release()) != 0) state_->fail(std::strerror(errno));
  state_->target.commit();
}

}  // namespace render
