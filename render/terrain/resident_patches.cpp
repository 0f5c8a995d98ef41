#include "render/terrain/resident_patches.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <utility>

#include "levelset/error.h"
#include "render/terrain/patch_borders.h"

namespace render {
namespace {

constexpr std::size_t kMostWarnings = 100;
constexpr std::size_t kReadAtOnce = 64;  // patches that load() reads concurrently

std::uint64_t nextSerial() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace

std::size_t ResidentPatches::patchBytes(int cells) {
  constexpr std::size_t kNodes = 400;  // tables, lists and their nodes, bytes of a patch
  const auto side = static_cast<std::size_t>(cells) + 1;
  return side * side * sizeof(float) + sizeof(PatchHeights) + kNodes;
}

ResidentPatches::ResidentPatches(std::shared_ptr<const levelset::PatchStore> store,
                                 std::size_t maxBytes, std::function<void()> onArrival)
    : store_(std::move(store)),
      grid_(store_->layout()),
      onArrival_(std::move(onArrival)),
      root_(grid_.root()) {
  const std::size_t bytes = patchBytes(store_->layout().pyramid.cells);
  capacity_ = maxBytes / bytes;
  if (capacity_ < kLeastPatches)
    throw levelset::UsageError(
        fmt::format("the patches of a terrain may take {} bytes, but {} patches take {}; allow at "
                    "least that",
                    maxBytes, kLeastPatches, kLeastPatches * bytes));
  rootHeights_ = read(root_);
  thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

ResidentPatches::~ResidentPatches() = default;  // the thread is stopped first

std::size_t ResidentPatches::count() const {
  const std::scoped_lock lock(mutex_);
  return entries_.size() + 1;
}

std::size_t ResidentPatches::mostCount() const {
  const std::scoped_lock lock(mutex_);
  return mostCount_;
}

std::shared_ptr<const PatchHeights> ResidentPatches::find(const TerrainPatch& patch) const {
  if (patch == root_) return rootHeights_;
  const std::scoped_lock lock(mutex_);
  if (!kept_.contains(patch)) return nullptr;  // the answer must not depend on earlier requests
  const auto found = entries_.find(patch);
  return found == entries_.end() ? nullptr : found->second.heights;
}

std::shared_ptr<const PatchHeights> ResidentPatches::read(const TerrainPatch& patch) const {
  const auto side = static_cast<std::size_t>(store_->layout().pyramid.cells) + 1;
  auto fresh = std::make_shared<PatchHeights>();
  fresh->heights.resize(side * side);
  store_->readPatch(patch.level, patch.column, patch.row, fresh->heights);
  fresh->borderErrors = patchBorderErrors(grid_, patch, fresh->heights);
  fresh->serial = nextSerial();
  return fresh;
}

/// Marks the needed patches as used. @return those that are not there and have not failed
std::vector<TerrainPatch> ResidentPatches::keep(std::span<const TerrainPatch> needed) {
  // One place is for the root, and one for a patch that the thread is reading.
  const std::size_t most = capacity_ - 2;
  kept_.clear();
  std::vector<TerrainPatch> missing;
  for (const TerrainPatch& patch : needed) {
    if (patch == root_) continue;
    if (kept_.size() == most) break;
    if (!kept_.insert(patch).second) continue;
    const auto found = entries_.find(patch);
    if (found != entries_.end())
      uses_.splice(uses_.begin(), uses_, found->second.use);
    else if (!failed_.contains(patch))
      missing.push_back(patch);
  }
  return missing;
}

/// Drops patches that are not kept until so many more fit. @return false if they never fit
bool ResidentPatches::makeRoom(std::size_t patches) {
  while (entries_.size() + 1 + beingRead_ + patches > capacity_) {
    if (uses_.empty() || kept_.contains(uses_.back())) return false;
    entries_.erase(uses_.back());
    uses_.pop_back();
  }
  mostCount_ = std::max(mostCount_, entries_.size() + 1 + beingRead_ + patches);
  return true;
}

void ResidentPatches::insert(const TerrainPatch& patch,
                             std::shared_ptr<const PatchHeights> heights) {
  if (entries_.contains(patch)) return;
  // A patch that is no longer needed makes room before the others.
  const auto use = uses_.insert(kept_.contains(patch) ? uses_.begin() : uses_.end(), patch);
  entries_.emplace(patch, Entry{std::move(heights), use});
}

void ResidentPatches::noteFailure(const TerrainPatch& patch, const std::string& sentence) {
  if (!failed_.insert(patch).second) return;
  if (failed_.size() > kMostWarnings) {
    if (failed_.size() == kMostWarnings + 1)
      warnings_.emplace_back("further patches that cannot be read are not listed");
    return;
  }
  warnings_.push_back(fmt::format("patch ({}, {}) of level {} is drawn by a coarser one: {}",
                                  patch.column, patch.row, patch.level, sentence));
}

void ResidentPatches::request(std::span<const TerrainPatch> needed) {
  {
    const std::scoped_lock lock(mutex_);
    waiting_ = keep(needed);
    std::reverse(waiting_.begin(), waiting_.end());
  }
  hasWork_.notify_one();
}

void ResidentPatches::load(std::span<const TerrainPatch> needed) {
  const std::scoped_lock alone(loading_);
  std::vector<TerrainPatch> missing;
  {
    const std::scoped_lock lock(mutex_);
    waiting_.clear();
    missing = keep(needed);
  }
  for (std::size_t first = 0; first < missing.size(); first += kReadAtOnce) {
    const std::size_t count = std::min(kReadAtOnce, missing.size() - first);
    {
      const std::scoped_lock lock(mutex_);
      makeRoom(count);
      beingRead_ += count;
    }
    std::vector<std::shared_ptr<const PatchHeights>> found(count);
    std::vector<std::string> failures(count);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t n) {
      try {
        found[n] = read(missing[first + n]);
      } catch (const std::exception& error) {
        failures[n] = error.what();
      }
    });
    const std::scoped_lock lock(mutex_);
    beingRead_ -= count;
    for (std::size_t n = 0; n < count; ++n)
      if (found[n])
        insert(missing[first + n], std::move(found[n]));
      else
        noteFailure(missing[first + n], failures[n]);
  }
}

bool ResidentPatches::isIdle() const {
  const std::scoped_lock lock(mutex_);
  return waiting_.empty() && !isWorking_;
}

std::vector<std::string> ResidentPatches::takeWarnings() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(warnings_, {});
}

void ResidentPatches::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (hasWork_.wait(lock, stop, [this] { return !waiting_.empty(); })) {
    if (stop.stop_requested()) return;
    const TerrainPatch patch = waiting_.back();
    waiting_.pop_back();
    if (entries_.contains(patch) || failed_.contains(patch) || !makeRoom(1)) continue;
    ++beingRead_;
    isWorking_ = true;
    lock.unlock();
    std::shared_ptr<const PatchHeights> found;
    std::string failure;
    try {
      found = read(patch);
    } catch (const std::exception& error) {
      failure = error.what();
    }
    lock.lock();
    --beingRead_;
    if (found)
      insert(patch, std::move(found));
    else
      noteFailure(patch, failure);
    if (onArrival_) {
      lock.unlock();
      onArrival_();
      lock.lock();
    }
    isWorking_ = false;
  }
}

}  // namespace render
