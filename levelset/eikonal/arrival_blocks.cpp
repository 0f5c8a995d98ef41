#include "levelset/eikonal/arrival_blocks.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::Index;

Coord neighbourOrigin(const Coord& origin, int direction) {
  Coord result = origin;
  result[direction >> 1] += direction & 1 ? 8 : -8;
  return result;
}

// Memory of one block in bytes: the block itself, its slowness and second-order times (2048 each),
// its sorted grid points (1024), its leaf of the result (2300) and its entry in the hash map (100).
constexpr double kBytesPerBlock = sizeof(ArrivalBlock) + 2 * 2048 + 1024 + 2300 + 100;

}  // namespace

ArrivalBlocks::ArrivalBlocks(Settings settings) : settings_(std::move(settings)) {
  if (settings_.side) side_ = std::make_unique<openvdb::FloatGrid::ConstAccessor>(*settings_.side);
  limit_ = static_cast<double>(memoryLimit(settings_.maxMemory));
}

void ArrivalBlocks::checkMemoryFor(const Coord& origin) const {
  const double bytes = static_cast<double>(blocks_.size() + 1) * kBytesPerBlock;
  if (bytes > limit_)
    throw ResourceLimit(
        fmt::format("the front has reached {} blocks of 512 grid points, which take {:.4g} MB, "
                    "more than the limit of {:.4g} MB; use a smaller distance or time, larger "
                    "voxels or more memory",
                    blocks_.size(), bytes / 1e6, limit_ / 1e6));
  for (int i = 0; i < 3; ++i)
    if (std::abs(static_cast<double>(origin[i])) > kIndexLimit - 16)
      throw ResourceLimit(
          "the front leaves the range of 32-bit indices; use a smaller distance "
          "or time, or larger voxels");
}

ArrivalBlock& ArrivalBlocks::touch(const Coord& origin) {
  ArrivalBlock*& slot = index_[origin];
  if (slot) return *slot;
  checkMemoryFor(origin);
  ArrivalBlock& block = blocks_.emplace_back();
  slot = &block;
  block.origin = origin;
  block.number = static_cast<std::uint32_t>(blocks_.size() - 1);
  block.time.fill(kFar);
  if (side_) {
    if (const auto* leaf = side_->probeConstLeaf(origin)) {
      for (Index n = 0; n < ArrivalBlock::kSize; ++n)
        if (leaf->getValue(n) < 0) block.inside.setOn(n);
    } else {
      block.inside.set(side_->getValue(origin) < 0);
    }
  }
  for (int d = 0; d < 6; ++d) {
    const auto found = index_.find(neighbourOrigin(origin, d));
    if (found == index_.end()) continue;
    block.neighbours[static_cast<std::size_t>(d)] = found->second;
    found->second->neighbours[static_cast<std::size_t>(d ^ 1)] = &block;
  }
  return block;
}

void ArrivalBlocks::loadSlowness() {
  if (settings_.slowness)
    tbb::parallel_for(loaded_, blocks_.size(), [&](std::size_t i) {
      ArrivalBlock& block = blocks_[i];
      block.slowness = std::make_unique<std::array<float, ArrivalBlock::kSize>>();
      for (Index n = 0; n < ArrivalBlock::kSize; ++n) {
        const Coord c = openvdb::FloatTree::LeafNodeType::offsetToLocalCoord(n) + block.origin;
        const double slowness = settings_.slowness(c);
        (*block.slowness)[n] = slowness < kFar ? static_cast<float>(slowness) : kFar;
      }
    });
  loaded_ = blocks_.size();
}

void ArrivalBlocks::start(const std::vector<StartTime>& times) {
  for (const StartTime& s : times) touch(s.gridPoint & ~7);
  loadSlowness();
  bool any = false;
  for (const StartTime& s : times) {
    ArrivalBlock& block = touch(s.gridPoint & ~7);
    const Index n = openvdb::FloatTree::LeafNodeType::coordToOffset(s.gridPoint);
    if (!(block.slownessAt(n) < kFar) || !(s.time < kFar)) continue;
    block.time[n] = std::min(block.time[n], s.time);
    block.known.setOn(n);
    any = true;
  }
  if (!any)
    throw InvalidInput(
        "the speed is nowhere positive where the front starts, so it cannot move; "
        "give a speed that is positive there");
}

}  // namespace levelset::eikonal
