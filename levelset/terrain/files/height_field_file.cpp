#include "levelset/terrain/files/height_field_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/terrain/files/gdal_grid.h"
#include "levelset/terrain/files/grid_header.h"
#include "levelset/volume_files/volume_header.h"

namespace levelset {
namespace {

using terrain::GridHeader;

/// Longest header beside a binary grid, bytes.
constexpr std::size_t kMostHeader = std::size_t{1} << 16;

[[noreturn]] void refuseHeights(const std::filesystem::path& path, const std::string& what) {
  throw InvalidInput(fmt::format("{}: {}", inputName(path), what));
}

/// Row of the field for a row of a file, which begins in the north.
int rowFromTop(const HeightField& field, int row) {
  return field.rows - 1 - row;
}

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
  /// Bytes behind the last word.
  [[nodiscard]] std::size_t left() const { return text_.size() - at_; }

 private:
  std::string_view text_;
  std::size_t at_ = 0, line_;
};

HeightField readAsciiGrid(const std::filesystem::path& path,
                          const ReadHeightFieldOptions& options) {
  MappedFile file(path, options.maxMemory);
  GridHeader header(inputName(path));
  const std::string_view text = header.take(file.view());
  HeightField field = header.grid();
  const auto columns = static_cast<std::size_t>(field.columns),
             rows = static_cast<std::size_t>(field.rows);
  // Each height takes a digit and a blank, except the last one.
  if (static_cast<double>(columns) * static_cast<double>(rows) >
      static_cast<double>(text.size()) / 2 + 1)
    refuseHeights(path,
                  fmt::format("the header states {}x{} heights, more than the {} bytes behind "
                              "it can hold; copy the file again",
                              columns, rows, text.size()));
  terrain::requireHeightMemory(field, file.isMapped() ? 0 : static_cast<double>(file.view().size()),
                               options.maxMemory);
  field.heights.resize(columns * rows);
  HeightNumbers numbers(text, header.lines());
  const bool marksNan = field.noData && std::isnan(*field.noData);
  for (int fromTop = 0; fromTop < field.rows; ++fromTop) {
    const int row = rowFromTop(field, fromTop);
    for (int column = 0; column < field.columns; ++column) {
      std::string_view word = numbers.next();
      if (word.empty())
        refuseHeights(path, fmt::format("the file ends in row {} of {}, column {}; copy it again",
                                        fromTop + 1, field.rows, column + 1));
      const std::optional<double> value = volume_files::numberIn<double>(word);
      float& height = field.heights[field.index(column, row)];
      if (value &&
          ((field.noData && static_cast<float>(*value) == static_cast<float>(*field.noData)) ||
           (marksNan && std::isnan(*value)))) {
        height = kMissingHeight;
        continue;
      }
      height = static_cast<float>(value.value_or(NAN));
      if (!std::isfinite(height))
        refuseHeights(path, fmt::format("line {}: '{}' is no finite height; mark missing heights "
                                        "with the number of NODATA_value",
                                        numbers.line(), word.substr(0, 40)));
    }
    file.release(file.view().size() - numbers.left());
    report(options.progress, static_cast<double>(fromTop + 1) / field.rows);
  }
  if (const std::string_view word = numbers.next(); !word.empty())
    refuseHeights(path, fmt::format("line {}: '{}' follows the last of the {}x{} heights; correct "
                                    "ncols and nrows",
                                    numbers.line(), word.substr(0, 40), columns, rows));
  terrain::readProjection(path, field);
  return field;
}

// === Numbers of a binary file

enum class HeightType { I16, U16, F32 };

/// Copies the heights of a binary file, rows from the north. @param bytes  exactly the heights
void takeHeights(HeightField& field, std::string_view bytes, HeightType type, bool isBigEndian,
                 const std::filesystem::path& path, const Progress& progress) {
  const std::size_t size = type == HeightType::F32 ? 4 : 2;
  const bool isSwapped = isBigEndian != (std::endian::native == std::endian::big);
  field.heights.resize(static_cast<std::size_t>(field.columns) *
                       static_cast<std::size_t>(field.rows));
  const char* from = bytes.data();
  for (int fromTop = 0; fromTop < field.rows; ++fromTop) {
    const int row = rowFromTop(field, fromTop);
    for (int column = 0; column < field.columns; ++column, from += size) {
      std::array<char, 4> raw{};
      std::memcpy(raw.data(), from, size);
      if (isSwapped) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(size));
      float value = 0;
      if (type == HeightType::F32) {
        value = std::bit_cast<float>(raw);
      } else {
        std::uint16_t number = 0;
        std::memcpy(&number, raw.data(), sizeof number);
        value = type == HeightType::U16 ? static_cast<float>(number)
                                        : static_cast<float>(static_cast<std::int16_t>(number));
      }
      // A file of floats rounds its mark to a float, too.
      const bool isMissing = field.noData && (value == static_cast<float>(*field.noData) ||
                                              (std::isnan(value) && std::isnan(*field.noData)));
      if (!isMissing && !std::isfinite(value))
        refuseHeights(path, fmt::format("the height in row {}, column {} is {}; mark missing "
                                        "heights with NODATA_value in the header",
                                        fromTop + 1, column + 1, value));
      field.heights[field.index(column, row)] = isMissing ? kMissingHeight : value;
    }
    report(progress, static_cast<double>(fromTop + 1) / field.rows);
  }
}

HeightField readHeaderedGrid(const std::filesystem::path& path, bool isFloat,
                             const ReadHeightFieldOptions& options) {
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
  HeightType type = HeightType::F32;
  std::size_t skip = 0;
  if (!isFloat) {
    const std::size_t bits = header.has("nbits") ? header.count("nbits", 8, 64) : 8;
    const std::string pixels = header.text("pixeltype");
    if (bits == 16 && (pixels.empty() || pixels == "signedint" || pixels == "unsignedint"))
      type = pixels == "unsignedint" ? HeightType::U16 : HeightType::I16;
    else if (bits != 32 || pixels != "float")
      header.fail(
          fmt::format("numbers of {} bits and type '{}' are not supported; convert the grid "
                      "to 16-bit integers or 32-bit floats",
                      bits, pixels.substr(0, 40)));
    if (header.has("nbands") && header.count("nbands", 1, 65536) != 1)
      header.fail("the grid has several bands, but a height field has one; extract a band");
    if (header.has("skipbytes")) skip = header.count("skipbytes", 0, std::size_t{1} << 40);
  }
  const std::string order = header.text("byteorder");
  const bool isBigEndian = order == "msbfirst" || order == "m" || order == "big_endian";
  if (!order.empty() && !isBigEndian && order != "lsbfirst" && order != "i" &&
      order != "little_endian")
    header.fail(
        fmt::format("'{}' is no byteorder; give LSBFIRST or MSBFIRST", order.substr(0, 40)));
  const std::size_t size = type == HeightType::F32 ? 4 : 2;
  for (const char* word : {"bandrowbytes", "totalrowbytes"})
    if (header.has(word) && header.count(word, 0, std::size_t{1} << 40) !=
                                size * static_cast<std::size_t>(field.columns))
      header.fail(
          fmt::format("{} does not equal the bytes of a row; rows with gaps are not "
                      "supported",
                      word));
  const MappedFile file(path, options.maxMemory, false);
  const std::size_t expected =
      skip + size * static_cast<std::size_t>(field.columns) * static_cast<std::size_t>(field.rows);
  if (file.view().size() != expected)
    refuseHeights(path, fmt::format("the file has {} bytes, but {} follow from its header, {}x{} "
                                    "heights; copy both files again",
                                    file.view().size(), expected, field.columns, field.rows));
  terrain::requireHeightMemory(field, file.isMapped() ? 0 : static_cast<double>(expected),
                               options.maxMemory);
  takeHeights(field, file.view().substr(skip), type, isBigEndian, path, options.progress);
  terrain::readProjection(path, field);
  return field;
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

HeightField readTile(const std::filesystem::path& path, const ReadHeightFieldOptions& options) {
  const Imath::V2d place = tilePlace(path.filename().string());
  if (std::isnan(place.x))
    refuseHeights(path, "the name of a .hgt file gives its place, as N37W123.hgt; rename the file");
  const MappedFile file(path, options.maxMemory, false);
  int side = 0;
  for (const int known : {1201, 3601})
    if (file.view().size() == 2 * static_cast<std::size_t>(known) * static_cast<std::size_t>(known))
      side = known;
  if (side == 0)
    refuseHeights(path, fmt::format("a .hgt file has 1201x1201 or 3601x3601 heights of 2 bytes, "
                                    "2884802 or 25934402 bytes, but this one has {}; download it "
                                    "again",
                                    file.view().size()));
  const double step = 1.0 / (side - 1);
  HeightField field{.columns = side,
                    .rows = side,
                    .origin = place,
                    .spacing = {step, step},
                    .noData = -32768,
                    .coordinateSystem = "WGS 84",
                    .isGeographic = true};
  terrain::requireHeightMemory(field, file.isMapped() ? 0 : static_cast<double>(file.view().size()),
                               options.maxMemory);
  takeHeights(field, file.view(), HeightType::I16, true, path, options.progress);
  return field;
}

/// Number that marks missing samples in a file, and that is the height of no sample.
double markOf(const HeightField& field) {
  const bool hasOwn = field.noData && std::isfinite(*field.noData);
  double mark = hasOwn ? *field.noData : -9999;
  const auto isHeight = [&](double number) {
    return std::find(field.heights.begin(), field.heights.end(), static_cast<float>(number)) !=
           field.heights.end();
  };
  const Imath::Box3d bounds = field.bounds();
  if (isHeight(mark)) mark = std::floor(bounds.min.z) - 9999;
  while (isHeight(mark)) mark *= 2;
  return mark;
}

}  // namespace

HeightField readHeightField(const std::filesystem::path& path,
                            const ReadHeightFieldOptions& options) {
  const std::string format = terrain::heightFormatOf(
      options.format.empty() ? path : std::filesystem::path(options.format));
  HeightField field;
  if (format == "asc")
    field = readAsciiGrid(path, options);
  else if (format == "hgt")
    field = readTile(path, options);
  else if (format == "flt" || format == "bil")
    field = readHeaderedGrid(path, format == "flt", options);
  else if (terrain::isGdalFormat(format))
    field = terrain::readGdalGrid(path, format, options);
  else
    throw UsageError(fmt::format(
        "'{}' is no format of heights; use asc, hgt, flt, bil, tif, dem or dt0 to dt2", format));
  withContext(inputName(path), [&] { requireHeights(field); });
  if (const std::size_t missing = field.missingCount(); missing > 0 && options.notes)
    options.notes->push_back(fmt::format("{}: {} of {} samples have no data", inputName(path),
                                         missing, field.heights.size()));
  return field;
}

bool isHeightFormat(const std::filesystem::path& nameOrFormat) {
  const std::string format = terrain::heightFormatOf(nameOrFormat);
  return format == "asc" || format == "hgt" || format == "flt" || format == "bil" ||
         terrain::isGdalFormat(format);
}

bool isAsciiGridFormat(const std::filesystem::path& nameOrFormat) {
  return terrain::heightFormatOf(nameOrFormat) == "asc";
}

void writeHeightField(const std::filesystem::path& path, const HeightField& field,
                      const WriteHeightFieldOptions& options) {
  requireHeights(field);
  ByteWriter out(path, false);
  const auto line = [&](std::string_view word, double number) {
    out.write(word);
    out.write(" ");
    out.writeNumber(number);
    out.write("\n");
  };
  line("ncols", field.columns);
  line("nrows", field.rows);
  line("xllcenter", field.origin.x);
  line("yllcenter", field.origin.y);
  if (field.spacing.x == field.spacing.y) {
    line("cellsize", field.spacing.x);
  } else {
    line("dx", field.spacing.x);
    line("dy", field.spacing.y);
  }
  const double mark = markOf(field);
  line("NODATA_value", mark);
  for (int fromTop = 0; fromTop < field.rows; ++fromTop) {
    const int row = rowFromTop(field, fromTop);
    for (int column = 0; column < field.columns; ++column) {
      const float height = field.at(column, row);
      if (column > 0) out.write(" ");
      if (std::isnan(height))
        out.writeNumber(mark);
      else
        out.writeNumber(height);
    }
    out.write("\n");
    report(options.progress, static_cast<double>(fromTop + 1) / field.rows);
  }
  out.commit();
}

}  // namespace levelset
