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

/// Choice of the back end.
enum class Renderer {
  Auto,  ///< the GPU if it is hardware, else the processor
  Cpu,
  Gpu
};

/// Everything that determines a picture.
struct View {
  std::shared_ptr<const Model> model;
  render::Camera camera;
  std::optional<ClipPlane> clip = {};
  render::Style style = render::Style::Lit;  ///< shading style; not matcap
};

/// Display options, which change without a new picture.
struct Display {
  Layer layer = Layer::Colour;
  double curvatureRange = 40;  ///< relative to the extent, see layerColours()
  PatchLines patches = PatchLines::All;
  bool contours = true;  ///< draws contours of φ on the clip plane
  bool operator==(const Display&) const = default;
};

/// A picture of a view at one level of refinement.
struct Frame {
  View view;
  int pixelSize = 8;                           ///< edge of a picture pixel, window pixels
  bool isComplete = false;                     ///< all samples are done, with light and shadow
  std::shared_ptr<const render::Image> image;  ///< the layers of the picture
  Canvas canvas;                               ///< displayed pixels, any size
};

/// Draws views in a background thread, in passes of increasing quality.
class ProgressivePicture {
 public:
  /// @param wake  called from that thread when a new frame is available
  explicit ProgressivePicture(Renderer renderer = Renderer::Auto, std::function<void()> wake = {});
  ~ProgressivePicture();
  ProgressivePicture(const ProgressivePicture&) = delete;
  ProgressivePicture& operator=(const ProgressivePicture&) = delete;

  /// Requests a view and returns at once. For the present view only the display options change.
  void request(const View& view, const Display& display);
  /// Newest frame; null before the first one.
  [[nodiscard]] std::shared_ptr<const Frame> frame() const;
  /// Error that prevents drawing of the requested view; null: none.
  [[nodiscard]] std::exception_ptr failure() const;
  /// Progress of the present pass, from 0 to 1; 1 when idle.
  [[nodiscard]] double progress() const { return progress_; }
  /// Description of the back end for the user.
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
  std::optional<Request> lastRequest_;  // newest request, taken or not
  std::shared_ptr<const Frame> frame_;
  std::exception_ptr failure_;
  std::string rendererName_;
  bool isEnding_ = false;
  std::atomic<bool> isStale_ = false;  // the present drawing is out of date
  std::atomic<double> progress_ = 1;
  std::thread thread_;
};

/// True when both are equal to the last bit.
[[nodiscard]] bool isSame(const render::Camera& a, const render::Camera& b);
[[nodiscard]] bool isSame(const View& a, const View& b);

}  // namespace viewer
