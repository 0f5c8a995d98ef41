#include "apps/viewer/viewer_script.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/core.h>

#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

#include "apps/viewer/interaction/input_script.h"
#include "apps/viewer/interaction/pick.h"
#include "apps/viewer/screenshot.h"
#include "apps/viewer/viewer.h"
#include "apps/viewer/window.h"
#include "levelset/error.h"
#include "levelset/file_target.h"

namespace viewer {
namespace {

void printLine(const std::string& line) {
  if (std::fputs((line + "\n").c_str(), stdout) < 0 || std::fflush(stdout) != 0)
    throw levelset::IoError(fmt::format("levelsmith-view: standard output cannot be written: {}",
                                        std::strerror(errno)));
}

/// Returns a picture of the window. It draws several frames, because ImGui computes the layout in
/// one frame and uses it in the next.
Canvas windowShot(Window& window, Viewer& viewer, int width, int height) {
  constexpr int kFrames = 3;
  Canvas shot;
  viewer.update();
  for (int i = 0; i < kFrames; ++i)
    shot = window.drawInMemory(width, height, [&] { viewer.drawInterface(width, height); });
  return shot;
}

/// Converts the name of a key in a script. @throws levelset::UsageError for an unknown name
KeyPress keyNamed(const std::string& name) {
  if (name.size() == 1) return {.character = static_cast<unsigned char>(name[0])};
  if (name.size() == 6 && name.starts_with("ctrl+"))
    return {.key = std::toupper(static_cast<unsigned char>(name[5])), .withControl = true};
  constexpr std::array<std::pair<const char*, int>, 7> kNames = {{{"backspace", GLFW_KEY_BACKSPACE},
                                                                  {"escape", GLFW_KEY_ESCAPE},
                                                                  {"enter", GLFW_KEY_ENTER},
                                                                  {"left", GLFW_KEY_LEFT},
                                                                  {"right", GLFW_KEY_RIGHT},
                                                                  {"up", GLFW_KEY_UP},
                                                                  {"down", GLFW_KEY_DOWN}}};
  for (const auto& [known, key] : kNames)
    if (name == known) return {.key = key};
  throw levelset::UsageError(
      fmt::format("levelsmith-view: --play: the key '{}' is unknown; give a character, backspace, "
                  "escape, enter, left, right, up, down, or ctrl+ and a letter",
                  name));
}

/// Plays simulated input in a window in memory. Each step takes one frame.
class Player {
 public:
  Player(Window& window, Viewer& viewer, int width, int height)
      : window_(window), viewer_(viewer), width_(width), height_(height) {}

  void play(const std::vector<InputStep>& steps) {
    for (const InputStep& step : steps) take(step);
    wait();
  }

 private:
  void take(const InputStep& step) {
    switch (step.kind) {
      case InputStep::Kind::Move:
        mouse_.x = static_cast<float>(step.place.x);
        mouse_.y = static_cast<float>(step.place.y);
        break;
      case InputStep::Kind::Press:
      case InputStep::Kind::Release:
        (step.button == InputStep::kShift ? mouse_.hasShift
                                          : mouse_.isDown[static_cast<std::size_t>(step.button)]) =
            step.kind == InputStep::Kind::Press;
        break;
      case InputStep::Kind::Key:
        window_.simulateKey(keyNamed(step.text));
        break;
      case InputStep::Kind::Wait:
        wait();
        break;
      case InputStep::Kind::Picture:
        render::writePng(step.text, width_, height_,
                         windowShot(window_, viewer_, width_, height_).colours);
        break;
      case InputStep::Kind::Copied:
        printLine(window_.clipboard());
        break;
    }
    window_.simulateMouse(mouse_);
    drawFrame();
  }

  void drawFrame() {
    viewer_.update();
    (void)window_.drawInMemory(width_, height_, [&] { viewer_.drawInterface(width_, height_); });
    viewer_.requestPicture(width_, height_);
  }

  void wait() {
    do {
      window_.wait(0.02);
      drawFrame();
    } while (viewer_.isBusy());
  }

  Window& window_;
  Viewer& viewer_;
  int width_, height_;
  Window::Mouse mouse_;
};

/// Waits until the picture is complete. @param isForPick  true: a picture at full resolution
/// suffices, without light and shadows
std::shared_ptr<const Frame> finishedFrame(Window& window, Viewer& viewer, int width, int height,
                                           bool isForPick) {
  for (;;) {
    viewer.requestPicture(width, height);
    if (const std::exception_ptr failure = viewer.picture().failure())
      std::rethrow_exception(failure);
    std::shared_ptr<const Frame> frame = viewer.picture().frame();
    if (frame && (frame->isComplete || (isForPick && frame->pixelSize == 1))) return frame;
    window.wait(0.1);
  }
}

}  // namespace

void runScript(const Arguments& arguments) {
  if (arguments.screenshot)
    levelset::FileTarget(
        *arguments.screenshot);  // throws before any work if the file cannot be written
  std::vector<InputStep> steps;
  if (arguments.play) steps = readInputScript(*arguments.play);
  const auto model = std::make_shared<const Model>(
      openModel(arguments.files, {.resolution = arguments.resolution}));
  requireFit(arguments, *model);
  // The size in a scene file is used if --size is not given, as in 'levelsmith render'.
  const bool isSceneSize = model->camera && !arguments.hasSize;
  const int width = isSceneSize ? model->camera->width : arguments.width,
            height = isSceneSize ? model->camera->height : arguments.height;
  const render::Camera camera = firstCamera(arguments, *model, width, height);
  constexpr int kAnyEdge = 64;  // edge of the invisible window, pixels; pictures are drawn in
                                // memory, so any size will do
  Window window("levelsmith-view", kAnyEdge, kAnyEdge, false);
  Viewer viewer(arguments, window);
  viewer.requestPicture(camera.width, camera.height);
  viewer.show(model, false);
  // The picture shows the finished solid.
  while (arguments.givesDeformation() && !arguments.play && viewer.isBusy()) {
    window.wait(0.02);
    viewer.update();
    viewer.requestPicture(width, height);
  }
  if (arguments.play) Player(window, viewer, width, height).play(steps);
  if (!arguments.screenshot && !arguments.pick) return;
  const std::shared_ptr<const Frame> frame =
      finishedFrame(window, viewer, width, height, !arguments.screenshot);
  if (arguments.pick) {
    const auto [x, y] = *arguments.pick;
    if (x >= width || y >= height)
      throw levelset::UsageError(
          fmt::format("levelsmith-view: --pick {},{} lies outside the picture of {}x{} pixels; 0,0 "
                      "is its upper left corner",
                      x, y, width, height));
    const std::optional<Picked> picked = pick(*frame, x, y);
    if (picked) viewer.addPick(*picked);
    printLine(pickedJson(picked));
  }
  if (!arguments.screenshot) return;
  if (arguments.isInterface)
    render::writePng(*arguments.screenshot, width, height,
                     windowShot(window, viewer, width, height).colours);
  else
    writeScreenshot(*arguments.screenshot, *frame);
}

}  // namespace viewer
