#include "levelset/terrain/files/height_field_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/terrain/files/gdal_grid.h"
#include "levelset/terrain/files/grid_header.h"
#include "levelset/terrain/files/height_rows.h"

namespace levelset {
namespace {

/// Row of the field for a row of a file, which begins in the north.
int rowFromTop(const HeightField& field, int row) {
  return field.rows - 1 - row;
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

HeightField readByRows(const std::filesystem::path& path, const ReadHeightFieldOptions& options) {
  const std::unique_ptr<HeightRows> rows =
      openHeightRows(path, {.format = options.format, .maxMemory = options.maxMemory});
  HeightField field = rows->grid();
  terrain::requireHeightMemory(field, static_cast<double>(rows->memoryUse()), options.maxMemory);
  const auto width = static_cast<std::size_t>(field.columns);
  field.heights.resize(width * static_cast<std::size_t>(field.rows));
  for (int n = 0; n < field.rows; ++n) {
    const int row = rows->isNorthFirst() ? rowFromTop(field, n) : n;
    const std::span heights(field.heights.data() + field.index(0, row), width);
    if (!rows->next(heights)) std::fill(heights.begin(), heights.end(), kMissingHeight);
    report(options.progress, static_cast<double>(n + 1) / field.rows);
  }
  return field;
}

}  // namespace

HeightField readHeightField(const std::filesystem::path& path,
                            const ReadHeightFieldOptions& options) {
  const std::string format = terrain::heightFormatOf(
      options.format.empty() ? path : std::filesystem::path(options.format));
  if (!isHeightFormat(format))
    throw UsageError(fmt::format(
        "'{}' is no format of heights; use asc, hgt, flt, bil, tif, dem or dt0 to dt2", format));
  HeightField field = terrain::isGdalFormat(format) ? terrain::readGdalGrid(path, format, options)
                                                    : readByRows(path, options);
  withContext(inputName(path), [&] { requireHeights(field); });
  if (const std::size_t missing = field.missingCount(); missing > 0 && options.notes)
    options.notes->push_back(fmt::format("{}: {} of {} samples have no data", inputName(path),
                                         missing, field.heights.size()));
  return field;
}

bool isHeightFormat(const std::filesystem::path& nameOrFormat) {
  const std::string format = terrain::heightFormatOf(nameOrFormat);
  return isRowFormat(format) || terrain::isGdalFormat(format);
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
