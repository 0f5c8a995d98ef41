#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "apps/viewer/interaction/patch_overlay.h"

struct GLFWwindow;

namespace viewer {

/// A key that was pressed: what it writes, or GLFW's number of one that writes nothing.
struct KeyPress {
  unsigned character = 0;
  int key = 0;
  bool withControl = false;
};

/// A window with OpenGL and Dear ImGui in it, one at a time. For the main thread only.
class Window {
 public:
  /// @param isVisible  false: for pictures of it alone
  /// @throws levelset::ResourceLimit where there is no display, or no OpenGL 3.3 on it
  Window(const std::string& title, int width, int height, bool isVisible);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// From any thread: something is to be drawn.
  static void wake();
  /// Waits for something to happen, some seconds at most. @return did it?
  bool wait(double seconds);
  [[nodiscard]] bool isToClose() const;
  void close();
  void setTitle(const std::string& title);

  [[nodiscard]] int width() const;   ///< pixels, at least 1
  [[nodiscard]] int height() const;  ///< pixels, at least 1

  /// Draws the picture, if it has one, and over it what `interface` makes of ImGui.
  void draw(const std::function<void()>& interface);
  /// The same into memory, of any size. @return red, green, blue, alpha
  /// @throws levelset::ResourceLimit for a size that OpenGL does not take
  [[nodiscard]] Canvas drawInMemory(int width, int height, const std::function<void()>& interface);

  /// What is drawn behind the interface, over all of the window.
  void setPicture(const Canvas& canvas);
  void clearPicture();

  /// Since the last call.
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
