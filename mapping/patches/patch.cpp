#include "mapping/patches/patch.h"

namespace mapping {

std::size_t Patch::particleCount() const {
  std::size_t count = 0;
  for (const ParticleLayer& layer : layers) count += layer.positions.size() + layer.rim.size();
  return count;
}

double meanSpacing(const Patch& patch) {
  double sum = 0, count = 0;
  for (const ParticleLayer& layer : patch.layers)
    for (std::size_t j = 0; j < layer.rows; ++j)
      for (std::size_t i = 0; i < layer.columns; ++i) {
        if (i > 0) sum += (layer.at(i, j) - layer.at(i - 1, j)).length(), ++count;
        if (j > 0) sum += (layer.at(i, j) - layer.at(i, j - 1)).length(), ++count;
      }
  return sum / count;
}

}  // namespace mapping
