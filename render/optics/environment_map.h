#pragma once

// Private to render: light from all directions.

#include <Imath/ImathVec.h>

#include <cstddef>
#include <string>
#include <vector>

namespace render {

/// Light of the surroundings by direction.
class EnvironmentMap {
 public:
  /// @param name  "studio" for a room with soft lights, or the path of an EXR with R, G and B:
  ///        longitudes from left to right with −z in the middle, latitudes from +y at the top
  /// @throws levelset::InvalidInput for an EXR without R, G and B, or that is not twice as wide as
  ///         high
  /// @throws as readExr()
  EnvironmentMap(const std::string& name, std::size_t maxMemory);
  /// Linear light from a direction of unit length. Interpolates bilinearly between pixels.
  [[nodiscard]] Imath::V3d light(const Imath::V3d& direction) const;

 private:
  [[nodiscard]] Imath::V3d pixel(int x, int y) const;
  int width_ = 0, height_ = 0;
  std::vector<Imath::V3f> pixels_;  // none: the studio
};

}  // namespace render
