#include "levelset/segmented/segment_labels.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress_gate.h"
#include "levelset/segmented/local/block_surroundings.h"
#include "levelset/segmented/segmented_data_vdb.h"
#include "levelset/transform/resample_vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;

constexpr double kLabelHalfWidth = 2;  // voxels
constexpr double kLargestLabel = 65535;

/// Labels of a volume as integers, with the void around it.
class LabelArray {
 public:
  /// @throws InvalidInput for a value that is no label
  LabelArray(const Volume& volume, bool isMirrored, const Progress& progress)
      : size_(volume.size()), labels_(volume.grid().pointCount()) {
    const auto rows = static_cast<std::size_t>(size_.y) * static_cast<std::size_t>(size_.z);
    std::atomic<std::size_t> bad = rows;  // first row with a bad value
    ProgressGate gate(progress, rows);
    tbb::parallel_for(std::size_t{0}, rows, [&](std::size_t r) {
      if (!readRow(volume, r, isMirrored)) {
        std::size_t first = bad;
        while (r < first && !bad.compare_exchange_weak(first, r)) continue;
      }
      gate.advance(1);
    });
    if (bad < rows) refuse(volume, bad);
  }

  [[nodiscard]] const Imath::V3i& size() const { return size_; }
  [[nodiscard]] bool contains(int i, int j, int k) const {
    return i >= 0 && j >= 0 && k >= 0 && i < size_.x && j < size_.y && k < size_.z;
  }
  [[nodiscard]] RegionLabel labelAt(int i, int j, int k) const {
    return contains(i, j, k) ? labels_[index(i, j, k)] : kVoid;
  }
  [[nodiscard]] RegionLabel& at(int i, int j, int k) { return labels_[index(i, j, k)]; }
  [[nodiscard]] bool isVoid() const {
    return std::all_of(labels_.begin(), labels_.end(), [](RegionLabel l) { return l == kVoid; });
  }

 private:
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size_.y) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size_.x) +
           static_cast<std::size_t>(i);
  }
  static bool isLabel(double value) {
    return value >= 0 && value <= kLargestLabel && value == std::floor(value);
  }
  bool readRow(const Volume& volume, std::size_t row, bool isMirrored) {
    const int j = static_cast<int>(row % static_cast<std::size_t>(size_.y)),
              k = static_cast<int>(row / static_cast<std::size_t>(size_.y));
    std::vector<float> stored(static_cast<std::size_t>(size_.x));
    volume.storedRow(j, k, stored);
    bool isGood = true;
    for (int i = 0; i < size_.x; ++i) {
      const double value = volume.scale()(static_cast<double>(stored[static_cast<std::size_t>(i)]));
      isGood = isGood && isLabel(value);
      if (isGood) at(isMirrored ? size_.x - 1 - i : i, j, k) = static_cast<RegionLabel>(value);
    }
    return isGood;
  }
  [[noreturn]] void refuse(const Volume& volume, std::size_t row) const {
    const int j = static_cast<int>(row % static_cast<std::size_t>(size_.y)),
              k = static_cast<int>(row / static_cast<std::size_t>(size_.y));
    int i = 0;
    while (isLabel(volume.at(i, j, k))) ++i;
    throw InvalidInput(
        fmt::format("the volume holds {:.6g} at index [{}, {}, {}], which is no label; labels are "
                    "integers from 0 to 65535",
                    volume.at(i, j, k), i, j, k));
  }

  Imath::V3i size_;
  std::vector<RegionLabel> labels_;
};

/// Calls visit(origin) for the blocks that meet the volume or the samples around it, by x, y, z.
template <typename Visit>
void forEachOriginOf(const LabelArray& labels, const Visit& visit) {
  for (int x = -8; x < labels.size().x + 8; x += 8)
    for (int y = -8; y < labels.size().y + 8; y += 8)
      for (int z = -8; z < labels.size().z + 8; z += 8) visit(Coord(x, y, z));
}
std::size_t blockCountOf(const LabelArray& labels) {
  std::size_t count = 0;
  forEachOriginOf(labels, [&](const Coord&) { ++count; });
  return count;
}
/// As forEachOriginOf(), in parallel: work(number, origin).
template <typename Work>
void forEachBlockOf(const LabelArray& labels, const Progress& progress, const Work& work) {
  std::vector<Coord> origins;
  forEachOriginOf(labels, [&](const Coord& origin) { origins.push_back(origin); });
  ProgressGate gate(progress, origins.size());
  tbb::parallel_for(std::size_t{0}, origins.size(), [&](std::size_t b) {
    work(b, origins[b]);
    gate.advance(1);
  });
}

/// Inverse of the error function [Giles11]. The relative error is below 1e-6.
double inverseErf(double x) {
  double w = -std::log((1 - x) * (1 + x)), p = 0;
  if (w < 5) {
    w -= 2.5;
    for (const double c : {2.81022636e-08, 3.43273939e-07, -3.5233877e-06, -4.39150654e-06,
                           0.00021858087, -0.00125372503, -0.00417768164, 0.246640727, 1.50140941})
      p = p * w + c;
  } else {
    w = std::sqrt(w) - 3;
    for (const double c : {-0.000200214257, 0.000100950558, 0.00134934322, -0.00367342844,
                           0.00573950773, -0.0076224613, 0.00943887047, 1.00167406, 2.83297682})
      p = p * w + c;
  }
  return p * x;
}

/// Indicator functions of the labels near a block, smoothed by a Gaussian.
class SmoothIndicators {
 public:
  explicit SmoothIndicators(double deviation)
      : deviation_(deviation), radius_(static_cast<int>(std::ceil(3 * deviation))) {
    double sum = 0;
    for (int d = -radius_; d <= radius_; ++d) {
      kernel_.push_back(std::exp(-d * d / (2 * deviation * deviation)));
      sum += kernel_.back();
    }
    for (double& weight : kernel_) weight /= sum;
  }

  /// @return false if only one label is near the block
  bool compute(const LabelArray& volume, const Coord& origin) {
    const int side = 8 + 2 * radius_;
    std::vector<RegionLabel> near(static_cast<std::size_t>(side * side * side));
    std::size_t n = 0;
    for (int x = 0; x < side; ++x)
      for (int y = 0; y < side; ++y)
        for (int z = 0; z < side; ++z)
          near[n++] = volume.labelAt(origin[0] + x - radius_, origin[1] + y - radius_,
                                     origin[2] + z - radius_);
    labels_ = near;
    std::sort(labels_.begin(), labels_.end());
    labels_.erase(std::unique(labels_.begin(), labels_.end()), labels_.end());
    values_.assign(labels_.size(), {});
    if (labels_.size() == 1) return false;
    for (std::size_t l = 0; l < labels_.size(); ++l) smooth(near, side, labels_[l], values_[l]);
    return true;
  }
  /// Label with the largest indicator; the smallest of equals.
  [[nodiscard]] RegionLabel largest(std::uint32_t n) const {
    std::size_t best = 0;
    for (std::size_t l = 1; l < labels_.size(); ++l)
      if (values_[l][n] > values_[best][n]) best = l;
    return labels_[best];
  }
  /// Distance at which a flat interface between two labels has the same indicators, voxels.
  [[nodiscard]] double distance(std::uint32_t n, RegionLabel own, RegionLabel other) const {
    const double a = at(n, own), b = at(n, other);
    if (!(a + b > 0)) return std::numeric_limits<double>::infinity();
    constexpr double kLargest = 1 - 1e-9;
    const double ratio = std::clamp((a - b) / (a + b), 0.0, kLargest);
    return std::numbers::sqrt2 * deviation_ * inverseErf(ratio);
  }

 private:
  using Block = std::array<double, SegmentedData::kVoxels>;

  [[nodiscard]] double at(std::uint32_t n, RegionLabel label) const {
    const auto found = std::lower_bound(labels_.begin(), labels_.end(), label);
    if (found == labels_.end() || *found != label) return 0;
    return values_[static_cast<std::size_t>(found - labels_.begin())][n];
  }

  void smooth(const std::vector<RegionLabel>& near, int side, RegionLabel label, Block& out) {
    const int taps = 2 * radius_ + 1;
    alongZ_.assign(static_cast<std::size_t>(side * side * 8), 0);
    alongY_.assign(static_cast<std::size_t>(side * 64), 0);
    for (int line = 0; line < side * side; ++line)
      for (int t = 0; t < taps; ++t)
        for (int z = 0; z < 8; ++z)
          if (near[static_cast<std::size_t>(line * side + z + t)] == label)
            alongZ_[static_cast<std::size_t>(line * 8 + z)] += kernel_[static_cast<std::size_t>(t)];
    for (int x = 0; x < side; ++x)
      for (int t = 0; t < taps; ++t)
        for (int n = 0; n < 64; ++n)
          alongY_[static_cast<std::size_t>(x * 64 + n)] +=
              kernel_[static_cast<std::size_t>(t)] *
              alongZ_[static_cast<std::size_t>((x * side + t) * 8 + n)];
    out.fill(0);
    for (int x = 0; x < 8; ++x)
      for (int t = 0; t < taps; ++t)
        for (int n = 0; n < 64; ++n)
          out[static_cast<std::size_t>(x * 64 + n)] +=
              kernel_[static_cast<std::size_t>(t)] *
              alongY_[static_cast<std::size_t>((x + t) * 64 + n)];
  }

  double deviation_;
  int radius_;
  std::vector<double> kernel_;
  std::vector<RegionLabel> labels_;
  std::vector<Block> values_;
  std::vector<double> alongZ_, alongY_;
};

/// Offsets of the samples around one, by the distance of their cubes.
struct CubeOffset {
  int x, y, z;
  double distance;  ///< voxels
};
std::vector<CubeOffset> cubeOffsets() {
  const auto gap = [](int d) { return std::max(std::abs(d) - 0.5, 0.0); };
  std::vector<CubeOffset> offsets;
  constexpr int kReach = BlockSurroundings::kReach;
  for (int x = -kReach; x <= kReach; ++x)
    for (int y = -kReach; y <= kReach; ++y)
      for (int z = -kReach; z <= kReach; ++z)
        offsets.push_back({x, y, z, std::hypot(gap(x), gap(y), gap(z))});
  std::stable_sort(offsets.begin(), offsets.end(),
                   [](const auto& a, const auto& b) { return a.distance < b.distance; });
  return offsets;
}

/// Distances of a sample to the cubes of other labels.
class CubeDistances {
 public:
  /// @param labels  that are searched
  void find(const BlockSurroundings& around, std::uint32_t n,
            const std::vector<RegionLabel>& labels, std::vector<double>& distances) const {
    distances.assign(labels.size(), std::numeric_limits<double>::infinity());
    std::size_t missing = labels.size();
    const Coord at = SegmentedData::localOf(n);
    for (const CubeOffset& offset : offsets_) {
      if (missing == 0) return;
      const RegionLabel label = around.at(at[0] + offset.x, at[1] + offset.y, at[2] + offset.z);
      const auto found = std::lower_bound(labels.begin(), labels.end(), label);
      if (found == labels.end() || *found != label) continue;
      double& distance = distances[static_cast<std::size_t>(found - labels.begin())];
      if (std::isfinite(distance)) continue;
      distance = offset.distance;
      --missing;
    }
  }

 private:
  std::vector<CubeOffset> offsets_ = cubeOffsets();
};

/// Distances of the samples of a block.
/// @param indicators  null: distances to cubes
void setDistances(const BlockSurroundings& around, const CubeDistances& cubes,
                  const SmoothIndicators* indicators, double voxelSize, float background,
                  SegmentedBlockValues& values) {
  const float largest = std::nextafter(background, 0.0f);
  std::vector<RegionLabel> others, adjacent;
  std::vector<double> distances;
  for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
    const RegionLabel own = values.labels[n];
    values.distances[n] = background;
    values.neighbours[n] = own;
    around.others(n, own, 2, others);
    if (others.empty()) continue;
    around.others(n, own, 1, adjacent);
    if (indicators) {
      distances.clear();
      for (const RegionLabel label : others)
        distances.push_back(indicators->distance(n, own, label));
    } else {
      cubes.find(around, n, others, distances);
    }
    const auto inWorld = [&](double distance) {
      return static_cast<float>(std::min(distance * voxelSize, static_cast<double>(background)));
    };
    const auto nearest = static_cast<std::size_t>(
        std::min_element(distances.begin(), distances.end()) - distances.begin());
    values.distances[n] = inWorld(distances[nearest]);
    values.neighbours[n] = others[nearest];
    if (adjacent.empty()) continue;
    // Cells with several labels need a distance in all corners.
    values.distances[n] = std::min(values.distances[n], largest);
    for (std::size_t i = 0; i < others.size(); ++i)
      if (i != nearest && std::binary_search(adjacent.begin(), adjacent.end(), others[i]))
        values.extras.push_back({static_cast<std::uint16_t>(n), others[i], inWorld(distances[i])});
  }
}

/// Index-to-world matrix of the field. A mirrored volume is read from the other end of its rows.
Imath::M44d cubicMatrix(const Volume& volume, bool& isMirrored) {
  constexpr double kTolerance = 1e-4;
  const VolumeGrid& grid = volume.grid();
  const Imath::V3d spacing = grid.spacing();
  const double largest = std::max({spacing.x, spacing.y, spacing.z}),
               smallest = std::min({spacing.x, spacing.y, spacing.z});
  if (largest > smallest * (1 + kTolerance)) {
    throw InvalidInput(fmt::format(
        "the spacings of the volume are {:.6g}, {:.6g} and {:.6g}; resample it to cubic "
        "voxels first, without interpolating between labels",
        spacing.x, spacing.y, spacing.z));
  }
  if (!grid.isOrthogonal())
    throw InvalidInput(
        "the axes of the volume are not perpendicular; resample it to a perpendicular grid first, "
        "without interpolating between labels");
  Imath::M44d matrix = grid.indexToWorld;
  isMirrored = matrix.determinant() < 0;
  if (isMirrored) {
    for (int j = 0; j < 3; ++j) {
      matrix[3][j] += matrix[0][j] * (grid.size.x - 1);
      matrix[0][j] = -matrix[0][j];
    }
  }
  // Makes the spacings equal to the last bit.
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) matrix[i][j] *= spacing.x / spacing[i];
  return matrix;
}

}  // namespace

SegmentedField segmentLabels(const Volume& volume, const SegmentLabelsOptions& options) {
  const bool isSmooth = options.smooth != 0;
  if (isSmooth && !(options.smooth >= 0.5 && options.smooth <= 3)) {
    throw UsageError(
        fmt::format("the deviation is {} voxels; give 0, or 0.5 to 3", options.smooth));
  }
  bool isMirrored = false;
  const Imath::M44d matrix = cubicMatrix(volume, isMirrored);
  requireMemory((isSmooth ? 4.0 : 2.0) * static_cast<double>(volume.grid().pointCount()),
                memoryLeft(options.maxMemory));
  const LabelArray given(volume, isMirrored, subProgress(options.progress, 0, 0.2));

  // === Owners
  LabelArray owners = given;
  if (isSmooth)
    forEachBlockOf(given, subProgress(options.progress, 0.2, 0.5),
                   [&](std::size_t, const Coord& origin) {
                     SmoothIndicators indicators(options.smooth);
                     if (!indicators.compute(given, origin)) return;
                     for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
                       const Coord at = origin + SegmentedData::localOf(n);
                       if (given.contains(at[0], at[1], at[2]))
                         owners.at(at[0], at[1], at[2]) = indicators.largest(n);
                     }
                   });
  if (owners.isVoid()) {
    throw InvalidInput(given.isVoid() ? "all labels of the volume are 0, the void; give a volume "
                                        "with regions"
                                      : "smoothing removes all regions; use a smaller deviation");
  }

  // === Distances
  const openvdb::math::Transform::Ptr transform = transformOf(matrix);
  const double voxelSize = transform->voxelSize()[0];
  const float background = backgroundOf(kLabelHalfWidth, voxelSize);
  requireBackground(background, voxelSize);
  const std::size_t count = blockCountOf(given);
  std::vector<PackedBlock> packed(count);
  std::vector<RegionLabel> tiles(count);
  const CubeDistances cubes;
  forEachBlockOf(
      owners, subProgress(options.progress, 0.5, 1), [&](std::size_t b, const Coord& origin) {
        BlockSurroundings around;
        around.fill([&](int i, int j, int k, int x, int y, RegionLabel* row) {
          for (int z = 0; z < 8; ++z)
            row[z] =
                owners.labelAt(origin[0] + 8 * i + x, origin[1] + 8 * j + y, origin[2] + 8 * k + z);
        });
        if (around.palette().size() == 1) {
          tiles[b] = around.palette()[0];
          return;
        }
        around.findNeighbours();
        SmoothIndicators indicators(std::max(options.smooth, 0.5));
        if (isSmooth) indicators.compute(given, origin);
        SegmentedBlockValues values;
        values.origin = origin;
        for (std::uint32_t n = 0; n < SegmentedData::kVoxels; ++n) {
          const Coord at = SegmentedData::localOf(n);
          values.labels[n] = around.at(at[0], at[1], at[2]);
        }
        setDistances(around, cubes, isSmooth ? &indicators : nullptr, voxelSize, background,
                     values);
        packed[b] = packBlock(values, background);
      });

  const auto tree = std::make_shared<openvdb::Int32Tree>(SegmentedData::tile(kVoid));
  openvdb::tree::ValueAccessor<openvdb::Int32Tree> accessor(*tree);
  std::size_t b = 0;
  forEachOriginOf(given, [&](const Coord& origin) {
    if (tiles[b] != kVoid)
      accessor.setValueOff(SegmentedData::blockCoord(origin), SegmentedData::tile(tiles[b]));
    ++b;
  });
  std::erase_if(packed, [](const PackedBlock& block) { return block.words.empty(); });
  return assembleSegmented(transform, kLabelHalfWidth, tree, std::move(packed));
}

}  // namespace levelset
