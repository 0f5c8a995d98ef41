#include "apps/viewer/screenshot.h"

#include <fmt/core.h>

#include "levelset/error.h"
#include "render/images/image.h"
#include "render/views/picture.h"

namespace viewer {

void requireScreenshotName(const std::filesystem::path& file, bool isInterface) {
  const std::string format = render::imageFormat(file);
  if (format == "png" || (format == "exr" && !isInterface)) return;
  throw levelset::UsageError(fmt::format("screenshot: '{}' has no supported extension; use .png{}",
                                         file.string(),
                                         isInterface ? "" : ", or .exr for all layers"));
}

void writeScreenshot(const std::filesystem::path& file, const Frame& frame) {
  requireScreenshotName(file, false);
  if (render::imageFormat(file) == "png") {
    const render::Camera& camera = frame.view.camera;
    const bool isWhole = frame.canvas.width == camera.width && frame.canvas.height == camera.height;
    const Canvas canvas =
        isWhole ? frame.canvas : stretched(frame.canvas, camera.width, camera.height);
    render::writePng(file, canvas.width, canvas.height, canvas.colours);
    return;
  }
  render::Scene scene = frame.view.model->scene;
  scene.camera = frame.view.camera;
  render::Image image = *frame.image;
  render::RenderOptions options;
  options.style.style = frame.view.style;
  options.thickness = frame.view.hasThickness;
  image.attributes = render::sceneAttributes(scene, options);
  render::addViewAttributes(image, scene, frame.view.model->extent());
  render::writeImage(file, image);
}

}  // namespace viewer
