#include "apps/viewer/window.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/core.h>
#include <imgui/backends/imgui_impl_glfw.h>
#include <imgui/backends/imgui_impl_opengl3.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <array>
#include <system_error>
#include <utility>

#include "levelset/error.h"

namespace viewer {
namespace {

constexpr const char* kWithoutDisplay =
    "provide a display, for example with xvfb-run, or draw with 'levelsmith render', which "
    "needs "
    "none";

std::string glfwError() {
  const char* description = nullptr;
  glfwGetError(&description);
  return description ? description : "unknown reason";
}

Window& windowOf(GLFWwindow* window) {
  return *static_cast<Window*>(glfwGetWindowUserPointer(window));
}

/// Loads a font with all characters of the interface, if it is installed; else ImGui's own font.
void loadFont() {
  constexpr std::array<const char*, 3> kPlaces = {
      "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
      "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf"};
  constexpr float kHeight = 15;  // height of the font, pixels
  ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
  for (const char* place : kPlaces) {
    std::error_code wrong;
    if (!std::filesystem::is_regular_file(place, wrong)) continue;
    if (fonts.AddFontFromFileTTF(place, kHeight)) return;
  }
  fonts.AddFontDefault();
}

void setStyle() {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = style.FrameRounding = style.GrabRounding = 3;
  style.WindowBorderSize = 0;
  style.Colors[ImGuiCol_WindowBg] = {0.09f, 0.10f, 0.12f, 0.86f};
  style.Colors[ImGuiCol_PopupBg] = {0.09f, 0.10f, 0.12f, 0.96f};
}

void drawBackground(ImDrawList& list, float width, float height) {
  const ImU32 top = IM_COL32(74, 80, 89, 255), bottom = IM_COL32(34, 37, 42, 255);
  list.AddRectFilledMultiColor({0, 0}, {width, height}, top, top, bottom, bottom);
}

/// A framebuffer in memory. OpenGL draws into it during its lifetime.
class MemoryTarget {
 public:
  MemoryTarget(int width, int height) {
    glGenFramebuffers(1, &frame_);
    glGenRenderbuffers(1, &colours_);
    glBindRenderbuffer(GL_RENDERBUFFER, colours_);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
    glBindFramebuffer(GL_FRAMEBUFFER, frame_);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colours_);
    isWhole_ = glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
  }
  ~MemoryTarget() {
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glDeleteFramebuffers(1, &frame_);
    glDeleteRenderbuffers(1, &colours_);
  }
  MemoryTarget(const MemoryTarget&) = delete;
  MemoryTarget& operator=(const MemoryTarget&) = delete;
  [[nodiscard]] bool isWhole() const { return isWhole_; }

 private:
  GLuint frame_ = 0, colours_ = 0;
  bool isWhole_ = false;
};

}  // namespace

Window::Window(const std::string& title, int width, int height, bool isVisible) {
  if (!glfwInit())
    throw levelset::ResourceLimit(fmt::format("levelsmith-view: no window can be opened ({}); {}",
                                              glfwError(), kWithoutDisplay));
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_VISIBLE, isVisible ? GLFW_TRUE : GLFW_FALSE);
  window_ = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
  if (!window_) {
    const std::string error = glfwError();
    glfwTerminate();
    throw levelset::ResourceLimit(
        fmt::format("levelsmith-view: no window with OpenGL 3.3 can be opened ({}); {}", error,
                    kWithoutDisplay));
  }
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(1);
  glfwSetWindowUserPointer(window_, this);
  // Set these callbacks before ImGui installs its own, which then call these.
  glfwSetCharCallback(window_, [](GLFWwindow* window, unsigned character) {
    windowOf(window).keys_.push_back({.character = character});
  });
  glfwSetKeyCallback(window_, [](GLFWwindow* window, int key, int, int action, int modifiers) {
    const bool withControl = (modifiers & GLFW_MOD_CONTROL) != 0;
    if (action != GLFW_RELEASE && (withControl || key >= GLFW_KEY_ESCAPE))
      windowOf(window).keys_.push_back({.key = key, .withControl = withControl});
  });
  glfwSetDropCallback(window_, [](GLFWwindow* window, int count, const char** files) {
    for (int i = 0; i < count; ++i) windowOf(window).drops_.emplace_back(files[i]);
  });
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // do not write a settings file to the user's folder
  setStyle();
  loadFont();
  ImGui_ImplGlfw_InitForOpenGL(window_, true);
  ImGui_ImplOpenGL3_Init("#version 330 core");
}

Window::~Window() {
  clearPicture();
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window_);
  glfwTerminate();
}

void Window::wake() {
  glfwPostEmptyEvent();
}

bool Window::wait(double seconds) {
  const double start = glfwGetTime();
  glfwWaitEventsTimeout(std::max(seconds, 1e-3));
  return glfwGetTime() - start < seconds;
}

bool Window::isToClose() const {
  return glfwWindowShouldClose(window_) != 0;
}

void Window::close() {
  glfwSetWindowShouldClose(window_, GLFW_TRUE);
}

void Window::setTitle(const std::string& title) {
  glfwSetWindowTitle(window_, title.c_str());
}

int Window::width() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return std::max(width, 1);
}

int Window::height() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return std::max(height, 1);
}

void Window::setPicture(const Canvas& canvas) {
  if (!texture_) glGenTextures(1, &texture_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  // With linear filtering, pictures with the size of the window stay sharp.
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, canvas.width, canvas.height, 0, GL_RGBA,
               GL_UNSIGNED_BYTE, canvas.colours.data());
  hasPicture_ = glGetError() == GL_NO_ERROR;
}

void Window::clearPicture() {
  if (texture_) glDeleteTextures(1, &texture_);
  texture_ = 0;
  hasPicture_ = false;
}

void Window::drawFrame(int width, int height, bool isInMemory,
                       const std::function<void()>& interface) {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGuiIO& io = ImGui::GetIO();
  if (isInMemory) {
    io.DisplaySize = {static_cast<float>(width), static_cast<float>(height)};
    io.DisplayFramebufferScale = {1, 1};
  }
  if (simulated_) {
    io.MousePos = {simulated_->x, simulated_->y};
    std::copy(simulated_->isDown.begin(), simulated_->isDown.end(), io.MouseDown);
    io.KeyShift = simulated_->hasShift;
  }
  ImGui::NewFrame();
  ImDrawList& behind = *ImGui::GetBackgroundDrawList();
  drawBackground(behind, io.DisplaySize.x, io.DisplaySize.y);
  if (hasPicture_)
    // NOLINTNEXTLINE(performance-no-int-to-ptr): ImGui stores texture numbers as pointers
    behind.AddImage(reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(texture_)), {0, 0},
                    io.DisplaySize);
  interface();
  ImGui::Render();
  glViewport(0, 0, width, height);
  glClearColor(0, 0, 0, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void Window::draw(const std::function<void()>& interface) {
  drawFrame(width(), height(), false, interface);
  glfwSwapBuffers(window_);
}

Canvas Window::drawInMemory(int width, int height, const std::function<void()>& interface) {
  GLint most = 0;
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &most);
  const auto refuse = [&] {
    throw levelset::ResourceLimit(
        fmt::format("levelsmith-view: a window of {}x{} pixels is too large; OpenGL supports at "
                    "most {} pixels along a side here; give a smaller --size",
                    width, height, most));
  };
  if (width > most || height > most) refuse();
  const MemoryTarget target(width, height);
  if (!target.isWhole()) refuse();
  drawFrame(width, height, true, interface);
  Canvas canvas{width, height, {}};
  canvas.colours.resize(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, canvas.colours.data());
  // Reverse the rows, which OpenGL counts from below. Set alpha to 255, because blending leaves a
  // meaningless value.
  const std::size_t row = 4 * static_cast<std::size_t>(width);
  for (int y = 0; y < height / 2; ++y)
    std::swap_ranges(canvas.colours.begin() + static_cast<std::ptrdiff_t>(row) * y,
                     canvas.colours.begin() + static_cast<std::ptrdiff_t>(row) * (y + 1),
                     canvas.colours.begin() + static_cast<std::ptrdiff_t>(row) * (height - 1 - y));
  for (std::size_t i = 3; i < canvas.colours.size(); i += 4) canvas.colours[i] = 255;
  return canvas;
}

std::vector<KeyPress> Window::takeKeys() {
  return std::exchange(keys_, {});
}

std::vector<std::filesystem::path> Window::takeDrops() {
  return std::exchange(drops_, {});
}

void Window::setClipboard(const std::string& text) {
  glfwSetClipboardString(window_, text.c_str());
}

std::string Window::clipboard() const {
  const char* text = glfwGetClipboardString(window_);
  return text ? text : "";
}

}  // namespace viewer
