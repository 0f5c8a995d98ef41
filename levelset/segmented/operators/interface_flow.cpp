#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "levelset/distance/redistance.h"
#include "levelset/grids/grid_queries_vdb.h"
#include "levelset/progress_gate.h"
#include "levelset/segmented/flow/flow_convolution_vdb.h"
#include "levelset/segmented/operators/interface_flow_vdb.h"
#include "levelset/segmented/operators/junction_distances_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using Leaf = FloatTree::LeafNodeType;

constexpr std::uint32_t kLeafVoxels = SegmentedData::kVoxels;
constexpr double kRaceHalfWidth = 3;  // voxels: of the bands before they are redistanced
// Voxels between the end of a band and the points that a step may give to another region.
constexpr double kFarMargin = 2;
// Distance from junctions within which distances are corrected, voxels.
constexpr double kJunctionRadius = 3;
// Half of the widths over which a volume fades out at an interface, voxels. Sums over grid planes
// are exact for whole widths.
constexpr double kFade = 1.5, kNarrowFade = 1;
/// Partition in the middle of a step: convolved distances, which compete for each grid point.
class Race {
 public:
  using Values = std::array<float, kLeafVoxels>;

  Race(const RegionBands& bands, const std::vector<char>& isFixed)
      : bands_(bands),
        isFixed_(isFixed),
        leaves_(labelledLeaves(bands)),
        firsts_(firstLeaves(leaves_)),
        voxelSize_(vdb(bands.bands.front()).voxelSize()[0]),
        far_(vdb(bands.bands.front()).background() - static_cast<float>(kFarMargin * voxelSize_)) {}

  [[nodiscard]] std::size_t blockCount() const { return firsts_.size() - 1; }
  [[nodiscard]] const std::vector<LabelledLeaf>& leaves() const { return leaves_; }

  /// Convolves distances to regions that move.
  void convolve(const StepKernels& step, const Progress& progress) {
    values_.resize(leaves_.size());
    const std::set<Coord> near = step.junction.empty() ? std::set<Coord>() : blocksNearJunctions();
    ProgressGate gate(progress, blockCount());
    tbb::parallel_for(std::size_t{0}, blockCount(), [&](std::size_t b) {
      const std::vector<FlowKernel>& kernels =
          near.contains(leaves_[firsts_[b]].block) ? step.junction : step.smooth;
      LeafConvolution convolution(kernels);
      for (std::size_t e = firsts_[b]; e < firsts_[b + 1]; ++e) {
        const LabelledLeaf& entry = leaves_[e];
        if (isFixed_[entry.region] || kernels.empty()) {
          std::copy_n(entry.leaf->buffer().data(), kLeafVoxels, values_[e].begin());
        } else {
          const auto accessor = vdb(bands_.bands[entry.region]).getConstUnsafeAccessor();
          convolution.run(accessor, entry.leaf->origin(), values_[e]);
        }
        for (float& value : values_[e]) value *= bands_.sign(entry.region);
      }
      gate.advance(1);
    });
  }

  /// Computes, for each leaf of a block, a function that is negative in the new region: half of the
  /// difference to the least value of the others.
  /// @param results  one for each leaf
  void run(std::size_t block, const std::vector<double>& constants,
           std::vector<Values>& results) const {
    const std::size_t first = firsts_[block], count = firsts_[block + 1] - first;
    results.resize(count);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (std::uint32_t n = 0; n < kLeafVoxels; ++n) {
      // The two least values of the regions that move, and the least of the fixed ones.
      float least = kInfinity, second = kInfinity, wall = kInfinity;
      std::size_t winner = count;
      for (std::size_t i = 0; i < count; ++i) {
        const float value = valueOf(first + i, n, constants);
        if (isFixed_[leaves_[first + i].region]) {
          wall = std::min(wall, value);
        } else if (value < least) {
          second = least;
          least = value;
          winner = i;
        } else {
          second = std::min(second, value);
        }
      }
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t e = first + i;
        const std::size_t region = leaves_[e].region;
        const float old = bands_.sign(region) * leaves_[e].leaf->getValue(n);
        if (std::abs(old) >= far_ || isFixed_[region]) {
          results[i][n] = old;
          continue;
        }
        const float rival = i == winner ? second : least;
        const float value = (valueOf(e, n, constants) - rival) / 2;
        results[i][n] = std::max(value, -wall);
      }
    }
  }

  /// Makes trees of the functions that compete.
  [[nodiscard]] CompetingFields fields(const std::vector<double>& constants) const {
    CompetingFields result{{}, isFixed_, voxelSize_};
    for (std::size_t r = 0; r < bands_.bands.size(); ++r) {
      result.trees.push_back(std::make_shared<FloatTree>(vdb(bands_.bands[r]).tree()));
      if (bands_.sign(r) > 0) continue;
      auto tile = result.trees[r]->beginValueOff();
      tile.setMaxDepth(FloatTree::DEPTH - 2);
      for (; tile; ++tile) tile.setValue(-*tile);
      result.trees[r]->root().setBackground(-result.trees[r]->background(), false);
    }
    std::vector<Leaf*> targets;
    for (const LabelledLeaf& entry : leaves_)
      targets.push_back(result.trees[entry.region]->probeLeaf(entry.leaf->origin()));
    tbb::parallel_for(std::size_t{0}, targets.size(), [&](std::size_t e) {
      for (std::uint32_t n = 0; n < kLeafVoxels; ++n)
        targets[e]->setValueOnly(n, valueOf(e, n, constants));
    });
    return result;
  }

  /// Volumes of the regions, voxels, and their derivatives by the constants.
  struct Volumes {
    Eigen::VectorXd volumes;
    Eigen::MatrixXd derivatives;
  };
  [[nodiscard]] Volumes volumes(const std::vector<double>& constants) const {
    const auto regions = static_cast<Eigen::Index>(bands_.bands.size());
    std::vector<BlockVolumes> parts(blockCount());
    tbb::parallel_for(std::size_t{0}, blockCount(),
                      [&](std::size_t b) { parts[b] = volumesOf(b, constants); });
    Volumes sum{Eigen::VectorXd::Zero(regions), Eigen::MatrixXd::Zero(regions, regions)};
    for (Eigen::Index r = 0; r < regions; ++r)
      sum.volumes[r] = tileVolume(static_cast<std::size_t>(r));
    for (std::size_t b = 0; b < blockCount(); ++b) {
      const std::size_t first = firsts_[b], count = firsts_[b + 1] - first;
      for (std::size_t i = 0; i < count; ++i) {
        const auto r = static_cast<Eigen::Index>(leaves_[first + i].region);
        sum.volumes[r] += parts[b].volumes[i];
        for (std::size_t j = 0; j < count; ++j) {
          const double area = parts[b].areas[i * count + j];
          const auto s = static_cast<Eigen::Index>(leaves_[first + j].region);
          sum.derivatives(r, r) -= area;
          sum.derivatives(r, s) += area;
        }
      }
    }
    return sum;
  }

 private:
  /// Finds the blocks of junctions and those beside them. Elsewhere the wide kernel gains nothing,
  /// and would average over regions of a few voxels.
  [[nodiscard]] std::set<Coord> blocksNearJunctions() const {
    constexpr double kTouch = 2;  // voxels: grid points as near to three regions
    std::set<Coord> result;
    for (std::size_t b = 0; b < blockCount(); ++b) {
      const std::span here(leaves_.data() + firsts_[b], firsts_[b + 1] - firsts_[b]);
      for (std::uint32_t n = 0; n < kLeafVoxels; ++n) {
        const auto near = std::ranges::count_if(here, [&](const LabelledLeaf& entry) {
          return std::abs(static_cast<double>(entry.leaf->getValue(n))) < kTouch * voxelSize_;
        });
        if (near < 3) continue;
        for (int i = 0; i < 27; ++i)
          result.insert(here[0].block + Coord(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1));
        break;
      }
    }
    return result;
  }

  [[nodiscard]] float valueOf(std::size_t leaf, std::uint32_t n,
                              const std::vector<double>& constants) const {
    return values_[leaf][n] + static_cast<float>(constants[leaves_[leaf].region]);
  }

  struct BlockVolumes {
    std::vector<double> volumes, areas;  ///< by leaf; by leaf and leaf, per world unit of constant
  };
  /// Sums the shares of the regions in each voxel. A share fades out over an interface, and all
  /// shares of a voxel add up to one. The error is of second order in the width over which they
  /// fade, also at junctions, so two widths cancel it.
  [[nodiscard]] BlockVolumes volumesOf(std::size_t block,
                                       const std::vector<double>& constants) const {
    const std::size_t count = firsts_[block + 1] - firsts_[block];
    BlockVolumes result{std::vector<double>(count), std::vector<double>(count * count)};
    std::vector<Values> values;
    run(block, constants, values);
    constexpr double kNarrowSquare = kNarrowFade * kNarrowFade, kWideSquare = kFade * kFade,
                     kNarrowWeight = kWideSquare / (kWideSquare - kNarrowSquare);
    const double fade = kFade * voxelSize_;
    std::vector<double> shares(count);
    for (std::uint32_t n = 0; n < kLeafVoxels; ++n) {
      std::size_t least = 0, second = count;
      for (std::size_t i = 1; i < count; ++i) {
        if (values[i][n] < values[least][n]) {
          second = least;
          least = i;
        } else if (second == count || values[i][n] < values[second][n]) {
          second = i;
        }
      }
      for (const auto& [width, weight] : {std::pair(kNarrowFade * voxelSize_, kNarrowWeight),
                                          std::pair(fade, 1 - kNarrowWeight)}) {
        double sum = 0;
        for (std::size_t i = 0; i < count; ++i) {
          shares[i] = std::clamp(0.5 - static_cast<double>(values[i][n]) / (2 * width), 0.0, 1.0);
          sum += shares[i];
        }
        if (!(sum > 0)) continue;
        for (std::size_t i = 0; i < count; ++i) result.volumes[i] += weight * shares[i] / sum;
      }
      const auto isNear = [&](std::size_t i) {
        return i < count && std::abs(static_cast<double>(values[i][n])) < fade &&
               !isFixed_[leaves_[firsts_[block] + i].region];
      };
      if (!isNear(least) || !isNear(second)) continue;
      result.areas[least * count + second] += 1 / (4 * fade);
      result.areas[second * count + least] += 1 / (4 * fade);
    }
    return result;
  }

  /// Volume of the tiles inside a region, voxels. That of the void counts as none.
  [[nodiscard]] double tileVolume(std::size_t region) const {
    if (bands_.labels[region] == kVoid) return 0;
    double sum = 0;
    auto it = vdb(bands_.bands[region]).tree().cbeginValueAll();
    it.setMaxDepth(FloatTree::DEPTH - 2);  // tiles only
    for (; it; ++it)
      if (*it < 0) sum += static_cast<double>(it.getBoundingBox().volume());
    return sum;
  }

  const RegionBands& bands_;
  const std::vector<char>& isFixed_;
  std::vector<LabelledLeaf> leaves_;
  std::vector<std::size_t> firsts_;
  std::vector<Values> values_;  ///< by leaf; negative inside, for the void too
  double voxelSize_;
  float far_;
};

/// Finds the constants that give the regions their volumes, by Newton's method.
/// @param constants  start, and result; that of the void and of fixed regions stays
/// @param reached    result: volumes before the last change
/// @return largest relative error of a volume before the last change
double findConstants(const Race& race, const std::vector<double>& volumes,
                     const std::vector<char>& isHeld, double voxelSize,
                     std::vector<double>& constants, std::vector<double>& reached) {
  constexpr int kVolumeIterations = 8;
  constexpr double kEnough = 1e-6;  // relative
  std::vector<Eigen::Index> free;
  for (std::size_t r = 0; r < volumes.size(); ++r)
    if (!isHeld[r]) free.push_back(static_cast<Eigen::Index>(r));
  double worst = 0;
  if (free.empty()) return worst;
  for (int n = 0; n < kVolumeIterations; ++n) {
    const Race::Volumes now = race.volumes(constants);
    reached.assign(now.volumes.begin(), now.volumes.end());
    Eigen::VectorXd missing(free.size());
    worst = 0;
    for (std::size_t i = 0; i < free.size(); ++i) {
      const double wanted = volumes[static_cast<std::size_t>(free[i])];
      missing[static_cast<Eigen::Index>(i)] = wanted - now.volumes[free[i]];
      worst = std::max(worst, std::abs(wanted - now.volumes[free[i]]) / std::max(wanted, 1.0));
    }
    if (worst < kEnough) break;
    const Eigen::MatrixXd matrix = now.derivatives(free, free);
    // Between fixed walls the sum of all volumes does not change, and the matrix is singular.
    const Eigen::VectorXd change = matrix.completeOrthogonalDecomposition().solve(missing);
    for (std::size_t i = 0; i < free.size(); ++i)
      constants[static_cast<std::size_t>(free[i])] +=
          std::clamp(change[static_cast<Eigen::Index>(i)], -voxelSize, voxelSize);
  }
  return worst;
}

/// Gives a tree another background.
void endTilesAt(FloatTree& tree, float background) {
  auto tile = tree.beginValueOff();
  tile.setMaxDepth(FloatTree::DEPTH - 2);
  for (; tile; ++tile) tile.setValue(std::copysign(background, *tile));
  tree.root().setBackground(background, /*updateChildNodes=*/false);
}

void writeLeaf(const Race::Values& values, float sign, float background, Leaf& leaf) {
  for (std::uint32_t n = 0; n < kLeafVoxels; ++n) {
    const float value = sign * values[n];
    if (std::abs(value) < background)
      leaf.setValueOn(n, value);
    else
      leaf.setValueOff(n, std::copysign(background, value));
  }
}

/// Replaces the distances near junctions. Creases of surfaces, at which distances are less exact,
/// end there.
/// @param bands   distances to the new regions
/// @param fields  functions that competed for them
/// @param radius  distance from junctions, voxels
void correctJunctions(RegionBands& bands, const CompetingFields& fields, double radius) {
  constexpr double kLargestChange = 1;  // voxels
  const double voxelSize = fields.voxelSize;
  const std::vector<LabelledLeaf> leaves = labelledLeaves(bands);
  const std::vector<std::size_t> firsts = firstLeaves(leaves);
  std::vector<Leaf*> targets(leaves.size());
  {
    std::vector<openvdb::FloatGrid*> grids;
    for (std::size_t r = 0; r < bands.bands.size(); ++r)
      grids.push_back(fields.isFixed[r] ? nullptr : &editVdb(bands.bands[r]));
    for (std::size_t e = 0; e < leaves.size(); ++e)
      if (grids[leaves[e].region])
        targets[e] = grids[leaves[e].region]->tree().probeLeaf(leaves[e].leaf->origin());
  }
  tbb::parallel_for(std::size_t{0}, firsts.size() - 1, [&](std::size_t b) {
    const std::size_t first = firsts[b], count = firsts[b + 1] - first;
    if (count < 3) return;
    JunctionDistances junctions(fields);
    std::vector<std::size_t> near, regions;
    std::vector<double> distances;
    for (std::uint32_t n = 0; n < kLeafVoxels; ++n) {
      near.clear();
      regions.clear();
      for (std::size_t e = first; e < first + count; ++e)
        if (std::abs(static_cast<double>(leaves[e].leaf->getValue(n))) < radius * voxelSize) {
          near.push_back(e);
          regions.push_back(leaves[e].region);
        }
      if (near.size() < 3) continue;
      junctions.find(leaves[first].leaf->offsetToGlobalCoord(n), regions, distances);
      for (std::size_t i = 0; i < near.size(); ++i) {
        if (!targets[near[i]] || distances[i] < 0) continue;
        const float old = targets[near[i]]->getValue(n);
        const auto distance = static_cast<float>(distances[i] * voxelSize);
        if (std::abs(distance - std::abs(old)) < kLargestChange * voxelSize)
          targets[near[i]]->setValueOnly(n, std::copysign(distance, old));
      }
    }
  });
}

}  // namespace

InterfaceFlow::InterfaceFlow(RegionBands bands, std::vector<char> isFixed, double step,
                             bool hasJunctions, bool keepsVolumes, std::size_t maxMemory)
    : bands_(std::move(bands)),
      isFixed_(std::move(isFixed)),
      constants_(bands_.bands.size(), 0),
      step_(step),
      hasJunctions_(hasJunctions),
      maxMemory_(maxMemory) {
  if (keepsVolumes) volumes_ = volumes();
}

double InterfaceFlow::halfWidthFor(double step, bool hasJunctions) {
  constexpr double kLeast = 6;
  double widest = 0;
  for (const auto& [variance, weight] : gaussiansFor(2 * step, hasJunctions))
    widest = std::max(widest, variance);
  return std::max(kLeast, std::ceil(kFarMargin + kDeviations * std::sqrt(widest)));
}

std::vector<double> InterfaceFlow::volumes() const {
  Race race(bands_, isFixed_);
  race.convolve({}, {});
  const Eigen::VectorXd now = race.volumes(std::vector<double>(bands_.bands.size())).volumes;
  return {now.begin(), now.end()};
}

void InterfaceFlow::addVolumes(const std::map<RegionLabel, double>& missing) {
  if (volumes_.empty()) return;
  volumes_ = volumes();
  for (std::size_t r = 0; r < volumes_.size(); ++r)
    if (const auto found = missing.find(bands_.labels[r]); found != missing.end())
      volumes_[r] += found->second;
}

std::vector<RegionLabel> InterfaceFlow::advance(const Progress& progress) {
  const double voxelSize = vdb(bands_.bands.front()).voxelSize()[0],
               halfWidth = bands_.bands.front().halfWidth();
  const float background = backgroundOf(kRaceHalfWidth, voxelSize);
  Race race(bands_, isFixed_);
  std::vector<double> wanted = volumes_;
  if (!reached_.empty()) {
    // Volumes of convolved distances differ from those of the redistanced regions. The difference
    // of the last step is made up for.
    race.convolve({}, {});
    const Eigen::VectorXd now = race.volumes(std::vector<double>(wanted.size())).volumes;
    for (std::size_t r = 0; r < wanted.size(); ++r)
      wanted[r] += reached_[r] - now[static_cast<Eigen::Index>(r)];
  }
  StepKernels kernels{flowKernels(2 * step_, false), {}};
  if (hasJunctions_) kernels.junction = flowKernels(2 * step_, true);
  race.convolve(kernels, subProgress(progress, 0, 0.3));
  if (!volumes_.empty()) {
    std::vector<char> isHeld = isFixed_;
    isHeld[0] = 1;  // the void
    volumeError_ = std::max(volumeError_,
                            findConstants(race, wanted, isHeld, voxelSize, constants_, reached_));
  }

  // === New regions
  std::vector<openvdb::FloatGrid::Ptr> grids(bands_.bands.size());
  for (std::size_t r = 0; r < grids.size(); ++r)
    if (!isFixed_[r]) grids[r] = vdb(bands_.bands[r]).deepCopy();
  std::vector<Leaf*> targets(race.leaves().size());
  for (std::size_t e = 0; e < targets.size(); ++e) {
    const LabelledLeaf& entry = race.leaves()[e];
    if (grids[entry.region])
      targets[e] = grids[entry.region]->tree().probeLeaf(entry.leaf->origin());
  }
  std::vector<std::size_t> firsts = firstLeaves(race.leaves());
  tbb::parallel_for(std::size_t{0}, race.blockCount(), [&](std::size_t b) {
    std::vector<Race::Values> values;
    race.run(b, constants_, values);
    for (std::size_t e = firsts[b]; e < firsts[b + 1]; ++e)
      if (targets[e])
        writeLeaf(values[e - firsts[b]], bands_.sign(race.leaves()[e].region), background,
                  *targets[e]);
  });

  // === Distances
  CompetingFields fields;
  if (grids.size() > 2) fields = race.fields(constants_);
  std::vector<RegionLabel> vanished;
  RegionBands next;
  std::vector<char> isFixed;
  std::vector<double> volumes, constants, reached;
  const bool hasTwo = grids.size() == 2 && grids[0] && grids[1];
  for (std::size_t r = 0; r < grids.size(); ++r) {
    NarrowBand band = bands_.bands[r];
    if (grids[r]) {
      endTilesAt(grids[r]->tree(), background);
      if (!hasInside(*grids[r])) {
        vanished.push_back(bands_.labels[r]);
        if (grids.size() > 2) fields.trees[r] = nullptr;
        continue;
      }
      const double done = static_cast<double>(r) / static_cast<double>(grids.size());
      // Between two regions there is one interface.
      band = hasTwo && r == 1 && !next.bands.empty()
                 ? next.bands[0]
                 : redistance(makeBand(std::move(grids[r])),
                              {.halfWidth = halfWidth,
                               .maxMemory = maxMemory_,
                               .progress = subProgress(progress, 0.4 + 0.6 * done, 1)});
    }
    next.labels.push_back(bands_.labels[r]);
    next.bands.push_back(std::move(band));
    isFixed.push_back(isFixed_[r]);
    constants.push_back(constants_[r]);
    if (!volumes_.empty()) volumes.push_back(volumes_[r]);
    if (!reached_.empty()) reached.push_back(reached_[r]);
  }
  if (grids.size() > 2) {
    std::erase(fields.trees, nullptr);
    fields.isFixed = isFixed;
    correctJunctions(next, fields, kJunctionRadius);
  }
  bands_ = std::move(next);
  isFixed_ = std::move(isFixed);
  constants_ = std::move(constants);
  volumes_ = std::move(volumes);
  reached_ = std::move(reached);
  return vanished;
}

}  // namespace levelset
