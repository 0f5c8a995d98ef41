#pragma once

// Fractal grounds, and sources of patches that are slow or fail.

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <utility>

#include "levelset/error.h"
#include "levelset/terrain/tiles/patch_store.h"

namespace support {

/// Number from -1 to 1 that depends on the place and the seed alone.
inline double noiseAt(std::uint32_t column, std::uint32_t row, std::uint32_t seed) {
  std::uint64_t x = (std::uint64_t{column} << 32 | row) + 0x9E3779B97F4A7C15ull * (seed + 1);
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ x >> 27) * 0x94D049BB133111EBull;
  x ^= x >> 31;
  return static_cast<double>(x >> 11) * 0x1p-52 - 1;
}

/// Ground by midpoint displacement: new samples of a stride s are the mean of two or four samples,
/// plus noise of the size roughness × s^smoothness. With smoothness 1, all scales are as rough.
/// Real grounds have about 0.8. The size is 2^power + 1 samples.
template <typename ForRows>
levelset::HeightField fractalTerrain(int power, double roughness, std::uint32_t seed,
                                     const ForRows& forRows, double smoothness = 1) {
  const int last = 1 << power;
  levelset::HeightField field{.columns = last + 1, .rows = last + 1};
  field.heights.assign(static_cast<std::size_t>(last + 1) * static_cast<std::size_t>(last + 1), 0);
  for (int stride = last / 2; stride > 0; stride /= 2) {
    const double size = roughness * std::pow(stride, smoothness);
    const auto row = [&](int n) {
      const int j = n * stride, down = j % (2 * stride);
      for (int i = down == 0 ? stride : 0; i <= last; i += down == 0 ? 2 * stride : stride) {
        const int side = i % (2 * stride);
        const auto at = [&](int c, int r) { return static_cast<double>(field.at(c, r)); };
        const double mean = 0.25 * (at(i - side, j - down) + at(i + side, j - down) +
                                    at(i - side, j + down) + at(i + side, j + down));
        field.heights[field.index(i, j)] =
            static_cast<float>(mean + size * noiseAt(static_cast<std::uint32_t>(i),
                                                     static_cast<std::uint32_t>(j), seed));
      }
    };
    forRows(last / stride + 1, row);
  }
  return field;
}

inline levelset::HeightField fractalTerrain(int power, double roughness, std::uint32_t seed) {
  return fractalTerrain(power, roughness, seed, [](int rows, const auto& row) {
    for (int n = 0; n < rows; ++n) row(n);
  });
}

/// Keeps the first columns and rows of a field.
inline levelset::HeightField cutTerrain(const levelset::HeightField& field, int columns, int rows) {
  const Imath::V2d end = field.position(columns - 1, rows - 1);
  return levelset::croppedHeights(field, {{field.origin.x, field.origin.y, 0}, {end.x, end.y, 0}});
}

inline std::unique_ptr<levelset::PatchStore> storeOf(levelset::HeightField field, int cells) {
  auto shared = std::make_shared<levelset::HeightField>(std::move(field));
  return levelset::patchStoreOf(shared, levelset::heightPyramid(*shared, {.cells = cells}));
}

/// A source that calls a function before it reads a patch. The function may wait or throw.
class HookedStore final : public levelset::PatchStore {
 public:
  using Hook = std::function<void(int level, int column, int row)>;
  HookedStore(std::unique_ptr<levelset::PatchStore> store, Hook hook)
      : store_(std::move(store)), hook_(std::move(hook)) {}
  const levelset::GroundLayout& layout() const override { return store_->layout(); }
  void readPatch(int level, int column, int row, std::span<float> heights) const override {
    hook_(level, column, row);
    store_->readPatch(level, column, row, heights);
  }

 private:
  std::unique_ptr<levelset::PatchStore> store_;
  Hook hook_;
};

}  // namespace support
