// Time to sculpt a dab, with the pyramid, and to undo it, by size of the terrain.
//   terrain_sculpt_bench [SIZE…]     samples along a side: 1025 4097 16385
// The brush has 64 samples across. Prints the mean and the largest time of 200 dabs, ms, and the
// time to build the pyramid.

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "levelset/terrain/sculpt/sculpted_ground.h"

namespace {

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

levelset::HeightField waves(int size) {
  levelset::HeightField field{.columns = size, .rows = size};
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < size; ++column)
      field.heights.push_back(
          static_cast<float>(100 * std::sin(column / 137.0) * std::cos(row / 111.0) +
                             3 * std::sin(column * 0.7 + row * 0.3)));
  return field;
}

void run(int size) {
  levelset::HeightField field = waves(size);
  const double begin = seconds();
  levelset::SculptedGround ground(std::move(field));
  const double build = seconds() - begin;
  std::mt19937 random(1);
  std::vector<double> dabs, undos;
  for (int n = 0; n < 200; ++n) {
    const auto place = [&] { return static_cast<double>(random() % static_cast<unsigned>(size)); };
    ground.beginStroke();
    const double start = seconds();
    ground.apply({.center = {place(), place()}, .radius = 32, .strength = 1});
    const double middle = seconds();
    ground.undo();
    dabs.push_back(1e3 * (middle - start));
    undos.push_back(1e3 * (seconds() - middle));
  }
  const auto mean = [](const std::vector<double>& times) {
    double sum = 0;
    for (const double time : times) sum += time;
    return sum / static_cast<double>(times.size());
  };
  fmt::print("{:>6} {:>9.2f} {:>9.2f} {:>9.2f} {:>9.2f} {:>9.2f}\n", size, build, mean(dabs),
             *std::max_element(dabs.begin(), dabs.end()), mean(undos),
             *std::max_element(undos.begin(), undos.end()));
}

}  // namespace

int main(int count, char** words) {
  std::vector<int> sizes;
  for (int n = 1; n < count; ++n) sizes.push_back(std::atoi(words[n]));
  if (sizes.empty()) sizes = {1025, 4097, 16385};
  fmt::print("{:>6} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "size", "build, s", "dab, ms", "most",
             "undo, ms", "most");
  for (const int size : sizes) run(size);
}
