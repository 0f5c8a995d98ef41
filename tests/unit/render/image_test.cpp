#include "render/images/image.h"

#include <gtest/gtest.h>
#include <png.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>

#include "levelset/error.h"
#include "tests/support/threads.h"

namespace image_test {

using namespace render;
namespace fs = std::filesystem;

class ImageFiles : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              ("levelsmith_image_" + std::string(info->name()) + "_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path file(const char* name) const { return folder_ / name; }

  fs::path folder_;
};

std::string bytesOf(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

Image gradientImage() {
  Image image(37, 21);
  for (const char* name : {"R", "G", "B", "A", "Z", "curvature.mean"}) {
    auto& channel = image.addChannel(name);
    for (std::size_t i = 0; i < channel.size(); ++i)
      channel[i] = static_cast<float>(i) / static_cast<float>(channel.size());
  }
  image.channels["Z"][5] = std::numeric_limits<float>::infinity();
  image.ids["id"].assign(image.pixelCount(), 4000000000u);
  image.attributes["ls:filter"] = "trilinear";
  image.matrices["worldToNDC"] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
  return image;
}

using ImageExr = ImageFiles;
using ImagePng = ImageFiles;

TEST_F(ImageExr, HasTheSameBytesOnAnyNumberOfThreads) {
  // Many blocks of lines, which are compressed on several threads.
  Image image(301, 403);
  std::uint32_t noise = 1;
  for (const char* name : {"R", "G", "B", "Z"})
    for (float& value : image.addChannel(name)) {
      noise = noise * 1664525u + 1013904223u;
      value = static_cast<float>(noise >> 20);
    }
  support::onThreads(1, [&] { writeImage(file("one.exr"), image); });
  support::onThreads(7, [&] { writeImage(file("seven.exr"), image); });
  EXPECT_GT(bytesOf(file("one.exr")).size(), 100'000u);
  EXPECT_TRUE(bytesOf(file("one.exr")) == bytesOf(file("seven.exr")));
  const Image back = support::onThreads(7, [&] { return readExr(file("one.exr")); });
  EXPECT_TRUE(back.channels == image.channels);
}

TEST_F(ImageExr, IsReadBackToTheBit) {
  const Image image = gradientImage();
  writeImage(file("a.exr"), image);
  const Image back = readExr(file("a.exr"));
  EXPECT_EQ(back.width, image.width);
  EXPECT_EQ(back.height, image.height);
  EXPECT_EQ(back.channels, image.channels);
  EXPECT_EQ(back.ids, image.ids);
  EXPECT_EQ(back.attributes.at("ls:filter"), "trilinear");
  EXPECT_EQ(back.matrices, image.matrices);
}

TEST_F(ImageExr, SameBytesEveryTime) {
  writeImage(file("a.exr"), gradientImage());
  writeImage(file("b.data"), gradientImage(), "exr");
  const std::string bytes = bytesOf(file("a.exr"));
  EXPECT_GT(bytes.size(), 100u);
  EXPECT_EQ(bytes, bytesOf(file("b.data")));
  EXPECT_EQ(bytes.find("capDate"), std::string::npos);
}

TEST_F(ImagePng, HasToneCurveAndAlpha) {
  Image image(3, 2);
  for (const char* name : {"R", "G", "B"}) image.addChannel(name);
  image.addChannel("A");
  const auto set = [&](std::size_t i, float colour, float alpha) {
    for (const char* name : {"R", "G", "B"}) image.channels[name][i] = colour * alpha;
    image.channels["A"][i] = alpha;
  };
  set(0, 0.5f, 1);
  set(1, 0.5f, 0.25f);
  set(2, 1000, 1);
  set(3, 0, 1);
  writeImage(file("a.png"), image);

  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_TRUE(png_image_begin_read_from_file(&png, file("a.png").c_str()));
  EXPECT_EQ(png.width, 3u);
  EXPECT_EQ(png.height, 2u);
  png.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(png));
  ASSERT_TRUE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr));
  const auto pixel = [&](std::size_t i) { return std::pair{pixels[4 * i], pixels[4 * i + 3]}; };
  EXPECT_EQ(pixel(0), (std::pair<std::uint8_t, std::uint8_t>{188, 255}));  // sRGB of 0.5
  EXPECT_EQ(pixel(1), (std::pair<std::uint8_t, std::uint8_t>{188, 64}));
  EXPECT_EQ(pixel(2), (std::pair<std::uint8_t, std::uint8_t>{255, 255}));
  EXPECT_EQ(pixel(3), (std::pair<std::uint8_t, std::uint8_t>{0, 255}));
  EXPECT_EQ(pixel(5), (std::pair<std::uint8_t, std::uint8_t>{0, 0}));
}

TEST_F(ImagePng, IsTheSameInMemory) {
  const Image image = gradientImage();
  writeImage(file("a.png"), image);
  const std::vector<char> bytes = pngBytes(image);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), bytesOf(file("a.png")));
  EXPECT_THROW((void)pngBytes(Image(4, 4)), levelset::UsageError);
  EXPECT_THROW((void)pngBytes(Image()), levelset::InvalidInput);
}

TEST_F(ImageFiles, RefusesUnwritableImages) {
  const Image image = gradientImage();
  EXPECT_THROW(writeImage(file("a.jpg"), image), levelset::UsageError);
  EXPECT_THROW(writeImage(file("a"), image), levelset::UsageError);
  EXPECT_THROW(writeImage("-", image), levelset::UsageError);
  EXPECT_THROW(writeImage(file("missing/a.exr"), image), levelset::IoError);
  EXPECT_THROW(writeImage("/dev/full", image, "exr"), levelset::IoError);
  EXPECT_THROW(writeImage("/dev/full", image, "png"), levelset::IoError);
  Image noColour(2, 2);
  noColour.addChannel("Z");
  EXPECT_THROW(writeImage(file("a.png"), noColour), levelset::UsageError);
  EXPECT_THROW(writeImage(file("a.exr"), Image()), levelset::InvalidInput);
  Image ragged = image;
  ragged.channels["R"].pop_back();
  EXPECT_THROW(writeImage(file("a.exr"), ragged), levelset::InvalidInput);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(ImageFiles, RefusesUnreadableImages) {
  EXPECT_THROW((void)readExr(file("missing.exr")), levelset::IoError);
  EXPECT_THROW((void)readExr(folder_), levelset::IoError);
  std::ofstream(file("text.exr")) << "not an image at all";
  EXPECT_THROW((void)readExr(file("text.exr")), levelset::InvalidInput);
  std::ofstream(file("empty.exr")).flush();
  EXPECT_THROW((void)readExr(file("empty.exr")), levelset::InvalidInput);
  writeImage(file("a.exr"), gradientImage());
  const std::string bytes = bytesOf(file("a.exr"));
  for (const std::size_t size : {std::size_t{40}, bytes.size() / 3, bytes.size() - 1}) {
    std::ofstream(file("cut.exr"), std::ios::binary).write(bytes.data(), static_cast<long>(size));
    EXPECT_THROW((void)readExr(file("cut.exr")), levelset::InvalidInput) << size;
  }
  // A header that declares 8192 x 8192 pixels: the four numbers of the data window.
  std::string greedy = bytes;
  const std::size_t window = greedy.find(std::string("dataWindow\0box2i", 16)) + 21;
  greedy.replace(window, 16, std::string("\0\0\0\0\0\0\0\0\xff\x1f\0\0\xff\x1f\0\0", 16));
  std::ofstream(file("greedy.exr"), std::ios::binary) << greedy;
  EXPECT_THROW((void)readExr(file("greedy.exr")), levelset::InvalidInput);
}

}  // namespace image_test
