#include "levelset/segmented/meshing/sharpen_junctions.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>

#include "levelset/progress_gate.h"
#include "levelset/segmented/local/interface_fit.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {
namespace {

using Imath::V3d;
using openvdb::Coord;

constexpr double kLargestDistance = 1.75;  // voxels: of the samples of a fit
constexpr int kReach = 3;                  // voxels: of the samples of a fit, along each axis
/// Limits of a first guess. The interfaces are then fitted again at the guess. Where interfaces
/// meet at small angles, the mesh of the labels has its junction up to three voxels beside the
/// guess.
constexpr MeetingLimits kGuess = {.farthest = 3, .miss = 0.3};
constexpr int kRelaxations = 5;
constexpr double kFar = 0.5;     // voxels: move of a vertex beside which curves may be folded
constexpr int kUnfoldings = 60;  // relaxations of curves with ends that moved far
constexpr int kFoldedEdges = 6;  // of a curve, on each side of a vertex that moved far
constexpr double kZigzag = 0.1;  // voxels: distance from the middle of both neighbours

/// Nearest interface of a grid point.
struct NearestInterface {
  double distance;  ///< voxels
  RegionLabel label, neighbour;
};
NearestInterface sampleAt(SegmentedReader& reader, const SegmentedData& data, const Coord& c) {
  const SegmentedReader::Nearest near = reader.nearest(c);
  return {static_cast<double>(near.distance) / data.voxelSize, near.label, near.neighbour};
}

/// Calls visit(c) for the grid points around one.
template <class Visit>
void forEachAround(const Coord& centre, const Visit& visit) {
  for (int x = centre[0] - kReach; x <= centre[0] + kReach; ++x)
    for (int y = centre[1] - kReach; y <= centre[1] + kReach; ++y)
      for (int z = centre[2] - kReach; z <= centre[2] + kReach; ++z) visit(Coord(x, y, z));
}

/// Signed distances of grid points from the interface between two regions. Only the grid points to
/// which it is the nearest interface count, so its fit is extended smoothly up to a junction where
/// it ends.
/// @param centre    grid point at the middle
/// @param sampleOf  nearest interface of a grid point
template <class SampleOf>
std::vector<InterfaceSample> samplesBetween(RegionLabel a, RegionLabel b, const Coord& centre,
                                            const SampleOf& sampleOf) {
  std::vector<InterfaceSample> found;
  forEachAround(centre, [&](const Coord& c) {
    const NearestInterface& sample = sampleOf(c);
    const bool isA = sample.label == a && sample.neighbour == b,
               isB = sample.label == b && sample.neighbour == a;
    if ((!isA && !isB) || sample.distance > kLargestDistance) return;
    found.push_back({V3d(c[0], c[1], c[2]), isA ? sample.distance : -sample.distance});
  });
  return found;
}

/// Adds grid points whose nearest interface is another one. A narrow interface has too few of its
/// own. Beyond its rim their distances are too large; the fit gives these little weight.
void addFarther(const SegmentedData& data, RegionLabel a, RegionLabel b, const Coord& centre,
                std::vector<InterfaceSample>& samples) {
  SegmentedReader reader(data);
  forEachAround(centre, [&](const Coord& c) {
    const SegmentedReader::Nearest near = reader.nearest(c);
    if (near.label != a && near.label != b) return;
    const RegionLabel other = near.label == a ? b : a;
    if (near.neighbour == other) return;
    const double distance = static_cast<double>(reader.distanceTo(c, near, other)) / data.voxelSize;
    if (distance <= kLargestDistance)
      samples.push_back({V3d(c[0], c[1], c[2]), near.label == a ? distance : -distance});
  });
}

/// Fits an interface between two regions.
template <class SampleOf>
std::optional<InterfaceFit> fitBetween(const SegmentedData& data, RegionLabel a, RegionLabel b,
                                       const V3d& position, const Coord& centre,
                                       const SampleOf& sampleOf) {
  std::vector<InterfaceSample> found = samplesBetween(a, b, centre, sampleOf);
  if (!found.empty() && found.size() < kFewestSamples) addFarther(data, a, b, centre, found);
  return fitInterface(position, found);
}

/// Distances to the nearest interfaces in and around a block.
class JunctionSamples {
 public:
  /// @param origin  of the block, index coordinates
  JunctionSamples(const SegmentedData& data, const Coord& origin)
      : data_(data), origin_(origin), samples_(static_cast<std::size_t>(kSide) * kSide * kSide) {
    SegmentedReader reader(data);
    for (int x = -kReach; x <= 8 + kReach; ++x)
      for (int y = -kReach; y <= 8 + kReach; ++y)
        for (int z = -kReach; z <= 8 + kReach; ++z) {
          samples_[index(x, y, z)] = sampleAt(reader, data, origin.offsetBy(x, y, z));
        }
  }

  /// Fits the interface between two regions, see fitBetween().
  /// @param position  in the block
  [[nodiscard]] std::optional<InterfaceFit> fit(RegionLabel a, RegionLabel b,
                                                const V3d& position) const {
    const V3d about = position - V3d(origin_[0], origin_[1], origin_[2]);
    Coord centre = origin_;
    for (int axis = 0; axis < 3; ++axis)
      centre[axis] += std::clamp(static_cast<int>(std::lround(about[axis])), 0, 8);
    return fitBetween(
        data_, a, b, position, centre, [this](const Coord& c) -> const NearestInterface& {
          return samples_[index(c[0] - origin_[0], c[1] - origin_[1], c[2] - origin_[2])];
        });
  }

 private:
  static constexpr int kSide = 8 + 1 + 2 * kReach;
  [[nodiscard]] static std::size_t index(int x, int y, int z) {
    return static_cast<std::size_t>(((x + kReach) * kSide + y + kReach) * kSide + z + kReach);
  }

  const SegmentedData& data_;
  Coord origin_;
  std::vector<NearestInterface> samples_;
};

/// Vertices at and beside junctions, with the interfaces that they lie on.
class JunctionStrip {
 public:
  JunctionStrip(const SegmentedData& data, const std::vector<char>& isDoubtful, SegmentedMesh& mesh)
      : data_(data), isDoubtful_(isDoubtful), mesh_(mesh) {}

  void run(const Progress& progress) {
    findVertices();
    findNeighbours();
    std::vector<std::uint32_t> all(strip_.size());
    std::iota(all.begin(), all.end(), 0u);
    for (StripVertex& vertex : strip_) vertex.start = mesh_.mesh.positions[vertex.vertex];
    fitInterfaces(subProgress(progress, 0, 0.9));
    relax(all, Round::First);
    const std::vector<std::uint32_t> folded = verticesToUnfold();
    for (int n = 0; n < kUnfoldings; ++n) {
      relax(folded, Round::Unfold);
      report(progress, 0.9 + 0.05 * (n + 1) / kUnfoldings);
    }
    for (int n = 1; n < kRelaxations; ++n) relax(all, Round::Middle);
    relax(all, Round::Last);
    for (int n = 0; n < kRelaxations; ++n) straighten();
    report(progress, 1);
  }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct StripVertex {
    std::uint32_t vertex;
    bool isJunction = false;
    V3d start = V3d(0);                          ///< position in the mesh of the labels
    std::vector<RegionLabel> labels = {};        ///< that meet here, ascending
    std::vector<std::uint32_t> neighbours = {};  ///< along the curve, or on the interface
    std::vector<InterfaceFit> interfaces = {};   ///< empty: none was fitted here
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

  void fitInterfacesAt(StripVertex& vertex, const JunctionSamples& samples) {
    V3d& position = mesh_.mesh.positions[vertex.vertex];
    vertex.interfaces = interfacesAt(vertex.labels, position, samples);
    if (!vertex.isJunction || vertex.interfaces.empty()) return;
    if (meetingPoint(vertex.interfaces, position)) return;
    const std::optional<V3d> guess = meetingAt(vertex, vertex.interfaces, position, kGuess);
    if (!guess) return;
    std::vector<InterfaceFit> there =
        interfacesAt(vertex.labels, *guess, DirectSamples{data_, SegmentedReader(data_)});
    if (there.empty() || !meetingPoint(there, *guess)) return;
    position = *guess;
    vertex.interfaces = std::move(there);
  }

  /// Point near a position in which interfaces meet. Those that do not meet exactly would carry a
  /// vertex along its curve, so it only moves across.
  [[nodiscard]] static std::optional<V3d> meetingAt(const StripVertex& vertex,
                                                    std::span<const InterfaceFit> interfaces,
                                                    const V3d& position,
                                                    const MeetingLimits& limits = {}) {
    std::optional<V3d> meeting = meetingPoint(interfaces, position, limits);
    if (!meeting || !vertex.isJunction || vertex.neighbours.size() != 2) return meeting;
    // Along the curve: orthogonal to the two normals that differ most.
    V3d along(0);
    for (std::size_t i = 0; i < interfaces.size(); ++i)
      for (std::size_t j = i + 1; j < interfaces.size(); ++j) {
        const V3d cross = interfaces[i].gradient(*meeting).normalized().cross(
            interfaces[j].gradient(*meeting).normalized());
        if (cross.length2() > along.length2()) along = cross;
      }
    along.normalize();
    *meeting -= along * along.dot(*meeting - position);
    const bool isOnAll = std::all_of(interfaces.begin(), interfaces.end(), [&](const auto& one) {
      return std::abs(one.value(*meeting)) <= limits.miss * one.gradient(*meeting).length();
    });
    return isOnAll ? meeting : std::nullopt;
  }

  /// Point near a position in which regions meet, by interfaces that are fitted there.
  [[nodiscard]] std::optional<V3d> refittedMeeting(const StripVertex& vertex,
                                                   const V3d& position) const {
    const std::vector<InterfaceFit> there =
        interfacesAt(vertex.labels, position, DirectSamples{data_, SegmentedReader(data_)});
    return there.empty() ? std::nullopt : meetingAt(vertex, there, position);
  }

  /// Samples that are read one by one.
  struct DirectSamples {
    const SegmentedData& data;
    mutable SegmentedReader reader;
    [[nodiscard]] std::optional<InterfaceFit> fit(RegionLabel a, RegionLabel b,
                                                  const V3d& position) const {
      Coord centre;
      for (int axis = 0; axis < 3; ++axis)
        centre[axis] = static_cast<int>(std::lround(position[axis]));
      return fitBetween(data, a, b, position, centre,
                        [this](const Coord& c) { return sampleAt(reader, data, c); });
    }
  };

  /// Fits the interfaces between the regions near a position.
  /// @return empty when too few are found to meet in a curve or point
  template <class Samples>
  [[nodiscard]] static std::vector<InterfaceFit> interfacesAt(
      const std::vector<RegionLabel>& labels, const V3d& position, const Samples& samples) {
    std::vector<InterfaceFit> interfaces;
    for (std::size_t i = 0; i < labels.size(); ++i)
      for (std::size_t j = i + 1; j < labels.size(); ++j)
        if (const auto found = samples.fit(labels[i], labels[j], position))
          interfaces.push_back(*found);
    // One interface less than labels meets in the curve or point.
    if (interfaces.size() + 1 < labels.size()) interfaces.clear();
    return interfaces;
  }

  /// Vertices of junctions near those that moved far. A curve may pass its end and return there.
  [[nodiscard]] std::vector<std::uint32_t> verticesToUnfold() const {
    std::vector<std::uint32_t> found;
    std::vector<char> isFound(strip_.size(), 0);
    const auto add = [&](std::uint32_t slot) {
      if (slot == kNone || isFound[slot] || !strip_[slot].isJunction) return;
      isFound[slot] = 1;
      found.push_back(slot);
    };
    for (std::uint32_t n = 0; n < strip_.size(); ++n)
      if ((mesh_.mesh.positions[strip_[n].vertex] - strip_[n].start).length() > kFar) add(n);
    std::size_t first = 0;
    for (int edges = 0; edges < kFoldedEdges; ++edges) {
      const std::size_t last = found.size();
      for (; first < last; ++first)
        for (const std::uint32_t v : strip_[found[first]].neighbours) add(slots_[v]);
    }
    return found;
  }

  /// The first round moves vertices to where interfaces meet, the others also between their
  /// neighbours. The last one fits again where the interfaces of a vertex do not meet.
  enum class Round { First, Unfold, Middle, Last };
  void relax(const std::vector<std::uint32_t>& slots, Round round) {
    std::vector<V3d> moved(slots.size());
    tbb::parallel_for(std::size_t{0}, slots.size(), [&](std::size_t n) {
      const StripVertex& vertex = strip_[slots[n]];
      const V3d& old = mesh_.mesh.positions[vertex.vertex];
      V3d target = old;
      // Ends of curves, and points where curves meet, have no direction to move in.
      if (round != Round::First && (!vertex.isJunction || vertex.neighbours.size() == 2)) {
        target = V3d(0);
        for (const std::uint32_t v : vertex.neighbours) target += mesh_.mesh.positions[v];
        target /= static_cast<double>(vertex.neighbours.size());
        // Repeated steps to the middle would keep a zigzag.
        if (round == Round::Unfold) target = (target + old) / 2;
      }
      // Beside creases, where no interface fits, the vertex only follows its neighbours.
      std::optional<V3d> meeting;
      if (!vertex.interfaces.empty()) meeting = meetingAt(vertex, vertex.interfaces, target);
      if (!meeting && round == Round::Last && (vertex.isJunction || !vertex.interfaces.empty()))
        meeting = refittedMeeting(vertex, target);
      // Many rounds would cut off corners of curves, so a vertex without a meeting stays.
      moved[n] = meeting.value_or(round == Round::Unfold ? old : target);
    });
    for (std::size_t n = 0; n < slots.size(); ++n)
      mesh_.mesh.positions[strip_[slots[n]].vertex] = moved[n];
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
