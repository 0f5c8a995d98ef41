#include "levelset/narrow_band.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include "levelset/error.h"
#include "levelset/grid_tools_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using LeafNode = openvdb::FloatTree::LeafNodeType;

// Name of the grid metadata that marks the band of an open surface.
constexpr const char* kOpenSurface = "levelsmith_open_surface";

/// Returns the linear part of a transform: row i is the image of the unit vector along index axis
/// i. Avoids OpenVDB's AffineMap, which refuses voxels smaller than 1.4e-5 as singular.
std::array<openvdb::Vec3d, 3> linearPart(const openvdb::math::Transform& transform) {
  const openvdb::math::MapBase& map = *transform.baseMap();
  return {map.applyJacobian(openvdb::Vec3d(1, 0, 0)), map.applyJacobian(openvdb::Vec3d(0, 1, 0)),
          map.applyJacobian(openvdb::Vec3d(0, 0, 1))};
}

std::string coordText(const Coord& c) {
  return fmt::format("[{}, {}, {}]", c.x(), c.y(), c.z());
}

}  // namespace

bool isSimilarity(const openvdb::math::Transform& transform) {
  if (!transform.isLinear()) return false;
  const std::array<openvdb::Vec3d, 3> rows = linearPart(transform);
  const double squaredScale = rows[0].lengthSqr();
  const double tolerance = 1e-6 * squaredScale;
  if (!(squaredScale > 0) || !std::isfinite(squaredScale)) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(rows[i].lengthSqr() - squaredScale) > tolerance) return false;
    if (std::abs(rows[i].dot(rows[(i + 1) % 3])) > tolerance) return false;
  }
  return rows[0].cross(rows[1]).dot(rows[2]) > 0;
}

bool NarrowBand::isEmpty() const {
  return !grid_ || grid_->grid->tree().empty() || !activeVoxelCount();
}

double NarrowBand::voxelSize() const {
  return grid_ ? grid_->grid->voxelSize()[0] : 0;
}

double NarrowBand::halfWidth() const {
  if (!grid_) return 0;
  // The background is a float, so background / voxel may be 3.0000001 for a half width of 3.
  // Returns the rounded number, 3, if it gives the same background, else the ratio itself.
  const double voxel = voxelSize(), ratio = static_cast<double>(grid_->grid->background()) / voxel;
  const double rounded = std::round(ratio * 1e6) / 1e6;
  return backgroundOf(rounded, voxel) == grid_->grid->background() ? rounded : ratio;
}

std::size_t NarrowBand::activeVoxelCount() const {
  return grid_ ? grid_->grid->activeVoxelCount() : 0;
}

std::size_t NarrowBand::memoryUse() const {
  if (!grid_) return 0;
  return grid_->grid->memUsage() + (grid_->beyond ? grid_->beyond->memUsage() : 0);
}

Imath::M44d NarrowBand::indexToWorld() const {
  Imath::M44d result;
  if (!grid_) return result;
  const openvdb::math::Transform& transform = grid_->grid->transform();
  const std::array<openvdb::Vec3d, 3> rows = linearPart(transform);
  const openvdb::Vec3d origin = transform.indexToWorld(openvdb::Vec3d(0));
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) result[i][j] = rows[static_cast<std::size_t>(i)][j];
    result[3][j] = origin[j];
  }
  return result;
}

std::vector<double> NarrowBand::zeroSetExtents(const std::vector<Imath::V3d>& directions) const {
  std::vector<double> nothing(directions.size(), -std::numeric_limits<double>::infinity());
  if (!grid_) return nothing;
  const FloatGrid& grid = *grid_->grid;
  std::vector<const LeafNode*> leaves;
  grid.tree().getNodes(leaves);
  const auto extendBy = [&](const openvdb::Vec3d& index, std::vector<double>& extents) {
    const Imath::V3d p = toImath(grid.indexToWorld(index));
    for (std::size_t d = 0; d < directions.size(); ++d)
      extents[d] = std::max(extents[d], p.dot(directions[d]));
  };
  // Along a direction, no point of a leaf's grid edges is farther than the leaf's centre plus this.
  std::vector<double> halfExtents;
  for (const Imath::V3d& d : directions) {
    double sum = 0;
    for (const openvdb::Vec3d& row : linearPart(grid.transform()))
      sum += std::abs(toImath(row).dot(d));
    halfExtents.push_back(LeafNode::DIM / 2 * sum);
  }
  constexpr double kRounding = 1e-12;
  const auto mayExtend = [&](const LeafNode& leaf, const std::vector<double>& extents) {
    const Imath::V3d centre =
        toImath(grid.indexToWorld(leaf.origin().asVec3d() + openvdb::Vec3d(LeafNode::DIM / 2)));
    for (std::size_t d = 0; d < directions.size(); ++d) {
      const double slack = kRounding * centre.length() * directions[d].length();
      if (centre.dot(directions[d]) + halfExtents[d] + slack >= extents[d]) return true;
    }
    return false;
  };
  const auto addLeaf = [&](const LeafNode& leaf, FloatGrid::ConstAccessor& accessor,
                           std::vector<double>& extents) {
    if (!mayExtend(leaf, extents)) return;
    const float* values = leaf.buffer().data();
    constexpr openvdb::Index kStrides[3] = {LeafNode::DIM * LeafNode::DIM, LeafNode::DIM, 1};
    for (auto it = leaf.cbeginValueOn(); it; ++it) {
      const openvdb::Index at = it.pos();
      const float a = values[at];
      const Coord local = LeafNode::offsetToLocalCoord(at);
      for (int axis = 0; axis < 3; ++axis) {
        float b = 0;
        if (local[axis] + 1 < static_cast<int>(LeafNode::DIM)) {
          const openvdb::Index next = at + kStrides[axis];
          if (!leaf.isValueOn(next)) continue;
          b = values[next];
          if ((a < 0) == (b < 0)) continue;
        } else {
          Coord next = leaf.origin() + local;
          next[axis] += 1;
          if (!accessor.probeValue(next, b) || (a < 0) == (b < 0)) continue;
        }
        openvdb::Vec3d p = (leaf.origin() + local).asVec3d();
        p[axis] += static_cast<double>(a) / (static_cast<double>(a) - static_cast<double>(b));
        extendBy(p, extents);
      }
    }
  };
  // With the extents of a few leaves known, most other leaves need no search.
  constexpr std::size_t kSample = 61;
  std::vector<double> sampled = nothing;
  FloatGrid::ConstAccessor sampler = grid.getConstAccessor();
  for (std::size_t n = 0; n < leaves.size(); n += kSample) addLeaf(*leaves[n], sampler, sampled);
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, leaves.size(), 64), sampled,
      [&](const tbb::blocked_range<std::size_t>& range, std::vector<double> extents) {
        FloatGrid::ConstAccessor accessor = grid.getConstAccessor();
        for (std::size_t n = range.begin(); n < range.end(); ++n)
          addLeaf(*leaves[n], accessor, extents);
        return extents;
      },
      [](std::vector<double> a, const std::vector<double>& b) {
        for (std::size_t d = 0; d < a.size(); ++d) a[d] = std::max(a[d], b[d]);
        return a;
      });
}

Imath::Box3d NarrowBand::zeroSetBounds() const {
  std::vector<Imath::V3d> axes;
  for (const double sign : {1.0, -1.0})
    for (int axis = 0; axis < 3; ++axis) {
      axes.emplace_back(0);
      axes.back()[axis] = sign;
    }
  const std::vector<double> extents = zeroSetExtents(axes);
  if (!std::isfinite(extents[0])) return {};
  return {Imath::V3d(-extents[3], -extents[4], -extents[5]),
          Imath::V3d(extents[0], extents[1], extents[2])};
}

bool NarrowBand::isOpenSurface() const {
  return grid_ && grid_->grid->getMetadata<openvdb::BoolMetadata>(kOpenSurface);
}

NarrowBand makeOpenBand(FloatGrid::Ptr grid, std::shared_ptr<const openvdb::FloatTree> beyond) {
  grid->insertMeta(kOpenSurface, openvdb::BoolMetadata(true));
  NarrowBand band = makeBand(std::move(grid));
  VdbAccess::slot(band)->beyond = std::move(beyond);
  return band;
}

void requireSolid(const NarrowBand& band) {
  if (!band.isOpenSurface()) return;
  throw InvalidInput(
      "the operand is an open surface, which has two sides and no "
      "inside; give a solid");
}

std::string NarrowBand::name() const {
  return grid_ ? grid_->grid->getName() : "";
}

std::uint64_t NarrowBand::contentHash() const {
  return grid_ ? gridHash(*grid_->grid) : 0x4c4556454c534d54ull;
}

FloatGrid& editVdb(NarrowBand& band) {
  std::shared_ptr<VdbGrid>& slot = VdbAccess::slot(band);
  if (slot.use_count() > 1)
    slot = std::make_shared<VdbGrid>(VdbGrid{slot->grid->deepCopy(), slot->beyond});
  return *slot->grid;
}

NarrowBand makeBand(FloatGrid::Ptr grid) {
  assert(grid && grid->background() > 0 && isSimilarity(grid->transform()));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return NarrowBand(std::make_shared<VdbGrid>(VdbGrid{std::move(grid), {}}));
}

NarrowBand importBand(FloatGrid::Ptr grid, BandRepairs* repairs) {
  if (!grid) throw InvalidInput("the grid pointer is null; give a float grid");
  const std::string name = grid->getName().empty() ? "(unnamed)" : grid->getName();
  if (grid->getGridClass() != openvdb::GRID_LEVEL_SET) {
    throw InvalidInput(fmt::format("grid '{}' is of class '{}', not a level set; convert it first",
                                   name, FloatGrid::gridClassToString(grid->getGridClass())));
  }
  if (!isSimilarity(grid->transform())) {
    throw InvalidInput(
        fmt::format("the transform of grid '{}' shears, mirrors or scales its axes "
                    "differently; resample it to uniform voxels first",
                    name));
  }
  const float background = grid->background();
  if (!(background > 0) || !std::isfinite(background)) {
    throw InvalidInput(fmt::format(
        "the background of grid '{}' is {}; write it with a positive, finite background", name,
        background));
  }
  BandRepairs made;
  made.activeTiles = grid->tree().activeTileCount();
  grid->tree().voxelizeActiveTiles();
  // Sets an inactive value to ± background. Differences below 0.1 % are not counted as repairs:
  // files with half floats round the background.
  const auto takes = [&](float& value) {
    const float right = std::signbit(value) ? -background : background;
    made.inactiveValues += std::abs(value - right) > 1e-3f * background;
    value = right;
  };
  for (auto leaf = grid->tree().beginLeaf(); leaf; ++leaf) {
    float* values = leaf->buffer().data();
    for (openvdb::Index i = 0; i < LeafNode::SIZE; ++i) {
      if (!std::isfinite(values[i])) {
        throw InvalidInput(
            fmt::format("grid '{}' holds {} at index {}; repair the file or write it "
                        "again",
                        name, values[i], coordText(leaf->offsetToGlobalCoord(i))));
      }
      if (!leaf->isValueOn(i)) takes(values[i]);
    }
  }
  auto it = grid->tree().beginValueOff();
  it.setMaxDepth(FloatGrid::TreeType::DEPTH - 2);  // tiles only
  for (; it; ++it) {
    if (!std::isfinite(*it)) {
      throw InvalidInput(fmt::format(
          "grid '{}' holds {} in a tile; repair the file or write it again", name, *it));
    }
    float value = *it;
    takes(value);
    it.setValue(value);
  }
  if (repairs) *repairs = made;
  return NarrowBand(std::make_shared<VdbGrid>(VdbGrid{std::move(grid), {}}));
}

openvdb::math::Transform::Ptr uniformTransform(double voxelSize) {
  using openvdb::math::UniformScaleMap;
  // The constructor of UniformScaleMap refuses a determinant below 3e-15, that is voxels below
  // 1.4e-5. Reading its members from a stream accepts any scale.
  const double fields[] = {voxelSize, voxelSize, 1 / voxelSize, 1 / voxelSize / voxelSize,
                           1 / voxelSize / 2};
  std::stringstream stream;
  for (const double field : fields)
    for (int axis = 0; axis < 3; ++axis)
      stream.write(reinterpret_cast<const char*>(&field), sizeof field);
  const auto map = std::make_shared<UniformScaleMap>();
  map->read(stream);
  return std::make_shared<openvdb::math::Transform>(map);
}

float backgroundOf(double halfWidth, double voxelSize) {
  const double width = halfWidth * voxelSize;
  const auto background = static_cast<float>(width);
  // If halfWidth was computed from a float background, `width` differs from that float only in the
  // last bits of a double. The tolerance avoids rounding it up to the next float.
  return background < width * (1 - 1e-12) ? std::nextafter(background, INFINITY) : background;
}

openvdb::CoordBBox blocksOf(const Imath::Box3d& world, const openvdb::math::Transform& transform) {
  openvdb::BBoxd index;
  for (int corner = 0; corner < 8; ++corner) {
    const Imath::V3d p((corner & 4) ? world.max.x : world.min.x,
                       (corner & 2) ? world.max.y : world.min.y,
                       (corner & 1) ? world.max.z : world.min.z);
    index.expand(transform.worldToIndex(toVdb(p)));
  }
  const auto at = [](double x) {
    return static_cast<int>(std::clamp(x, -kIndexLimit, kIndexLimit));
  };
  openvdb::CoordBBox blocks;
  for (int axis = 0; axis < 3; ++axis) {
    blocks.min()[axis] = at(std::floor(index.min()[axis])) & ~7;
    blocks.max()[axis] = at(std::ceil(index.max()[axis])) | 7;
  }
  return blocks;
}

void requireBackground(float background, double voxelSize) {
  // A thousandth of the background must still be a normal (not denormal) float, so that small
  // distances keep full precision.
  if (background > 1000 * std::numeric_limits<float>::min() && std::isfinite(background)) return;
  throw InvalidInput(
      fmt::format("the voxel size {:.6g} is too {} for distances in single precision; change the "
                  "unit of length",
                  voxelSize, background < 1 ? "small" : "large"));
}

FloatGrid::Ptr emptyLevelSet(openvdb::math::Transform::Ptr transform, double halfWidth) {
  const float background = backgroundOf(halfWidth, transform->voxelSize()[0]);
  requireBackground(background, transform->voxelSize()[0]);
  FloatGrid::Ptr grid = FloatGrid::create(background);
  grid->setTransform(std::move(transform));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

}  // namespace levelset
