#include "apps/pipeline/values/units.h"

#include <gtest/gtest.h>

#include <clocale>
#include <locale>

#include "levelset/error.h"

namespace units_test {

using levelset::UsageError;
using namespace pipeline;

TEST(Units, ReadsLengthsInThreeUnits) {
  EXPECT_EQ(parseLength("0.5", "t").unit, Unit::World);
  EXPECT_EQ(parseLength("2vx", "t").unit, Unit::Voxels);
  EXPECT_EQ(parseLength("-1e-2%", "t").unit, Unit::Percent);
  EXPECT_DOUBLE_EQ(parseLength("-1e-2%", "t").number, -0.01);
  EXPECT_DOUBLE_EQ(parseLength("+3", "t").number, 3);
  EXPECT_EQ(parseLength("0.1mm", "t").unit, Unit::World);
  EXPECT_DOUBLE_EQ(parseLength("0.1mm", "t").number, 0.1);
  for (const char* bad : {"1cm", "1m", "1mmm", "1MM", "mm", "1 mm"})
    EXPECT_THROW((void)parseLength(bad, "t"), UsageError) << bad;
}

TEST(Units, UsesPointsForAnyLocale) {
  const auto expectPoints = [] {
    EXPECT_DOUBLE_EQ(parseNumber("1.5", "t"), 1.5);
    EXPECT_DOUBLE_EQ(parseNumber("1234.5", "t"), 1234.5);
    EXPECT_THROW((void)parseNumber("1,5", "t"), UsageError);
  };
  expectPoints();
  // Few machines have such a locale; streams take this one.
  struct Comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const std::locale before = std::locale::global(std::locale(std::locale(), new Comma));
  expectPoints();
  std::locale::global(before);
  for (const char* locale : {"de_DE.UTF-8", "fr_FR.UTF-8"})
    if (std::setlocale(LC_ALL, locale)) expectPoints();
  std::setlocale(LC_ALL, "C");
}

TEST(Units, RefusesInvalidNumbers) {
  for (const char* bad :
       {"", " 1", "1 ", "nan", "NaN", "inf", "-inf", "1e400", "--1", "one", "0x10", "1.2.3"})
    EXPECT_THROW((void)parseNumber(bad, "t"), UsageError) << bad;
}

TEST(Units, ReadsMemorySizes) {
  EXPECT_EQ(parseBytes("4G", "t"), std::size_t{4} << 30);
  EXPECT_EQ(parseBytes("512MiB", "t"), std::size_t{512} << 20);
  EXPECT_EQ(parseBytes("1000", "t"), 1000u);
  for (const char* bad : {"0", "-1G", "4X", "4GG", "1e30"})
    EXPECT_THROW((void)parseBytes(bad, "t"), UsageError) << bad;
}

TEST(Units, ReadsImageSizes) {
  EXPECT_EQ(parseImageSize("1024x768", "t"), std::pair(1024, 768));
  for (const char* bad : {"0x0", "10x", "x10", "10", "-1x5", "1x1x1"})
    EXPECT_THROW((void)parseImageSize(bad, "t"), UsageError) << bad;
  EXPECT_THROW((void)parseImageSize("9999999x9999999", "t"), levelset::ResourceLimit);
}

TEST(Units, ReadsBoxesAndMatrices) {
  EXPECT_EQ(parseBox("0,0,0 1,2,3", "t").max, Imath::V3d(1, 2, 3));
  EXPECT_THROW((void)parseBox("0,0,0 0,1,1", "t"), UsageError);
  EXPECT_EQ(parseMatrix("1 0 0 0 1 0 0 0 1 5 6 7", "t")[3][1], 6);
  EXPECT_THROW((void)parseMatrix("1 2 3", "t"), UsageError);
}

TEST(Units, SuggestsCorrections) {
  EXPECT_EQ(didYouMean("spehre", {"sphere", "box"}), "sphere");
  EXPECT_EQ(didYouMean("zzz", {"sphere", "box"}), "");
}

}  // namespace units_test
