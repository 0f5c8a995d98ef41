#include "levelset/segmented/local/block_surroundings.h"

namespace levelset {

void BlockSurroundings::findPalette() {
  palette_.clear();
  Owner last = at(0, 0, 0);
  palette_.push_back(last);
  for (int x = -kReach; x < 8 + kReach; ++x)
    for (int y = -kReach; y < 8 + kReach; ++y)
      for (int z = -kReach; z < 8 + kReach; ++z) {
        const Owner owner = at(x, y, z);
        if (owner == last) continue;
        last = owner;
        if (std::find(palette_.begin(), palette_.end(), owner) == palette_.end())
          palette_.push_back(owner);
      }
  std::sort(palette_.begin(), palette_.end());
}

std::array<std::uint32_t, 512> BlockSurroundings::dilated(int reach) const {
  // Unites the bits along z, y and x in turn. Lines along z stay together, so the loops vectorise.
  constexpr int kFrom = -kReach, kCount = 8 + 2 * kReach;
  static thread_local std::array<std::uint32_t, kCount * kCount * 8> alongZ;
  static thread_local std::array<std::uint32_t, kCount * 8 * 8> alongY;
  Owner last = palette_[0];
  std::uint32_t bit = 1;
  for (int x = 0; x < kCount; ++x)
    for (int y = 0; y < kCount; ++y) {
      std::array<std::uint32_t, kCount> bits;
      for (int z = 0; z < kCount; ++z) {
        const Owner owner = at(x + kFrom, y + kFrom, z + kFrom);
        if (owner != last) {
          last = owner;
          bit =
              1u << (std::lower_bound(palette_.begin(), palette_.end(), owner) - palette_.begin());
        }
        bits[static_cast<std::size_t>(z)] = bit;
      }
      std::uint32_t* out = &alongZ[static_cast<std::size_t>((x * kCount + y) * 8)];
      for (int z = 0; z < 8; ++z) {
        std::uint32_t sum = 0;
        for (int d = -reach; d <= reach; ++d) sum |= bits[static_cast<std::size_t>(z + d - kFrom)];
        out[z] = sum;
      }
    }
  for (int x = 0; x < kCount; ++x)
    for (int y = 0; y < 8; ++y) {
      std::uint32_t* out = &alongY[static_cast<std::size_t>((x * 8 + y) * 8)];
      for (int z = 0; z < 8; ++z) out[z] = 0;
      for (int d = -reach; d <= reach; ++d) {
        const std::uint32_t* in =
            &alongZ[static_cast<std::size_t>((x * kCount + y + d - kFrom) * 8)];
        for (int z = 0; z < 8; ++z) out[z] |= in[z];
      }
    }
  std::array<std::uint32_t, 512> result{};
  for (int x = 0; x < 8; ++x)
    for (int d = -reach; d <= reach; ++d) {
      const std::uint32_t* in = &alongY[static_cast<std::size_t>((x + d - kFrom) * 64)];
      std::uint32_t* out = &result[static_cast<std::size_t>(x * 64)];
      for (int n = 0; n < 64; ++n) out[n] |= in[n];
    }
  return result;
}

void BlockSurroundings::findNeighbours() {
  if (palette_.size() > kBits) return;
  masks_[0] = dilated(1);
  masks_[1] = dilated(2);
}

void BlockSurroundings::others(std::uint32_t n, Owner own, int reach,
                               std::vector<Owner>& result) const {
  result.clear();
  if (palette_.size() <= kBits) {
    std::uint32_t mask = masks_[static_cast<std::size_t>(reach - 1)][n];
    for (std::size_t i = 0; mask; ++i, mask >>= 1)
      if ((mask & 1) && palette_[i] != own) result.push_back(palette_[i]);
    return;
  }
  const int x0 = static_cast<int>(n >> 6), y0 = static_cast<int>(n >> 3 & 7),
            z0 = static_cast<int>(n & 7);
  for (int x = x0 - reach; x <= x0 + reach; ++x)
    for (int y = y0 - reach; y <= y0 + reach; ++y)
      for (int z = z0 - reach; z <= z0 + reach; ++z) {
        const Owner owner = at(x, y, z);
        if (owner != own && std::find(result.begin(), result.end(), owner) == result.end())
          result.push_back(owner);
      }
  std::sort(result.begin(), result.end());
}

}  // namespace levelset
