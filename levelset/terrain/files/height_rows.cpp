#include "levelset/terrain/files/height_rows.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/terrain/files/grid_header.h"
#include "levelset/terrain/files/height_field_file.h"
#include "levelset/volume_files/volume_header.h"

namespace levelset {
namespace {

using terrain::GridHeader;

/// Longest header beside a binary grid, bytes.
constexpr std::size_t kMostHeader = std::size_t{1} << 16;

[[noreturn]] void refuseRows(const std::filesystem::path& path, const std::string& what) {
  throw InvalidInput(fmt::format("{}: {}", inputName(path), what));
}

/// Grid of a field, without its heights.
HeightField gridOf(const HeightField& field) {
  return {.columns = field.columns,
          .rows = field.rows,
          .origin = field.origin,
          .spacing = field.spacing,
          .noData = field.noData,
          .coordinateSystem = field.coordinateSystem,
          .isGeographic = field.isGeographic};
}

class FieldRows final : public HeightRows {
 public:
  explicit FieldRows(const HeightField& field) : field_(field), grid_(gridOf(field)) {}
  const HeightField& grid() const override { return grid_; }
  bool isNorthFirst() const override { return false; }
  bool next(std::span<float> heights) override {
    const auto from = field_.heights.begin() + static_cast<std::ptrdiff_t>(field_.index(0, row_++));
    std::copy(from, from + field_.columns, heights.begin());
    return true;
  }

 private:
  const HeightField& field_;
  HeightField grid_;
  int row_ = 0;
};

// === ESRI ASCII grid

/// Numbers of a text, with the line of the last one.
class HeightNumbers {
 public:
  HeightNumbers(std::string_view text, std::size_t line) : text_(text), line_(line) {}

  /// Takes the next word; empty at the end.
  std::string_view next() {
    while (at_ < text_.size() && static_cast<unsigned char>(text_[at_]) <= ' ')
      line_ += text_[at_++] == '\n';
    const std::size_t begin = at_;
    while (at_ < text_.size() && static_cast<unsigned char>(text_[at_]) > ' ') ++at_;
    return text_.substr(begin, at_ - begin);
  }
  [[nodiscard]] std::size_t line() const { return line_ + 1; }
  /// Number of characters taken so far.
  [[nodiscard]] std::size_t position() const { return at_; }

 private:
  std::string_view text_;
  std::size_t at_ = 0, line_;
};

class AsciiRows final : public HeightRows {
 public:
  AsciiRows(const std::filesystem::path& path, std::size_t maxMemory)
      : path_(path), file_(path, maxMemory), header_(inputName(path)), numbers_({}, 0) {
    const std::string_view text = header_.take(file_.view());
    grid_ = header_.grid();
    const auto columns = static_cast<std::size_t>(grid_.columns),
               rows = static_cast<std::size_t>(grid_.rows);
    // Each height takes a digit and a blank, except the last one.
    if (static_cast<double>(columns) * static_cast<double>(rows) >
        static_cast<double>(text.size()) / 2 + 1)
      refuseRows(path, fmt::format("the header states {}x{} heights, more than the {} bytes behind "
                                   "it can hold; copy the file again",
                                   columns, rows, text.size()));
    headerBytes_ = file_.view().size() - text.size();
    numbers_ = HeightNumbers(text, header_.lines());
    marksNan_ = grid_.noData && std::isnan(*grid_.noData);
    terrain::readProjection(path, grid_);
  }

  const HeightField& grid() const override { return grid_; }
  bool isNorthFirst() const override { return true; }
  std::size_t memoryUse() const override { return file_.isMapped() ? 0 : file_.view().size(); }

  bool next(std::span<float> heights) override {
    ++row_;
    for (int column = 0; column < grid_.columns; ++column)
      heights[static_cast<std::size_t>(column)] = nextHeight(column);
    if (row_ == grid_.rows) requireEnd();
    file_.release(headerBytes_ + numbers_.position());
    return true;
  }

 private:
  float nextHeight(int column) {
    const std::string_view word = numbers_.next();
    if (word.empty())
      refuseRows(path_, fmt::format("the file ends in row {} of {}, column {}; copy it again", row_,
                                    grid_.rows, column + 1));
    const std::optional<double> value = volume_files::numberIn<double>(word);
    if (value &&
        ((grid_.noData && static_cast<float>(*value) == static_cast<float>(*grid_.noData)) ||
         (marksNan_ && std::isnan(*value))))
      return kMissingHeight;
    const auto height = static_cast<float>(value.value_or(NAN));
    if (!std::isfinite(height))
      refuseRows(path_, fmt::format("line {}: '{}' is no finite height; mark missing heights "
                                    "with the number of NODATA_value",
                                    numbers_.line(), word.substr(0, 40)));
    return height;
  }

  void requireEnd() {
    if (const std::string_view word = numbers_.next(); !word.empty())
      refuseRows(path_,
                 fmt::format("line {}: '{}' follows the last of the {}x{} heights; correct "
                             "ncols and nrows",
                             numbers_.line(), word.substr(0, 40), grid_.columns, grid_.rows));
  }

  std::filesystem::path path_;
  MappedFile file_;
  GridHeader header_;
  HeightField grid_;
  HeightNumbers numbers_;
  std::size_t headerBytes_ = 0;
  bool marksNan_ = false;
  int row_ = 0;
};

// === Numbers of a binary file

/// Form of the numbers in a binary file.
struct NumberForm {
  std::string type = "i16";
  bool isBigEndian = false, isNorthFirst = true;
  std::size_t skip = 0;  ///< number of bytes before the first number

  /// Bytes of a number; 0 for a type that is not supported.
  [[nodiscard]] std::size_t size() const {
    if (type == "u8" || type == "i8") return 1;
    if (type == "u16" || type == "i16") return 2;
    if (type == "u32" || type == "i32" || type == "f32") return 4;
    return type == "f64" ? 8 : 0;
  }
};

/// Tells which numbers of a file are missing samples.
struct MissingMark {
  std::optional<double> number = {};
  bool withNan = false;  ///< NaN is missing beside the number, too

  template <typename T>
  [[nodiscard]] bool isMissing(T value) const {
    if (!number) return false;
    if constexpr (std::is_floating_point_v<T>)
      if (std::isnan(value)) return withNan || std::isnan(*number);
    // A file of floats rounds its mark to a float, too.
    if constexpr (std::is_same_v<T, float>) return value == static_cast<float>(*number);
    return static_cast<double>(value) == *number;
  }
};

/// Reads numbers of type T. @param isSwapped  their bytes have the other order
/// @return number of the first height that is not finite; that of all heights if there is none
template <typename T>
std::size_t loadHeights(const char* from, bool isSwapped, const MissingMark& mark,
                        std::span<float> heights) {
  for (std::size_t n = 0; n < heights.size(); ++n, from += sizeof(T)) {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), from, sizeof(T));
    if (isSwapped) std::reverse(raw.begin(), raw.end());
    const T value = std::bit_cast<T>(raw);
    const bool isMissing = mark.isMissing(value);
    heights[n] = isMissing ? kMissingHeight : static_cast<float>(value);
    if (!isMissing && !std::isfinite(heights[n])) return n;
  }
  return heights.size();
}

class BinaryRows final : public HeightRows {
 public:
  /// @param isRaw  the file has no header: its form is that of the caller
  BinaryRows(const std::filesystem::path& path, HeightField grid, const NumberForm& form,
             std::size_t maxMemory, bool isRaw)
      : path_(path),
        file_(path, maxMemory, false),
        grid_(std::move(grid)),
        form_(form),
        isRaw_(isRaw) {
    const std::size_t bytes = form.skip + rowBytes() * static_cast<std::size_t>(grid_.rows);
    if (file_.view().size() != bytes)
      refuseRows(path, fmt::format("the file has {} bytes, but {} follow from {}, {}x{} "
                                   "heights; {}",
                                   file_.view().size(), bytes, isRaw ? "its size" : "its header",
                                   grid_.columns, grid_.rows,
                                   isRaw ? "correct the size" : "copy both files again"));
  }

  const HeightField& grid() const override { return grid_; }
  bool isNorthFirst() const override { return form_.isNorthFirst; }
  std::size_t memoryUse() const override { return file_.isMapped() ? 0 : file_.view().size(); }

  bool next(std::span<float> heights) override {
    const std::size_t begin = form_.skip + rowBytes() * static_cast<std::size_t>(row_++);
    if (const std::size_t bad = load(file_.view().data() + begin, heights); bad < heights.size())
      refuseRows(
          path_,
          fmt::format("the height in row {}, column {} is {}; {}", row_, bad + 1, heights[bad],
                      isRaw_ ? "repair it, or give the number of missing samples"
                             : "mark missing heights with NODATA_value in the header"));
    file_.release(begin);
    return true;
  }

 private:
  [[nodiscard]] std::size_t rowBytes() const {
    return form_.size() * static_cast<std::size_t>(grid_.columns);
  }

  /// @return as loadHeights()
  std::size_t load(const char* from, std::span<float> heights) const {
    const bool isSwapped = form_.isBigEndian != (std::endian::native == std::endian::big);
    const MissingMark mark{.number = grid_.noData, .withNan = isRaw_};
    if (form_.type == "u8") return loadHeights<std::uint8_t>(from, isSwapped, mark, heights);
    if (form_.type == "i8") return loadHeights<std::int8_t>(from, isSwapped, mark, heights);
    if (form_.type == "u16") return loadHeights<std::uint16_t>(from, isSwapped, mark, heights);
    if (form_.type == "i16") return loadHeights<std::int16_t>(from, isSwapped, mark, heights);
    if (form_.type == "u32") return loadHeights<std::uint32_t>(from, isSwapped, mark, heights);
    if (form_.type == "i32") return loadHeights<std::int32_t>(from, isSwapped, mark, heights);
    if (form_.type == "f32") return loadHeights<float>(from, isSwapped, mark, heights);
    return loadHeights<double>(from, isSwapped, mark, heights);
  }

  std::filesystem::path path_;
  MappedFile file_;
  HeightField grid_;
  NumberForm form_;
  bool isRaw_;
  int row_ = 0;
};

/// Form of the numbers of a .bil file.
NumberForm bilForm(const GridHeader& header) {
  NumberForm form;
  const std::size_t bits = header.has("nbits") ? header.count("nbits", 8, 64) : 8;
  const std::string pixels = header.text("pixeltype");
  if (bits == 16 && (pixels.empty() || pixels == "signedint" || pixels == "unsignedint"))
    form.type = pixels == "unsignedint" ? "u16" : "i16";
  else if (bits == 32 && pixels == "float")
    form.type = "f32";
  else
    header.fail(
        fmt::format("numbers of {} bits and type '{}' are not supported; convert the grid "
                    "to 16-bit integers or 32-bit floats",
                    bits, pixels.substr(0, 40)));
  if (header.has("nbands") && header.count("nbands", 1, 65536) != 1)
    header.fail("the grid has several bands, but a height field has one; extract a band");
  if (header.has("skipbytes")) form.skip = header.count("skipbytes", 0, std::size_t{1} << 40);
  return form;
}

std::unique_ptr<HeightRows> openHeaderedGrid(const std::filesystem::path& path, bool isFloat,
                                             std::size_t maxMemory) {
  if (path == "-")
    throw UsageError(
        "a grid with a header beside it cannot be read from standard input; give a file");
  std::filesystem::path headerFile = path;
  headerFile.replace_extension(".hdr");
  const Bytes headerBytes = readBytes(headerFile, kMostHeader);
  GridHeader header(inputName(headerFile));
  if (const std::string_view rest = header.take(headerBytes.view()); !rest.empty())
    header.fail(
        fmt::format("line {} does not begin with a name; repair the header", header.lines() + 1));
  HeightField field = header.grid();
  NumberForm form{.type = "f32"};
  if (!isFloat) form = bilForm(header);
  const std::string order = header.text("byteorder");
  form.isBigEndian = order == "msbfirst" || order == "m" || order == "big_endian";
  if (!order.empty() && !form.isBigEndian && order != "lsbfirst" && order != "i" &&
      order != "little_endian")
    header.fail(
        fmt::format("'{}' is no byteorder; give LSBFIRST or MSBFIRST", order.substr(0, 40)));
  for (const char* word : {"bandrowbytes", "totalrowbytes"})
    if (header.has(word) && header.count(word, 0, std::size_t{1} << 40) !=
                                form.size() * static_cast<std::size_t>(field.columns))
      header.fail(
          fmt::format("{} does not equal the bytes of a row; rows with gaps are not "
                      "supported",
                      word));
  terrain::readProjection(path, field);
  return std::make_unique<BinaryRows>(path, std::move(field), form, maxMemory, false);
}

// === Tiles of the Shuttle Radar Topography Mission

/// Latitude and longitude of the lower left sample, from a name such as N37W123.hgt; NaN: none.
Imath::V2d tilePlace(const std::string& stem) {
  const Imath::V2d none(NAN, NAN);
  if (stem.size() < 7) return none;
  const auto digits = [&](std::size_t at, std::size_t count) {
    int value = 0;
    for (std::size_t n = at; n < at + count; ++n) {
      if (stem[n] < '0' || stem[n] > '9') return -1;
      value = 10 * value + stem[n] - '0';
    }
    return value;
  };
  const int latitude = digits(1, 2), longitude = digits(4, 3);
  const char north = static_cast<char>(stem[0] & ~0x20), east = static_cast<char>(stem[3] & ~0x20);
  const bool isEnd = stem.size() == 7 || stem[7] == '.';
  if (latitude < 0 || latitude > 90 || longitude < 0 || longitude > 180 || !isEnd ||
      (north != 'N' && north != 'S') || (east != 'E' && east != 'W'))
    return none;
  return Imath::V2d(east == 'E' ? longitude : -longitude, north == 'N' ? latitude : -latitude);
}

std::unique_ptr<HeightRows> openShuttleTile(const std::filesystem::path& path,
                                            std::size_t maxMemory) {
  const Imath::V2d place = tilePlace(path.filename().string());
  if (std::isnan(place.x))
    refuseRows(path, "the name of a .hgt file gives its place, as N37W123.hgt; rename the file");
  const std::size_t bytes = MappedFile(path, maxMemory, false).view().size();
  int side = 0;
  for (const int known : {1201, 3601})
    if (bytes == 2 * static_cast<std::size_t>(known) * static_cast<std::size_t>(known))
      side = known;
  if (side == 0)
    refuseRows(path, fmt::format("a .hgt file has 1201x1201 or 3601x3601 heights of 2 bytes, "
                                 "2884802 or 25934402 bytes, but this one has {}; download it "
                                 "again",
                                 bytes));
  const double step = 1.0 / (side - 1);
  HeightField field{.columns = side,
                    .rows = side,
                    .origin = place,
                    .spacing = {step, step},
                    .noData = -32768,
                    .coordinateSystem = "WGS 84",
                    .isGeographic = true};
  return std::make_unique<BinaryRows>(
      path, std::move(field), NumberForm{.type = "i16", .isBigEndian = true}, maxMemory, false);
}

}  // namespace

std::unique_ptr<HeightRows> rowsOf(const HeightField& field) {
  requireHeights(field);
  return std::make_unique<FieldRows>(field);
}

bool isRowFormat(const std::filesystem::path& nameOrFormat) {
  const std::string format = terrain::heightFormatOf(nameOrFormat);
  return format == "asc" || format == "hgt" || format == "flt" || format == "bil";
}

std::unique_ptr<HeightRows> openHeightRows(const std::filesystem::path& path,
                                           const HeightRowsOptions& options) {
  const std::string format = terrain::heightFormatOf(
      options.format.empty() ? path : std::filesystem::path(options.format));
  if (format == "asc") return std::make_unique<AsciiRows>(path, options.maxMemory);
  if (format == "hgt") return openShuttleTile(path, options.maxMemory);
  if (format == "flt" || format == "bil")
    return openHeaderedGrid(path, format == "flt", options.maxMemory);
  throw UsageError(fmt::format(
      "'{}' is no format of heights that is read by rows; use asc, hgt, flt or bil", format));
}

std::unique_ptr<HeightRows> openRawHeightRows(const std::filesystem::path& path,
                                              const RawHeights& raw) {
  const NumberForm form{.type = raw.type,
                        .isBigEndian = raw.isBigEndian,
                        .isNorthFirst = raw.isNorthFirst,
                        .skip = raw.skip};
  if (form.size() == 0)
    throw UsageError(
        fmt::format("heights of type '{}' are not supported; use u8, i8, u16, i16, u32, i32, f32 "
                    "or f64",
                    raw.type));
  constexpr int kMostSide = 1 << 30;
  if (raw.columns < 1 || raw.rows < 1 || raw.columns > kMostSide || raw.rows > kMostSide)
    throw UsageError(fmt::format("the size of the terrain is {}x{}; give numbers from 1 to 2^30",
                                 raw.columns, raw.rows));
  HeightField grid{.columns = raw.columns,
                   .rows = raw.rows,
                   .origin = raw.origin,
                   .spacing = raw.spacing,
                   .noData = raw.noData};
  return std::make_unique<BinaryRows>(path, std::move(grid), form, raw.maxMemory, true);
}

}  // namespace levelset
