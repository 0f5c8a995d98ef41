#pragma once

// Private to the drawing of terrains.

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <unordered_map>

namespace render {

/// Places in a table of fixed size. The patch that was not drawn for the longest time makes room.
class PatchSlots {
 public:
  PatchSlots() = default;
  explicit PatchSlots(std::size_t capacity) : capacity_(capacity) {}

  struct Slot {
    std::size_t number = 0;
    bool isNew = false;  ///< its contents are not those of the patch yet
  };

  [[nodiscard]] std::size_t capacity() const { return capacity_; }
  /// From now on, patches that have been placed may make room.
  void startPicture() { ++picture_; }
  /// Finds or makes the slot of a patch. @return none if all slots have patches of this picture
  [[nodiscard]] std::optional<Slot> place(std::uint64_t serial) {
    const auto known = places_.find(serial);
    if (known != places_.end()) {
      uses_.splice(uses_.begin(), uses_, known->second);
      uses_.front().picture = picture_;
      return Slot{uses_.front().slot, false};
    }
    std::size_t slot = uses_.size();
    if (slot == capacity_) {
      if (capacity_ == 0 || uses_.back().picture == picture_) return std::nullopt;
      slot = uses_.back().slot;
      places_.erase(uses_.back().serial);
      uses_.pop_back();
    }
    uses_.push_front({serial, slot, picture_});
    places_[serial] = uses_.begin();
    return Slot{slot, true};
  }

 private:
  struct Use {
    std::uint64_t serial;
    std::size_t slot;
    std::uint64_t picture;
  };

  std::size_t capacity_ = 0;
  std::uint64_t picture_ = 0;
  std::list<Use> uses_;  // last used first
  std::unordered_map<std::uint64_t, std::list<Use>::iterator> places_;
};

}  // namespace render
