#include "mapping/layers/layer_resampling.h"

#include <algorithm>
#include <cmath>

namespace mapping {
namespace {

using Imath::V3d;

/// Interpolates a row of positions at x = 0 … count − 1 (Catmull-Rom); extrapolates linearly beyond
/// its ends.
template <typename At>
V3d along(const At& at, std::size_t count, double x) {
  const double last = static_cast<double>(count - 1);
  if (x < 0) return at(0) + (at(1) - at(0)) * x;
  if (x > last) return at(count - 1) + (at(count - 1) - at(count - 2)) * (x - last);
  const double cell = std::min(std::floor(x), last - 1);
  const auto i = static_cast<std::size_t>(cell);
  const double f = x - cell;
  const V3d b = at(i), c = at(i + 1);
  // Continues the row at either end by the parabola through its three outermost positions, or
  // linearly if it has only two.
  const auto beyond = [&](const V3d& end, const V3d& next, std::size_t third) {
    return count > 2 ? (end - next) * 3.0 + at(third) : end * 2.0 - next;
  };
  const V3d a = i > 0 ? at(i - 1) : beyond(b, c, 2),
            d = i + 2 < count ? at(i + 2) : beyond(c, b, count - 3);
  return b + (c - a) * (0.5 * f) + (a * 2.0 - b * 5.0 + c * 4.0 - d) * (0.5 * f * f) +
         (b * 3.0 - a - c * 3.0 + d) * (0.5 * f * f * f);
}

V3d positionAt(const ParticleLayer& layer, double x, double y) {
  const auto row = [&](std::size_t j) {
    return along([&](std::size_t i) { return layer.at(i, j); }, layer.columns, x);
  };
  return along(row, layer.rows, y);
}

/// Turns the rim into ordinary rows and columns, which shifts the index of each particle by one
/// along both axes.
ParticleLayer withRimInside(const ParticleLayer& layer) {
  ParticleLayer wide;
  wide.columns = layer.columns + 2;
  wide.rows = layer.rows + 2;
  for (int j = -1; j <= static_cast<int>(layer.rows); ++j)
    for (int i = -1; i <= static_cast<int>(layer.columns); ++i)
      wide.positions.push_back(layer.beyond(i, j));
  return wide;
}

}  // namespace

ParticleLayer withCounts(const ParticleLayer& layer, std::size_t columns, std::size_t rows) {
  if (layer.columns == columns && layer.rows == rows) return layer;
  ParticleLayer result{.columns = columns,
                       .rows = rows,
                       .w = layer.w,
                       .height = layer.height,
                       .positions = {},
                       .rim = {}};
  const auto stride = [](std::size_t from, std::size_t to) {
    return static_cast<double>(from - 1) / static_cast<double>(to - 1);
  };
  const double across = stride(layer.columns, columns), up = stride(layer.rows, rows);
  if (!layer.hasRim()) {
    for (std::size_t j = 0; j < rows; ++j)
      for (std::size_t i = 0; i < columns; ++i)
        result.positions.push_back(
            positionAt(layer, static_cast<double>(i) * across, static_cast<double>(j) * up));
    return result;
  }
  const ParticleLayer wide = withRimInside(layer);
  const auto place = [&](int i, int j) { return positionAt(wide, 1 + i * across, 1 + j * up); };
  result.rim.resize(2 * (columns + rows) + 4);
  const auto right = static_cast<int>(columns), top = static_cast<int>(rows);
  for (int j = -1; j <= top; ++j)
    for (int i = -1; i <= right; ++i) {
      const bool isInside = i >= 0 && i < right && j >= 0 && j < top;
      if (isInside)
        result.positions.push_back(place(i, j));
      else
        result.rim[result.rimIndex(i, j)] = place(i, j);
    }
  return result;
}

std::vector<EmbeddedParticle> embeddedParticles(const Patch& patch, double embedDepth) {
  // Least distance between neighbouring columns, as a share of their distance on the outermost
  // layer. Where columns come closer, no embedded particle is added.
  constexpr double kLeastShare = 0.25;
  // Largest distance of embedded layers, in layer spacings of the patch.
  constexpr double kWidest = 1.1;
  std::vector<EmbeddedParticle> particles;
  if (embedDepth == 0 || patch.layers.size() < 2) return particles;
  const bool isBelow = embedDepth > 0;
  const ParticleLayer& last = isBelow ? patch.layers.front() : patch.layers.back();
  const ParticleLayer before =
      withCounts(isBelow ? patch.layers[1] : *(patch.layers.end() - 2), last.columns, last.rows);
  const int rim = last.hasRim() && before.hasRim() ? 1 : 0;
  const auto right = static_cast<int>(last.columns), top = static_cast<int>(last.rows);
  const auto isThere = [&](int i, int j) {
    return i >= -rim && i < right + rim && j >= -rim && j < top + rim;
  };
  const double step = std::abs(last.w - before.w);
  // A smooth map has its largest errors beside its last particles. So particles continue deeper
  // than the texture, by the same depth again or by one layer spacing, whichever is less. Columns
  // are straight there, so embedded layers may be kWidest spacings apart, or further where `most`
  // limits their number.
  const double reach = std::abs(embedDepth) + std::min(std::abs(embedDepth), step);
  const double most = 2.0 * static_cast<double>(patch.layers.size());
  const auto layers = static_cast<int>(std::min(most, std::ceil(reach / (kWidest * step))));
  for (int n = 1; n <= layers; ++n) {
    const double depth = reach * n / layers, share = depth / step;
    const auto keepsApart = [&](int i, int j, int u, int v) {
      if (!isThere(u, v)) return true;
      const V3d offset = last.beyond(u, v) - last.beyond(i, j);
      const V3d turn = offset - (before.beyond(u, v) - before.beyond(i, j));
      return (offset + turn * share).dot(offset) >= kLeastShare * offset.length2();
    };
    for (int j = -rim; j < top + rim; ++j)
      for (int i = -rim; i < right + rim; ++i) {
        if (!keepsApart(i, j, i - 1, j) || !keepsApart(i, j, i + 1, j) ||
            !keepsApart(i, j, i, j - 1) || !keepsApart(i, j, i, j + 1))
          continue;
        const V3d place = last.beyond(i, j);
        particles.push_back(
            {place + (place - before.beyond(i, j)) * share,
             {static_cast<double>(i) / (right - 1), static_cast<double>(j) / (top - 1),
              last.w + (isBelow ? -depth : depth)}});
      }
  }
  return particles;
}

}  // namespace mapping
