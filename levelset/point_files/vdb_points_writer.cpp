#include <openvdb/points/AttributeArray.h>
#include <openvdb/points/PointDataGrid.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <tuple>
#include <vector>

#include "levelset/files/vdb_writer.h"
#include "levelset/point_files/cloud_builder.h"

namespace levelset::point_files {
namespace {

using Imath::V3d;
using openvdb::Coord;
using openvdb::Vec3f;
using PointLeaf = openvdb::points::PointDataTree::LeafNodeType;
using openvdb::points::AttributeSet;

/// Least voxel that OpenVDB's transforms accept, as a power of two: its volume is above 3e-15.
constexpr int kLeastExponent = -16;
/// Greatest index of a voxel, as a power of two. Positions are exact to 2⁻²⁴ voxel there.
constexpr int kIndexBits = 29;

Coord voxelAt(const V3d& position, double voxel) {
  return Coord::round(toVdb(position / voxel));
}

/// Number of voxels that hold points.
std::size_t occupiedVoxels(const PointCloud& cloud, double voxel) {
  std::vector<Coord> voxels(cloud.size());
  tbb::parallel_for(std::size_t{0}, cloud.size(),
                    [&](std::size_t i) { voxels[i] = voxelAt(cloud.positions[i], voxel); });
  tbb::parallel_sort(voxels.begin(), voxels.end());
  return static_cast<std::size_t>(std::unique(voxels.begin(), voxels.end()) - voxels.begin());
}

/// Returns the exponent of a power of two at or above a positive number.
int exponentAbove(double x) {
  int exponent = 0;
  return std::frexp(x, &exponent) == 0.5 ? exponent - 1 : exponent;
}

/// Returns a voxel size with about eight points in a voxel. It is a power of two, so that positions
/// of type float are exact: their distance from the centre of a voxel is of type float, too.
double chooseVoxel(const PointCloud& cloud) {
  constexpr double kPointsPerVoxel = 8;
  constexpr int kMostTries = 12;
  double farthest = 0;
  for (const V3d& p : cloud.positions)
    farthest = std::max({farthest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const V3d size = bounds(cloud).size();
  const double longest = std::max({size.x, size.y, size.z});
  const auto count = static_cast<double>(cloud.size());
  const int least = farthest > 0 ? std::max(kLeastExponent, exponentAbove(farthest) - kIndexBits)
                                 : kLeastExponent;
  // Points that fill their box need the largest voxels.
  int exponent = longest > 0 ? exponentAbove(longest * std::cbrt(kPointsPerVoxel / count)) : 0;
  exponent = std::max(exponent, least);
  for (int tries = 0; tries < kMostTries && longest > 0 && exponent > least; ++tries) {
    const auto voxels = static_cast<double>(occupiedVoxels(cloud, std::ldexp(1.0, exponent)));
    if (count / voxels < kPointsPerVoxel * std::sqrt(2.0)) break;
    --exponent;
  }
  return std::ldexp(1.0, exponent);
}

/// Point with its place in the grid.
struct PlacedPoint {
  Coord leaf;
  openvdb::Index voxel;
  std::uint32_t index;

  [[nodiscard]] auto rank() const { return std::tie(leaf, voxel, index); }
};

template <typename T, typename Value>
void fill(PointLeaf& leaf, std::size_t& attribute, const PlacedPoint* points, std::size_t count,
          const Value& value) {
  openvdb::points::AttributeWriteHandle<T> handle(leaf.attributeArray(attribute++));
  for (std::size_t i = 0; i < count; ++i)
    handle.set(static_cast<openvdb::Index>(i), value(points[i].index));
}

/// The points as a grid of OpenVDB.
class PointGridMaker {
 public:
  explicit PointGridMaker(const PointCloud& cloud)
      : cloud_(cloud), voxel_(chooseVoxel(cloud)), hasAlpha_(hasAlpha(cloud)) {}

  openvdb::points::PointDataGrid::Ptr make() const {
    using openvdb::points::TypedAttributeArray;
    const auto vector = TypedAttributeArray<Vec3f>::attributeType();
    const auto number = TypedAttributeArray<float>::attributeType();
    auto descriptor = AttributeSet::Descriptor::create(vector);
    const auto add = [&](bool isPresent, const char* name, const openvdb::NamePair& type) {
      if (isPresent) descriptor = descriptor->duplicateAppend(name, type);
    };
    add(!cloud_.normals.empty(), "N", vector);
    add(!cloud_.colors.empty(), "Cd", vector);
    add(hasAlpha_, "Alpha", number);
    add(!cloud_.radii.empty(), "pscale", number);
    add(!cloud_.weights.empty(), "weight", number);

    const std::vector<PlacedPoint> points = placed();
    std::vector<std::size_t> starts;  // of the leaves
    for (std::size_t i = 0; i < points.size(); ++i)
      if (i == 0 || points[i].leaf != points[i - 1].leaf) starts.push_back(i);
    starts.push_back(points.size());
    std::vector<std::unique_ptr<PointLeaf>> leaves(starts.size() - 1);
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
      leaves[i] = makeLeaf(points.data() + starts[i], starts[i + 1] - starts[i], descriptor);
    });
    auto grid = openvdb::points::PointDataGrid::create();
    for (std::unique_ptr<PointLeaf>& leaf : leaves) grid->tree().addLeaf(leaf.release());
    return grid;
  }
  [[nodiscard]] double voxel() const { return voxel_; }

 private:
  [[nodiscard]] std::vector<PlacedPoint> placed() const {
    std::vector<PlacedPoint> points(cloud_.size());
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
      const Coord at = voxelAt(cloud_.positions[i], voxel_);
      points[i] = {at & ~7, PointLeaf::coordToOffset(at), static_cast<std::uint32_t>(i)};
    });
    tbb::parallel_sort(
        points.begin(), points.end(),
        [](const PlacedPoint& a, const PlacedPoint& b) { return a.rank() < b.rank(); });
    return points;
  }

  [[nodiscard]] std::unique_ptr<PointLeaf> makeLeaf(
      const PlacedPoint* points, std::size_t count,
      const AttributeSet::Descriptor::Ptr& descriptor) const {
    auto leaf = std::make_unique<PointLeaf>(points[0].leaf);
    leaf->replaceAttributeSet(new AttributeSet(descriptor, static_cast<openvdb::Index>(count)),
                              true);
    std::vector<PointLeaf::ValueType> ends(PointLeaf::SIZE);
    std::size_t next = 0;
    for (openvdb::Index voxel = 0; voxel < PointLeaf::SIZE; ++voxel) {
      while (next < count && points[next].voxel == voxel) ++next;
      ends[voxel] = static_cast<std::uint32_t>(next);
    }
    leaf->setOffsets(ends);
    std::size_t attribute = 0;
    const auto vector = [](const auto& v) { return Vec3f(v[0], v[1], v[2]); };
    fill<Vec3f>(*leaf, attribute, points, count, [&](std::uint32_t i) {
      const openvdb::Vec3d at = toVdb(cloud_.positions[i] / voxel_);
      return Vec3f(at - Coord::round(at).asVec3d());
    });
    if (!cloud_.normals.empty())
      fill<Vec3f>(*leaf, attribute, points, count,
                  [&](std::uint32_t i) { return vector(cloud_.normals[i]); });
    if (!cloud_.colors.empty())
      fill<Vec3f>(*leaf, attribute, points, count,
                  [&](std::uint32_t i) { return vector(cloud_.colors[i]); });
    if (hasAlpha_)
      fill<float>(*leaf, attribute, points, count,
                  [&](std::uint32_t i) { return cloud_.colors[i][3]; });
    if (!cloud_.radii.empty())
      fill<float>(*leaf, attribute, points, count,
                  [&](std::uint32_t i) { return cloud_.radii[i]; });
    if (!cloud_.weights.empty())
      fill<float>(*leaf, attribute, points, count,
                  [&](std::uint32_t i) { return cloud_.weights[i]; });
    return leaf;
  }

  const PointCloud& cloud_;
  double voxel_;
  bool hasAlpha_;
};

/// Hash of lists of numbers.
class ContentHash {
 public:
  template <typename T>
  void add(const std::vector<T>& list) {
    for (const T& vector : list)
      for (std::size_t at = 0; at < sizeof(T); at += 4) {
        std::uint32_t word = 0;
        std::memcpy(&word, reinterpret_cast<const char*>(&vector) + at, 4);
        hash_ = (hash_ ^ word) * 0x9e3779b97f4a7c15ull;
        hash_ ^= hash_ >> 29;
      }
    hash_ += list.size();
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0x243f6a8885a308d3ull;
};

}  // namespace

void writeVdbPoints(const std::filesystem::path& path, const PointCloud& cloud,
                    const std::string& name, const Progress& progress) {
  openvdb::initialize();
  const PointGridMaker maker(cloud);
  const auto grid = maker.make();
  const auto transform = openvdb::math::Transform::createLinearTransform(maker.voxel());
  nameGrid(*grid, *transform, name, openvdb::GRID_UNKNOWN);
  ContentHash hash;
  hash.add(cloud.positions);
  hash.add(cloud.normals);
  hash.add(cloud.colors);
  hash.add(cloud.radii);
  hash.add(cloud.weights);
  writeTarget(path, [&](const std::filesystem::path& target) {
    writeVdb(
        target, static_cast<double>(grid->memUsage()),
        [&](std::ostream& out) { writeGrid(out, grid); }, [&] { return hash.value(); }, progress);
  });
}

}  // namespace levelset::point_files
