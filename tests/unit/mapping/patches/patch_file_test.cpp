#include "mapping/patches/patch_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <random>
#include <string>

#include "levelset/error.h"
#include "mapping/placement/make_patch.h"
#include "tests/support/files.h"
#include "tests/support/patches.h"

namespace patch_file_test {

using Imath::V3d;
using levelset::InvalidInput;
using mapping::ParticleLayer;
using mapping::Patch;
using mapping::readPatches;
using mapping::writePatches;

std::vector<Patch> twoPatches() {
  const levelset::NarrowBand ball = support::makeBall(1, 0.1);
  const mapping::PatchOptions options = {.layers = 2, .spacing = 0.2};
  return {mapping::makePatch(ball, support::cap(0.6), 0.3, options).patch,
          mapping::makePatch(ball, support::cap(0.4), 0.1, options).patch};
}

TEST(PatchFile, KeepsEveryBit) {
  const support::TemporaryFolder folder;
  const std::vector<Patch> before = twoPatches();
  writePatches(folder.path() / "two.patch", before);
  const std::vector<Patch> after = readPatches(folder.path() / "two.patch");
  ASSERT_EQ(after.size(), 2u);
  for (std::size_t n = 0; n < 2; ++n) {
    EXPECT_EQ(after[n].corners, before[n].corners);
    EXPECT_EQ(after[n].height, before[n].height);
    EXPECT_EQ(after[n].mirrored, before[n].mirrored);
    EXPECT_EQ(after[n].spacing, before[n].spacing);
    ASSERT_EQ(after[n].layers.size(), before[n].layers.size());
    for (std::size_t k = 0; k < after[n].layers.size(); ++k) {
      const ParticleLayer &a = after[n].layers[k], &b = before[n].layers[k];
      EXPECT_EQ(a.columns, b.columns);
      EXPECT_EQ(a.rows, b.rows);
      EXPECT_EQ(a.w, b.w);
      EXPECT_EQ(a.height, b.height);
      EXPECT_EQ(a.positions, b.positions);
      EXPECT_EQ(a.rim, b.rim);
    }
  }
}

TEST(PatchFile, RefusesInvalidFiles) {
  const support::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "bad.patch";
  writePatches(file, twoPatches());
  const std::string text = support::readText(file);
  const auto refusal = [&](const std::string& broken) -> std::string {
    support::writeText(file, broken);
    try {
      (void)readPatches(file);
    } catch (const InvalidInput& error) {
      return error.what();
    }
    return "";
  };
  const auto with = [&](const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return std::string(text).replace(at, from.size(), to);
  };
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "JSON"},
      {"{}", "format"},
      {"[1, 2]", "format"},
      {with("levelsmith patches", "something else"), "is not a patch file"},
      {with("\"version\":1", "\"version\":7"), "version"},
      {with("\"columns\":", "\"columns\":1"), "positions"},
      {with("\"columns\":", "\"columns\":-"), "columns"},
      {with("\"w\":0.0", "\"w\":0.5"), "w = 0.5"},
      {with("\"w\":1.0", "\"w\":0.9"), "below w = 1"},
      {with("\"mirrored\":false", "\"mirrored\":3"), "mirrored"},
      {with("\"rim\":[[", "\"rim\":[[0,0,0],["), "rim"},
      {with("\"positions\":[[", "\"positions\":[[1,2],["), "point"},
      {with("\"height\":", "\"height\":-"), "not positive"},
  };
  for (const auto& [broken, word] : cases)
    EXPECT_NE(refusal(broken).find(word), std::string::npos) << word << ": " << refusal(broken);
  // Truncated or damaged at any position, a file is refused or yields complete patches.
  std::mt19937 random(1);
  for (int n = 0; n < 200; ++n) {
    std::string broken = text;
    if (n % 2 == 0) {
      broken.resize(random() % text.size());
    } else {
      broken[random() % text.size()] = static_cast<char>(random() % 256);
    }
    support::writeText(file, broken);
    try {
      for (const Patch& patch : readPatches(file))
        for (const ParticleLayer& layer : patch.layers)
          EXPECT_EQ(layer.positions.size(), layer.columns * layer.rows);
    } catch (const InvalidInput&) {
    }
  }
  EXPECT_THROW((void)readPatches(folder.path() / "missing.patch"), levelset::IoError);
  support::writeText(file, text);
  EXPECT_THROW((void)readPatches(file, 1000), levelset::ResourceLimit);
}

TEST(PatchFile, WritesNoPartialFile) {
  const support::TemporaryFolder folder;
  std::vector<Patch> patches = twoPatches();
  patches[1].layers[0].positions[3].y = std::numeric_limits<double>::quiet_NaN();
  const std::filesystem::path file = folder.path() / "old.patch";
  writePatches(file, twoPatches());
  EXPECT_THROW(writePatches(file, patches), InvalidInput);
  patches = twoPatches();
  patches[0].layers[1].w = std::numeric_limits<double>::infinity();
  EXPECT_THROW(writePatches(file, patches), InvalidInput);
  // The earlier file is unchanged, and no other file exists.
  EXPECT_EQ(readPatches(file).size(), 2u);
  EXPECT_EQ(folder.fileCount(), 1u);
}

}  // namespace patch_file_test
