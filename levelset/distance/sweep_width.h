#pragma once

namespace levelset {

/// Extent along x, voxels, of the part of a grid that a distance transform works on at once. It
/// sweeps the grid along x, and holds its working memory for that part only.
inline constexpr double kSweepWidth = 176;

}  // namespace levelset
