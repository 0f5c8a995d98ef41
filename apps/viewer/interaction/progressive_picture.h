#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "apps/viewer/effects/shown_effects.h"
#include "apps/viewer/interaction/clip_plane.h"
#include "apps/viewer/interaction/patch_overlay.h"
#include "apps/viewer/model/layer_colours.h"
#include "apps/viewer/model/model.h"
#include "render/camera.h"
#include "render/images/image.h"
#include "render/shading/style.h"

namespace viewer {

/// Back end that draws the picture.
enum class Renderer {
  Auto,  ///< the GPU if OpenGL runs on hardware, else the processor
  Cpu,
  Gpu
};

/// Model, camera, clip plane and appearance of a picture. A change of them needs new rays.
struct View {
  std::shared_ptr<const Model> model;
  render::Camera camera;
  std::optional<ClipPlane> clip = {};
  render::Style style = render::Style::Lit;
  /// Picture of a shaded ball for the style matcap; null: matcapBall().
  std::shared_ptr<const render::ColourImage> matcap = {};
  /// Factor of the opacities of all solids and meshes, (0, 1]. Without effect on blended scenes.
  double opacity = 1;
  bool hasThickness = false;       ///< the picture has the layer thickness
  IsosurfaceView isosurface = {};  ///< of the model's volume, if it has one
  LightView light = {};            ///< of the model's volume; then `opacity` has no effect
};

/// Display options. A change of them recolours the present picture, without new rays.
struct Display {
  Layer layer = Layer::Colour;
  /// Curvature at the end of the colour scale, multiplied by the diagonal of the box of the model's
  /// surfaces.
  double curvatureRange = 40;
  PatchLines patches = PatchLines::All;
  bool contours = true;     ///< draws contours of φ on the clip plane
  EffectView effects = {};  ///< on the layer Colour
  SliceView slices = {};    ///< slices through the model's volume, if it has one
  bool operator==(const Display&) const = default;
};

/// A picture of a view at one level of refinement.
struct Frame {
  View view;
  Display display;    ///< options of `canvas`
  int pixelSize = 8;  ///< edge of a pixel of `image`, in pixels of the window
  /// True after the last pass: full resolution, all samples, shadows and occlusion.
  bool isComplete = false;
  std::shared_ptr<const render::Image> image;  ///< the picture with all layers, without effects
  std::string note = {};  ///< sentence on effects that were left out; empty: none
  Canvas
      canvas;  ///< colours to display; its size may differ from that of `image` and of the window
};

/// Draws views in a background thread, in passes of increasing quality.
class ProgressivePicture {
 public:
  /// @param wake  called from the drawing thread when a new frame is available
  explicit ProgressivePicture(Renderer renderer = Renderer::Auto, std::function<void()> wake = {});
  ~ProgressivePicture();
  ProgressivePicture(const ProgressivePicture&) = delete;
  ProgressivePicture& operator=(const ProgressivePicture&) = delete;

  /// Requests a picture of a view and returns at once. If the view has not changed, only the
  /// display options are applied.
  void request(const View& view, const Display& display);
  /// Newest frame; null before the first one.
  [[nodiscard]] std::shared_ptr<const Frame> frame() const;
  /// Error that prevented the drawing of the requested view; null without an error.
  [[nodiscard]] std::exception_ptr failure() const;
  /// Progress of the pass of refinement that is being drawn, from 0 to 1; 1 when nothing is drawn.
  [[nodiscard]] double progress() const { return progress_; }
  /// True while the picture of the newest request is not complete, unless it failed.
  [[nodiscard]] bool isBusy() const;
  /// Name of the back end in use: "processor", or the description of the OpenGL device.
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
  std::optional<Request> pending_;      // request that the drawing thread has not yet taken
  std::optional<Request> lastRequest_;  // newest request, even if taken
  std::shared_ptr<const Frame> frame_;
  std::exception_ptr failure_;
  std::string rendererName_;
  bool isEnding_ = false;
  std::atomic<bool> isStale_ = false;  // a newer request makes the picture being drawn obsolete
  std::atomic<double> progress_ = 1;
  std::thread thread_;
};

/// True when all members of both cameras, or of both views, are equal. Models are equal if they are
/// the same object.
[[nodiscard]] bool isSame(const render::Camera& a, const render::Camera& b);
[[nodiscard]] bool isSame(const View& a, const View& b);

}  // namespace viewer
