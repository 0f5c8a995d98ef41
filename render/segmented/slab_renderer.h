#pragma once

#include <cstdint>
#include <vector>

#include "render/camera.h"
#include "render/segmented/vertex_diagram.h"

namespace render {

/// How a slice reads packed values between grid points.
enum class SlabFetch {
  Nearest,  ///< value of the nearest grid point, as published
  /// Trilinear interpolation of packed values. Between regions 0 and 2 it passes through the values
  /// of region 1, which shows a film of it that does not exist.
  Linear,
  /// Region with the largest of the interpolated signed distances, and that distance.
  LabelAware
};

struct SlabOptions {
  int slices = 128;
  SlabFetch fetch = SlabFetch::Nearest;
  /// Distance of two samples for the test of the diagram, relative to the spacing of the slices
  /// along the ray; the published one is 1.
  double width = 1;
  double tolerance = 1;  ///< levels, see VertexDiagram
};

/// Picture of a slab renderer.
struct SlabPicture {
  int width = 0, height = 0;
  std::vector<double> distance;  ///< along the ray of the pixel, world units; +inf for a miss
  std::vector<std::int8_t> front, behind;  ///< region indices on both sides; −1 for a miss
};

/// Draws packed distances by pre-integrated slices [Engel01] [Yamazaki03]: slices perpendicular to
/// the view axis, at equal distances, back to front. Each slab takes the values of the ray on its
/// two slices, and the diagram tells if an interface lies between them. It visits all slices of all
/// pixels, as graphics hardware does. A baseline for InterfaceCaster, which is exact.
/// @throws levelset::UsageError for fewer than two slices; for the reasons of validate()
[[nodiscard]] SlabPicture renderSlabs(const PackedDistances& packed, const Camera& camera,
                                      const SlabOptions& options);

}  // namespace render
