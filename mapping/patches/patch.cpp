#include "mapping/patches/patch.h"

namespace mapping {

std::size_t Patch::particleCount() const {
  std::size_t count = 0;
  for (const ParticleLevel& level : levels) count += level.positions.size() + level.rim.size();
  return count;
}

double meanSpacing(const Patch& patch) {
  double sum = 0, count = 0;
  for (const ParticleLevel& level : patch.levels)
    for (std::size_t j = 0; j < level.rows; ++j)
      for (std::size_t i = 0; i < level.columns; ++i) {
        if (i > 0) sum += (level.at(i, j) - level.at(i - 1, j)).length(), ++count;
        if (j > 0) sum += (level.at(i, j) - level.at(i, j - 1)).length(), ++count;
      }
  return sum / count;
}

}  // namespace mapping
