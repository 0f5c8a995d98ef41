#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "levelset/terrain/tiles/patch_store.h"
#include "render/terrain/terrain_patch.h"

namespace render {

/// Heights of a patch in memory.
struct PatchHeights {
  std::vector<float> heights;           ///< as of PatchStore::readPatch()
  std::array<float, 4> borderErrors{};  ///< from patchBorderErrors()
  std::uint64_t serial = 0;             ///< differs between all patches that were ever read
};

/// Patches that were read from a store, within a limit of memory. A thread reads the patches that
/// are asked for; those that were not needed for the longest time make room. The patch of the
/// coarsest level is always there. All functions may be called by several threads at once.
class ResidentPatches {
 public:
  /// Reads the coarsest patch.
  /// @param maxBytes   limit on the memory of all patches, with those that are just being read
  /// @param onArrival  called from another thread when a patch arrived or failed; may be empty. It
  ///                   must not throw, nor wait for the thread that destroys this object
  /// @throws UsageError for a limit below the memory of kLeastPatches patches
  /// @throws the error of the store when the coarsest patch cannot be read
  ResidentPatches(std::shared_ptr<const levelset::PatchStore> store, std::size_t maxBytes,
                  std::function<void()> onArrival);
  ~ResidentPatches();
  ResidentPatches(const ResidentPatches&) = delete;
  ResidentPatches& operator=(const ResidentPatches&) = delete;

  static constexpr std::size_t kLeastPatches = 16;
  /// Memory of a patch with so many cells along a side, bytes.
  [[nodiscard]] static std::size_t patchBytes(int cells);

  /// Number of patches that fit into the limit, with the coarsest one and one that is being read.
  [[nodiscard]] std::size_t capacity() const { return capacity_; }
  /// Number of patches that are there.
  [[nodiscard]] std::size_t count() const;
  /// Largest number of patches that were there at once, with those that were just being read.
  [[nodiscard]] std::size_t mostCount() const;
  /// Heights of the coarsest patch, or of one of the last request; null if they are not there.
  [[nodiscard]] std::shared_ptr<const PatchHeights> find(const TerrainPatch& patch) const;

  /// Asks for patches, the most important first, instead of those of the call before. Patches
  /// beyond the capacity are ignored. The others stay there until the next call.
  void request(std::span<const TerrainPatch> needed);
  /// As request(), and waits until all of them were read or have failed. Concurrent calls wait for
  /// each other.
  void load(std::span<const TerrainPatch> needed);
  /// Returns true when the last request is answered, and onArrival() has returned.
  [[nodiscard]] bool isIdle() const;

  /// Returns and removes the sentences about patches that could not be read. Each patch has at
  /// most one, and is not read again.
  [[nodiscard]] std::vector<std::string> takeWarnings();

 private:
  struct Entry {
    std::shared_ptr<const PatchHeights> heights;
    std::list<TerrainPatch>::iterator use;
  };

  [[nodiscard]] std::shared_ptr<const PatchHeights> read(const TerrainPatch& patch) const;
  void work(const std::stop_token& stop);
  // These need the lock.
  std::vector<TerrainPatch> keep(std::span<const TerrainPatch> needed);
  bool makeRoom(std::size_t patches);
  void insert(const TerrainPatch& patch, std::shared_ptr<const PatchHeights> heights);
  void noteFailure(const TerrainPatch& patch, const std::string& sentence);

  std::shared_ptr<const levelset::PatchStore> store_;
  PatchGrid grid_;
  std::function<void()> onArrival_;
  std::size_t capacity_ = 0;
  TerrainPatch root_;
  std::shared_ptr<const PatchHeights> rootHeights_;
  std::mutex loading_;  // held by load()
  mutable std::mutex mutex_;
  std::condition_variable_any hasWork_;
  std::unordered_map<TerrainPatch, Entry, PatchHash> entries_;  // without the root
  std::list<TerrainPatch> uses_;                      // the patches of entries_, last used first
  std::unordered_set<TerrainPatch, PatchHash> kept_;  // needed by the last request
  std::vector<TerrainPatch> waiting_;                 // not yet read, the most important last
  std::unordered_set<TerrainPatch, PatchHash> failed_;
  std::vector<std::string> warnings_;
  std::size_t beingRead_ = 0, mostCount_ = 1;
  bool isWorking_ = false;  // the thread is reading or calls onArrival()
  std::jthread thread_;     // the last member: it uses the others
};

}  // namespace render
