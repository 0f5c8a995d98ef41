#include "levelset/eikonal/fast_marching.h"

#include <queue>
#include <tuple>

namespace levelset::eikonal {
namespace {

using openvdb::Index;

struct Trial {
  float time;
  std::uint32_t block;
  Index offset;
  /// Orders equal times by block number and offset, so the order of the queue is deterministic.
  friend bool operator>(const Trial& a, const Trial& b) {
    return std::tie(a.time, a.block, a.offset) > std::tie(b.time, b.block, b.offset);
  }
};

constexpr std::size_t kReportInterval = 1 << 15;

class Marcher {
 public:
  Marcher(ArrivalBlocks& blocks, int order) : blocks_(blocks), order_(order) {}

  void run() {
    const auto until = static_cast<float>(blocks_.settings().until);
    const std::size_t first = blocks_.blocks().size();
    for (std::size_t i = 0; i < first; ++i) {
      ArrivalBlock& block = blocks_.block(static_cast<std::uint32_t>(i));
      for (auto it = block.known.beginOn(); it; ++it)
        if (block.time[it.pos()] <= until) updateAround(block, it.pos());
    }
    for (std::size_t count = 0; !queue_.empty(); ++count) {
      const Trial trial = queue_.top();
      queue_.pop();
      if (trial.time > until) break;
      ArrivalBlock& block = blocks_.block(trial.block);
      if (block.known.isOn(trial.offset) || trial.time > block.time[trial.offset]) continue;
      block.known.setOn(trial.offset);
      updateAround(block, trial.offset);
      if (count % kReportInterval == 0)
        report(blocks_.settings().progress, static_cast<double>(trial.time / until));
    }
    clearTrials();
  }

 private:
  void updateAround(ArrivalBlock& from, Index n) {
    for (int d = 0; d < 6; ++d) {
      Index to;
      auto* block = const_cast<ArrivalBlock*>(from.step(n, d, to));
      if (!block) {
        openvdb::Coord origin = from.origin;
        origin[d >> 1] += d & 1 ? 8 : -8;
        block = &blocks_.touch(origin);
        blocks_.loadSlowness();
      }
      if (!block->known.isOn(to) && block->inside.isOn(to) == from.inside.isOn(n))
        update(*block, to);
    }
  }

  void update(ArrivalBlock& block, Index n) {
    const double slowness = block.slownessAt(n);
    if (!(slowness < kFar)) return;
    const StraightTime straight = order_ == 2 ? blocks_.straightTime(block, n) : StraightTime{};
    const UpwindTerms terms = gather(block, n, order_, straight);
    if (terms.count == 0) return;
    double time = solveUpwind(terms, slowness);
    bool first = order_ == 2 && terms.hasFirst;
    // A time must not precede the times that it is computed from (causality). If it does, two
    // fallbacks follow: first-order differences, then first order without the correction by
    // StraightTime. The second fallback is always causal but the least accurate.
    if (terms.hasSecond && time < terms.latest - straight.slack()) {
      time = solveUpwind(gather(block, n, 1, straight), slowness);
      first = true;
    }
    if (time < terms.latest - straight.slack())
      time = solveUpwind(gather(block, n, 1, {}), slowness);
    const auto stored = static_cast<float>(time);
    if (!(stored < block.time[n])) return;
    block.time[n] = stored;
    block.firstOrder.set(n, first);
    queue_.push({stored, block.number, n});
  }

  /// Collects the times of accepted neighbours on the upwind side of each axis. A neighbour on the
  /// other side of the start surface counts with its time negated.
  static UpwindTerms gather(const ArrivalBlock& block, Index n, int order,
                            const StraightTime& straight) {
    UpwindTerms terms;
    const bool inside = block.inside.isOn(n);
    const auto known = [inside](const ArrivalBlock* at, Index i, double& time) {
      if (!at || !at->known.isOn(i)) return false;
      time = static_cast<double>(at->time[i]);
      if (at->inside.isOn(i) != inside) time = -time;
      return true;
    };
    for (int axis = 0; axis < 3; ++axis) {
      double best = 0, beyond = 0;
      bool any = false, second = false, up = false;
      for (int d = 2 * axis; d < 2 * axis + 2; ++d) {
        Index near = 0, far = 0;
        double time = 0, other = 0;
        const ArrivalBlock* at = block.step(n, d, near);
        if (!known(at, near, time) || (any && time >= best)) continue;
        any = true;
        up = d & 1;
        best = time;
        const ArrivalBlock* behind = at->step(near, d, far);
        second = order == 2 && known(behind, far, other) && other <= time;
        if (second) beyond = other;
      }
      if (!any) {
        terms.known += straight.level(static_cast<std::size_t>(axis));
        continue;
      }
      const double missed = straight.missed(static_cast<std::size_t>(axis), up, second);
      if (second)
        terms.addSecond(best, beyond, missed);
      else
        terms.addFirst(best, missed);
    }
    return terms;
  }

  void clearTrials() {
    for (ArrivalBlock& block : blocks_.blocks())
      for (auto it = block.known.beginOff(); it; ++it) block.time[it.pos()] = kFar;
  }

  ArrivalBlocks& blocks_;
  int order_;
  std::priority_queue<Trial, std::vector<Trial>, std::greater<>> queue_;
};

}  // namespace

void marchArrivals(ArrivalBlocks& blocks, int order) {
  Marcher(blocks, order).run();
}

}  // namespace levelset::eikonal
