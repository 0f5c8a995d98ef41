#include "levelset/eikonal/fast_sweeping.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "levelset/grids/padded_leaf_vdb.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::Index;
using Mask = ArrivalBlock::Mask;

// Smallest change of an arrival time that is stored, as a fraction of the time for one voxel at the
// speed of the grid point.
constexpr float kImprovement = 1e-5f;
// Length of the time window of a round. It starts at the earliest arrival time that changed and is
// not yet processed. Its length is the larger of kWindow, the time for half a voxel at typical
// speed, and the fraction kWindowShare of that earliest time. Blocks whose changed times are all
// later wait, since these times would change again. The fraction serves slow media, where the front
// needs long for a voxel.
constexpr float kWindow = 0.5f, kWindowShare = 0.05f;
constexpr std::size_t kBlocksPerTask = 8;

/// Latest arrival time to compute: `until`, the latest requested time. With `lookahead` it is
/// later, because the second-order solution reads first-order times after `until`. It is later by
/// the time for one voxel at the local speed or a twentieth of `until`, whichever is larger.
struct SweepLimit {
  float until = 0;
  bool lookahead = false;
  [[nodiscard]] float at(double slowness) const {
    return lookahead ? std::max(until + static_cast<float>(slowness), 1.05f * until) : until;
  }
};

int parityOf(const Coord& origin) {
  return ((origin.x() >> 3) & 1) * 4 + ((origin.y() >> 3) & 1) * 2 + ((origin.z() >> 3) & 1);
}

/// State of a block during sweeping; ArrivalBlock holds its arrival times. Neighbours d = 0 … 5 are
/// the blocks at −x, +x, −y, +y, −z, +z.
struct BlockState {
  float earliest = kFar;  ///< earliest changed time not yet processed; kFar: block is clean
  bool seen = false;      ///< the first-order solver processed the block before
  std::uint8_t dirtyNeighbours = 0;  ///< dirty flags, bit d: times of neighbour d changed
  /// Bit d: times that neighbour d reads have changed, so that neighbour must get a dirty flag.
  /// Written only by the task that processes this block.
  std::uint8_t dirtiedNeighbours = 0;
  std::array<float, 6> earliestAtFace{};  ///< earliest changed time that neighbour d reads
  /// Offsets of the grid points that the second-order solver computes, sorted by first-order time;
  /// nullopt before its first visit of the block.
  std::optional<std::vector<std::uint16_t>> order;
  std::unique_ptr<std::array<float, ArrivalBlock::kSize>> second;  ///< second-order times
};

/// Scheduler of dirty blocks: calls work(block, state) until no block is dirty.
/// A parity is one of the eight combinations of even and odd block indices on x, y and z. Each
/// round takes the parities in turn. It skips blocks whose changed times are after a time window.
/// Blocks of one parity do not touch and run in parallel. The order is fixed, so the result does
/// not depend on the number of threads.
class Rounds {
 public:
  explicit Rounds(ArrivalBlocks& blocks) : blocks_(blocks) {}
  std::vector<BlockState> blockStates;

  /// Passes the dirty flags that were set before the first round on to the neighbouring blocks.
  void passInitialFlags() {
    blockStates.resize(blocks_.blocks().size());
    for (std::size_t i = 0, end = blockStates.size(); i < end; ++i)
      passDirtyFlags(static_cast<std::uint32_t>(i), true);
  }

  template <typename Work>
  void run(bool mayGrow, double from, double to, const Work& work) {
    sortNew();
    float window = 0;
    for (;;) {
      const float earliest = earliestDirty();
      if (earliest == kFar) return;
      window = std::max({window, earliest + kWindow, (1 + kWindowShare) * earliest});
      report(subProgress(blocks_.settings().progress, from, to),
             std::min(1.0, static_cast<double>(earliest) / blocks_.settings().until));
      for (auto& candidates : byParity_) {
        std::vector<std::uint32_t> due;
        for (const std::uint32_t i : candidates)
          if (blockStates[i].earliest <= window) due.push_back(i);
        const auto range = tbb::blocked_range<std::size_t>(0, due.size(), kBlocksPerTask);
        tbb::parallel_for(range, [&](const auto& part) {
          for (std::size_t i = part.begin(); i != part.end(); ++i)
            work(blocks_.block(due[i]), blockStates[due[i]]);
        });
        for (const std::uint32_t i : due) passDirtyFlags(i, mayGrow);
        if (mayGrow) sortNew();
      }
    }
  }

 private:
  void sortNew() {
    blocks_.loadSlowness();
    for (; sorted_ < blocks_.blocks().size(); ++sorted_) {
      const auto number = static_cast<std::uint32_t>(sorted_);
      byParity_[static_cast<std::size_t>(parityOf(blocks_.block(number).origin))].push_back(number);
    }
    blockStates.resize(sorted_);
  }

  [[nodiscard]] float earliestDirty() const {
    float earliest = kFar;
    for (const BlockState& state : blockStates) earliest = std::min(earliest, state.earliest);
    return earliest;
  }

  void passDirtyFlags(std::uint32_t number, bool mayGrow) {
    for (int d = 0; d < 6; ++d) {
      if (!(blockStates[number].dirtiedNeighbours >> d & 1)) continue;
      ArrivalBlock& block = blocks_.block(number);
      ArrivalBlock* other = block.neighbours[static_cast<std::size_t>(d)];
      if (!other && !mayGrow) continue;
      if (!other) {
        Coord origin = block.origin;
        origin[d >> 1] += d & 1 ? 8 : -8;
        other = &blocks_.touch(origin);
        blockStates.resize(blocks_.blocks().size());
      }
      BlockState& state = blockStates[other->number];
      state.dirtyNeighbours |= static_cast<std::uint8_t>(1 << (d ^ 1));
      state.earliest =
          std::min(state.earliest, blockStates[number].earliestAtFace[static_cast<std::size_t>(d)]);
    }
    blockStates[number].dirtiedNeighbours = 0;
  }

  ArrivalBlocks& blocks_;
  std::array<std::vector<std::uint32_t>, 8> byParity_;
  std::size_t sorted_ = 0;
};

/// Records that the time at grid point `n` changed, for the neighbouring blocks that read it.
/// @param depth  number of layers of grid points that a neighbouring block reads: 1 or 2
void markDirty(BlockState& state, Index n, float time, Index depth) {
  const std::array<Index, 3> at = {n >> 6, n >> 3 & 7u, n & 7u};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t side = 0; side < 2; ++side) {
      if (side ? at[axis] < 8 - depth : at[axis] >= depth) continue;
      const std::size_t d = 2 * axis + side;
      if (!(state.dirtiedNeighbours >> d & 1) || time < state.earliestAtFace[d])
        state.earliestAtFace[d] = time;
      state.dirtiedNeighbours |= static_cast<std::uint8_t>(1u << d);
    }
}

/// Gauss-Seidel sweeps over one block, padded with the nearest layer of grid points of its six
/// neighbouring blocks. Each sweep visits only grid points beside a changed time.
class FirstOrderWorker {
 public:
  FirstOrderWorker(ArrivalBlock& block, BlockState& state, const SweepLimit& limit)
      : block_(block), state_(state), limit_(limit) {
    times_.values.fill(kFar);
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y)
        std::copy_n(&block.time[offset(x, y, 0)], 8, &times_.values[slot(x, y, 0)]);
    for (int d = 0; d < 6; ++d) loadFace(d);
  }

  void run() {
    markPending();
    // The first sweep runs away from the neighbouring blocks whose times changed.
    const int start = (state_.dirtyNeighbours & 2 ? 4 : 0) | (state_.dirtyNeighbours & 8 ? 2 : 0) |
                      (state_.dirtyNeighbours & 32 ? 1 : 0);
    constexpr std::array<int, 8> kGray = {0, 1, 3, 2, 6, 7, 5, 4};
    for (std::size_t i = 0; isPending(); ++i) sweep(start ^ kGray[i % 8]);
    state_.seen = true;
    state_.dirtyNeighbours = 0;
    state_.earliest = kFar;
    for (auto it = changed_.beginOn(); it; ++it) {
      const Index n = it.pos();
      const float time = times_.values[slot(n)];
      block_.time[n] = time;
      if (time <= limit_.at(block_.slownessAt(n))) markDirty(state_, n, time, 1);
    }
  }

 private:
  using Times = PaddedLeaf<1>;

  static Index offset(int x, int y, int z) { return static_cast<Index>((x << 6) + (y << 3) + z); }
  static std::size_t slot(int x, int y, int z) { return Times::slot(x, y, z); }
  static std::size_t slot(Index n) {
    return slot(static_cast<int>(n >> 6), static_cast<int>(n >> 3 & 7u), static_cast<int>(n & 7u));
  }

  void loadFace(int d) {
    const ArrivalBlock* other = block_.neighbours[static_cast<std::size_t>(d)];
    if (!other) return;
    const int axis = d >> 1, u = (axis + 1) % 3, v = (axis + 2) % 3;
    Coord here, there;
    here[axis] = d & 1 ? 8 : -1;
    there[axis] = d & 1 ? 0 : 7;
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) {
        here[u] = there[u] = i;
        here[v] = there[v] = j;
        times_.values[slot(here.x(), here.y(), here.z())] =
            other->time[offset(there.x(), there.y(), there.z())];
      }
  }

  /// Marks the grid points to solve: all on the first visit of the block, later those on the faces
  /// towards neighbouring blocks whose times changed.
  void markPending() {
    if (!state_.seen) {
      pending_.fill(~std::uint64_t{0});
      return;
    }
    constexpr std::uint64_t kColumn = 0x0101010101010101;
    if (state_.dirtyNeighbours & 1) pending_[0] = ~std::uint64_t{0};
    if (state_.dirtyNeighbours & 2) pending_[7] = ~std::uint64_t{0};
    for (std::uint64_t& slice : pending_) {
      if (state_.dirtyNeighbours & 4) slice |= 0xFF;
      if (state_.dirtyNeighbours & 8) slice |= std::uint64_t{0xFF} << 56;
      if (state_.dirtyNeighbours & 16) slice |= kColumn;
      if (state_.dirtyNeighbours & 32) slice |= kColumn << 7;
    }
  }

  [[nodiscard]] bool isPending() const {
    return std::any_of(pending_.begin(), pending_.end(), [](std::uint64_t s) { return s != 0; });
  }

  void sweep(int direction) {
    const bool bx = direction & 4, by = direction & 2, bz = direction & 1;
    for (int i = 0; i < 8; ++i) {
      const int x = bx ? 7 - i : i;
      for (int j = 0; j < 8 && pending_[static_cast<std::size_t>(x)]; ++j)
        sweepRow(x, by ? 7 - j : j, bz);
    }
  }

  void sweepRow(int x, int y, bool backwards) {
    std::uint64_t& slice = pending_[static_cast<std::size_t>(x)];
    unsigned remaining = 0xFF;
    while (const unsigned row = static_cast<unsigned>(slice >> (8 * y)) & remaining) {
      const int z = backwards ? std::bit_width(row) - 1 : std::countr_zero(row);
      slice &= ~(std::uint64_t{1} << (8 * y + z));
      remaining = backwards ? (1u << z) - 1 : 0xFFu << (z + 1) & 0xFFu;
      if (relax(x, y, z)) markReaders(x, y, z);
    }
  }

  /// Marks the neighbours in the block that have later times than the changed grid point (x, y, z):
  /// only they depend on its time.
  void markReaders(int x, int y, int z) {
    const std::size_t here = slot(x, y, z);
    const auto mark = [&](int i, int j, int k) {
      if (times_.values[slot(i, j, k)] > times_.values[here])
        pending_[static_cast<std::size_t>(i)] |= std::uint64_t{1} << (8 * j + k);
    };
    if (x > 0) mark(x - 1, y, z);
    if (x < 7) mark(x + 1, y, z);
    if (y > 0) mark(x, y - 1, z);
    if (y < 7) mark(x, y + 1, z);
    if (z > 0) mark(x, y, z - 1);
    if (z < 7) mark(x, y, z + 1);
  }

  /// Computes the first-order time of a grid point from those of its six neighbours.
  /// @return true when the time improved
  bool relax(int x, int y, int z) {
    const std::size_t s = slot(x, y, z);
    float a = std::min(times_.values[s - Times::kStepX], times_.values[s + Times::kStepX]),
          b = std::min(times_.values[s - Times::kStepY], times_.values[s + Times::kStepY]),
          c = std::min(times_.values[s - 1], times_.values[s + 1]);
    if (a > b) std::swap(a, b);
    if (b > c) std::swap(b, c);
    if (a > b) std::swap(a, b);
    const float here = times_.values[s];
    if (!(a < here)) return false;
    const Index n = offset(x, y, z);
    if (block_.known.isOn(n)) return false;
    const auto slowness = static_cast<float>(block_.slownessAt(n));
    if (!(slowness < kFar) || a > limit_.at(block_.slownessAt(n))) return false;
    // Update by [Zhao05, section 2], with times relative to the earliest neighbour.
    float u = slowness;
    const float p = b - a, q = c - a;
    if (u > p) {
      u = (p + std::sqrt(2 * slowness * slowness - p * p)) / 2;
      if (u > q)
        u = (p + q +
             std::sqrt(
                 std::max(0.0f, (p + q) * (p + q) - 3 * (p * p + q * q - slowness * slowness)))) /
            3;
    }
    const float time = a + u;
    if (!(time < here - kImprovement * slowness)) return false;
    times_.values[s] = time;
    changed_.setOn(n);
    return true;
  }

  ArrivalBlock& block_;
  BlockState& state_;
  SweepLimit limit_;
  Times times_;  ///< times of the block and, in the border, of its six neighbouring blocks
  /// Grid points to solve: one word for each x, bit 8 y + z.
  std::array<std::uint64_t, 8> pending_{};
  Mask changed_;
};

/// Solver with second-order differences. The first-order solution decides which neighbours are
/// upwind. Each grid point thus depends only on points with earlier first-order times, and the
/// equations have one solution.
class SecondOrderWorker {
 public:
  SecondOrderWorker(const ArrivalBlocks& blocks, ArrivalBlock& block, BlockState& state,
                    const std::vector<BlockState>& blockStates, const SweepLimit& limit)
      : blocks_(blocks), block_(block), state_(state), limit_(limit) {
    load(block, state, Coord(0), Coord(0), Coord(8));
    for (int d = 0; d < 6; ++d) {
      Coord from(0), to(8), shift(0);
      shift[d >> 1] = d & 1 ? 8 : -8;
      (d & 1 ? to : from)[d >> 1] = d & 1 ? 2 : 6;
      if (const ArrivalBlock* other = block.neighbours[static_cast<std::size_t>(d)])
        load(*other, blockStates[other->number], shift, from, to);
      else
        clear(shift, from, to);
    }
  }

  void run() {
    if (state_.order) {
      markPending();
    } else {
      sortByTime();
      pending_.setOn();
    }
    for (const std::uint16_t n : *state_.order) {
      if (!pending_.isOn(n)) continue;
      const auto time = static_cast<float>(solve(n));
      float& stored = (*state_.second)[n];
      if (std::abs(time - stored) <= kImprovement * static_cast<float>(block_.slownessAt(n)))
        continue;
      stored = time;
      second_[slot(n)] = block_.inside.isOn(n) ? -time : time;
      markDirty(state_, n, block_.time[n], 2);
      markReaders(n);
    }
    state_.dirtyNeighbours = 0;
    state_.earliest = kFar;
  }

 private:
  /// Marks the two layers of grid points of the block beside each neighbouring block whose times
  /// changed.
  void markPending() {
    for (std::size_t d = 0; d < 6; ++d)
      if (state_.dirtyNeighbours >> d & 1) pending_ |= facingLayers()[d];
  }

  static const std::array<Mask, 6>& facingLayers() {
    static const std::array<Mask, 6> layers = [] {
      std::array<Mask, 6> made;
      for (Index n = 0; n < ArrivalBlock::kSize; ++n)
        for (std::size_t d = 0; d < 6; ++d) {
          const Index at = n >> (6 - 3 * static_cast<Index>(d >> 1)) & 7u;
          if (d & 1 ? at >= 6 : at < 2) made[d].setOn(n);
        }
      return made;
    }();
    return layers;
  }

  /// Marks the grid points of the block up to two steps from `n` along the axes. Marks on points
  /// with earlier times have no effect: run() has passed these points, and none of them reads `n`.
  void markReaders(Index n) {
    for (const Index shift : {0u, 3u, 6u}) {
      const Index at = n >> shift & 7u, step = 1u << shift;
      if (at > 0) pending_.setOn(n - step);
      if (at > 1) pending_.setOn(n - 2 * step);
      if (at < 7) pending_.setOn(n + step);
      if (at < 6) pending_.setOn(n + 2 * step);
    }
  }

  void sortByTime() {
    // Times are not negative, so their bit patterns as integers sort in the same order.
    std::array<std::uint64_t, ArrivalBlock::kSize> keys;
    std::size_t count = 0;
    for (Index n = 0; n < ArrivalBlock::kSize; ++n)
      if (!block_.known.isOn(n) && block_.time[n] <= limit_.at(block_.slownessAt(n)))
        keys[count++] = std::uint64_t{std::bit_cast<std::uint32_t>(block_.time[n])} << 16 | n;
    std::sort(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(count));
    state_.order.emplace(count);
    for (std::size_t i = 0; i < count; ++i)
      (*state_.order)[i] = static_cast<std::uint16_t>(keys[i] & 0xFFFF);
  }

  struct Neighbour {
    float first = kFar;  ///< first-order time, negative on the other side of the start surface
    double time = 0;     ///< second-order time, negative on the other side of the start surface
  };

  static std::size_t slot(const Coord& c) {
    return static_cast<std::size_t>(((c.x() + 2) * 12 + c.y() + 2) * 12 + c.z() + 2);
  }
  static std::size_t slot(Index n) {
    return slot(openvdb::FloatTree::LeafNodeType::offsetToLocalCoord(n));
  }

  /// Calls each(c) for all rows along z of the box [from, to), where c is the first grid point of
  /// the row.
  template <typename Each>
  static void forEachRow(const Coord& from, const Coord& to, const Each& each) {
    for (int x = from.x(); x < to.x(); ++x)
      for (int y = from.y(); y < to.y(); ++y) each(Coord(x, y, from.z()));
  }
  void clear(const Coord& shift, const Coord& from, const Coord& to) {
    const auto count = static_cast<std::size_t>(to.z() - from.z());
    forEachRow(from, to,
               [&](const Coord& c) { std::fill_n(&first_[slot(c + shift)], count, kFar); });
  }
  void load(const ArrivalBlock& block, const BlockState& state, const Coord& shift,
            const Coord& from, const Coord& to) {
    const auto count = static_cast<Index>(to.z() - from.z());
    const bool isMixed = !block.inside.isOn() && !block.inside.isOff();
    const float all = block.inside.isOn() ? -1.0f : 1.0f;
    forEachRow(from, to, [&](const Coord& c) {
      const Index n = openvdb::FloatTree::LeafNodeType::coordToOffset(c);
      float* first = &first_[slot(c + shift)];
      float* second = &second_[slot(c + shift)];
      for (Index i = 0; i < count; ++i) {
        const float side = !isMixed ? all : block.inside.isOn(n + i) ? -1.0f : 1.0f;
        first[i] = side * block.time[n + i];
        second[i] = side * (*state.second)[n + i];
      }
    });
  }

  [[nodiscard]] Neighbour look(std::size_t at, float side) const {
    if (!(std::abs(first_[at]) < kFar)) return {};
    return {side * first_[at], static_cast<double>(side * second_[at])};
  }

  double solve(Index n) {
    constexpr std::array<std::size_t, 3> kStep = {144, 12, 1};
    const float side = block_.inside.isOn(n) ? -1.0f : 1.0f;
    const std::size_t here = slot(n);
    const StraightTime straight = blocks_.straightTime(block_, n);
    UpwindTerms terms;
    std::array<double, 3> near{}, missed{};  // for each term: nearest upwind time, and error of a
                                             // first-order difference of the straight time
                                             // from a point source (StraightTime)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t step = kStep[axis];
      const Neighbour a = look(here - step, side), b = look(here + step, side);
      const bool up = b.first < a.first;
      const Neighbour& next = up ? b : a;
      if (!(next.first < block_.time[n])) {
        terms.known += straight.level(axis);
        continue;
      }
      const auto term = static_cast<std::size_t>(terms.count);
      near[term] = next.time;
      missed[term] = straight.missed(axis, up, false);
      const Neighbour beyond = look(up ? here + 2 * step : here - 2 * step, side);
      if (beyond.first <= next.first)
        terms.addSecond(next.time, beyond.time, straight.missed(axis, up, true));
      else
        terms.addFirst(near[term], missed[term]);
    }
    const double slowness = block_.slownessAt(n);
    if (terms.count == 0) return static_cast<double>(block_.time[n]);
    double time = solveUpwind(terms, slowness);
    bool first = terms.hasFirst;
    const auto inFirstOrder = [&](double share) {
      UpwindTerms plain;
      plain.known = share * terms.known;
      for (std::size_t i = 0; i < static_cast<std::size_t>(terms.count); ++i)
        plain.addFirst(near[i], share * missed[i]);
      return solveUpwind(plain, slowness);
    };
    // A time must not precede the times that it is computed from (causality). If it does, two
    // fallbacks follow: first-order differences, then first order without the correction by
    // StraightTime. The second fallback is always causal but the least accurate.
    if (terms.hasSecond && time < terms.latest - straight.slack()) {
      time = inFirstOrder(1);
      first = true;
    }
    if (time < terms.latest - straight.slack()) time = inFirstOrder(0);
    block_.firstOrder.set(n, first);
    return time;
  }

  const ArrivalBlocks& blocks_;
  ArrivalBlock& block_;
  BlockState& state_;
  SweepLimit limit_;
  /// First- and second-order times of the block and of two layers of grid points in each
  /// neighbouring block, negative inside the start surface.
  std::array<float, 12 * 12 * 12> first_, second_;
  Mask pending_;  ///< grid points of the block whose times are still to be computed
};

float earliestUnknown(const ArrivalBlock& block) {
  float earliest = kFar;
  for (auto it = block.known.beginOff(); it; ++it)
    earliest = std::min(earliest, block.time[it.pos()]);
  return earliest;
}

void solveSecondOrder(ArrivalBlocks& blocks, const SweepLimit& limit) {
  Rounds rounds(blocks);
  rounds.blockStates.resize(blocks.blocks().size());
  for (ArrivalBlock& block : blocks.blocks()) {
    BlockState& state = rounds.blockStates[block.number];
    state.second = std::make_unique<std::array<float, ArrivalBlock::kSize>>(block.time);
    state.earliest = earliestUnknown(block);
  }
  rounds.run(false, 0.5, 1, [&](ArrivalBlock& block, BlockState& state) {
    SecondOrderWorker(blocks, block, state, rounds.blockStates, limit).run();
  });
  for (ArrivalBlock& block : blocks.blocks()) block.time = *rounds.blockStates[block.number].second;
}

}  // namespace

void sweepArrivals(ArrivalBlocks& blocks, int order) {
  const auto until = static_cast<float>(blocks.settings().until);
  const SweepLimit limit{until, order == 2};
  {
    Rounds rounds(blocks);
    rounds.blockStates.resize(blocks.blocks().size());
    for (ArrivalBlock& block : blocks.blocks())
      for (auto it = block.known.beginOn(); it; ++it) {
        BlockState& state = rounds.blockStates[block.number];
        if (block.time[it.pos()] > until) continue;
        state.earliest = std::min(state.earliest, block.time[it.pos()]);
        markDirty(state, it.pos(), block.time[it.pos()], 1);
      }
    rounds.passInitialFlags();
    rounds.run(true, 0, order == 2 ? 0.5 : 1, [&](ArrivalBlock& block, BlockState& state) {
      FirstOrderWorker(block, state, limit).run();
    });
  }
  if (order == 2) solveSecondOrder(blocks, limit);
  for (ArrivalBlock& block : blocks.blocks())
    for (Index n = 0; n < ArrivalBlock::kSize; ++n) {
      if (block.time[n] <= until)
        block.known.setOn(n);
      else
        block.time[n] = kFar;
    }
}

}  // namespace levelset::eikonal
