#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace viewer {

/// Earlier and later states of what the user edits, for undo and redo.
template <class State>
class EditHistory {
 public:
  /// Stores the state before a change. The states that were undone are lost.
  void add(State before) {
    constexpr std::size_t kMostStates = 200;
    if (past_.size() == kMostStates) past_.erase(past_.begin());
    past_.push_back(std::move(before));
    future_.clear();
  }
  /// Replaces the present state by the one before, or by the one that was undone.
  /// @return true when there is one
  bool undo(State& present) { return step(past_, future_, present); }
  bool redo(State& present) { return step(future_, past_, present); }
  [[nodiscard]] bool canUndo() const { return !past_.empty(); }
  [[nodiscard]] bool canRedo() const { return !future_.empty(); }

 private:
  static bool step(std::vector<State>& from, std::vector<State>& to, State& present) {
    if (from.empty()) return false;
    to.push_back(std::exchange(present, std::move(from.back())));
    from.pop_back();
    return true;
  }
  std::vector<State> past_, future_;
};

}  // namespace viewer
