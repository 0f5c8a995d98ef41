#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "apps/viewer/interaction/patch_overlay.h"

struct GLFWwindow;

namespace viewer {

/// A pressed key: its character, or GLFW's key number for keys without a character.
struct KeyPress {
  unsigned character = 0;
  int key = 0;
  bool withControl = false;
};

/// A window with OpenGL and Dear ImGui. Only one may exist at a time, on the main thread.
class Window {
 public:
  /// @param isVisible  false: for pictures of the window only
  /// @throws levelset::ResourceLimit when there is no display, or OpenGL 3.3 is missing
  Window(const std::string& title, int width, int height, bool isVisible);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Requests a redraw. May be called from any thread.
  static void wake();
  /// Waits for an event, at most the given time. Returns true when an event arrived.
  bool wait(double seconds);
  [[nodiscard]] bool isToClose() const;
  void close();
  void setTitle(const std::string& title);

  [[nodiscard]] int width() const;   ///< pixels, at least 1
  [[nodiscard]] int height() const;  ///< pixels, at least 1

  /// Draws the picture, if there is one, and on top of it the ImGui widgets of `interface`.
  void draw(const std::function<void()>& interface);
  /// Draws the same into memory, at any size. @return red, green, blue, alpha
  /// @throws levelset::ResourceLimit for a size that OpenGL does not support
  [[nodiscard]] Canvas drawInMemory(int width, int height, const std::function<void()>& interface);

  /// Picture behind the interface, stretched to the window.
  void setPicture(const Canvas& canvas);
  void clearPicture();

  /// Input since the last call.
  [[nodiscard]] std::vector<KeyPress> takeKeys();
  [[nodiscard]] std::vector<std::filesystem::path> takeDrops();

  void setClipboard(const std::string& text);

 private:
  void drawFrame(int width, int height, bool isInMemory, const std::function<void()>& interface);

  GLFWwindow* window_ = nullptr;
  unsigned texture_ = 0;
  bool hasPicture_ = false;
  std::vector<KeyPress> keys_;
  std::vector<std::filesystem::path> drops_;
};

}  // namespace viewer
