#include "render/gpu/nano_grid.h"

#include <fmt/core.h>
#include <nanovdb/util/OpenToNanoVDB.h>

#include <cstddef>
#include <cstring>
#include <limits>

#include "levelset/error.h"
#include "levelset/vdb.h"

namespace render {
namespace {

using NanoRoot = nanovdb::RootData<nanovdb::NanoUpper<float>>;
using NanoUpperNode = nanovdb::NanoUpper<float>::DataType;
using NanoLowerNode = nanovdb::NanoLower<float>::DataType;
using NanoLeafNode = nanovdb::NanoLeaf<float>::DataType;

constexpr std::size_t kNanoWord = sizeof(float);

}  // namespace

std::string NanoGrid::layout() {
  return fmt::format(
      "const int kRootWords = {}, kTileWords = {}, kTileChild = {}, kTileValue = {};\n"
      "const int kUpperMask = {}, kUpperTable = {}, kLowerMask = {}, kLowerTable = {};\n"
      "const int kLeafValues = {};\n",
      sizeof(NanoRoot) / kNanoWord, sizeof(NanoRoot::Tile) / kNanoWord,
      offsetof(NanoRoot::Tile, child) / kNanoWord, offsetof(NanoRoot::Tile, value) / kNanoWord,
      offsetof(NanoUpperNode, mChildMask) / kNanoWord, offsetof(NanoUpperNode, mTable) / kNanoWord,
      offsetof(NanoLowerNode, mChildMask) / kNanoWord, offsetof(NanoLowerNode, mTable) / kNanoWord,
      offsetof(NanoLeafNode, mValues) / kNanoWord);
}

NanoGrid makeNanoGrid(const levelset::NarrowBand& band) {
  constexpr std::size_t kRow = 8;
  const auto handle = nanovdb::openToNanoVDB(levelset::vdb(band));
  const std::size_t count = handle.size() / kNanoWord;
  if (count + 2 * kRow > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw levelset::ResourceLimit(
        fmt::format("a NanoVDB grid of {} MB is too large for the shader's 32-bit index; draw with "
                    "--tables bricks (the default)",
                    handle.size() >> 20));
  NanoGrid grid;
  grid.words.resize(count);
  std::memcpy(grid.words.data(), handle.data(), count * kNanoWord);
  const auto* root = handle.grid<float>()->tree().root().data();
  grid.root = static_cast<int>((reinterpret_cast<const std::uint8_t*>(root) - handle.data()) /
                               static_cast<std::ptrdiff_t>(kNanoWord));
  grid.tiles = static_cast<int>(root->mTableSize);
  grid.far = static_cast<int>(count);
  const float background = levelset::vdb(band).background();
  grid.words.insert(grid.words.end(), kRow, background);
  grid.words.insert(grid.words.end(), kRow, -background);
  return grid;
}

}  // namespace render
