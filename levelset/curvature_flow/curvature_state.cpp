#include "levelset/curvature_flow/curvature_state_vdb.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "levelset/curvature_flow/curvature_rate_vdb.h"

namespace levelset::flow {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3d;
using LeafNode = openvdb::FloatTree::LeafNodeType;

constexpr float kNear = 1;  // voxels: measureNearSurface() counts grid points with |φ| below this
// A grid point follows a leader, its closest point on |φ| = kFlowLeader, only if enough corners of
// the leader's cell lie in the core. The trilinear weights of these corners must have at least this
// sum.
constexpr float kLeastSum = 0.1f;

// Bound of the magnitude of principal curvatures, voxels⁻¹. Close to a focus or a crease, level
// sets are not parallel and their curvature difference is unbounded.
constexpr double kMostBent = 0.12;

// Distance to the farthest grid point that differences read, (2, 2, 0), voxels.
constexpr double kDifferencesReach = 2.8284271247461903;
static_assert(kFlowWidth >= kFlowCore + kDifferencesReach);

struct Nothing {};

/// Returns k1 + k2 of the parallel surface `away` voxels further out, minus `sum`.
/// @param sum      k1 + k2 of a surface
/// @param squares  k1² + k2² of that surface
double differenceOfParallel(double away, double sum, double squares) {
  const double half = std::sqrt(std::max(0.0, squares / 2 - sum * sum / 4));
  double difference = 0;
  for (const double k : {sum / 2 + half, sum / 2 - half}) {
    const double bent = std::clamp(k, -kMostBent, kMostBent);
    difference += bent / (1 + away * bent) - bent;
  }
  return difference;
}

/// Returns sum and sum of squares of the principal curvatures of the level set through a grid
/// point. For a distance field these are the traces of the Hessian and of its square.
std::pair<float, float> bendingAt(const float* p) {
  constexpr std::array<int, 3> kSteps = {PaddedBlock::kStepX, PaddedBlock::kStepY, 1};
  float sum = 0, squares = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const int s = kSteps[a], t = kSteps[(a + 1) % 3];
    const float straight = p[s] - 2 * p[0] + p[-s];
    const float mixed = (p[s + t] - p[s - t] - p[t - s] + p[-s - t]) / 4;
    sum += straight;
    squares += straight * straight + 2 * mixed * mixed;
  }
  return {sum, squares};
}

/// Returns the gradient at a grid point of a padded block by central differences.
Vec3d gradientAt(const PaddedBlock& block, const Coord& c) {
  const float* p = block.at(c.x(), c.y(), c.z());
  const auto difference = [&](int step) { return static_cast<double>(p[step] - p[-step]) / 2; };
  return {difference(PaddedBlock::kStepX), difference(PaddedBlock::kStepY), difference(1)};
}

}  // namespace

CurvatureState::CurvatureState(const FloatGrid& distance, const std::optional<Mask>& mask)
    : blocks_(distance.tree()) {
  start_ = blocks_.read(distance.tree(), distance.voxelSize()[0]);
  value = start_;
  core_.resize(blocks_.size());
  followers_.resize(blocks_.size());
  Bending bending{Field(blocks_.size()), Field(blocks_.size())};
  blocks_.forEach<PaddedBlock>(
      [&](std::size_t i, PaddedBlock& block) { findCore(i, block, bending); });
  blocks_.forEach<PaddedBlock>(
      [&](std::size_t i, PaddedBlock& block) { findFollowers(i, block, bending); });
  if (!mask) return;
  weights_.assign(blocks_.size(), Values{});
  blocks_.forEach<Nothing>([&](std::size_t i, Nothing&) {
    for (auto it = blocks_.active(i).beginOn(); it; ++it) {
      const Coord c = blocks_.origin(i) + LeafNode::offsetToLocalCoord(it.pos());
      weights_[i][it.pos()] =
          static_cast<float>(mask->weight(toImath(distance.transform().indexToWorld(c))));
    }
  });
}

void CurvatureState::findCore(std::size_t i, PaddedBlock& block, Bending& bending) {
  blocks_.gather(start_, i, static_cast<float>(kFlowWidth), block);
  for (auto it = blocks_.active(i).beginOn(); it; ++it) {
    const double phi = static_cast<double>(std::abs(start_[i][it.pos()]));
    if (!(phi < kFlowCore)) continue;
    core_[i].setOn(it.pos());
    // Curvatures are needed only at the corners of cells that contain leaders (points with |φ| =
    // kFlowLeader). These corners lie within a cell diagonal of that level set.
    if (phi < kFlowLeader - 1.8) continue;
    const Coord c = LeafNode::offsetToLocalCoord(it.pos());
    std::tie(bending.sums[i][it.pos()], bending.squares[i][it.pos()]) =
        bendingAt(block.at(c.x(), c.y(), c.z()));
  }
}

void CurvatureState::findFollowers(std::size_t i, PaddedBlock& block, const Bending& bending) {
  blocks_.gather(start_, i, static_cast<float>(kFlowWidth), block);
  for (auto it = blocks_.active(i).beginOn(); it; ++it) {
    const double phi = static_cast<double>(start_[i][it.pos()]);
    if (std::abs(phi) < kFlowLeader) continue;
    const Coord c = LeafNode::offsetToLocalCoord(it.pos());
    Vec3d normal = gradientAt(block, c);
    if (!normal.normalize()) continue;
    const double back = phi - std::copysign(kFlowLeader, phi);
    const Vec3d p = (blocks_.origin(i) + c).asVec3d() - normal * back;
    Follower follower;
    follower.gridPoint = static_cast<std::uint16_t>(it.pos());
    const Coord cell = Coord::floor(p);
    const Vec3d t = p - cell.asVec3d();
    float sum = 0;
    for (unsigned k = 0; k < 8; ++k) {
      const Coord d(k >> 2 & 1, k >> 1 & 1, k & 1);
      const std::uint32_t corner = blocks_.find(cell + d);
      if (corner == BandBlocks::kNone || !core_[corner / 512].isOn(corner % 512)) continue;
      double weight = 1;
      for (int axis = 0; axis < 3; ++axis) weight *= d[axis] ? t[axis] : 1 - t[axis];
      follower.corners[k] = corner;
      follower.weights[k] = static_cast<float>(weight);
      sum += follower.weights[k];
    }
    if (!(sum > kLeastSum)) continue;
    double bent = 0, squares = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      follower.weights[k] /= sum;
      const std::uint32_t corner = follower.corners[k];
      const auto weight = static_cast<double>(follower.weights[k]);
      bent += weight * static_cast<double>(bending.sums[corner / 512][corner % 512]);
      squares += weight * static_cast<double>(bending.squares[corner / 512][corner % 512]);
    }
    follower.rateDifference = static_cast<float>(differenceOfParallel(back, bent, squares));
    followers_[i].push_back(follower);
  }
}

void CurvatureState::evaluate(const Field& field, double shift, Field& rate) const {
  blocks_.forEach<PaddedBlock>([&](std::size_t i, PaddedBlock& block) {
    Values& out = rate[i];
    if (!core_[i].isOff()) {
      blocks_.gather(field, i, static_cast<float>(kFlowWidth), block);
      curvatureRate(block, core_[i], static_cast<float>(shift), out);
    }
    for (auto it = core_[i].beginOff(); it; ++it) out[it.pos()] = 0;
  });
  followed_.resize(blocks_.size());
  blocks_.forEach<Nothing>([&](std::size_t i, Nothing&) {
    followed_[i].clear();
    for (const Follower& f : followers_[i]) {
      float sum = f.rateDifference;
      for (std::size_t k = 0; k < 8; ++k)
        sum += f.weights[k] * rate[f.corners[k] / 512][f.corners[k] % 512];
      followed_[i].push_back(sum);
    }
  });
  blocks_.forEach<Nothing>([&](std::size_t i, Nothing&) {
    for (std::size_t k = 0; k < followers_[i].size(); ++k)
      rate[i][followers_[i][k].gridPoint] = followed_[i][k];
  });
  if (weights_.empty()) return;
  blocks_.forEach<Nothing>([&](std::size_t i, Nothing&) {
    for (std::size_t n = 0; n < 512; ++n) rate[i][n] *= weights_[i][n];
  });
}

FloatGrid::Ptr CurvatureState::toGrid(const FloatGrid& distance) const {
  FloatGrid::Ptr grid = distance.deepCopy();
  blocks_.write(value, distance.voxelSize()[0], grid->tree());
  return grid;
}

NearSurface& NearSurface::operator+=(const NearSurface& other) {
  count += other.count;
  fastest = std::max(fastest, other.fastest);
  displaced = std::max(displaced, other.displaced);
  squares += other.squares;
  rates += other.rates;
  weights += other.weights;
  levels += other.levels;
  levelSquares += other.levelSquares;
  levelRates += other.levelRates;
  clear = std::min(clear, other.clear);
  return *this;
}

double NearSurface::unevenness() const {
  const double spread = levelSquares - levels * levels / count,
               together = levelRates - levels * rates / count,
               all = squares - rates * rates / count;
  const double linear = spread > 0 ? together * together / spread : 0;
  return std::sqrt(std::max(0.0, all - linear) / count);
}

NearSurface measureNearSurface(const CurvatureState& state, const Field& rate) {
  return state.blocks().sum<NearSurface>([&](std::size_t i) {
    NearSurface near;
    for (auto it = state.blocks().active(i).beginOn(); it; ++it) {
      const float phi = state.value[i][it.pos()], start = state.start()[i][it.pos()];
      const double speed = static_cast<double>(rate[i][it.pos()]);
      if (std::abs(start) >= static_cast<float>(kFlowLeader)) {
        const auto side = static_cast<double>(std::copysign(1.0f, start));
        const double left = side * static_cast<double>(phi) - kFlowNearest, pace = -side * speed;
        if (pace > 0) near.clear = std::min(near.clear, std::max(0.0, left) / pace);
      }
      if (!(std::abs(phi) < kNear)) continue;
      const double weight =
          state.weights().empty() ? 1 : static_cast<double>(state.weights()[i][it.pos()]);
      const auto level = static_cast<double>(phi);
      near += {1,
               std::abs(speed),
               static_cast<double>(std::abs(start - phi)),
               speed * speed,
               speed,
               weight,
               level,
               level * level,
               level * speed};
    }
    return near;
  });
}

}  // namespace levelset::flow
