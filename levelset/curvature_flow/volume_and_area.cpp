#include <algorithm>
#include <cmath>

#include "levelset/curvature_flow/curvature_state_vdb.h"

namespace levelset::flow {
namespace {

using LeafNode = openvdb::FloatTree::LeafNodeType;

// A plane at a larger distance from a grid point, in voxels, does not cut the unit cube about it.
// Half the diagonal of the cube is 0.866.
constexpr float kReach = 0.87f;
// Lower bound of the components of a normal in partBelow(), which divides by them.
constexpr double kLeastComponent = 1e-3;
// Half width of the triangular kernel that approximates the delta function of the surface, voxels.
constexpr double kSpread = 1.5;

double cubed(double x) {
  return x > 0 ? x * x * x : 0;
}

/// Returns the volume of the part of the unit cube about the origin in which n·x + d < 0, for a
/// unit normal n.
double partBelow(openvdb::Vec3d n, double d) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    n[i] = std::max(std::abs(n[i]), kLeastComponent);
    sum += n[i];
  }
  const double a = sum / 2 - d;  // distance of the plane from the lowest corner of the cube
  if (a <= 0) return 0;
  if (a >= sum) return 1;
  double volume = cubed(a) - cubed(a - sum);
  for (int i = 0; i < 3; ++i) volume += cubed(a - n[i] - n[(i + 1) % 3]) - cubed(a - n[i]);
  return volume / (6 * n[0] * n[1] * n[2]);
}

VolumeAndArea volumeAndAreaOfBlock(const CurvatureState& state, const Field& rate, double shift,
                                   std::size_t i, const PaddedBlock& block) {
  VolumeAndArea volumeAndArea;
  for (auto it = state.blocks().active(i).beginOn(); it; ++it) {
    const float phi = state.value[i][it.pos()];
    if (std::abs(phi) > 2 * kSpread) {
      volumeAndArea.volume += phi < 0;
      continue;
    }
    const openvdb::Coord c = LeafNode::offsetToLocalCoord(it.pos());
    const float* p = block.at(c.x(), c.y(), c.z());
    const auto difference = [&](int step) { return static_cast<double>(p[step] - p[-step]) / 2; };
    openvdb::Vec3d normal(difference(PaddedBlock::kStepX), difference(PaddedBlock::kStepY),
                          difference(1));
    const double slope = normal.length();
    const double d = static_cast<double>(phi) / std::max(slope, 1e-3);
    if (std::abs(d) < static_cast<double>(kReach) && slope > 0)
      volumeAndArea.volume += partBelow(normal / slope, d);
    else
      volumeAndArea.volume += phi < 0;
    const double delta = std::max(0.0, 1 - std::abs(d) / kSpread) / kSpread;
    const double weight =
        state.weights().empty() ? 1 : static_cast<double>(state.weights()[i][it.pos()]);
    volumeAndArea.area += delta * weight / std::max(slope, 0.1);
    // The volume behind the tangent plane at the foot point exceeds that behind a surface of
    // curvature κ by κ/24 on average.
    volumeAndArea.volume -= delta * (static_cast<double>(rate[i][it.pos()]) + weight * shift) / 24;
  }
  return volumeAndArea;
}

}  // namespace

VolumeAndArea& VolumeAndArea::operator+=(const VolumeAndArea& other) {
  volume += other.volume;
  area += other.area;
  return *this;
}

VolumeAndArea volumeAndAreaOf(const CurvatureState& state, const Field& rate, double shift) {
  return state.blocks().sum<VolumeAndArea>([&](std::size_t i) {
    const auto block = std::make_unique<PaddedBlock>();
    state.blocks().gather(state.value, i, static_cast<float>(kFlowWidth), *block);
    return volumeAndAreaOfBlock(state, rate, shift, i, *block);
  });
}

double inactiveVolume(const openvdb::FloatTree& tree) {
  double count = 0;
  for (auto it = tree.cbeginValueOff(); it; ++it)
    if (*it < 0) count += static_cast<double>(it.getVoxelCount());
  return count;
}

}  // namespace levelset::flow
