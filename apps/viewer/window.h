#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/viewer/interaction/patch_overlay.h"

struct GLFWwindow;

namespace viewer {

/// A pressed key. Keys with a character have `character`, all others have `key`.
struct KeyPress {
  unsigned character = 0;    ///< Unicode code point; 0: none
  int key = 0;               ///< GLFW's key number
  bool withControl = false;  ///< the control key was held
};

/// A window with OpenGL 3.3 and Dear ImGui. Only one may exist at a time, on the main thread.
class Window {
 public:
  /// @param isVisible  false: the window only serves drawInMemory()
  /// @throws levelset::ResourceLimit when no display is available, or OpenGL 3.3 is missing
  Window(const std::string& title, int width, int height, bool isVisible);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Ends wait() early, so that the window is redrawn. May be called from any thread.
  static void wake();
  /// Waits for an event, at most `seconds`. Returns true when an event arrived.
  bool wait(double seconds);
  [[nodiscard]] bool isToClose() const;
  void close();
  void setTitle(const std::string& title);

  [[nodiscard]] int width() const;   ///< width of the framebuffer, pixels, at least 1
  [[nodiscard]] int height() const;  ///< height of the framebuffer, pixels, at least 1

  /// Draws the picture, if there is one, and on top of it the ImGui widgets of `interface`.
  void draw(const std::function<void()>& interface);
  /// Draws the same contents as draw() into memory, at any size in pixels.
  /// @throws levelset::ResourceLimit for a size that OpenGL does not support
  [[nodiscard]] Canvas drawInMemory(int width, int height, const std::function<void()>& interface);

  /// Sets the picture behind the interface. It is stretched to the window.
  void setPicture(const Canvas& canvas);
  void clearPicture();

  /// Returns and removes the key presses, or the files dropped into the window, since the last
  /// call.
  [[nodiscard]] std::vector<KeyPress> takeKeys();
  [[nodiscard]] std::vector<std::filesystem::path> takeDrops();

  void setClipboard(const std::string& text);
  [[nodiscard]] std::string clipboard() const;

  /// State of a mouse that a script moves.
  struct Mouse {
    float x = 0, y = 0;               ///< position, pixels
    std::array<bool, 3> isDown = {};  ///< left, right and middle button
    bool hasShift = false;            ///< the shift key is held
  };
  /// From now on the interface sees this mouse instead of the user's.
  void simulateMouse(const Mouse& mouse) { simulated_ = mouse; }
  /// Adds a key press to those that takeKeys() returns.
  void simulateKey(const KeyPress& key) { keys_.push_back(key); }

 private:
  void drawFrame(int width, int height, bool isInMemory, const std::function<void()>& interface);

  GLFWwindow* window_ = nullptr;
  unsigned texture_ = 0;
  bool hasPicture_ = false;
  std::optional<Mouse> simulated_;
  std::vector<KeyPress> keys_;
  std::vector<std::filesystem::path> drops_;
};

}  // namespace viewer
