#include "levelset/terrain/files/gdal_grid.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/terrain/files/grid_header.h"

#ifdef LEVELSMITH_HAS_GDAL
#include <cpl_error.h>
#include <dlfcn.h>
#include <gdal.h>
#include <ogr_srs_api.h>
#endif

namespace levelset::terrain {

bool isGdalFormat(std::string_view format) {
  constexpr std::array<std::string_view, 6> known = {"tif", "tiff", "dem", "dt0", "dt1", "dt2"};
  return std::find(known.begin(), known.end(), format) != known.end();
}

#ifdef LEVELSMITH_HAS_GDAL

namespace {

/// Blocks that GDAL keeps in memory, bytes.
constexpr GIntBig kGdalCache = GIntBig{64} << 20;

/// Functions of GDAL, which is loaded while the program runs. Linking it would add a hundred
/// libraries to the start of every program.
class Gdal {
 public:
  static const Gdal& instance() {
    static const Gdal gdal;
    return gdal;
  }

#define LEVELSMITH_GDAL_FUNCTION(name) decltype(&::name) name = load<decltype(&::name)>(#name)
  LEVELSMITH_GDAL_FUNCTION(GDALOpenEx);
  LEVELSMITH_GDAL_FUNCTION(GDALClose);
  LEVELSMITH_GDAL_FUNCTION(GDALGetRasterXSize);
  LEVELSMITH_GDAL_FUNCTION(GDALGetRasterYSize);
  LEVELSMITH_GDAL_FUNCTION(GDALGetRasterCount);
  LEVELSMITH_GDAL_FUNCTION(GDALGetRasterBand);
  LEVELSMITH_GDAL_FUNCTION(GDALGetRasterDataType);
  LEVELSMITH_GDAL_FUNCTION(GDALDataTypeIsComplex);
  LEVELSMITH_GDAL_FUNCTION(GDALGetBlockSize);
  LEVELSMITH_GDAL_FUNCTION(GDALGetRasterNoDataValue);
  LEVELSMITH_GDAL_FUNCTION(GDALGetRasterScale);
  LEVELSMITH_GDAL_FUNCTION(GDALGetRasterOffset);
  LEVELSMITH_GDAL_FUNCTION(GDALGetRasterUnitType);
  LEVELSMITH_GDAL_FUNCTION(GDALGetMaskFlags);
  LEVELSMITH_GDAL_FUNCTION(GDALGetMaskBand);
  LEVELSMITH_GDAL_FUNCTION(GDALRasterIO);
  LEVELSMITH_GDAL_FUNCTION(GDALGetGeoTransform);
  LEVELSMITH_GDAL_FUNCTION(GDALGetSpatialRef);
  LEVELSMITH_GDAL_FUNCTION(GDALGetDataTypeSizeBytes);
  LEVELSMITH_GDAL_FUNCTION(GDALGetCacheMax64);
  LEVELSMITH_GDAL_FUNCTION(GDALSetCacheMax64);
  LEVELSMITH_GDAL_FUNCTION(OSRGetName);
  LEVELSMITH_GDAL_FUNCTION(OSRIsGeographic);
  LEVELSMITH_GDAL_FUNCTION(OSRIsProjected);
  LEVELSMITH_GDAL_FUNCTION(OSRGetAngularUnits);
  LEVELSMITH_GDAL_FUNCTION(OSRGetLinearUnits);
  LEVELSMITH_GDAL_FUNCTION(CPLErrorReset);
  LEVELSMITH_GDAL_FUNCTION(CPLGetLastErrorMsg);
  LEVELSMITH_GDAL_FUNCTION(CPLPushErrorHandler);
  LEVELSMITH_GDAL_FUNCTION(CPLPopErrorHandler);
  CPLErrorHandler quiet = load<CPLErrorHandler>("CPLQuietErrorHandler");
#undef LEVELSMITH_GDAL_FUNCTION

 private:
  Gdal() {
    load<decltype(&::GDALAllRegister)>("GDALAllRegister")();
  }

  template <typename Function>
  static Function load(const char* name) {
    static std::string reason;
    static void* library = open(reason);
    void* symbol = library ? dlsym(library, name) : nullptr;
    if (!symbol)
      throw IoError(fmt::format("GDAL cannot be loaded ({}); install its library {}",
                                library ? fmt::format("it has no {}", name) : reason,
                                LEVELSMITH_HAS_GDAL));
    return reinterpret_cast<Function>(symbol);
  }
  static void* open(std::string& reason) {
    void* library = dlopen(LEVELSMITH_HAS_GDAL, RTLD_NOW | RTLD_LOCAL);
    if (!library) reason = dlerror();
    return library;
  }
};

/// Keeps GDAL silent and its cache small for a while. The program may use GDAL, too. The cache
/// belongs to the process: the first of several readers sets it, and the last one restores it.
class GdalSettings {
 public:
  explicit GdalSettings(GIntBig cache) {
    gdal_.CPLPushErrorHandler(gdal_.quiet);
    const std::lock_guard lock(mutex_);
    if (readers_++ > 0) return;
    cacheBefore_ = gdal_.GDALGetCacheMax64();
    gdal_.GDALSetCacheMax64(cache);
  }
  ~GdalSettings() {
    {
      const std::lock_guard lock(mutex_);
      if (--readers_ == 0) gdal_.GDALSetCacheMax64(cacheBefore_);
    }
    gdal_.CPLPopErrorHandler();
  }
  GdalSettings(const GdalSettings&) = delete;
  GdalSettings& operator=(const GdalSettings&) = delete;

  void needCache(GIntBig bytes) const {
    const std::lock_guard lock(mutex_);
    if (bytes > gdal_.GDALGetCacheMax64()) gdal_.GDALSetCacheMax64(bytes);
  }

 private:
  static inline std::mutex mutex_;
  static inline int readers_ = 0;
  static inline GIntBig cacheBefore_ = 0;
  const Gdal& gdal_ = Gdal::instance();
};

class GdalGrid {
 public:
  GdalGrid(const std::filesystem::path& path, std::string_view format,
           const ReadHeightFieldOptions& options)
      : path_(path), options_(options) {
    const char* driver = format == "dem" ? "USGSDEM" : format.starts_with("dt") ? "DTED" : "GTiff";
    const std::array<const char*, 2> drivers = {driver, nullptr};
    gdal_.CPLErrorReset();
    set_.reset(gdal_.GDALOpenEx(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers.data(),
                                nullptr, nullptr));
    if (!set_) fail(fmt::format("GDAL's {} cannot read it{}", driver, lastMessage()));
    if (const int bands = gdal_.GDALGetRasterCount(set_.get()); bands != 1)
      fail(
          fmt::format("it has {} bands, but a height field has one; extract it with "
                      "'gdal_translate -b N'",
                      bands));
    band_ = gdal_.GDALGetRasterBand(set_.get(), 1);
    if (gdal_.GDALDataTypeIsComplex(gdal_.GDALGetRasterDataType(band_)))
      fail("its numbers are complex; convert them to heights");
  }

  HeightField read() {
    HeightField field{.columns = gdal_.GDALGetRasterXSize(set_.get()),
                      .rows = gdal_.GDALGetRasterYSize(set_.get())};
    place(field);
    nameSystem(field);
    int known = 0;
    if (const double mark = gdal_.GDALGetRasterNoDataValue(band_, &known); known)
      field.noData = mark;
    takeHeights(field);
    return field;
  }

 private:
  struct Close {
    void operator()(GDALDatasetH set) const { Gdal::instance().GDALClose(set); }
  };

  [[noreturn]] void fail(const std::string& what) const {
    throw InvalidInput(fmt::format("{}: {}", inputName(path_), what));
  }

  void note(const std::string& what) const {
    if (options_.notes) options_.notes->push_back(fmt::format("{}: {}", inputName(path_), what));
  }

  [[nodiscard]] std::string lastMessage() const {
    const std::string text = gdal_.CPLGetLastErrorMsg();
    return text.empty() ? text : ": " + text.substr(0, 200);
  }

  /// Sets origin and spacing. GDAL counts from the corner of the first cell, samples are centres.
  void place(HeightField& field) {
    std::array<double, 6> t{};
    if (gdal_.GDALGetGeoTransform(set_.get(), t.data()) != CE_None) {
      note("the file does not tell its place; samples are 1 apart, use 'terrain --spacing'");
      return;
    }
    if (t[2] != 0 || t[4] != 0 || !(t[1] > 0) || t[5] == 0 || !std::isfinite(t[1] + t[5]))
      fail("its grid is turned or mirrored; make it north-up with 'gdalwarp'");
    isSouthUp_ = t[5] > 0;
    field.spacing = {t[1], std::abs(t[5])};
    field.origin = {t[0] + 0.5 * t[1], t[3] + (isSouthUp_ ? 0.5 : field.rows - 0.5) * t[5]};
  }

  void nameSystem(HeightField& field) {
    // Slopes and volumes are wrong when heights and positions have different units.
    const std::string unit = gdal_.GDALGetRasterUnitType(band_);
    constexpr std::array<std::string_view, 6> metres = {"",      "m",      "metre",
                                                        "meter", "metres", "meters"};
    if (std::find(metres.begin(), metres.end(), unit) == metres.end())
      note(fmt::format("heights are in '{}'; 'terrain --scale' converts them", unit.substr(0, 40)));
    const OGRSpatialReferenceH system = gdal_.GDALGetSpatialRef(set_.get());
    if (!system) return;
    if (const char* name = gdal_.OSRGetName(system)) field.coordinateSystem = name;
    field.isGeographic = gdal_.OSRIsGeographic(system) != 0;
    if (!field.isGeographic) {
      if (const double length = gdal_.OSRGetLinearUnits(system, nullptr); length != 1)
        note(fmt::format("a unit of x and y is {:.9g} m; 'terrain --scale' gives heights this unit",
                         length));
      return;
    }
    constexpr double kDegree = std::numbers::pi / 180;
    if (std::abs(gdal_.OSRGetAngularUnits(system, nullptr) - kDegree) > 1e-9 * kDegree)
      fail("its positions are angles in other units than degrees; convert it with 'gdalwarp'");
  }

  void readRows(GDALRasterBandH band, int row, int count, int columns, std::vector<double>& out) {
    gdal_.CPLErrorReset();
    if (gdal_.GDALRasterIO(band, GF_Read, 0, row, columns, count, out.data(), columns, count,
                           GDT_Float64, 0, 0) != CE_None)
      fail(fmt::format("row {} cannot be read{}; copy the file again", row + 1, lastMessage()));
  }

  void takeHeights(HeightField& field) {
    int blockColumns = 0, blockRows = 0;
    gdal_.GDALGetBlockSize(band_, &blockColumns, &blockRows);
    const int atOnce = blockRows >= field.rows ? 1 : std::max(1, blockRows);
    const auto width = static_cast<std::size_t>(field.columns);
    const bool hasMask = (gdal_.GDALGetMaskFlags(band_) & (GMF_ALL_VALID | GMF_NODATA)) == 0;
    // GDAL decodes whole blocks. Those of a row stay in its cache, or they are decoded again.
    const double blocks =
        std::ceil(static_cast<double>(width) / blockColumns) * blockColumns * blockRows *
        (gdal_.GDALGetDataTypeSizeBytes(gdal_.GDALGetRasterDataType(band_)) + (hasMask ? 1 : 0));
    const double buffer = static_cast<double>(width) * atOnce * sizeof(double);
    requireHeightMemory(
        field, (hasMask ? 2 : 1) * buffer + std::max(2 * blocks, static_cast<double>(kGdalCache)),
        options_.maxMemory);
    settings_.needCache(static_cast<GIntBig>(2 * blocks));
    int known = 0;
    const double offset = gdal_.GDALGetRasterOffset(band_, &known);
    double scale = gdal_.GDALGetRasterScale(band_, &known);
    if (!known) scale = 1;
    field.heights.resize(width * static_cast<std::size_t>(field.rows));
    std::vector<double> numbers(width * static_cast<std::size_t>(atOnce)),
        mask(hasMask ? numbers.size() : 0);
    for (int first = 0; first < field.rows; first += atOnce) {
      const int count = std::min(atOnce, field.rows - first);
      readRows(band_, first, count, field.columns, numbers);
      if (hasMask) readRows(gdal_.GDALGetMaskBand(band_), first, count, field.columns, mask);
      for (int n = 0; n < count; ++n) {
        const int row = isSouthUp_ ? first + n : field.rows - 1 - (first + n);
        for (std::size_t column = 0; column < width; ++column) {
          const std::size_t at = static_cast<std::size_t>(n) * width + column;
          const double number = numbers[at];
          const auto height = static_cast<float>(number * scale + offset);
          const bool isMissing = (hasMask && mask[at] == 0) || isMark(field, number);
          if (!isMissing && !std::isfinite(height))
            fail(
                fmt::format("the height in row {}, column {} is {}; mark missing heights with "
                            "'gdal_translate -a_nodata'",
                            first + n + 1, column + 1, number));
          field.heights[static_cast<std::size_t>(row) * width + column] =
              isMissing ? kMissingHeight : height;
        }
      }
      report(options_.progress, static_cast<double>(first + count) / field.rows);
    }
    // The mark is a number of the file, before its scale.
    if (scale != 1 || offset != 0) field.noData.reset();
  }

  /// A file of floats may have its mark as a text of a double. NaN is no height in any file.
  static bool isMark(const HeightField& field, double number) {
    return std::isnan(number) ||
           (field.noData && static_cast<float>(number) == static_cast<float>(*field.noData));
  }

  const Gdal& gdal_ = Gdal::instance();
  GdalSettings settings_{kGdalCache};
  const std::filesystem::path& path_;
  const ReadHeightFieldOptions& options_;
  std::unique_ptr<void, Close> set_;
  GDALRasterBandH band_ = nullptr;
  bool isSouthUp_ = false;
};

}  // namespace

HeightField readGdalGrid(const std::filesystem::path& path, std::string_view format,
                         const ReadHeightFieldOptions& options) {
  if (path == "-")
    throw UsageError(fmt::format("'{}' cannot be read from standard input; give a file", format));
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored))
    throw UsageError(
        fmt::format("{} is no regular file, but '{}' is read at several places; give a "
                    "file",
                    inputName(path), format));
  // Reports a file that is missing or cannot be opened as other readers do.
  static_cast<void>(MappedFile(path, options.maxMemory, false));
  return GdalGrid(path, format, options).read();
}

#else

HeightField readGdalGrid(const std::filesystem::path& path, std::string_view format,
                         const ReadHeightFieldOptions&) {
  throw UsageError(fmt::format(
      "{}: this build cannot read '{}', since GDAL was not found; install libgdal-dev and "
      "build again, or convert the file with 'gdal_translate -of AAIGrid'",
      inputName(path), format));
}

#endif

}  // namespace levelset::terrain
