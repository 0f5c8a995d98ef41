#include "levelset/terrain/tiles/patch_codec.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "levelset/terrain/height_field.h"
#include "levelset/terrain/tiles/range_coder.h"

namespace patch_codec_test {

using levelset::terrain::decodeHeights;
using levelset::terrain::encodeHeights;
using levelset::terrain::heightStep;
using levelset::terrain::storedHeight;

/// Returns whether heights come back with the same bits. NaN of all bits becomes kMissingHeight.
testing::AssertionResult comesBack(const std::vector<float>& heights, int width, double step = 0) {
  std::vector<float> again(heights.size());
  if (!decodeHeights(encodeHeights(heights, width, step), width, step, again))
    return testing::AssertionFailure() << "the bytes are refused";
  for (std::size_t n = 0; n < heights.size(); ++n) {
    const float expected = std::isnan(heights[n]) ? levelset::kMissingHeight : heights[n];
    if (std::bit_cast<std::uint32_t>(again[n]) != std::bit_cast<std::uint32_t>(expected))
      return testing::AssertionFailure()
             << "height " << n << " is " << again[n] << ", not " << expected;
  }
  return testing::AssertionSuccess();
}

/// Number of compressed bytes.
std::size_t bytesOf(const std::vector<float>& heights, int width, double step = 0) {
  return encodeHeights(heights, width, step).size();
}

/// Heights of waves with some noise. @param noise  amplitude of the noise
std::vector<float> waves(int width, int height, double noise, double missing = 0) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<float> heights;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const double h = 500 + 80 * std::sin(i * 0.11) * std::cos(j * 0.07) + noise * unit(random);
      heights.push_back(std::abs(unit(random)) < missing ? levelset::kMissingHeight
                                                         : static_cast<float>(h));
    }
  return heights;
}

std::vector<float> roundedTo(std::vector<float> heights, double denominator) {
  for (float& h : heights)
    h = static_cast<float>(std::nearbyint(static_cast<double>(h) * denominator) / denominator);
  return heights;
}

TEST(RangeCoder, RestoresBitsAtTheirEntropy) {
  std::mt19937 random(1);
  std::bernoulli_distribution rare(0.02);
  std::vector<unsigned> bits;
  for (int n = 0; n < 200'000; ++n) bits.push_back(rare(random) ? 1 : 0);
  levelset::terrain::RangeEncoder encoder;
  levelset::terrain::BitModel model;
  for (std::size_t n = 0; n < bits.size(); ++n) {
    encoder.bit(model, bits[n]);
    if (n % 100 == 0) encoder.rawBits(static_cast<std::uint32_t>(n), 18);
  }
  std::string bytes;
  encoder.finish(bytes);
  levelset::terrain::RangeDecoder decoder(bytes);
  levelset::terrain::BitModel again;
  for (std::size_t n = 0; n < bits.size(); ++n) {
    ASSERT_EQ(decoder.bit(again), bits[n]);
    if (n % 100 == 0) {
      ASSERT_EQ(decoder.rawBits(18), n);
    }
  }
  const double entropy = -0.02 * std::log2(0.02) - 0.98 * std::log2(0.98);  // 0.1414 bits
  const double most = (200'000 * entropy + 2000 * 18) / 8;
  EXPECT_LT(static_cast<double>(bytes.size()), 1.05 * most);
}

/// Carries run through many bytes when the lower bound is just below a power of two.
TEST(RangeCoder, CarriesThroughLongRuns) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    levelset::terrain::RangeEncoder encoder;
    std::vector<std::uint32_t> numbers;
    for (int n = 0; n < 300; ++n)
      numbers.push_back(random() % 50 == 0 ? static_cast<std::uint32_t>(random()) : 0xffffffffu);
    for (const std::uint32_t number : numbers) encoder.rawBits(number, 32);
    std::string bytes;
    encoder.finish(bytes);
    levelset::terrain::RangeDecoder decoder(bytes);
    for (const std::uint32_t number : numbers) ASSERT_EQ(decoder.rawBits(32), number);
  }
}

TEST(PatchCodec, RestoresAllBits) {
  EXPECT_TRUE(comesBack(waves(65, 65, 1), 65));
  EXPECT_TRUE(comesBack(waves(65, 65, 1, 0.3), 65));
  EXPECT_TRUE(comesBack(waves(3, 129, 5), 3));
  EXPECT_TRUE(comesBack(waves(2, 2, 5), 2));
  EXPECT_TRUE(comesBack({1, 2, 3, 4, 5, 6, 7}, 7));
  EXPECT_TRUE(comesBack({-0.F, 0.F, -0.F, 1, -1, 0.F}, 3));
  std::mt19937 random(5);
  std::vector<float> any;
  while (any.size() < 65 * 33)
    if (const auto h = std::bit_cast<float>(static_cast<std::uint32_t>(random())); !std::isinf(h))
      any.push_back(h);
  EXPECT_TRUE(comesBack(any, 33));
  using Limits = std::numeric_limits<float>;
  EXPECT_TRUE(comesBack({Limits::max(), -Limits::max(), Limits::max(), Limits::denorm_min(),
                         Limits::min(), -Limits::denorm_min(), 1, Limits::max(), Limits::lowest()},
                        3));
}

TEST(PatchCodec, RestoresFixedPointHeights) {
  for (const double denominator : {1., 2., 4., 64., 4096., 10., 100., 1000., 255., 65535.})
    EXPECT_TRUE(comesBack(roundedTo(waves(65, 65, 1, 0.1), denominator), 65));
  for (const double tolerance : {0.01, 0.1, 1., 30.}) {
    const double step = heightStep(tolerance);
    std::vector<float> heights = waves(65, 65, 1, 0.1);
    for (float& h : heights) h = storedHeight(h, step, tolerance);
    EXPECT_TRUE(comesBack(heights, 65, step));
    heights[100] = 0.123456F;  // no multiple of the step
    EXPECT_TRUE(comesBack(heights, 65, step));
  }
}

/// Heights of fewer digits take fewer bytes. Level ground takes next to nothing.
TEST(PatchCodec, TakesTheBytesThatTheHeightsNeed) {
  const std::vector<float> rough = waves(65, 65, 1);
  const std::size_t metres = bytesOf(roundedTo(rough, 1), 65),
                    centimetres = bytesOf(roundedTo(rough, 100), 65), all = bytesOf(rough, 65);
  // The noise alone has 1 bit in metres and 7.6 bits in centimetres. Predictions from noisy
  // neighbours double it.
  EXPECT_LT(static_cast<double>(metres), 65 * 65 * 2.3 / 8);
  EXPECT_LT(static_cast<double>(centimetres), 65 * 65 * 8.8 / 8);
  EXPECT_LT(all, 65 * 65 * 2.3);
  EXPECT_LT(bytesOf(std::vector<float>(65 * 65, 1234), 65), 60u);
  EXPECT_LT(bytesOf(std::vector<float>(65 * 65, 1.1F), 65), 60u);
  std::vector<float> half(65 * 65, levelset::kMissingHeight);
  std::fill(half.begin() + 65 * 30, half.end(), 5.F);
  EXPECT_LT(bytesOf(half, 65), 80u);
}

TEST(PatchCodec, KeepsTheTolerance) {
  std::mt19937 random(3);
  for (const double tolerance : {1e-6, 0.003, 0.01, 0.25, 1., 77.}) {
    const double step = heightStep(tolerance);
    EXPECT_LE(step, 2 * tolerance);
    EXPECT_GT(step, 1.87 * tolerance);
    for (const double size : {1e-3, 1., 1e3, 1e6, 1e20, 3e38}) {
      std::uniform_real_distribution<double> heights(-size, size);
      for (int n = 0; n < 2000; ++n) {
        const auto h = static_cast<float>(heights(random));
        EXPECT_LE(std::abs(static_cast<double>(storedHeight(h, step, tolerance)) - h), tolerance);
      }
    }
  }
  EXPECT_EQ(heightStep(0), 0);
  EXPECT_EQ(storedHeight(0.3F, 0, 0), 0.3F);
  EXPECT_TRUE(std::isnan(storedHeight(levelset::kMissingHeight, 1, 0.5)));
}

TEST(PatchCodec, RefusesOrReadsAnyBytes) {
  std::mt19937 random(9);
  const std::string whole = encodeHeights(waves(33, 17, 1, 0.1), 33, 0);
  std::vector<float> heights(33 * 17);
  int read = 0;
  for (int n = 0; n < 2000; ++n) {
    std::string bytes = whole;
    if (n % 2 == 0) {
      bytes.resize(random() % bytes.size());
    } else {
      for (char& byte : bytes) byte = static_cast<char>(random());
      bytes[0] = static_cast<char>(random());
    }
    if (!decodeHeights(bytes, 33, n % 3 == 0 ? 1e37 : 0, heights)) continue;
    ++read;
    for (const float h : heights) EXPECT_FALSE(std::isinf(h));
  }
  EXPECT_GT(read, 0);
  EXPECT_FALSE(decodeHeights("", 33, 0, heights));
  EXPECT_FALSE(decodeHeights("\x3f", 33, 0, heights));  // no form of numbers
  EXPECT_FALSE(decodeHeights("\x01", 33, 0, heights));  // multiples of no step
  EXPECT_FALSE(decodeHeights("\x82", 33, 0, heights));  // without its weights
}

}  // namespace patch_codec_test
