#include "levelset/terrain/tiles/tiled_ground.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <csignal>
#include <random>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/terrain/height_pyramid.h"
#include "levelset/terrain/tiles/tile_format.h"
#include "levelset/terrain/tiles/write_tiled_ground.h"
#include "tests/support/files.h"
#include "tests/support/terrains.h"
#include "tests/support/threads.h"

namespace tiled_ground_test {

using levelset::HeightField;
using levelset::HeightPyramid;
using levelset::InvalidInput;
using levelset::kMissingHeight;
using levelset::openTiledGround;
using levelset::PatchStore;
using levelset::PyramidPatch;
using levelset::writeTiledGround;
using support::refusal;

/// Rows that a function makes.
template <typename Heights>
class MadeRows final : public levelset::HeightRows {
 public:
  MadeRows(HeightField grid, bool isNorthFirst, Heights heights)
      : grid_(std::move(grid)), isNorthFirst_(isNorthFirst), heights_(std::move(heights)) {}
  const HeightField& grid() const override { return grid_; }
  bool isNorthFirst() const override { return isNorthFirst_; }
  bool next(std::span<float> heights) override {
    const int row = isNorthFirst_ ? grid_.rows - 1 - row_ : row_;
    ++row_;
    return heights_(row, heights);
  }

 private:
  HeightField grid_;
  bool isNorthFirst_;
  Heights heights_;
  int row_ = 0;
};

/// Rows of a field, from the north.
auto northernRows(const HeightField& field) {
  HeightField grid = field;
  grid.heights.clear();
  return MadeRows(std::move(grid), true, [&field](int row, std::span<float> heights) {
    std::copy_n(field.heights.begin() + static_cast<std::ptrdiff_t>(field.index(0, row)),
                heights.size(), heights.begin());
    return true;
  });
}

/// Hills with noise. @param missing  share of single samples without data
HeightField hills(int columns, int rows, double missing = 0) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  HeightField field = support::terrainOf(columns, rows, {10, 20}, [&](double x, double y) {
    return unit(random) < missing ? static_cast<double>(kMissingHeight)
                                  : 90 * std::sin(x / 170) * std::cos(y / 290) + 4 * unit(random);
  });
  field.coordinateSystem = "ETRS89 / UTM zone 32N";
  return field;
}

std::uint32_t bitsOf(float height) {
  return std::bit_cast<std::uint32_t>(std::isnan(height) ? kMissingHeight : height);
}

void expectSamePatch(const PyramidPatch& a, const PyramidPatch& b) {
  EXPECT_EQ(bitsOf(a.lowest), bitsOf(b.lowest));
  EXPECT_EQ(bitsOf(a.highest), bitsOf(b.highest));
  EXPECT_EQ(bitsOf(a.error), bitsOf(b.error));
  EXPECT_EQ(bitsOf(a.bound), bitsOf(b.bound));
}

void expectSamePyramid(const HeightPyramid& a, const HeightPyramid& b) {
  EXPECT_EQ(a.cells, b.cells);
  ASSERT_EQ(a.levels.size(), b.levels.size());
  for (std::size_t n = 0; n < a.levels.size(); ++n) {
    SCOPED_TRACE(n);
    ASSERT_EQ(a.levels[n].columns, b.levels[n].columns);
    ASSERT_EQ(a.levels[n].rows, b.levels[n].rows);
    for (std::size_t k = 0; k < a.levels[n].patches.size(); ++k) {
      expectSamePatch(a.levels[n].patches[k], b.levels[n].patches[k]);
      if (testing::Test::HasFailure()) return;
    }
  }
}

void expectSamePatches(const PatchStore& a, const PatchStore& b) {
  const HeightPyramid& pyramid = a.layout().pyramid;
  const auto side = static_cast<std::size_t>(pyramid.cells) + 1;
  std::vector<float> first(side * side), second(side * side);
  for (std::size_t n = 0; n < pyramid.levels.size(); ++n)
    for (int row = 0; row < pyramid.levels[n].rows; ++row)
      for (int column = 0; column < pyramid.levels[n].columns; ++column) {
        a.readPatch(static_cast<int>(n), column, row, first);
        b.readPatch(static_cast<int>(n), column, row, second);
        for (std::size_t k = 0; k < first.size(); ++k)
          ASSERT_EQ(bitsOf(first[k]), bitsOf(second[k])) << n << " " << column << "," << row;
      }
}

/// Store in memory of what a tiled file should have.
std::unique_ptr<PatchStore> storeOf(const HeightField& field, int cells) {
  return levelset::patchStoreOf(std::make_shared<HeightField>(field),
                                heightPyramid(field, {.cells = cells}));
}

class TiledGround : public ::testing::Test {
 protected:
  void expectRoundTrip(const HeightField& field, int cells) {
    SCOPED_TRACE(std::to_string(field.columns) + "x" + std::to_string(field.rows));
    writeTiledGround(folder_ / "a.lst", field, {.cells = cells});
    const auto tiles = openTiledGround(folder_ / "a.lst");
    EXPECT_EQ(tiles->layout().columns, field.columns);
    EXPECT_EQ(tiles->layout().rows, field.rows);
    EXPECT_EQ(tiles->layout().origin, field.origin);
    EXPECT_EQ(tiles->layout().spacing, field.spacing);
    EXPECT_EQ(tiles->layout().coordinateSystem, field.coordinateSystem);
    EXPECT_EQ(tiles->layout().isGeographic, field.isGeographic);
    const auto expected = storeOf(field, cells);
    expectSamePyramid(tiles->layout().pyramid, expected->layout().pyramid);
    expectSamePatches(*tiles, *expected);
    auto rows = northernRows(field);
    writeTiledGround(folder_ / "b.lst", rows, {.cells = cells});
    const auto other = openTiledGround(folder_ / "b.lst");
    expectSamePyramid(other->layout().pyramid, expected->layout().pyramid);
    expectSamePatches(*other, *expected);
  }
  support::TemporaryFolder folder_;
};

TEST_F(TiledGround, HasTheBitsOfTheGroundAndItsPyramid) {
  const int sizes[][3] = {{65, 65, 64}, {2, 2, 64},    {2, 90, 16},  {129, 100, 16},  {67, 131, 8},
                          {66, 34, 4},  {130, 257, 4}, {200, 3, 32}, {100, 100, 128}, {33, 33, 2}};
  for (const auto& [columns, rows, cells] : sizes) {
    expectRoundTrip(hills(columns, rows), cells);
    expectRoundTrip(hills(columns, rows, 0.002), cells);
  }
}

TEST_F(TiledGround, KeepsSpecialHeights) {
  HeightField field = hills(100, 70);
  for (std::size_t n = 0; n < field.heights.size(); ++n) {
    float& height = field.heights[n];
    if (n % 100 < 40) height = std::round(height);
    if (n / 100 < 20) height = n % 3 == 0 ? -0.F : 0.F;
    if (n / 100 > 40 && n % 100 > 30) height = kMissingHeight;
  }
  field.isGeographic = true;
  field.coordinateSystem = "WGS 84";
  expectRoundTrip(field, 16);
  field.heights.assign(field.heights.size(), kMissingHeight);
  expectRoundTrip(field, 16);
  // A patch of a coarser level has no known sample, but its ground has.
  field.heights[field.index(33, 33)] = 7;
  expectRoundTrip(field, 8);
  std::mt19937 random(2);
  for (float& height : field.heights) {
    height = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    if (!(std::abs(height) < 1e37F)) height = kMissingHeight;
  }
  expectRoundTrip(field, 16);
}

TEST_F(TiledGround, IsTheSameFileForAnyNumberOfThreads) {
  const HeightField field = hills(300, 200, 0.001);
  const auto bytes = [&] {
    writeTiledGround(folder_ / "a.lst", field, {.cells = 16, .tolerance = 0.1});
    return support::readText(folder_ / "a.lst");
  };
  EXPECT_EQ(support::onThreads(1, bytes), support::onThreads(4, bytes));
  EXPECT_EQ(folder_.fileCount(), 1u);
}

/// Heights, borders and bounds of a file with a tolerance.
TEST_F(TiledGround, KeepsTheTolerance) {
  HeightField field = hills(210, 150, 0.0005);
  field.heights[5] = 3e7F;  // farther from its neighbouring floats than the tolerance
  const double tolerance = 0.25;
  writeTiledGround(folder_ / "a.lst", field, {.cells = 16, .tolerance = tolerance});
  EXPECT_EQ(levelset::tiledGroundInfo(folder_ / "a.lst").tolerance, tolerance);
  const auto tiles = openTiledGround(folder_ / "a.lst");
  const HeightPyramid& pyramid = tiles->layout().pyramid;
  HeightField stored = field;
  stored.heights.assign(stored.heights.size(), -1e9F);
  std::vector<float> heights(17 * 17);
  double largest = 0;
  for (int row = 0; row < pyramid.levels[0].rows; ++row)
    for (int column = 0; column < pyramid.levels[0].columns; ++column) {
      tiles->readPatch(0, column, row, heights);
      for (int j = 0; j <= 16 && row * 16 + j < field.rows; ++j)
        for (int i = 0; i <= 16 && column * 16 + i < field.columns; ++i) {
          float& height = stored.heights[stored.index(column * 16 + i, row * 16 + j)];
          const float read = heights[static_cast<std::size_t>(j * 17 + i)];
          if (height != -1e9F) {
            EXPECT_EQ(bitsOf(height), bitsOf(read));  // a border of two patches
          }
          height = read;
        }
    }
  for (std::size_t n = 0; n < field.heights.size(); ++n) {
    EXPECT_EQ(std::isnan(stored.heights[n]), std::isnan(field.heights[n]));
    if (!std::isnan(field.heights[n]))
      largest = std::max(largest, std::abs(static_cast<double>(stored.heights[n]) -
                                           static_cast<double>(field.heights[n])));
  }
  EXPECT_LE(largest, tolerance);
  EXPECT_GT(largest, 0.9 * tolerance);
  // Errors are those of the stored ground and the tolerance, so they bound those of the true one.
  const HeightPyramid truth = heightPyramid(field, {.cells = 16}),
                      ofStored = heightPyramid(stored, {.cells = 16});
  expectSamePatches(*tiles, *storeOf(stored, 16));
  for (std::size_t n = 0; n < pyramid.levels.size(); ++n)
    for (std::size_t k = 0; k < pyramid.levels[n].patches.size(); ++k) {
      const PyramidPatch& patch = pyramid.levels[n].patches[k];
      const PyramidPatch& own = ofStored.levels[n].patches[k];
      EXPECT_EQ(bitsOf(patch.lowest), bitsOf(own.lowest));
      EXPECT_EQ(bitsOf(patch.highest), bitsOf(own.highest));
      // Both are rounded up to floats.
      EXPECT_GE(patch.error, (own.error + tolerance) * (1 - 2e-7));
      EXPECT_LE(patch.error, (own.error + tolerance) * (1 + 2e-7));
      EXPECT_GE(patch.bound, patch.error);
      // The coarse corners are those of the stored ground: up to one tolerance higher or lower.
      EXPECT_LE(truth.levels[n].patches[k].error, patch.error + tolerance);
    }
  EXPECT_LT(std::filesystem::file_size(folder_ / "a.lst"), 210 * 150 * 2u);
}

/// A terrain of 65,536² samples with data in ten places takes the bytes of these.
TEST_F(TiledGround, StoresSparseGroundsOfAnySize) {
  HeightField grid{.columns = 65536, .rows = 65536};
  const auto made = [](int row, std::span<float> heights) {
    if (row % 6553 != 5000) return false;
    std::fill(heights.begin(), heights.end(), kMissingHeight);
    for (int n = 0; n < 5; ++n) heights[static_cast<std::size_t>(row + n)] = static_cast<float>(n);
    return true;
  };
  MadeRows rows(grid, false, made);
  const std::size_t before = levelset::residentBytes();
  writeTiledGround(folder_ / "a.lst", rows);
  EXPECT_LT(std::filesystem::file_size(folder_ / "a.lst"), 8192u);
  const auto tiles = openTiledGround(folder_ / "a.lst");
  // The pyramid has 1.4 million patches of 16 bytes. 20 MB were measured.
  EXPECT_LT(static_cast<double>(levelset::residentBytes()) - static_cast<double>(before), 60e6);
  std::vector<float> heights(65 * 65);
  tiles->readPatch(0, 5000 / 64, 5000 / 64, heights);
  EXPECT_EQ(heights[(5000 % 64) * 65 + 5000 % 64 + 3], 3);
  EXPECT_TRUE(std::isnan(heights[0]));
  tiles->readPatch(0, 3, 4, heights);
  EXPECT_TRUE(std::isnan(heights[17]));
  const levelset::TiledGroundInfo info = levelset::tiledGroundInfo(folder_ / "a.lst");
  EXPECT_EQ(info.levels[0].patches, 1u << 20);
  EXPECT_EQ(info.levels[0].known, 10u);
  EXPECT_EQ(info.layout.pyramid.levels.back().patches[0].highest, 4);
  EXPECT_EQ(info.layout.pyramid.levels.back().patches[0].error, HUGE_VALF);
  EXPECT_SAYS(refusal<levelset::ResourceLimit>(
                  [&] { static_cast<void>(openTiledGround(folder_ / "a.lst", 1'000'000)); }),
              "memory");
}

TEST_F(TiledGround, RefusesOtherGroundsAndOptions) {
  const auto refusedFor = [&]<typename ErrorT>(ErrorT*, const HeightField& field,
                                               const levelset::WriteTilesOptions& options) {
    const std::string told =
        refusal<ErrorT>([&] { writeTiledGround(folder_ / "a.lst", field, options); });
    EXPECT_EQ(folder_.fileCount(), 0u);
    return told;
  };
  levelset::UsageError* usage = nullptr;
  InvalidInput* input = nullptr;
  for (const int cells : {0, 1, 3, 256})
    EXPECT_SAYS(refusedFor(usage, hills(9, 9), {.cells = cells}), "power of two");
  for (const double tolerance : {-1., HUGE_VAL, std::nan("")})
    EXPECT_SAYS(refusedFor(usage, hills(9, 9), {.tolerance = tolerance}), "tolerance");
  EXPECT_SAYS(refusedFor(input, hills(1, 9), {}), "1x9");
  EXPECT_SAYS(refusedFor(input, hills(9, 1), {}), "9x1");
  HeightField field = hills(9, 9);
  field.heights[3] = HUGE_VALF;
  EXPECT_SAYS(refusedFor(input, field, {}), "infinite");
  levelset::ResourceLimit* resource = nullptr;
  EXPECT_SAYS(refusedFor(resource, hills(500, 500), {.cells = 2, .maxMemory = 500'000}), "memory");
  levelset::Cancelled* cancelled = nullptr;
  EXPECT_SAYS(refusedFor(cancelled, hills(99, 99), {.progress = [](double f) { return f < 0.5; }}),
              "");
  EXPECT_SAYS(refusal<levelset::IoError>(
                  [&] { writeTiledGround(folder_ / "none" / "a.lst", hills(9, 9)); }),
              "no folder");
}

/// A process that is killed while it writes leaves no file under the name, and an old file as it
/// was. 6 MB of its temporary file are on the disk then.
TEST_F(TiledGround, IsUnchangedWhenTheWriterIsKilled) {
  writeTiledGround(folder_ / "old.lst", hills(40, 40));
  const std::string before = support::readText(folder_ / "old.lst");
  for (const char* name : {"old.lst", "new.lst"}) {
    const pid_t child = ::fork();
    if (child == 0) {
      HeightField grid{.columns = 2000, .rows = 1000};
      std::mt19937 random(1);
      MadeRows rows(grid, false, [&](int row, std::span<float> heights) {
        for (float& height : heights) height = static_cast<float>(random());
        if (row == 900) ::kill(::getpid(), SIGKILL);
        return true;
      });
      writeTiledGround(folder_ / name, rows, {.cells = 128});
      ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status));
  }
  EXPECT_EQ(support::readText(folder_ / "old.lst"), before);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "new.lst"));
}

// === Damaged files

/// Reads all patches. @return false if the file is refused
bool readsCompletely(const std::filesystem::path& file) {
  try {
    const auto tiles = openTiledGround(file, std::size_t{64} << 20);
    const HeightPyramid& pyramid = tiles->layout().pyramid;
    std::vector<float> heights(static_cast<std::size_t>((pyramid.cells + 1) * (pyramid.cells + 1)));
    for (std::size_t n = 0; n < pyramid.levels.size(); ++n)
      for (int row = 0; row < pyramid.levels[n].rows && row < 20; ++row)
        for (int column = 0; column < pyramid.levels[n].columns && column < 20; ++column)
          tiles->readPatch(static_cast<int>(n), column, row, heights);
    return true;
  } catch (const levelset::Error& error) {
    EXPECT_FALSE(std::string(error.what()).empty());
    return false;
  }
}

TEST_F(TiledGround, RefusesDamagedFiles) {
  writeTiledGround(folder_ / "a.lst", hills(100, 90, 0.01), {.cells = 16, .tolerance = 0.5});
  const std::string whole = support::readText(folder_ / "a.lst");
  const auto refused = [&](const std::string& bytes) {
    support::writeText(folder_ / "b.lst", bytes);
    return refusal<InvalidInput>([&] { static_cast<void>(openTiledGround(folder_ / "b.lst")); });
  };
  const auto with = [&](std::size_t at, char byte) {
    std::string bytes = whole;
    bytes[at] = byte;
    return bytes;
  };
  EXPECT_SAYS(refused("ncols 3\n"), "no tiled terrain");
  EXPECT_SAYS(refused(""), "empty");
  EXPECT_SAYS(refused(whole.substr(0, 5)), "ends in its header");
  EXPECT_SAYS(refused(whole.substr(0, 130)), "ends in its header");
  EXPECT_SAYS(refused(whole.substr(0, whole.size() - 1)), "bytes of");
  EXPECT_SAYS(refused(whole + "x"), "bytes of");
  EXPECT_SAYS(refused(with(8, 2)), "has version 2, but this program reads version 1");
  EXPECT_SAYS(refused(with(12, 3)), "the header is damaged");
  EXPECT_SAYS(refused(with(130, 'x')), "the header is damaged");  // the coordinate system
  EXPECT_SAYS(refused(with(whole.size() - 9, '\x55')), "the index is damaged");
  EXPECT_SAYS(
      refusal<levelset::IoError>([&] { static_cast<void>(openTiledGround(folder_ / "none.lst")); }),
      "none.lst");
  // A damaged patch does not hinder the others.
  support::writeText(folder_ / "b.lst", with(200, static_cast<char>(whole[200] ^ 1)));
  const auto tiles = openTiledGround(folder_ / "b.lst");
  std::vector<float> heights(17 * 17);
  EXPECT_SAYS(refusal<InvalidInput>([&] { tiles->readPatch(0, 0, 0, heights); }),
              "patch 0,0 of level 0 is damaged, as its checksum differs");
  EXPECT_NO_THROW(tiles->readPatch(0, 1, 0, heights));
  EXPECT_SAYS(refusal<levelset::UsageError>([&] { tiles->readPatch(0, 7, 0, heights); }),
              "no patch 7,0");
  EXPECT_SAYS(refusal<levelset::UsageError>([&] { tiles->readPatch(9, 0, 0, heights); }),
              "level 9");
  heights.resize(3);
  EXPECT_SAYS(refusal<levelset::UsageError>([&] { tiles->readPatch(0, 0, 0, heights); }), "289");
}

TEST_F(TiledGround, RefusesMutatedFiles) {
  writeTiledGround(folder_ / "a.lst", hills(60, 50, 0.01), {.cells = 16});
  const std::string whole = support::readText(folder_ / "a.lst");
  std::mt19937 random(8);
  int read = 0;
  for (int n = 0; n < 300; ++n) {
    const std::string bytes = support::mutated(whole, random);
    if (bytes == whole) continue;
    support::writeText(folder_ / "b.lst", bytes);
    read += readsCompletely(folder_ / "b.lst") ? 1 : 0;
  }
  EXPECT_EQ(read, 0);
}

/// Mutated headers and indices with right checksums: they are read or refused.
TEST_F(TiledGround, ReadsOrRefusesForgedFiles) {
  writeTiledGround(folder_ / "a.lst", hills(60, 50, 0.01), {.cells = 16});
  const std::string whole = support::readText(folder_ / "a.lst");
  const levelset::terrain::TileHeader header = levelset::terrain::parseTileHeader(whole);
  const levelset::Bytes index = levelset::decompress(
      std::string_view(whole).substr(header.indexOffset), "index", header.indexLength);
  const std::string before = whole.substr(0, header.indexOffset);
  std::mt19937 random(8);
  int read = 0;
  for (int n = 0; n < 300; ++n) {
    std::string forged(index.view());
    if (n % 3 != 0) forged = support::mutated(forged, random);
    const std::string compressed = levelset::terrain::deflated(forged);
    levelset::terrain::TileHeader other = header;
    other.indexBytes = compressed.size();
    other.indexLength = forged.size();
    other.indexChecksum = levelset::terrain::checksumOf(compressed);
    other.fileBytes = before.size() + compressed.size();
    const std::string first = levelset::terrain::tileHeaderBytes(other);
    std::string bytes = before + compressed;
    bytes.replace(0, first.size(), first);
    if (n % 3 == 0) {
      bytes[12 + random() % 108] = static_cast<char>(random());
      std::string covered = bytes.substr(0, 120) + first.substr(128);
      const std::uint64_t checksum = levelset::terrain::checksumOf(covered);
      for (std::size_t k = 0; k < 8; ++k)
        bytes[120 + k] = static_cast<char>(checksum >> 8 * k & 0xff);
    }
    support::writeText(folder_ / "b.lst", bytes);
    read += readsCompletely(folder_ / "b.lst") ? 1 : 0;
  }
  // 50 are read: they have another place or another range.
  EXPECT_GT(read, 17);
  EXPECT_LT(read, 150);
}

// === Large grounds

/// Largest memory of this process so far, bytes.
double peakMemory() {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line))
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) * 1024;
  return 0;
}

/// A ground of 16385x4097 samples takes 269 MB in memory, and is written with 60.
TEST(SlowTiledGround, IsWrittenWithBoundedMemory) {
  const support::TemporaryFolder folder;
  HeightField grid{.columns = 16385, .rows = 4097};
  const auto heightAt = [](int column, int row) {
    return static_cast<float>(
        std::nearbyint(400 * std::sin(column * 0.001) * std::cos(row * 0.0013) +
                       7 * std::sin(column * 0.31 + row)));
  };
  MadeRows rows(grid, true, [&](int row, std::span<float> heights) {
    for (int column = 0; column < 16385; ++column)
      heights[static_cast<std::size_t>(column)] = heightAt(column, row);
    return true;
  });
  const double before = peakMemory();
  writeTiledGround(folder / "a.lst", rows, {.maxMemory = std::size_t{200} << 20});
  EXPECT_LT(peakMemory() - before, 60e6);
  const auto tiles = openTiledGround(folder / "a.lst");
  std::vector<float> heights(65 * 65);
  for (int level = 0; level <= 6; ++level) {
    const int last = tiles->layout().pyramid.levels[static_cast<std::size_t>(level)].columns - 1,
              middle = tiles->layout().pyramid.levels[static_cast<std::size_t>(level)].rows / 2;
    tiles->readPatch(level, last, middle, heights);
    for (int j = 0; j <= 64; ++j)
      for (int i = 0; i <= 64; ++i)
        ASSERT_EQ(heights[static_cast<std::size_t>(j * 65 + i)],
                  heightAt((last * 64 + i) << level, (middle * 64 + j) << level));
  }
  EXPECT_LT(peakMemory() - before, 60e6);
}

}  // namespace tiled_ground_test
