#include "apps/viewer/interaction/progressive_picture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "apps/viewer/interaction/point_splats.h"
#include "apps/viewer/model/matcap_ball.h"
#include "apps/viewer/model/surface_discs.h"
#include "apps/viewer/volume/volume_slices.h"
#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "render/cpu/cpu_tracer.h"
#include "render/gpu/device/gl_context.h"
#include "render/gpu/gpu_tracer.h"
#include "render/kernel/kernel_scene.h"
#include "render/kernel/paint.h"
#include "render/views/picture.h"

namespace viewer {
namespace {

/// A pass of refinement: edge of a pixel of the picture, in pixels of the window, and numbers of
/// samples as in RenderOptions.
struct Pass {
  int pixelSize, samples, ambientSamples, shadowSamples;
};
constexpr std::array<Pass, 6> kPasses = {Pass{8, 1, 0, 0}, {4, 1, 0, 0},  {2, 1, 0, 0},
                                         {1, 1, 0, 0},     {1, 1, 16, 4}, {1, 4, 16, 4}};

// Edges of a tile of the picture, pixels. A tile has enough rays for efficient tracing.
constexpr int kCpuTileEdge = 16, kGpuTileEdge = 64;
// Number of voxels from which on discs at the surface points are drawn before rays, edge of their
// pixels, and number of the pass that follows them.
constexpr std::size_t kManyVoxels = 10'000'000;
constexpr int kSplatPixelSize = 2;
constexpr std::size_t kPassAfterSplats = 3;
// Depth behind the surface up to which patch lines count as in front of it, as a fraction of the
// diagonal of the model's box.
constexpr double kOnSurface = 4e-3;

render::Camera shrunk(render::Camera camera, int pixelSize) {
  camera.width = std::max(1, (camera.width + pixelSize / 2) / pixelSize);
  camera.height = std::max(1, (camera.height + pixelSize / 2) / pixelSize);
  return camera;
}

}  // namespace

/// State of the drawing thread, which it keeps from picture to picture.
struct ProgressivePicture::Worker {
  const ProgressivePicture& owner;
  View view;
  Display display;
  std::size_t pass =
      kPasses.size();  // index of the next pass; kPasses.size(): the picture is finished
  int pixelSize = kPasses[0].pixelSize;
  std::shared_ptr<const render::Image>
      image;  // picture of the last finished pass for `view`; null: none

  std::shared_ptr<const Model>
      preparedModel;  // model from which the kernel's tables in `surfaces` were built
  std::optional<ClipPlane::Across> preparedCut;
  double preparedOpacity = 1;
  IsosurfaceView preparedIsosurface;
  std::vector<render::TransferPoint> preparedTransfer;
  std::optional<render::DirectVolume> directVolume;
  std::shared_ptr<const Model> directVolumeModel;  // model of directVolume
  std::unique_ptr<ClippedScene> cut;
  std::unique_ptr<render::KernelScene> surfaces;
  std::unique_ptr<render::GlContext> context;
  std::unique_ptr<render::KernelTracer> tracer;
  bool hasTriedGpu = false;

  // Surface discs of the solids of discsModel; empty if its scene has too few voxels for discs.
  std::shared_ptr<const Model> discsModel;
  std::vector<SurfaceDiscs> discs;
  std::string name = "processor";

  // Pictures of the terrain of terrainModel. They are drawn again while patches arrive.
  std::shared_ptr<const Model> terrainModel;
  std::unique_ptr<TerrainFrames> terrainFrames;
  std::string terrainNote;
  bool isTerrainFinal = true;

  explicit Worker(const ProgressivePicture& owner_) : owner(owner_) {}

  [[nodiscard]] bool hasLight() const { return view.model->volume && !view.light.transfer.empty(); }
  [[nodiscard]] bool isCut() const { return view.clip && view.model->canCut(); }
  [[nodiscard]] PlacedPlane plane() const {
    return placed(*view.clip, view.camera, view.model->solidBounds);
  }
  /// The volume with the transfer function of the view.
  [[nodiscard]] const render::DirectVolume& volumeWithTransfer() {
    if (!directVolume || directVolumeModel != view.model ||
        preparedTransfer != view.light.transfer) {
      directVolume = viewer::directVolume(*view.model->volume, view.light);
      directVolumeModel = view.model;
      preparedTransfer = view.light.transfer;
    }
    return *directVolume;
  }
  /// Scene of the view, with a camera for a picture of coarser pixels. @param edge  edge of a pixel
  /// of the picture, in pixels of the window
  [[nodiscard]] render::Scene sceneFor(int edge) {
    render::Scene scene = isCut() ? cut->at(plane()) : view.model->scene;
    scene.camera = shrunk(view.camera, edge);
    if (view.model->volume) placeIsosurface(*view.model->volume, view.isosurface, scene);
    if (hasLight()) scene.volumePart = {volumeWithTransfer(), view.light.isShaded};
    if (view.opacity == 1 || scene.isBlended() || hasLight()) return scene;
    // The box of the clip plane, which follows the model's solids, stays opaque.
    const std::size_t solids = std::min(view.model->scene.solids.size(), scene.solids.size());
    for (std::size_t i = 0; i < solids; ++i) scene.solids[i].opacity *= view.opacity;
    for (render::MeshPart& part : scene.meshes) part.opacity *= view.opacity;
    return scene;
  }

  void take(const Request& request) {
    if (!view.model || !isSame(view, request.view)) {
      view = request.view;
      pass = 0;
      image = nullptr;
    }
    display = request.display;
  }

  /// True when the next picture is drawn as discs: of a new view on a large grid, in a layer that
  /// discs have.
  [[nodiscard]] bool wantsSplats() {
    if (image || pass != 0 || isCut() || view.opacity != 1 || view.hasThickness ||
        (display.layer >= Layer::MeanCurvature && display.layer <= Layer::K2))
      return false;
    if (discsModel != view.model) {
      discsModel = view.model;
      discs.clear();
      const std::vector<render::Solid>& solids = view.model->scene.solids;
      const std::size_t voxels = std::accumulate(
          solids.begin(), solids.end(), std::size_t{0},
          [](std::size_t sum, const auto& solid) { return sum + solid.band.activeVoxelCount(); });
      if (voxels >= kManyVoxels && canSplat(view.model->scene))
        for (const render::Solid& solid : solids) discs.push_back(surfaceDiscs(solid.band));
    }
    return !discs.empty();
  }

  /// Draws the picture as discs. @return the picture, or null when a newer request is pending
  std::shared_ptr<const render::Image> splatted(const std::atomic<bool>& isStale) {
    const render::Scene scene = sceneFor(kSplatPixelSize);
    render::validate(scene.camera);
    std::shared_ptr<render::Image> drawn = drawSplats(
        discs, scene, view.model->extent(), optionsFor({kSplatPixelSize, 1, 0, 0}), isStale);
    if (drawn) render::addViewAttributes(*drawn, scene, view.model->extent());
    return drawn;
  }

  /// Draws the terrain of the model. Its pictures have full resolution at once.
  void requireTerrainLayer() const {
    if (display.layer >= Layer::MeanCurvature && display.layer <= Layer::K2)
      throw levelset::UsageError("a terrain has no curvature layers; choose another layer");
    if (view.hasThickness || display.layer == Layer::Thickness)
      throw levelset::UsageError("a terrain has no thickness; choose another layer");
  }

  void drawTerrain() {
    if (terrainModel != view.model) {
      terrainFrames = nullptr;
      terrainFrames = std::make_unique<TerrainFrames>(*view.model->terrain);
      terrainModel = view.model;
      isTerrainFinal = true;
    }
    if (!isTerrainFinal) terrainFrames->waitForPatch();
    const TerrainFrames::Drawn drawn = terrainFrames->draw(view.camera);
    image = drawn.image;
    terrainNote = drawn.note;
    isTerrainFinal = drawn.isFinal;
    pixelSize = 1;
    pass = drawn.isFinal ? kPasses.size() : 0;
    name = "OpenGL";
  }

  [[nodiscard]] render::RenderOptions optionsFor(const Pass& how) const {
    render::RenderOptions options;
    options.samples = how.samples;
    options.ambientSamples = how.ambientSamples;
    options.shadowSamples = how.shadowSamples;
    options.style.style = view.style;
    options.style.matcap = view.matcap ? view.matcap : matcapBall();
    options.thickness = view.hasThickness;
    options.filter = view.isosurface.filter;
    options.volumeLight = false;
    options.maxBytes = levelset::memoryLimit(levelset::kNoMemoryLimit);
    return options;
  }

  void findTracer() {
    tracer = nullptr;
    if (owner.renderer_ != Renderer::Cpu && !hasTriedGpu) {
      hasTriedGpu = true;
      try {
        context = std::make_unique<render::GlContext>();
        // OpenGL in software is slower than the kernel on the processor.
        const bool isSoftware = context->description().find("llvmpipe") != std::string::npos;
        if (owner.renderer_ == Renderer::Auto && isSoftware) context = nullptr;
      } catch (const levelset::ResourceLimit&) {
        if (owner.renderer_ == Renderer::Gpu) throw;
      }
    }
    if (context) {
      try {
        tracer = std::make_unique<render::GpuTracer>(*context, *surfaces);
        name = context->description();
      } catch (const levelset::ResourceLimit&) {  // the tables do not fit into the GPU's memory
        if (owner.renderer_ == Renderer::Gpu) throw;
      }
    }
    if (!tracer) useProcessor();
  }

  void useProcessor() {
    tracer = std::make_unique<render::CpuTracer>();
    name = "processor";
  }

  /// Builds the kernel's tables, unless the tables of the previous picture were built for the same
  /// model, the same isosurface, the same axis of the clip plane and the same opacity.
  void prepare() {
    const std::optional<ClipPlane::Across> newCut =
        isCut() ? std::optional(view.clip->across) : std::nullopt;
    if (surfaces && preparedModel == view.model && preparedCut == newCut &&
        preparedOpacity == view.opacity && preparedIsosurface == view.isosurface)
      return;
    tracer = nullptr;  // the tracer references the tables in `surfaces`
    surfaces = nullptr;
    cut = nullptr;
    if (newCut)
      cut = std::make_unique<ClippedScene>(view.model->scene, view.model->solidBounds, *newCut);
    const render::Scene scene = sceneFor(1);
    render::validate(scene.camera);
    surfaces = std::make_unique<render::KernelScene>(
        scene, levelset::memoryLimit(levelset::kNoMemoryLimit), view.isosurface.filter);
    preparedModel = view.model;
    preparedCut = newCut;
    preparedOpacity = view.opacity;
    preparedIsosurface = view.isosurface;
    findTracer();
  }

  /// Draws the picture of one pass. @return the picture, or null when a newer request is pending
  std::shared_ptr<const render::Image> draw(const Pass& how, std::atomic<double>& progress,
                                            const std::atomic<bool>& isStale) {
    const render::Scene scene = sceneFor(how.pixelSize);
    const render::RenderOptions options = optionsFor(how);
    render::requirePicture(scene, options);
    surfaces->updateView(scene);
    auto drawn = std::make_shared<render::Image>(scene.camera.width, scene.camera.height);
    const render::KernelPainter painter(scene, *surfaces, options, *drawn);
    try {
      paintTiles(painter, *drawn, progress, isStale);
    } catch (const levelset::ResourceLimit&) {  // the volume does not fit into the GPU's memory
      if (owner.renderer_ == Renderer::Gpu || name == "processor") throw;
      useProcessor();
      paintTiles(painter, *drawn, progress, isStale);
    }
    if (isStale) return nullptr;
    render::finishColours(*drawn, scene, options, surfaces->bounds().size().length());
    render::addViewAttributes(*drawn, scene, surfaces->tableBounds().size().length());
    return drawn;
  }

  void paintTiles(const render::KernelPainter& painter, const render::Image& drawn,
                  std::atomic<double>& progress, const std::atomic<bool>& isStale) const {
    const int edge = context && name != "processor" ? kGpuTileEdge : kCpuTileEdge;
    const int across = (drawn.width + edge - 1) / edge, down = (drawn.height + edge - 1) / edge;
    std::atomic<int> done = 0;
    tbb::parallel_for(0, across * down, [&](int number) {
      if (isStale) return;
      const int left = number % across * edge, top = number / across * edge;
      painter.paint(*tracer, {left, top, std::min(left + edge, drawn.width),
                              std::min(top + edge, drawn.height)});
      progress = static_cast<double>(++done) / (across * down);
    });
  }

  [[nodiscard]] std::shared_ptr<const Frame> shown() {
    auto frame = std::make_shared<Frame>();
    frame->view = view;
    frame->display = display;
    frame->pixelSize = pixelSize;
    frame->isComplete = pass == kPasses.size();
    frame->image = image;
    Canvas& canvas = frame->canvas;
    frame->note = view.model->terrain ? terrainNote : "";
    const render::Image* seen = image.get();
    EffectPicture effected;
    if (display.layer == Layer::Colour && !display.effects.isEmpty()) {
      effected = withEffects(*image, display.effects, pixelSize);
      frame->note = effected.note;
      seen = &effected.image;
    }
    canvas = {image->width, image->height,
              layerColours(*seen, display.layer, view.model->extent(), display.curvatureRange)};
    if (isCut() && display.contours)
      paintPhi(*image, shrunk(view.camera, pixelSize), plane(), view.model->scene, canvas.colours);
    const bool hasSlices = view.model->volume && !display.slices.isEmpty();
    const bool hasPatches = display.patches != PatchLines::None && !view.model->patches.empty();
    if ((hasSlices || hasPatches) &&
        (canvas.width != view.camera.width || canvas.height != view.camera.height))
      canvas = stretched(canvas, view.camera.width, view.camera.height);
    if (hasSlices)
      paintSlices(view.model->volume->surface.volume(), display.slices, view.camera, *image,
                  canvas.colours);
    if (hasPatches) {
      drawPatches(view.model->patches, display.patches, view.camera, *image,
                  kOnSurface * view.model->bounds.size().length(), canvas);
    }
    return frame;
  }
};

ProgressivePicture::ProgressivePicture(Renderer renderer, std::function<void()> wake)
    : wake_(std::move(wake)), renderer_(renderer), thread_([this] { run(); }) {}

ProgressivePicture::~ProgressivePicture() {
  {
    const std::scoped_lock lock(mutex_);
    isEnding_ = true;
    isStale_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void ProgressivePicture::request(const View& view, const Display& display) {
  {
    const std::scoped_lock lock(mutex_);
    if (lastRequest_ && isSame(lastRequest_->view, view) && lastRequest_->display == display)
      return;
    lastRequest_ = pending_ = Request{view, display};
    isStale_ = true;
    failure_ = nullptr;
  }
  changed_.notify_all();
}

std::shared_ptr<const Frame> ProgressivePicture::frame() const {
  const std::scoped_lock lock(mutex_);
  return frame_;
}

std::exception_ptr ProgressivePicture::failure() const {
  const std::scoped_lock lock(mutex_);
  return failure_;
}

bool ProgressivePicture::isBusy() const {
  const std::scoped_lock lock(mutex_);
  if (!lastRequest_ || failure_) return false;
  return pending_ || !frame_ || !frame_->isComplete || !isSame(frame_->view, lastRequest_->view) ||
         !(frame_->display == lastRequest_->display);
}

std::string ProgressivePicture::rendererName() const {
  const std::scoped_lock lock(mutex_);
  return rendererName_;
}

void ProgressivePicture::run() {
  Worker worker(*this);
  for (;;) {
    bool isRecoloured = false;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return isEnding_ || pending_ || worker.pass < kPasses.size(); });
      if (isEnding_) return;
      if (pending_) {
        worker.take(*pending_);
        isRecoloured = worker.image != nullptr;
        pending_.reset();
        isStale_ = false;
      }
    }
    std::shared_ptr<const Frame> frame;
    std::exception_ptr failure;
    try {
      if (worker.view.model->terrain) {
        worker.requireTerrainLayer();
        // Another layer needs no new picture.
        if (!isRecoloured || !worker.isTerrainFinal) worker.drawTerrain();
        frame = worker.shown();
      } else if (isRecoloured) {
        frame = worker.shown();
      } else if (worker.wantsSplats()) {
        if (auto drawn = worker.splatted(isStale_)) {
          worker.image = std::move(drawn);
          worker.pixelSize = kSplatPixelSize;
          worker.pass = kPassAfterSplats;
          frame = worker.shown();
        }
      } else {
        worker.prepare();
        const Pass& how = kPasses[worker.pass];
        if (auto drawn = worker.draw(how, progress_, isStale_)) {
          worker.image = std::move(drawn);
          worker.pixelSize = how.pixelSize;
          ++worker.pass;
          frame = worker.shown();
        }
      }
    } catch (...) {
      failure = std::current_exception();
      worker.pass = kPasses.size();
      worker.surfaces = nullptr;
    }
    if (!frame && !failure) continue;
    {
      const std::scoped_lock lock(mutex_);
      if (frame) frame_ = frame;
      if (!pending_) failure_ = failure;
      rendererName_ = worker.name;
      if (worker.pass == kPasses.size()) progress_ = 1;
    }
    if (wake_) wake_();
  }
}

bool isSame(const render::Camera& a, const render::Camera& b) {
  return a.from == b.from && a.to == b.to && a.up == b.up && a.verticalFov == b.verticalFov &&
         a.orthoHeight == b.orthoHeight && a.near == b.near && a.far == b.far &&
         a.width == b.width && a.height == b.height;
}

bool isSame(const View& a, const View& b) {
  return a.model == b.model && a.clip == b.clip && a.style == b.style && a.matcap == b.matcap &&
         a.opacity == b.opacity && a.hasThickness == b.hasThickness &&
         a.isosurface == b.isosurface && a.light == b.light && isSame(a.camera, b.camera);
}

}  // namespace viewer
