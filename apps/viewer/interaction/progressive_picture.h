#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "apps/viewer/interaction/clip_plane.h"
#include "apps/viewer/interaction/patch_overlay.h"
#include "apps/viewer/model/layer_colours.h"
#include "apps/viewer/model/model.h"
#include "render/camera.h"
#include "render/images/image.h"
#include "render/shading/style.h"

namespace viewer {

enum class Renderer {
  Auto,  ///< the GPU where it is one, else the processor
  Cpu,
  Gpu
};

/// What is drawn. Another view is another picture.
struct View {
  std::shared_ptr<const Model> model;
  render::Camera camera;
  std::optional<ClipPlane> clip = {};
  render::Style style = render::Style::Lit;  ///< of the colours; no matcap
};

/// How a picture is shown; nothing is drawn again when it changes.
struct Display {
  Layer layer = Layer::Colour;
  double curvatureRange = 40;  ///< by the extent, see layerColours()
  PatchLines patches = PatchLines::All;
  bool contours = true;  ///< φ on the clip plane
  bool operator==(const Display&) const = default;
};

/// A view, drawn more or less finely.
struct Frame {
  View view;
  int pixelSize = 8;        ///< of the window, along an edge of one of the picture
  bool isComplete = false;  ///< with all samples, light and shadow
  std::shared_ptr<const render::Image> image;  ///< its layers
  Canvas canvas;                               ///< as it is shown, of any size
};

/// Draws views in a thread of its own, each first coarsely and then ever finer.
class ProgressivePicture {
 public:
  /// @param wake  called from that thread when there is something new to be shown
  explicit ProgressivePicture(Renderer renderer = Renderer::Auto, std::function<void()> wake = {});
  ~ProgressivePicture();
  ProgressivePicture(const ProgressivePicture&) = delete;
  ProgressivePicture& operator=(const ProgressivePicture&) = delete;

  /// Returns at once. Of a view that is drawn already only the display is taken.
  void request(const View& view, const Display& display);
  /// The newest one; null before there is any.
  [[nodiscard]] std::shared_ptr<const Frame> frame() const;
  /// Why the view that is wanted cannot be drawn; null: it can.
  [[nodiscard]] std::exception_ptr failure() const;
  /// Of the present pass, from 0 to 1; 1 when there is nothing to do.
  [[nodiscard]] double progress() const { return progress_; }
  /// Who draws, for people.
  [[nodiscard]] std::string rendererName() const;

 private:
  struct Worker;
  struct Request {
    View view;
    Display display;
  };
  void run();

  std::function<void()> wake_;
  Renderer renderer_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Request> pending_;      // not yet taken by the thread
  std::optional<Request> lastRequest_;  // taken or not
  std::shared_ptr<const Frame> frame_;
  std::exception_ptr failure_;
  std::string rendererName_;
  bool isEnding_ = false;
  std::atomic<bool> isStale_ = false;  // what is being drawn is no longer wanted
  std::atomic<double> progress_ = 1;
  std::thread thread_;
};

/// Are both cameras the same, to the last bit?
[[nodiscard]] bool isSame(const render::Camera& a, const render::Camera& b);
[[nodiscard]] bool isSame(const View& a, const View& b);

}  // namespace viewer
