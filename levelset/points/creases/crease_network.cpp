#include "levelset/points/creases/crease_network.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>

#include "levelset/points/creases/crease_samples.h"
#include "levelset/points/creases/crease_tracer.h"

namespace levelset::points {
namespace {

/// Adds the pieces of a corner to the conflicts.
void addConflicts(const CreaseCorner& corner, CreaseNetwork& network) {
  for (std::size_t k = 1; k < corner.pieces.size(); ++k)
    network.conflicts.push_back({corner.pieces[0], corner.pieces[k]});
}

/// Links the curves around each piece to loops.
void linkLoops(CreaseNetwork& network, std::size_t pieceCount) {
  network.loops.resize(pieceCount);
  // For each piece: the side that leaves a corner.
  using Key = std::pair<std::uint32_t, std::uint32_t>;  // piece, corner
  std::map<Key, std::vector<PieceSide>> leaving;
  std::map<Key, std::size_t> arriving;
  for (std::uint32_t c = 0; c < network.curves.size(); ++c) {
    const CreaseCurve& curve = network.curves[c];
    for (const bool isReversed : {false, true}) {
      const std::uint32_t piece = curve.pieces[isReversed];
      if (curve.isClosed()) {
        network.loops[piece].push_back({{c, isReversed}});
        continue;
      }
      leaving[{piece, curve.corners[isReversed]}].push_back({c, isReversed});
      ++arriving[{piece, curve.corners[!isReversed]}];
    }
  }
  bool isConsistent = true;
  const auto reject = [&](std::uint32_t corner) {
    addConflicts(network.corners[corner], network);
    isConsistent = false;
  };
  for (const auto& [key, sides] : leaving)
    if (sides.size() != 1 || !arriving.contains(key)) reject(key.second);
  for (const auto& [key, count] : arriving)
    if (count != 1 || !leaving.contains(key)) reject(key.second);
  if (!isConsistent) return;
  while (!leaving.empty()) {
    const auto [start, sides] = *leaving.begin();
    std::vector<PieceSide> loop;
    Key key = start;
    do {
      const PieceSide side = leaving.at(key).front();
      leaving.erase(key);
      loop.push_back(side);
      key.second = network.curves[side.curve].corners[!side.isReversed];
    } while (key != start);
    network.loops[start.first].push_back(std::move(loop));
  }
}

}  // namespace

CreaseNetwork traceCreases(const PointSurface& whole, const PointSurface& divided,
                           const Pieces& pieces) {
  CreaseNetwork network;
  network.corners = findCorners(whole, divided, pieces);
  const std::vector<PairSamples> pairs = sampleCreases(whole, divided, pieces);
  std::vector<std::vector<CreaseCurve>> curves(pairs.size());
  std::vector<char> isComplete(pairs.size(), 0), isOpposed(pairs.size(), 0);
  tbb::parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t p) {
    const PairSamples& pair = pairs[p];
    constexpr double kMostLost = 0.3;
    const auto all = static_cast<double>(pair.samples.size() + pair.lost);
    CreaseTracer tracer(divided, network.corners, pair);
    isComplete[p] = tracer.trace(curves[p]) && static_cast<double>(pair.lost) <= kMostLost * all;
    isOpposed[p] = tracer.isOpposed();
  });
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    if (!isComplete[p]) network.conflicts.push_back(pairs[p].pieces);
    if (isOpposed[p]) network.opposed.push_back(pairs[p].pieces);
    for (CreaseCurve& curve : curves[p]) network.curves.push_back(std::move(curve));
  }
  if (network.conflicts.empty() && network.opposed.empty()) linkLoops(network, pieces.count);
  return network;
}

}  // namespace levelset::points
