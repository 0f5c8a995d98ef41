#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "levelset/splines/type6_partition.h"

namespace levelset {

/// Weights of the 27 data around a cube in one Bernstein coefficient: weight / denominator. The
/// data are ordered like Type6Neighbourhood.
struct Type6Mask {
  int denominator = 1;
  std::array<int, 27> weights{};

  /// Sets a weight at data that are listed by their offsets along the axes of the frame: "10m" is
  /// the offset (1, 0, −1).
  [[nodiscard]] constexpr Type6Mask with(int weight, std::string_view offsets) const {
    Type6Mask mask = *this;
    for (std::size_t n = 0; n + 2 < offsets.size(); n += 4) {
      int index = 0;
      for (std::size_t d = 0; d < 3; ++d)
        index = 3 * index + (offsets[n + d] == 'm' ? 0 : offsets[n + d] - '0' + 1);
      mask.weights[index] = weight;
    }
    return mask;
  }
};

/// Returns the 27 data around a cube along the axes of a tetrahedron. The index is
/// 9 (x + 1) + 3 (y + 1) + (z + 1) for the offset (x, y, z) in the frame of the tetrahedron.
template <GridSample Sample>
std::array<SampleScalar<Sample>, 27> type6Neighbourhood(const Sample& sample,
                                                        const PartitionTetrahedron& t) {
  const Type6Partition::Frame frame = Type6Partition::frame(t.index);
  std::array<SampleScalar<Sample>, 27> data{};
  int n = 0;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const std::array<int, 3> o = frame.offset(x, y, z);
        data[n++] = sample(t.cell[0] + o[0], t.cell[1] + o[1], t.cell[2] + o[2]);
      }
  return data;
}

/// Returns the coefficients of a tetrahedron as the masks sum them.
template <int Degree, class Scalar, std::size_t Count>
BernsteinTetrahedron<Degree, Scalar> type6Coefficients(const std::array<Type6Mask, Count>& masks,
                                                       const std::array<Scalar, 27>& data) {
  BernsteinTetrahedron<Degree, Scalar> form;
  static_assert(Count == form.coefficients.size());
  for (std::size_t c = 0; c < Count; ++c) {
    Scalar sum(0);
    for (std::size_t n = 0; n < data.size(); ++n)
      if (masks[c].weights[n] != 0) sum += Scalar(masks[c].weights[n]) * data[n];
    form.coefficients[c] = sum / Scalar(masks[c].denominator);
  }
  return form;
}

}  // namespace levelset
