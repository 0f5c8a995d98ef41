#include "levelset/terrain/files/height_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "levelset/error.h"
#include "levelset/terrain/files/height_field_file.h"
#include "tests/support/files.h"
#include "tests/support/terrains.h"

namespace height_rows_test {

using levelset::HeightField;
using levelset::HeightRows;
using levelset::InvalidInput;
using levelset::openHeightRows;
using levelset::openRawHeightRows;
using levelset::RawHeights;
using support::refusal;

/// Puts rows together.
HeightField fieldOf(HeightRows& rows) {
  HeightField field = rows.grid();
  EXPECT_TRUE(field.heights.empty());
  const auto width = static_cast<std::size_t>(field.columns);
  field.heights.resize(width * static_cast<std::size_t>(field.rows));
  for (int n = 0; n < field.rows; ++n) {
    const int row = rows.isNorthFirst() ? field.rows - 1 - n : n;
    EXPECT_TRUE(rows.next({field.heights.data() + field.index(0, row), width}));
  }
  return field;
}

TEST(HeightRows, AreThoseOfAField) {
  const HeightField field = support::randomTerrain(7, 5, 0.2, 3);
  EXPECT_EQ(fieldOf(*levelset::rowsOf(field)).contentHash(), field.contentHash());
}

TEST(HeightRows, AreThoseOfAFile) {
  const support::TemporaryFolder folder;
  writeHeightField(folder / "a.asc", support::randomTerrain(7, 5, 0.2, 3));
  const auto rows = openHeightRows(folder / "a.asc");
  EXPECT_TRUE(rows->isNorthFirst());
  EXPECT_EQ(rows->memoryUse(), 0u);
  EXPECT_EQ(fieldOf(*rows).contentHash(),
            levelset::readHeightField(folder / "a.asc").contentHash());
  EXPECT_SAYS(
      refusal<levelset::UsageError>([&] { static_cast<void>(openHeightRows(folder / "a.xyz")); }),
      "no format of heights");
}

/// Bytes of numbers of a type, in an order.
template <typename T>
std::string bytesOf(std::initializer_list<double> numbers, bool isBigEndian) {
  std::string bytes;
  for (const double number : numbers) {
    const auto value = static_cast<T>(number);
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (isBigEndian) std::reverse(std::begin(raw), std::end(raw));
    bytes.append(raw, sizeof(T));
  }
  return bytes;
}

class RawHeightRows : public ::testing::Test {
 protected:
  HeightField read(const std::string& bytes, const RawHeights& raw) {
    support::writeText(folder_ / "a.raw", bytes);
    return fieldOf(*openRawHeightRows(folder_ / "a.raw", raw));
  }
  template <typename T>
  void expectType(const std::string& type) {
    for (const bool isBigEndian : {false, true}) {
      const HeightField field =
          read("xyz" + bytesOf<T>({1, 2, 3, 100, 5, 6}, isBigEndian),
               {.columns = 3, .rows = 2, .type = type, .isBigEndian = isBigEndian, .skip = 3});
      EXPECT_EQ(field.heights, (std::vector<float>{1, 2, 3, 100, 5, 6})) << type;
    }
  }
  support::TemporaryFolder folder_;
};

TEST_F(RawHeightRows, ReadAllTypes) {
  expectType<std::uint8_t>("u8");
  expectType<std::int8_t>("i8");
  expectType<std::uint16_t>("u16");
  expectType<std::int16_t>("i16");
  expectType<std::uint32_t>("u32");
  expectType<std::int32_t>("i32");
  expectType<float>("f32");
  expectType<double>("f64");
}

TEST_F(RawHeightRows, TakePlaceAndMissingSamples) {
  const HeightField field = read(bytesOf<std::int16_t>({1, -5, 3, 4}, false), {.columns = 2,
                                                                               .rows = 2,
                                                                               .type = "i16",
                                                                               .isNorthFirst = true,
                                                                               .origin = {7, 8},
                                                                               .spacing = {2, 3},
                                                                               .noData = -5});
  EXPECT_EQ(field.at(0, 0), 3);
  EXPECT_EQ(field.at(0, 1), 1);
  EXPECT_TRUE(field.isMissing(1, 1));
  EXPECT_EQ(field.origin, Imath::V2d(7, 8));
  EXPECT_EQ(field.spacing, Imath::V2d(2, 3));
}

/// Marks are compared with the numbers of the file, since floats hold 24 bits only.
TEST_F(RawHeightRows, CompareMarksBeforeRounding) {
  const auto missing = [&](const std::string& bytes, int columns, const char* type, double mark) {
    return read(bytes, {.columns = columns, .rows = 1, .type = type, .noData = mark})
        .missingCount();
  };
  EXPECT_EQ(missing(bytesOf<std::int32_t>({16777216, 16777217}, false), 2, "i32", 16777217), 1u);
  EXPECT_EQ(missing(bytesOf<std::uint32_t>({4294967295.0, 4294967294.0, 7}, false), 3, "u32",
                    4294967295.0),
            1u);
  EXPECT_EQ(missing(bytesOf<double>({-9999, -9999.0001}, false), 2, "f64", -9999), 1u);
  EXPECT_EQ(missing(bytesOf<float>({0.1, 1}, false), 2, "f32", 0.1), 1u);
  // NaN is missing if a mark is given.
  EXPECT_EQ(missing(bytesOf<float>({NAN, -9999, 1}, false), 3, "f32", -9999), 2u);
  EXPECT_SAYS(refusal<InvalidInput>([&] {
                read(bytesOf<float>({1, NAN}, false), {.columns = 2, .rows = 1, .type = "f32"});
              }),
              "column 2 is nan; repair it, or give the number of missing samples");
}

TEST_F(RawHeightRows, RefuseOtherSizesAndTypes) {
  EXPECT_SAYS(
      refusal<InvalidInput>([&] { read("12345", {.columns = 3, .rows = 2, .type = "u8"}); }),
      "5 bytes, but 6 follow from its size, 3x2 heights; correct the size");
  EXPECT_SAYS(refusal<levelset::UsageError>(
                  [&] { read("123456", {.columns = 3, .rows = 2, .type = "f16"}); }),
              "'f16' are not supported");
  EXPECT_SAYS(refusal<levelset::UsageError>(
                  [&] { read("123456", {.columns = 0, .rows = 2, .type = "u8"}); }),
              "0x2");
  EXPECT_SAYS(
      refusal<InvalidInput>([&] {
        read(bytesOf<float>({1, HUGE_VAL}, false), {.columns = 2, .rows = 1, .type = "f32"});
      }),
      "row 1, column 2 is inf");
}

}  // namespace height_rows_test
