#include "apps/viewer/viewer_script.h"

#include <fmt/core.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

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

}  // namespace

void runScript(const Arguments& arguments) {
  if (arguments.screenshot)
    levelset::FileTarget(
        *arguments.screenshot);  // throws before any work if the file cannot be written
  const auto model = std::make_shared<const Model>(
      openModel(arguments.files, {.resolution = arguments.resolution}));
  if (arguments.clip && !model->canCut())
    throw levelset::InvalidInput(
        "levelsmith-view: --clip needs solids that can be cut, and the model has none; omit "
        "--clip");
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
