#include "levelset/distance/surface/surface_points.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>

#include "levelset/distance/surface/closest_point.h"
#include "levelset/error.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;

constexpr std::array<std::array<int, 3>, 6> kDirections = {
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

// Largest difference, about, between zero crossings by linear interpolation on grid edges and those
// of the tricubic interpolant, voxels.
constexpr double kCrossingTolerance = 0.05;
// Largest difference, about, between the linear zero crossings and the sharp patches (triangles
// near edges), voxels.
constexpr double kSharpTolerance = 0.5;

Vec3d directionVector(const std::array<int, 3>& d) {
  return Vec3d(d[0], d[1], d[2]);
}

/// Zero crossings by linear interpolation on the six grid edges at a grid point, as distances from
/// it in voxels; 2: no crossing.
struct Crossings {
  std::array<double, 6> at;
  int nearest = 0;

  template <typename Block>
  Crossings(const Block& block, int x, int y, int z, float background) {
    const float here = block.at(x, y, z);
    for (int i = 0; i < 6; ++i) {
      const auto& d = kDirections[static_cast<std::size_t>(i)];
      const float there = block.at(x + d[0], y + d[1], z + d[2]);
      const bool informs = std::abs(here) < background || std::abs(there) < background;
      const double a = here, b = there;
      at[static_cast<std::size_t>(i)] = (here < 0) != (there < 0) && informs ? a / (a - b) : 2;
      if (at[static_cast<std::size_t>(i)] < at[static_cast<std::size_t>(nearest)]) nearest = i;
    }
  }
  [[nodiscard]] double nearestDistance() const { return at[static_cast<std::size_t>(nearest)]; }
  [[nodiscard]] Vec3d offset(int i) const {
    return directionVector(kDirections[static_cast<std::size_t>(i)]) *
           at[static_cast<std::size_t>(i)];
  }
};

/// Returns the start of Newton's method, relative to the grid point: the foot point by value and
/// gradient if it is not farther than the nearest crossing, else that crossing.
Vec3d firstGuess(const DenseBlock& block, int x, int y, int z, const Crossings& crossings) {
  const auto difference = [&](int dx, int dy, int dz) {
    const double forward = block.at(x + dx, y + dy, z + dz),
                 backward = block.at(x - dx, y - dy, z - dz);
    return (forward - backward) / 2;
  };
  const Vec3d gradient(difference(1, 0, 0), difference(0, 1, 0), difference(0, 0, 1));
  const double squared = gradient.lengthSqr();
  if (squared > 0) {
    const Vec3d step = gradient * (-static_cast<double>(block.at(x, y, z)) / squared);
    if (step.length() <= crossings.nearestDistance() + kCrossingTolerance) return step;
  }
  return crossings.offset(crossings.nearest);
}

/// Finds the closest point of the zero set to a grid point beside it, in the frame of the block. A
/// crossing nearer than the point that Newton's method found is used as another start. So the
/// nearer wall of a narrow gap is found.
/// @param best  closest point from the start firstGuess()
Vec3d footOf(const DenseBlock& block, const Vec3d& from, const Crossings& crossings, Foot best) {
  for (int i = 0; i < 6; ++i) {
    const double distance = crossings.at[static_cast<std::size_t>(i)];
    if (distance > 1 || (best.converged && distance > best.distance - kCrossingTolerance)) continue;
    const Foot other = closestPoint(block, from, from + crossings.offset(i));
    if (other.converged && (!best.converged || other.distance < best.distance)) best = other;
  }
  // On creases Newton's method may not converge. A linear crossing always lies on the surface.
  const bool plausible = best.converged && changesSignAround(block, best.point) &&
                         best.distance <= crossings.nearestDistance() + 4 * kCrossingTolerance;
  return plausible ? best.point : from + crossings.offset(crossings.nearest);
}

/// Calls visit(x, y, z, crossings) for the grid points of a block that have a zero crossing within
/// a voxel along an axis.
template <typename Block, typename Visit>
void forEachPointBeside(const Block& block, float background, const Visit& visit) {
  // Signs of the block and its border: bit z + 1 of a row along z is set inside.
  std::array<std::array<std::uint32_t, 10>, 10> inside;
  for (int x = -1; x <= 8; ++x)
    for (int y = -1; y <= 8; ++y) {
      std::uint32_t bits = 0;
      for (int z = -1; z <= 8; ++z)
        bits |= static_cast<std::uint32_t>(block.at(x, y, z) < 0) << (z + 1);
      inside[static_cast<std::size_t>(x + 1)][static_cast<std::size_t>(y + 1)] = bits;
    }
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const auto row = [&](int dx, int dy) {
        return inside[static_cast<std::size_t>(x + 1 + dx)][static_cast<std::size_t>(y + 1 + dy)];
      };
      const std::uint32_t own = row(0, 0);
      const std::uint32_t differs = (own ^ row(-1, 0)) | (own ^ row(1, 0)) | (own ^ row(0, -1)) |
                                    (own ^ row(0, 1)) | (own ^ own << 1) | (own ^ own >> 1);
      for (std::uint32_t bits = differs >> 1 & 0xff; bits; bits &= bits - 1) {
        const int z = __builtin_ctz(bits);
        const Crossings crossings(block, x, y, z, background);
        if (crossings.nearestDistance() <= 1) visit(x, y, z, crossings);
      }
    }
}

/// Dense copy of a leaf block and of two grid points on each side of it.
class NearBlock {
 public:
  void load(const FloatGrid::ConstAccessor& accessor, const Coord& origin) {
    origin_ = origin;
    copyPaddedLeaf(accessor, origin, 2, 2, values_.values.data());
  }
  [[nodiscard]] const Coord& origin() const { return origin_; }
  [[nodiscard]] float at(int x, int y, int z) const { return *values_.at(x, y, z); }

 private:
  Coord origin_;
  PaddedLeaf<2> values_;
};

std::vector<const LeafNode*> leavesOf(const FloatTree& tree, const BlockSelection& within) {
  std::vector<const LeafNode*> leaves;
  for (auto it = tree.cbeginLeaf(); it; ++it)
    if (within.holdsBlock(it->getNodeBoundingBox())) leaves.push_back(it.getLeaf());
  return leaves;
}

std::vector<Coord> originsOf(const std::vector<const LeafNode*>& leaves) {
  std::vector<Coord> origins;
  origins.reserve(leaves.size());
  for (const LeafNode* leaf : leaves) origins.push_back(leaf->origin());
  return origins;
}

/// Calls work(index of a leaf, dense block of the leaf) for all leaves, in parallel.
/// @tparam Block  DenseBlock or NearBlock
template <typename Block, typename Work>
void forEachBlock(const FloatTree& tree, const std::vector<Coord>& origins, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, origins.size(), 8), [&](const auto& range) {
    const FloatGrid::ConstAccessor accessor(tree);
    const auto block = std::make_unique<Block>();
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      block->load(accessor, origins[i]);
      work(i, *block);
    }
  });
}

/// Extrapolates the field to a grid point whose value is the background. Takes the mean over the
/// six axis directions, each value at least the background in magnitude. Returns 0 when no
/// direction has two distances to extrapolate from. The extrapolation is quadratic where the second
/// difference is small, so that the interpolation of smooth fields keeps its order.
float extrapolate(const DenseBlock& block, int x, int y, int z, float background) {
  constexpr float kGentle = 0.25f;
  const float sign = block.at(x, y, z) < 0 ? -1.0f : 1.0f;
  float sum = 0, count = 0;
  for (const auto& d : kDirections) {
    const auto behind = [&](int k) {
      return sign * block.at(x + k * d[0], y + k * d[1], z + k * d[2]);
    };
    const float near = behind(1), far = behind(2), farther = behind(3);
    if (std::abs(near) == background || std::abs(far) == background || near < far) continue;
    const float slope = near - far, bend = slope - (far - farther);
    const bool isSmooth = std::abs(farther) != background && std::abs(bend) < kGentle * slope;
    sum += std::max(background * 1.000001f, near + slope + (isSmooth ? bend : 0));
    ++count;
  }
  return count > 0 ? sign * sum / count : 0;
}

/// Extends the band by one grid point.
/// @param within  only in leaves of this tree; null: everywhere
void addLayer(FloatTree& tree, const openvdb::MaskTree* within) {
  const float background = tree.background();
  const auto isWithin = [&](const Coord& origin) {
    return !within || within->probeConstLeaf(origin);
  };
  std::vector<Coord> origins;
  for (const LeafNode* leaf : leavesOf(tree, {}))
    if (isWithin(leaf->origin())) origins.push_back(leaf->origin());
  for (const Coord& o : origins)
    for (const auto& d : kDirections) {
      const Coord beside = o.offsetBy(8 * d[0], 8 * d[1], 8 * d[2]);
      if (isWithin(beside)) tree.touchLeaf(beside);
    }
  std::vector<const LeafNode*> leaves = leavesOf(tree, {});
  std::erase_if(leaves, [&](const LeafNode* leaf) { return !isWithin(leaf->origin()); });
  std::vector<std::vector<std::pair<openvdb::Index, float>>> additions(leaves.size());
  forEachBlock<DenseBlock>(tree, originsOf(leaves), [&](std::size_t i, const DenseBlock& block) {
    for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) {
      const Coord c = LeafNode::offsetToLocalCoord(n);
      if (std::abs(block.at(c.x(), c.y(), c.z())) != background) continue;
      const float value = extrapolate(block, c.x(), c.y(), c.z(), background);
      if (value != 0) additions[i].emplace_back(n, value);
    }
  });
  std::size_t i = 0;
  for (auto leaf = tree.beginLeaf(); leaf; ++leaf) {
    if (!isWithin(leaf->origin())) continue;
    for (const auto& [n, value] : additions[i]) leaf->setValueOnly(n, value);
    ++i;
  }
}

/// Returns true when the interpolant beside this grid point reads values that are clipped to the
/// background.
bool isThinAt(const NearBlock& block, int x, int y, int z, float background) {
  const float here = std::abs(block.at(x, y, z));
  for (const auto& d : kDirections) {
    const float one = std::abs(block.at(x + d[0], y + d[1], z + d[2]));
    const float two = std::abs(block.at(x + 2 * d[0], y + 2 * d[1], z + 2 * d[2]));
    // The value two voxels away counts as clipped if the linear continuation exceeds the
    // background.
    if (one >= background || (two >= background && 2 * one - here > 1.02f * background))
      return true;
  }
  return false;
}

/// Surface points of one leaf.
struct LeafPoints {
  std::vector<Vec3d> positions;
  std::vector<Coord> gridPoints;
  std::vector<CompactJet> jets;
  std::vector<char> sharp;
};

/// Finds the surface points of one leaf. They do not include points on edges and corners.
/// @param among  only for these grid points; null: for all
LeafPoints surfacePointsOf(const DenseBlock& block, float background, const SharpPatches& patches,
                           const openvdb::MaskTree::LeafNodeType* among) {
  const Vec3d origin = block.origin().asVec3d();
  LeafPoints found;
  std::vector<Crossings> crossingsOf;  // one for each search
  std::vector<FootSearch> searches;
  constexpr std::size_t kUsual = 96;  // a plane through a block has about as many surface points
  found.positions.reserve(kUsual);
  found.gridPoints.reserve(kUsual);
  found.sharp.reserve(kUsual);
  crossingsOf.reserve(kUsual);
  searches.reserve(kUsual);
  forEachPointBeside(block, background, [&](int x, int y, int z, const Crossings& crossings) {
    const Coord gridPoint = block.origin().offsetBy(x, y, z);
    if (among && !among->isValueOn(gridPoint)) return;
    SharpPatches::Hit hit;
    if (patches.touches(gridPoint))
      hit = patches.nearest(gridPoint.asVec3d(), crossings.nearestDistance() + kSharpTolerance);
    const bool isSharp = hit.found && patches.covers(Coord::floor(hit.point));
    if (!isSharp) {
      const Vec3d from(x, y, z);
      searches.push_back({from, from + firstGuess(block, x, y, z, crossings)});
      crossingsOf.push_back(crossings);
    }
    found.positions.push_back(hit.point);
    found.gridPoints.push_back(gridPoint);
    found.sharp.push_back(isSharp);
  });
  std::vector<Foot> feet;
  closestPoints(block, searches, feet);
  std::vector<Vec3d> places;  // positions of the jets, relative to the block
  std::vector<std::size_t> owners;
  std::size_t search = 0;
  for (std::size_t i = 0; i < found.positions.size(); ++i) {
    if (found.sharp[i]) continue;
    found.positions[i] =
        origin + footOf(block, searches[search].from, crossingsOf[search], feet[search]);
    ++search;
    const Vec3d local = found.positions[i] - origin;
    if (!DenseBlock::contains(local)) continue;
    places.push_back(local);
    owners.push_back(i);
  }
  found.jets.resize(found.positions.size());
  for (std::size_t first = 0; first < places.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, places.size() - first);
    Triple<DoubleLanes> p;
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      setLane(p, static_cast<int>(lane), places[first + std::min(lane, count - 1)]);
    JetOf<DoubleLanes> jets;
    block.jets(p, jets);
    for (std::size_t lane = 0; lane < count; ++lane)
      found.jets[owners[first + lane]] = CompactJet(jets, static_cast<int>(lane));
  }
  return found;
}

}  // namespace

SurfacePointSearch::SurfacePointSearch(const FloatTree& field, const BlockSelection& within,
                                       const SharpPatches& patches)
    : field_(field),
      within_(within),
      patches_(patches),
      origins_(originsOf(leavesOf(field, within))) {
  const float background = field.background();
  struct Count {
    std::uint32_t points = 0;
    bool isThin = false;
    openvdb::CoordBBox bounds = {};
  };
  std::vector<Count> counts(origins_.size());
  forEachBlock<NearBlock>(field, origins_, [&](std::size_t i, const NearBlock& block) {
    const auto* among =
        within_.gridPoints ? within_.gridPoints->probeConstLeaf(block.origin()) : nullptr;
    Count& count = counts[i];
    forEachPointBeside(block, background, [&](int x, int y, int z, const Crossings&) {
      const Coord gridPoint = block.origin().offsetBy(x, y, z);
      if (among && !among->isValueOn(gridPoint)) return;
      ++count.points;
      count.bounds.expand(gridPoint);
      if (!count.isThin) count.isThin = isThinAt(block, x, y, z, background);
    });
  });
  for (const Vec3d& feature : patches.features())
    if (within.holds(Coord::floor(feature))) features_.push_back(feature);
  std::size_t sum = 0;
  first_.push_back(0);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    sum += counts[i].points;
    first_.push_back(static_cast<std::uint32_t>(sum));
    if (counts[i].isThin) thin_.push_back(origins_[i]);
    if (counts[i].points > 0) bounds_.expand(counts[i].bounds);
  }
  if (sum + features_.size() >= std::numeric_limits<std::uint32_t>::max())
    throw ResourceLimit(
        "more than 2^32 grid points lie beside the surface; use larger "
        "voxels");
}

SurfacePoints SurfacePointSearch::reserve() const {
  SurfacePoints points;
  points.positions = PageArray<Vec3d>(size());
  points.jets = PageArray<CompactJet>(size());
  points.sharp = PageArray<char>(size());
  for (std::size_t i = 0; i < features_.size(); ++i) {
    points.positions[countOfGridPoints() + i] = features_[i];
    points.sharp[countOfGridPoints() + i] = 1;
  }
  return points;
}

std::vector<std::vector<Coord>> SurfacePointSearch::find(const std::vector<std::size_t>& blocks,
                                                         SurfacePoints& points) const {
  std::vector<std::vector<Coord>> gridPoints(blocks.size());
  std::vector<Coord> origins;
  origins.reserve(blocks.size());
  for (const std::size_t block : blocks) origins.push_back(origins_[block]);
  forEachBlock<DenseBlock>(field_, origins, [&](std::size_t i, const DenseBlock& block) {
    const auto* among =
        within_.gridPoints ? within_.gridPoints->probeConstLeaf(block.origin()) : nullptr;
    LeafPoints found = surfacePointsOf(block, field_.background(), patches_, among);
    const std::size_t first = first_[blocks[i]];
    std::copy(found.positions.begin(), found.positions.end(), points.positions.data() + first);
    std::copy(found.jets.begin(), found.jets.end(), points.jets.data() + first);
    std::copy(found.sharp.begin(), found.sharp.end(), points.sharp.data() + first);
    gridPoints[i] = std::move(found.gridPoints);
  });
  return gridPoints;
}

SurfacePoints findSurfacePoints(const FloatTree& field, const BlockSelection& within,
                                const SharpPatches& patches, std::vector<Coord>* thin,
                                std::vector<Coord>* gridPoints) {
  const SurfacePointSearch search(field, within, patches);
  if (thin) *thin = search.thin();
  if (thin && !thin->empty()) return {};
  SurfacePoints points = search.reserve();
  std::vector<std::size_t> all(search.blockCount());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const auto found = search.find(all, points);
  if (gridPoints)
    for (const std::vector<Coord>& part : found)
      gridPoints->insert(gridPoints->end(), part.begin(), part.end());
  return points;
}

bool hasZeroCrossing(const FloatTree& field) {
  const std::vector<const LeafNode*> leaves = leavesOf(field, {});
  std::atomic<bool> found = false;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16), [&](const auto& range) {
    const FloatGrid::ConstAccessor accessor(field);
    const auto block = std::make_unique<DenseBlock>();
    for (std::size_t i = range.begin(); i != range.end() && !found; ++i) {
      block->load(accessor, leaves[i]->origin());
      forEachPointBeside(*block, field.background(),
                         [&](int, int, int, const Crossings&) { found = true; });
    }
  });
  return found;
}

FloatTree::Ptr thicken(const FloatTree& field) {
  auto result = std::make_shared<FloatTree>(field);
  addLayer(*result, nullptr);
  addLayer(*result, nullptr);
  return result;
}

FloatTree::Ptr thicken(const FloatTree& field, const std::vector<Coord>& leaves) {
  openvdb::MaskTree around;
  for (const Coord& origin : leaves)
    for (int x = -8; x <= 8; x += 8)
      for (int y = -8; y <= 8; y += 8)
        for (int z = -8; z <= 8; z += 8) around.touchLeaf(origin.offsetBy(x, y, z));
  auto result = std::make_shared<FloatTree>(field);
  addLayer(*result, &around);
  addLayer(*result, &around);
  return result;
}

}  // namespace levelset::eikonal
