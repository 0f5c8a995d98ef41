#include "levelset/segmented/meshing/sharpen_junctions.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "levelset/progress_gate.h"
#include "levelset/segmented/local/interface_fit.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {
namespace {

using Imath::V3d;
using openvdb::Coord;

constexpr double kLargestDistance = 1.75;  // voxels: of the samples of a fit
constexpr int kRelaxations = 5;
constexpr double kZigzag = 0.1;  // voxels: distance from the middle of both neighbours

/// Distances to the nearest interfaces in and around a block.
class JunctionSamples {
 public:
  /// @param origin  of the block, index coordinates
  JunctionSamples(const SegmentedData& data, const Coord& origin)
      : origin_(origin), samples_(static_cast<std::size_t>(kSide) * kSide * kSide) {
    SegmentedReader reader(data);
    for (int x = -kReach; x <= 8 + kReach; ++x)
      for (int y = -kReach; y <= 8 + kReach; ++y)
        for (int z = -kReach; z <= 8 + kReach; ++z) {
          const SegmentedReader::Nearest near = reader.nearest(origin.offsetBy(x, y, z));
          samples_[index(x, y, z)] = {static_cast<double>(near.distance) / data.voxelSize,
                                      near.label, near.neighbour};
        }
  }

  /// Fits the interface between two regions. Only the grid points to which it is the nearest
  /// interface determine it, so it is extended smoothly up to a junction where it ends.
  /// @param position  in the block
  [[nodiscard]] std::optional<InterfaceFit> fit(RegionLabel a, RegionLabel b,
                                                const V3d& position) const {
    const V3d about = position - V3d(origin_[0], origin_[1], origin_[2]);
    std::array<int, 3> centre{};
    for (int axis = 0; axis < 3; ++axis)
      centre[static_cast<std::size_t>(axis)] =
          std::clamp(static_cast<int>(std::lround(about[axis])), 0, 8);
    std::vector<InterfaceSample> found;
    for (int x = centre[0] - kReach; x <= centre[0] + kReach; ++x)
      for (int y = centre[1] - kReach; y <= centre[1] + kReach; ++y)
        for (int z = centre[2] - kReach; z <= centre[2] + kReach; ++z) {
          const Sample& sample = samples_[index(x, y, z)];
          const bool isA = sample.label == a && sample.neighbour == b,
                     isB = sample.label == b && sample.neighbour == a;
          if ((!isA && !isB) || sample.distance > kLargestDistance) continue;
          found.push_back({V3d(origin_[0] + x, origin_[1] + y, origin_[2] + z),
                           isA ? sample.distance : -sample.distance});
        }
    return fitInterface(position, found);
  }

 private:
  static constexpr int kReach = 3;  // voxels
  static constexpr int kSide = 8 + 1 + 2 * kReach;
  [[nodiscard]] static std::size_t index(int x, int y, int z) {
    return static_cast<std::size_t>(((x + kReach) * kSide + y + kReach) * kSide + z + kReach);
  }
  struct Sample {
    double distance;  ///< voxels
    RegionLabel label, neighbour;
  };

  Coord origin_;
  std::vector<Sample> samples_;
};

/// Vertices at and beside junctions, with the interfaces that they lie on.
class JunctionStrip {
 public:
  JunctionStrip(const SegmentedData& data, const std::vector<char>& isDoubtful, SegmentedMesh& mesh)
      : data_(data), isDoubtful_(isDoubtful), mesh_(mesh) {}

  void run(const Progress& progress) {
    findVertices();
    findNeighbours();
    fitInterfaces(subProgress(progress, 0, 0.9));
    // The points first, then the curves between them, then the interfaces.
    for (int n = 0; n <= kRelaxations; ++n) relax(n == 0);
    for (int n = 0; n < kRelaxations; ++n) straighten();
    report(progress, 1);
  }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct StripVertex {
    std::uint32_t vertex;
    bool isJunction = false;
    std::vector<RegionLabel> labels = {};        ///< that meet here, ascending
    std::vector<std::uint32_t> neighbours = {};  ///< along the curve, or on the interface
    std::vector<InterfaceFit> interfaces = {};   ///< empty: the vertex stays
  };

  void addLabel(StripVertex& vertex, RegionLabel label) {
    const auto at = std::lower_bound(vertex.labels.begin(), vertex.labels.end(), label);
    if (at == vertex.labels.end() || *at != label) vertex.labels.insert(at, label);
  }

  void findVertices() {
    slots_.assign(mesh_.mesh.positions.size(), kNone);
    const auto touch = [&](std::uint32_t vertex) -> StripVertex& {
      std::uint32_t& slot = slots_[vertex];
      if (slot == kNone) {
        slot = static_cast<std::uint32_t>(strip_.size());
        strip_.push_back({.vertex = vertex});
      }
      return strip_[slot];
    };
    for (const JunctionEdge& edge : mesh_.junctions)
      for (std::size_t end = 0; end < 2; ++end) {
        StripVertex& vertex = touch(edge.vertices[end]);
        vertex.isJunction = true;
        vertex.neighbours.push_back(edge.vertices[1 - end]);
        for (const RegionLabel label : edge.labels) addLabel(vertex, label);
      }
    const std::size_t junctions = strip_.size();
    for (std::size_t t = 0; t < mesh_.sides.size(); ++t) {
      const auto& triangle = mesh_.mesh.triangles[t];
      const bool isBeside = std::any_of(triangle.begin(), triangle.end(),
                                        [&](std::uint32_t v) { return slots_[v] < junctions; });
      for (const std::uint32_t v : triangle) {
        if (!isBeside && !isDoubtful_[v]) continue;
        StripVertex& vertex = touch(v);
        addLabel(vertex, mesh_.sides[t].behind);
        addLabel(vertex, mesh_.sides[t].front);
      }
    }
  }

  void findNeighbours() {
    for (const auto& triangle : mesh_.mesh.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t slot = slots_[triangle[k]];
        if (slot == kNone || strip_[slot].isJunction) continue;
        strip_[slot].neighbours.push_back(triangle[(k + 1) % 3]);
        strip_[slot].neighbours.push_back(triangle[(k + 2) % 3]);
      }
    for (StripVertex& vertex : strip_) {
      std::vector<std::uint32_t>& list = vertex.neighbours;
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
  }

  [[nodiscard]] Coord blockOf(std::uint32_t vertex) const {
    const V3d& p = mesh_.mesh.positions[vertex];
    const auto block = [](double x) { return static_cast<int>(std::floor(x)) >> 3; };
    return {block(p.x), block(p.y), block(p.z)};
  }

  /// Fits the interfaces at all vertices, block by block.
  void fitInterfaces(const Progress& progress) {
    std::vector<std::pair<Coord, std::uint32_t>> order;
    for (std::uint32_t n = 0; n < strip_.size(); ++n)
      order.emplace_back(blockOf(strip_[n].vertex), n);
    std::sort(order.begin(), order.end());
    std::vector<std::size_t> firsts;
    for (std::size_t i = 0; i < order.size(); ++i)
      if (i == 0 || order[i].first != order[i - 1].first) firsts.push_back(i);
    firsts.push_back(order.size());
    ProgressGate gate(progress, firsts.size());
    tbb::parallel_for(std::size_t{0}, firsts.size() - 1, [&](std::size_t b) {
      const Coord block = order[firsts[b]].first;
      const JunctionSamples samples(data_, {block[0] << 3, block[1] << 3, block[2] << 3});
      for (std::size_t i = firsts[b]; i < firsts[b + 1]; ++i)
        fitInterfacesAt(strip_[order[i].second], samples);
      gate.advance(1);
    });
  }

  void fitInterfacesAt(StripVertex& vertex, const JunctionSamples& samples) const {
    const V3d& about = mesh_.mesh.positions[vertex.vertex];
    const std::vector<RegionLabel>& labels = vertex.labels;
    for (std::size_t i = 0; i < labels.size(); ++i)
      for (std::size_t j = i + 1; j < labels.size(); ++j)
        if (const auto found = samples.fit(labels[i], labels[j], about))
          vertex.interfaces.push_back(*found);
    // One interface less than labels meets in the curve or point.
    if (vertex.interfaces.size() + 1 < labels.size()) vertex.interfaces.clear();
  }

  void relax(bool isFirst) {
    std::vector<V3d> moved(strip_.size());
    tbb::parallel_for(std::size_t{0}, strip_.size(), [&](std::size_t n) {
      const StripVertex& vertex = strip_[n];
      const V3d& old = mesh_.mesh.positions[vertex.vertex];
      V3d target = old;
      // Ends of curves, and points where curves meet, have no direction to move in.
      if (!isFirst && (!vertex.isJunction || vertex.neighbours.size() == 2)) {
        target = V3d(0);
        for (const std::uint32_t v : vertex.neighbours) target += mesh_.mesh.positions[v];
        target /= static_cast<double>(vertex.neighbours.size());
      }
      // Beside creases, where no interface fits, the vertex only follows its neighbours.
      moved[n] = vertex.interfaces.empty()
                     ? target
                     : meetingPoint(vertex.interfaces, target).value_or(target);
    });
    for (std::size_t n = 0; n < strip_.size(); ++n)
      mesh_.mesh.positions[strip_[n].vertex] = moved[n];
  }

  /// Moves vertices of curves that zigzag towards their neighbours. Smooth curves stay. Fits to
  /// volumes of labels have noise, which differs from vertex to vertex.
  void straighten() {
    std::vector<V3d> moved(strip_.size());
    tbb::parallel_for(std::size_t{0}, strip_.size(), [&](std::size_t n) {
      const StripVertex& vertex = strip_[n];
      const V3d& old = mesh_.mesh.positions[vertex.vertex];
      moved[n] = old;
      if (!vertex.isJunction || vertex.neighbours.size() != 2) return;
      const V3d middle = (mesh_.mesh.positions[vertex.neighbours[0]] +
                          mesh_.mesh.positions[vertex.neighbours[1]]) /
                         2;
      if ((middle - old).length() > kZigzag) moved[n] = (old + middle) / 2;
    });
    for (std::size_t n = 0; n < strip_.size(); ++n)
      mesh_.mesh.positions[strip_[n].vertex] = moved[n];
  }

  const SegmentedData& data_;
  const std::vector<char>& isDoubtful_;
  SegmentedMesh& mesh_;
  std::vector<std::uint32_t> slots_;  ///< place in the strip, by vertex
  std::vector<StripVertex> strip_;    ///< junctions first
};

}  // namespace

void sharpenJunctions(const SegmentedData& data, const std::vector<char>& isDoubtful,
                      SegmentedMesh& mesh, const Progress& progress) {
  if (mesh.junctions.empty()) return;
  JunctionStrip(data, isDoubtful, mesh).run(progress);
}

}  // namespace levelset
