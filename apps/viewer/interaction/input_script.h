#pragma once

#include <Imath/ImathVec.h>

#include <filesystem>
#include <string>
#include <vector>

namespace viewer {

/// One step of simulated input.
struct InputStep {
  enum class Kind {
    Move,     ///< the pointer moves to `place`
    Press,    ///< mouse button `button` is pressed at the pointer
    Release,  ///< mouse button `button` is released
    Key,      ///< the key with the name `text` is pressed and released
    Wait,     ///< waits until picture and preview are finished
    Picture,  ///< writes the complete window to the file `text`
    Copied    ///< prints the contents of the clipboard
  };
  Kind kind = Kind::Wait;
  Imath::V2d place{0, 0};  ///< pixels; 0,0 is the upper left corner
  int button = 0;          ///< 0: left, 1: right, 2: middle, or kShift
  static constexpr int kShift = 3;
  std::string text = {};
};

/// Reads a script of simulated input, one command a line; `#` starts a comment:
/// - `move X,Y`, `press BUTTON`, `release BUTTON` (left, right, middle, or the key shift)
/// - `click X,Y`: moves there, presses and releases the left button
/// - `drag X,Y X,Y …`: presses the left button at the first position and releases it at the last.
///   Between two positions the pointer takes eight steps.
/// - `key NAME`: a character, or one of backspace, escape, enter, left, right, up, down, or ctrl+
///   and a letter
/// - `wait`, `picture FILE.png`, `copied`
/// @throws levelset::IoError if the file cannot be read
/// @throws levelset::UsageError, with the number of the line, for a command that it does not know
[[nodiscard]] std::vector<InputStep> readInputScript(const std::filesystem::path& file);

}  // namespace viewer
