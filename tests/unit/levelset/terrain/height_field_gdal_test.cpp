#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/terrain/files/height_field_file.h"
#include "tests/support/files.h"

namespace gdal_grid_test {

using Imath::V2d;
using levelset::HeightField;
using levelset::InvalidInput;
using levelset::readHeightField;
using support::refusal;
using support::writeText;

constexpr int kShort = 3, kLong = 4, kDouble = 12, kAscii = 2;

/// A GeoTIFF of one uncompressed strip, byte by byte from the specification.
class Tiff {
 public:
  explicit Tiff(bool isBigEndian = false) : isBigEndian_(isBigEndian) {}

  template <typename T>
  std::string bytes(const std::vector<T>& numbers) const {
    std::string out;
    for (const T number : numbers) {
      char raw[sizeof(T)];
      std::memcpy(raw, &number, sizeof(T));
      if (isBigEndian_ != (std::endian::native == std::endian::big))
        std::reverse(std::begin(raw), std::end(raw));
      out.append(raw, sizeof(T));
    }
    return out;
  }

  template <typename T>
  Tiff& image(std::uint32_t width, std::uint32_t height, const std::vector<T>& numbers) {
    heights_ = bytes(numbers);
    const auto format = static_cast<std::uint16_t>(std::is_floating_point_v<T> ? 3
                                                   : std::is_signed_v<T>       ? 2
                                                                               : 1);
    longs(256, {width}).longs(257, {height}).shorts(258, {sizeof(T) * 8}).shorts(259, {1});
    shorts(262, {1}).longs(273, {8}).shorts(277, {1}).longs(278, {height});
    return longs(279, {static_cast<std::uint32_t>(heights_.size())}).shorts(339, {format});
  }
  Tiff& shorts(std::uint16_t tag, const std::vector<std::uint16_t>& v) {
    return set(tag, kShort, v.size(), bytes(v));
  }
  Tiff& longs(std::uint16_t tag, const std::vector<std::uint32_t>& v) {
    return set(tag, kLong, v.size(), bytes(v));
  }
  Tiff& doubles(std::uint16_t tag, const std::vector<double>& v) {
    return set(tag, kDouble, v.size(), bytes(v));
  }
  Tiff& text(std::uint16_t tag, const std::string& v) {
    return set(tag, kAscii, v.size() + 1, v + '\0');
  }
  /// Places the outer corner of the cell in the north-west at (x, y).
  Tiff& place(double x, double y, double stepX, double stepY) {
    return doubles(33550, {stepX, stepY, 0}).doubles(33922, {0, 0, 0, x, y, 0});
  }
  /// @param isPoint  positions are those of samples, not of the corners of cells
  Tiff& system(std::uint16_t model, std::uint16_t key, std::uint16_t code, bool isPoint = false) {
    return shorts(34735, {1, 1, 0, 3, 1024, 0, 1, model, 1025, 0, 1,
                          static_cast<std::uint16_t>(isPoint ? 2 : 1), key, 0, 1, code});
  }
  Tiff& projected(bool isPoint = false) { return system(1, 3072, 32633, isPoint); }

  [[nodiscard]] std::string str() const {
    std::string file = isBigEndian_ ? "MM" : "II";
    file += bytes<std::uint16_t>({42});
    file += bytes<std::uint32_t>({static_cast<std::uint32_t>(8 + heights_.size())});
    file += heights_;
    std::string directory = bytes<std::uint16_t>({static_cast<std::uint16_t>(tags_.size())});
    std::string values;
    const std::size_t after = file.size() + 2 + 12 * tags_.size() + 4;
    for (const auto& [tag, entry] : tags_) {
      directory += bytes<std::uint16_t>({tag, static_cast<std::uint16_t>(entry.type)});
      directory += bytes<std::uint32_t>({static_cast<std::uint32_t>(entry.count)});
      if (entry.bytes.size() <= 4) {
        directory += entry.bytes + std::string(4 - entry.bytes.size(), '\0');
      } else {
        directory += bytes<std::uint32_t>({static_cast<std::uint32_t>(after + values.size())});
        values += entry.bytes;
      }
    }
    return file + directory + bytes<std::uint32_t>({0}) + values;
  }

 private:
  struct Entry {
    int type;
    std::size_t count;
    std::string bytes;
  };
  Tiff& set(std::uint16_t tag, int type, std::size_t count, std::string bytes) {
    tags_[tag] = {type, count, std::move(bytes)};
    return *this;
  }
  bool isBigEndian_;
  std::string heights_;
  std::map<std::uint16_t, Entry> tags_;
};

class GdalGrid : public ::testing::Test {
 protected:
  HeightField read(const Tiff& tiff, std::vector<std::string>* notes = nullptr) {
    writeText(folder_ / "a.tif", tiff.str());
    return readHeightField(folder_ / "a.tif", {.notes = notes});
  }
  std::string refused(const Tiff& tiff) {
    return refusal<InvalidInput>([&] { static_cast<void>(read(tiff)); });
  }
  support::TemporaryFolder folder_;
};

TEST_F(GdalGrid, ReadsAGeoTiff) {
  for (const bool isBigEndian : {false, true}) {
    std::vector<std::string> notes;
    const HeightField field = read(Tiff(isBigEndian)
                                       .image<std::int16_t>(3, 2, {1, 2, 3, 4, -9999, -6})
                                       .place(500000, 4200000, 10, 20)
                                       .projected()
                                       .text(42113, "-9999"),
                                   &notes);
    ASSERT_EQ(field.columns, 3);
    ASSERT_EQ(field.rows, 2);
    EXPECT_EQ(field.origin, V2d(500005, 4199970));  // the centre of the cell in the south-west
    EXPECT_EQ(field.spacing, V2d(10, 20));
    EXPECT_EQ(field.coordinateSystem, "WGS 84 / UTM zone 33N");
    EXPECT_FALSE(field.isGeographic);
    EXPECT_EQ(field.noData, -9999);
    EXPECT_EQ(field.at(0, 0), 4);  // the first row of the file is in the north
    EXPECT_TRUE(field.isMissing(1, 0));
    EXPECT_EQ(field.at(2, 0), -6);
    EXPECT_EQ(field.at(0, 1), 1);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("1 of 6 samples have no data"), std::string::npos);
  }
}

TEST_F(GdalGrid, PlacesSamplesOfPoints) {
  // A file whose positions are those of points gives the sample itself.
  const HeightField field = read(
      Tiff().image<float>(2, 2, {1.5F, 2, 3, 4}).place(500000, 4200000, 10, 10).projected(true));
  EXPECT_EQ(field.origin, V2d(500000, 4199990));
  EXPECT_EQ(field.at(0, 1), 1.5F);
}

TEST_F(GdalGrid, KnowsDegrees) {
  const HeightField field = read(Tiff()
                                     .image<std::uint16_t>(2, 2, {0, 1, 2, 65535})
                                     .place(12, 47, 0.25, 0.25)
                                     .system(2, 2048, 4326));
  EXPECT_TRUE(field.isGeographic);
  EXPECT_EQ(field.coordinateSystem, "WGS 84");
  EXPECT_EQ(field.at(1, 0), 65535);
}

TEST_F(GdalGrid, NotesUnknownPlacesAndOtherUnits) {
  std::vector<std::string> notes;
  EXPECT_EQ(read(Tiff().image<float>(2, 2, {1, 2, 3, 4}), &notes).spacing, V2d(1));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("terrain --spacing"), std::string::npos);
  notes.clear();
  // New York Long Island in feet of the survey.
  const HeightField feet =
      read(Tiff().image<float>(2, 2, {1, 2, 3, 4}).place(0, 0, 1, 1).system(1, 3072, 2263), &notes);
  EXPECT_FALSE(feet.isGeographic);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("0.30480061 m"), std::string::npos);
}

TEST_F(GdalGrid, AppliesScaleAndOffset) {
  const std::string metadata =
      "<GDALMetadata><Item name=\"OFFSET\" sample=\"0\" role=\"offset\">100</Item>"
      "<Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.25</Item></GDALMetadata>";
  const HeightField field = read(Tiff()
                                     .image<std::int16_t>(2, 2, {4, 8, -32768, 0})
                                     .place(0, 0, 1, 1)
                                     .text(42112, metadata)
                                     .text(42113, "-32768"));
  EXPECT_EQ(field.at(0, 1), 101);
  EXPECT_EQ(field.at(1, 1), 102);
  EXPECT_TRUE(field.isMissing(0, 0));
  EXPECT_EQ(field.at(1, 0), 100);
}

TEST_F(GdalGrid, LeavesOutMaskedSamples) {
  const Tiff heights = Tiff().image<float>(2, 2, {1, 2, 3, 4}).place(0, 0, 1, 1);
  // Flags of 0: the mask is that of the band. Without them GDAL does not use the file.
  const std::string flags =
      "<GDALMetadata><Item name=\"INTERNAL_MASK_FLAGS_1\">0</Item></GDALMetadata>";
  writeText(folder_ / "a.tif.msk",
            Tiff().image<std::uint8_t>(2, 2, {255, 0, 255, 255}).text(42112, flags).str());
  const HeightField field = read(heights);
  EXPECT_TRUE(field.isMissing(1, 1));
  EXPECT_EQ(field.missingCount(), 1u);
  EXPECT_EQ(field.at(0, 1), 1);
}

TEST_F(GdalGrid, RefusesGridsThatAreNoHeights) {
  Tiff turned;
  turned.image<float>(2, 2, {1, 2, 3, 4});
  turned.doubles(34264, {0.8, -0.6, 0, 10, 0.6, 0.8, 0, 20, 0, 0, 0, 0, 0, 0, 0, 1});
  EXPECT_NE(refused(turned).find("turned or mirrored"), std::string::npos);
  EXPECT_NE(refused(Tiff().image<float>(2, 2, {1, INFINITY, 3, 4}).place(0, 0, 1, 1))
                .find("row 1, column 2 is inf"),
            std::string::npos);
  Tiff bands;
  bands.image<std::uint8_t>(2, 1, {1, 2, 3, 4, 5, 6}).shorts(258, {8, 8, 8}).shorts(277, {3});
  bands.shorts(262, {2}).shorts(339, {1, 1, 1});
  EXPECT_NE(refused(bands).find("3 bands"), std::string::npos);
  EXPECT_THROW(static_cast<void>(readHeightField(folder_ / "none.tif")), levelset::IoError);
  EXPECT_THROW(static_cast<void>(readHeightField("-", {.format = "tif"})), levelset::UsageError);
  // 16 MB of heights do not fit into 1 MB.
  const Tiff large =
      Tiff().image<float>(2048, 2048, std::vector<float>(2048 * 2048)).place(0, 0, 1, 1);
  writeText(folder_ / "large.tif", large.str());
  EXPECT_THROW(static_cast<void>(
                   readHeightField(folder_ / "large.tif", {.maxMemory = std::size_t{1} << 20})),
               levelset::ResourceLimit);
}

TEST_F(GdalGrid, RefusesDamagedFiles) {
  const std::string whole = Tiff()
                                .image<float>(4, 4, std::vector<float>(16, 7))
                                .place(10, 20, 1, 1)
                                .projected()
                                .text(42113, "-1")
                                .str();
  for (const char* text : {"II*", "no picture at all", "MM"}) {
    writeText(folder_ / "a.tif", text);
    EXPECT_NE(refusal<InvalidInput>([&] {
                static_cast<void>(readHeightField(folder_ / "a.tif"));
              }).find("GTiff cannot read it"),
              std::string::npos);
  }
  std::mt19937 random(32);
  int refusals = 0, read = 0;
  for (int n = 0; n < 300; ++n) {
    std::string bytes = whole;
    if (n % 3 == 0)
      bytes.resize(random() % whole.size());
    else
      for (int k = 0; k < 2; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
    writeText(folder_ / "a.tif", bytes);
    try {
      const HeightField field =
          readHeightField(folder_ / "a.tif", {.maxMemory = std::size_t{1} << 28});
      // Damage of the heights is not seen, but a cut file has no heights that it lacks.
      if (n % 3 == 0) {
        EXPECT_EQ(std::count(field.heights.begin(), field.heights.end(), 7), 16);
      }
      EXPECT_EQ(field.heights.size(),
                static_cast<std::size_t>(field.columns) * static_cast<std::size_t>(field.rows));
      ++read;
    } catch (const levelset::Error&) {
      ++refusals;
    }
  }
  EXPECT_GT(refusals, 100);
  EXPECT_GT(read, 20);
}

}  // namespace gdal_grid_test
