#include "levelset/terrain/files/height_field_file.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <random>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/terrains.h"

namespace height_field_file_test {

using Imath::V2d;
using levelset::HeightField;
using levelset::InvalidInput;
using levelset::readHeightField;
using support::refusal;
using support::writeText;

constexpr const char* kGrid =
    "ncols 3\nnrows 2\nxllcorner 100\nyllcorner 200\ncellsize 10\nNODATA_value -9999\n"
    "1 2 3\n4 -9999 6.5\n";

class HeightFieldFile : public ::testing::Test {
 protected:
  HeightField read(const std::string& name, const std::string& bytes) {
    writeText(folder_ / name, bytes);
    return readHeightField(folder_ / name);
  }
  std::string refused(const std::string& name, const std::string& bytes) {
    return refusal<InvalidInput>([&] { static_cast<void>(read(name, bytes)); });
  }
  support::TemporaryFolder folder_;
};

/// Bytes of numbers in the given order.
template <typename T>
std::string bytesOf(const std::vector<T>& numbers, bool isBigEndian) {
  std::string bytes;
  for (const T number : numbers) {
    char raw[sizeof(T)];
    std::memcpy(raw, &number, sizeof(T));
    if (isBigEndian != (std::endian::native == std::endian::big))
      std::reverse(std::begin(raw), std::end(raw));
    bytes.append(raw, sizeof(T));
  }
  return bytes;
}

TEST_F(HeightFieldFile, ReadsAnAsciiGrid) {
  std::vector<std::string> notes;
  writeText(folder_ / "a.asc", kGrid);
  const HeightField field = readHeightField(folder_ / "a.asc", {.notes = &notes});
  EXPECT_EQ(field.columns, 3);
  EXPECT_EQ(field.rows, 2);
  EXPECT_EQ(field.origin, V2d(105, 205));  // the centre of a cell
  EXPECT_EQ(field.spacing, V2d(10, 10));
  // The first line is the northern row.
  EXPECT_EQ(field.at(0, 1), 1);
  EXPECT_EQ(field.at(2, 0), 6.5);
  EXPECT_TRUE(field.isMissing(1, 0));
  EXPECT_EQ(field.missingCount(), 1u);
  EXPECT_EQ(field.noData, -9999);
  EXPECT_TRUE(field.coordinateSystem.empty());
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_SAYS(notes[0], "1 of 6 samples have no data");
}

TEST_F(HeightFieldFile, TakesHeadersInAnyForm) {
  const HeightField centred =
      read("b.asc",
           "NODATA_VALUE nan\r\nCELLSIZE 2\r\nYLLCENTER -4\r\nXLLCENTER +3\r\nNROWS 1\r\n"
           "NCOLS 2\r\nnan\r\n1e2");
  EXPECT_EQ(centred.origin, V2d(3, -4));
  EXPECT_TRUE(centred.isMissing(0, 0));
  EXPECT_EQ(centred.at(1, 0), 100);
  const HeightField oblong =
      read("c.asc", "ncols 1\nnrows 1\nxllcorner 0\nyllcorner 0\ndx 2\ndy 4\n7\n");
  EXPECT_EQ(oblong.spacing, V2d(2, 4));
  EXPECT_EQ(oblong.origin, V2d(1, 2));
}

TEST_F(HeightFieldFile, NamesTheCoordinateSystem) {
  writeText(folder_ / "a.prj", "PROJCS[\"ETRS89 / UTM zone 32N\",GEOGCS[\"ETRS89\"]]");
  HeightField field = read("a.asc", kGrid);
  EXPECT_EQ(field.coordinateSystem, "ETRS89 / UTM zone 32N");
  EXPECT_FALSE(field.isGeographic);
  writeText(folder_ / "a.prj", "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\"]]");
  field = read("a.asc", kGrid);
  EXPECT_EQ(field.coordinateSystem, "WGS 84");
  EXPECT_TRUE(field.isGeographic);
  writeText(folder_ / "a.prj", "Projection    GEOGRAPHIC\nDatum WGS84\n");
  field = read("a.asc", kGrid);
  EXPECT_EQ(field.coordinateSystem, "GEOGRAPHIC");
  EXPECT_TRUE(field.isGeographic);
  writeText(folder_ / "a.prj",
            "\xef\xbb\xbf"
            "COMPD_CS[\"WGS 84 + EGM96 height\",GEOGCS[\"WGS 84\"]]");
  field = read("a.asc", kGrid);
  EXPECT_EQ(field.coordinateSystem, "WGS 84 + EGM96 height");
  EXPECT_TRUE(field.isGeographic);
  writeText(folder_ / "a.prj", "nothing");
  EXPECT_SAYS(refused("a.asc", kGrid), "names no coordinate system");
  writeText(folder_ / "a.prj", std::string(70000, 'x'));
  EXPECT_SAYS(refused("a.asc", kGrid), "longer than 64 KiB");
}

TEST_F(HeightFieldFile, RefusesDamagedAsciiGrids) {
  const auto with = [](const std::string& old, const std::string& text) {
    std::string grid = kGrid;
    return grid.replace(grid.find(old), old.size(), text);
  };
  EXPECT_SAYS(refused("a.asc", with(" 6.5", "")), "the file ends in row 2 of 2, column 3");
  EXPECT_SAYS(refused("a.asc", std::string(kGrid) + "8\n"), "line 9: '8' follows the last");
  EXPECT_SAYS(refused("a.asc", with("6.5", "six")), "line 8: 'six' is no finite height");
  EXPECT_SAYS(refused("a.asc", with("6.5", "nan")), "line 8: 'nan' is no finite height");
  EXPECT_SAYS(refused("a.asc", with("6.5", "inf")), "no finite height");
  EXPECT_SAYS(refused("a.asc", with("6.5", "1e300")), "no finite height");
  EXPECT_SAYS(refused("a.asc", with("6.5", "6.5x")), "'6.5x' is no finite height");
  EXPECT_SAYS(refused("a.asc", with("ncols 3", "ncols 0")), "ncols is 0");
  EXPECT_SAYS(refused("a.asc", with("ncols 3", "ncols 2.5")), "must be a whole number");
  EXPECT_SAYS(refused("a.asc", with("ncols 3", "ncols -3")), "ncols is -3");
  EXPECT_SAYS(refused("a.asc", with("ncols 3", "ncols nan")), "not a finite number");
  EXPECT_SAYS(refused("a.asc", with("ncols 3", "ncols")), "'ncols' has no value");
  EXPECT_SAYS(refused("a.asc", with("ncols 3", "ncols 1000000000")), "can hold");
  EXPECT_SAYS(refused("a.asc", with("ncols 3\n", "")), "lacks ncols");
  EXPECT_SAYS(refused("a.asc", with("nrows 2", "ncols 3")), "'ncols' is given twice");
  EXPECT_SAYS(refused("a.asc", with("cellsize 10", "cellsize 0")), "must be positive");
  EXPECT_SAYS(refused("a.asc", with("cellsize 10\n", "")), "lacks cellsize");
  EXPECT_SAYS(refused("a.asc", with("xllcorner 100\n", "")), "lacks the position");
  EXPECT_SAYS(refused("a.asc", with("xllcorner 100", "xllcorner 1\nxllcenter 2")), "remove one");
  EXPECT_SAYS(refused("a.asc", with("xllcorner 100", "xllcorner 1e999")), "not a finite number");
  EXPECT_SAYS(refused("a.asc", ""), "empty");
  EXPECT_SAYS(refused("a.asc", "1 2 3\n"), "lacks ncols");
  EXPECT_SAYS(refusal<levelset::UsageError>([&] { static_cast<void>(read("a.xyz", kGrid)); }),
              "'xyz' is no format of heights");
  EXPECT_SAYS(
      refusal<levelset::IoError>([&] { static_cast<void>(readHeightField(folder_ / "none.asc")); }),
      "none.asc");
  std::string large = "ncols 1000\nnrows 1000\nxllcorner 0\nyllcorner 0\ncellsize 1\n";
  for (int n = 0; n < 1'000'000; ++n) large += "1 ";
  writeText(folder_ / "large.asc", large);
  EXPECT_SAYS(refusal<levelset::ResourceLimit>([&] {
                static_cast<void>(readHeightField(folder_ / "large.asc", {.maxMemory = 3'000'000}));
              }),
              "");
  EXPECT_NO_THROW(
      static_cast<void>(readHeightField(folder_ / "large.asc", {.maxMemory = 4'200'000})));
}

TEST_F(HeightFieldFile, WritesWhatItReads) {
  HeightField field = support::randomTerrain(17, 9, 0.2, 1);
  field.origin = {0.1, -1e7 / 3};
  field.spacing = {30.87, 30.87};
  writeHeightField(folder_ / "a.asc", field);
  const HeightField again = readHeightField(folder_ / "a.asc");
  EXPECT_EQ(again.contentHash(), field.contentHash());
  EXPECT_EQ(again.noData, -9999);
  field.spacing.y = 1.0 / 3;
  field.noData = static_cast<double>(field.heights[0]);  // no mark any more: a height has it
  writeHeightField(folder_ / "b.asc", field);
  EXPECT_EQ(readHeightField(folder_ / "b.asc").contentHash(), field.contentHash());
}

TEST_F(HeightFieldFile, ReadsTilesOfTheShuttle) {
  std::vector<std::int16_t> heights(1201 * 1201, 5);
  heights[0] = 1000;          // north-west
  heights[1200] = -32768;     // north-east
  heights[1200 * 1201] = -7;  // south-west
  const std::string bytes = bytesOf(heights, true);
  const HeightField field = read("S03w123.hgt", bytes);
  EXPECT_EQ(field.columns, 1201);
  EXPECT_EQ(field.origin, V2d(-123, -3));
  EXPECT_NEAR(field.position(1200, 1200).x, -122, 1e-12);
  EXPECT_EQ(field.at(0, 1200), 1000);
  EXPECT_EQ(field.at(0, 0), -7);
  EXPECT_TRUE(field.isMissing(1200, 1200));
  EXPECT_EQ(field.missingCount(), 1u);
  EXPECT_TRUE(field.isGeographic);
  EXPECT_EQ(read("N37E000.SRTMGL3.hgt", bytes).origin, V2d(0, 37));
  EXPECT_SAYS(refused("dem.hgt", bytes), "rename the file");
  EXPECT_SAYS(refused("N91E000.hgt", bytes), "rename the file");
  EXPECT_SAYS(refused("N37E000.hgt", bytes.substr(1)), "2884801");
  EXPECT_SAYS(refused("N37E000.hgt", "x"), "1201x1201");
}

TEST_F(HeightFieldFile, ReadsNumbersWithAHeaderBesideThem) {
  const std::string place = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n";
  const std::vector<float> floats = {1.5f, 2, 3, 4, 5, -9999};
  for (const bool isBig : {false, true}) {
    writeText(folder_ / "a.hdr",
              place + "NODATA_value -9999\nbyteorder " + (isBig ? "MSBFIRST\n" : "LSBFIRST\n"));
    const HeightField field = read("a.flt", bytesOf(floats, isBig));
    EXPECT_EQ(field.at(0, 1), 1.5);
    EXPECT_EQ(field.at(1, 0), 5);
    EXPECT_TRUE(field.isMissing(2, 0));
  }
  EXPECT_SAYS(refused("a.flt", std::string(23, '\0')), "24 follow from its header");
  EXPECT_SAYS(refused("a.flt", bytesOf<float>({1, 2, NAN, 4, 5, 6}, true)),
              "row 1, column 3 is nan");
  const std::vector<std::int16_t> integers = {1, -2, 3, 4, 5, -6};
  writeText(folder_ / "a.hdr",
            "BYTEORDER I\nLAYOUT BIL\nNROWS 2\nNCOLS 3\nNBANDS 1\nNBITS 16\nBANDROWBYTES 6\n"
            "TOTALROWBYTES 6\nPIXELTYPE SIGNEDINT\nULXMAP 10\nULYMAP 20\nXDIM 0.5\nYDIM 2\n"
            "NODATA -6\nSKIPBYTES 4\n");
  const HeightField field = read("a.bil", "skip" + bytesOf(integers, false));
  EXPECT_EQ(field.origin, V2d(10, 18));
  EXPECT_EQ(field.spacing, V2d(0.5, 2));
  EXPECT_EQ(field.at(1, 1), -2);
  EXPECT_TRUE(field.isMissing(2, 0));
  const auto refusedWith = [&](const std::string& header) {
    writeText(folder_ / "a.hdr", header);
    return refused("a.bil", bytesOf(integers, false));
  };
  EXPECT_SAYS(refusedWith(place), "numbers of 8 bits");
  EXPECT_SAYS(refusedWith(place + "nbits 16\nnbands 3\n"), "several bands");
  EXPECT_SAYS(refusedWith(place + "nbits 16\nbandrowbytes 8\n"), "rows with gaps");
  EXPECT_SAYS(refusedWith(place + "nbits 16\nbyteorder vax\n"), "'vax' is no byteorder");
  EXPECT_SAYS(refusedWith(place + "nbits 16\n1 2 3\n"), "line 7 does not begin with a name");
  writeText(folder_ / "a.hdr", place + "nbits 16\npixeltype unsignedint\n");
  EXPECT_EQ(read("a.bil", bytesOf(integers, false)).at(1, 1), 65534);
  std::filesystem::remove(folder_ / "a.hdr");
  EXPECT_SAYS(
      refusal<levelset::IoError>([&] { static_cast<void>(readHeightField(folder_ / "a.bil")); }),
      "a.hdr");
}

/// Files with random damage are read or refused with a sentence.
TEST_F(HeightFieldFile, SurvivesRandomDamage) {
  std::mt19937 random(7);
  std::size_t refusals = 0;
  for (int n = 0; n < 500; ++n) {
    try {
      const HeightField field = read("a.asc", support::mutated(kGrid, random));
      EXPECT_NO_THROW(levelset::requireHeights(field));
    } catch (const levelset::Error& error) {
      EXPECT_SAYS(error.what(), "a.asc");
      ++refusals;
    }
  }
  EXPECT_GT(refusals, 100u);
  EXPECT_LT(refusals, 490u);
}

}  // namespace height_field_file_test
