#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "levelset/mesh.h"

namespace levelset {

/// Greatest magnitude of a coordinate, that of type float.
inline constexpr double kMostCoordinate = std::numeric_limits<float>::max();

/// Points of a surface or of a volume, without connectivity. Each list of attributes is empty or
/// has one entry for each point.
struct PointCloud {
  std::vector<Imath::V3d> positions = {};  ///< n × 3, world units, within kMostCoordinate
  std::vector<Imath::V3f> normals = {};    ///< n × 3, outwards, any length; zero: no normal
  std::vector<Imath::V4f> colors = {};     ///< n × 4, red, green, blue, alpha, 1 is full
  std::vector<float> radii = {};           ///< n, world units, positive
  std::vector<float> weights = {};         ///< n, confidence, not negative
  /// Type of the positions in a file.
  CoordinatePrecision precision = CoordinatePrecision::Double;

  [[nodiscard]] bool isEmpty() const { return positions.empty(); }
  [[nodiscard]] std::size_t size() const { return positions.size(); }
};

/// Returns the names of the attributes that are present, as text: "normals and colours". Empty when
/// there are none.
[[nodiscard]] std::string describe(const PointCloud& cloud);

/// Checks the lists of a point cloud.
/// @throws InvalidInput when the length of a list differs from the number of points, or a value is
///         outside its range: "the point cloud has 3 normals for 4 points; …"
void requirePoints(const PointCloud& cloud);

/// Bounding box of the positions. Empty for a cloud without points.
[[nodiscard]] Imath::Box3d bounds(const PointCloud& cloud);

}  // namespace levelset
