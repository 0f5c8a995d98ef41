#include "apps/viewer/viewer.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/core.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "apps/viewer/screenshot.h"
#include "levelset/deform/lattice_file.h"
#include "levelset/error.h"

namespace viewer {
namespace {

using Imath::V2d;
using Imath::V3d;

constexpr double kWatchSeconds = 0.4;
constexpr double kTurnPerPixel = 0.006;  // rotation for a pixel of a drag, radians
constexpr double kTurnPerKey = 0.1;      // rotation for an arrow key, radians
constexpr double kClickPixels =
    3;  // movement with a pressed button from which on it is a drag, pixels
constexpr double kZoomPerStep = 0.88;  // factor of the distance for each step of the wheel

std::string namesOf(const std::vector<std::filesystem::path>& files) {
  std::string names;
  for (const std::filesystem::path& file : files)
    names += (names.empty() ? "" : ", ") + file.filename().string();
  return names;
}

/// True when isovalues and slices of one volume fit the other: same grid and range of values.
bool isSameGrid(const std::shared_ptr<const ShownVolume>& a,
                const std::shared_ptr<const ShownVolume>& b) {
  if (!a || !b) return false;
  const levelset::Volume &x = a->surface.volume(), &y = b->surface.volume();
  return x.size() == y.size() && x.lowest() == y.lowest() && x.highest() == y.highest();
}

}  // namespace

Viewer::Viewer(const Arguments& arguments, Window& window)
    : arguments_(arguments),
      window_(window),
      loader_(Window::wake),
      picture_(arguments.renderer, Window::wake),
      clip_(arguments.clip.value_or(ClipPlane{})),
      isClipped_(arguments.clip.has_value()),
      display_(arguments.display),
      style_(arguments.style),
      opacity_(arguments.opacity) {
  std::snprintf(screenshotName_.data(), screenshotName_.size(), "view.png");
  std::snprintf(resultName_.data(), resultName_.size(), "textured.vdb");
  showMessage("Drop a file here, or press Ctrl+O to open one.");
}

void Viewer::open(const std::vector<std::filesystem::path>& files, bool isReload) {
  loader_.open(files, arguments_.resolution, isReload);
  showMessage(fmt::format("Reading {} …", namesOf(files)));
}

void Viewer::show(std::shared_ptr<const Model> model, bool keepView) {
  if (!model_) requireFit(arguments_, *model);
  const bool wasEmpty = !model_ || model_->bounds.isEmpty();
  const bool keepsVolume = keepView && model_ && isSameGrid(model_->volume, model->volume);
  model_ = std::move(model);
  if (!model_->volume) {
    isosurface_ = {};
    light_ = {};
    display_.slices = {};
  } else if (!keepsVolume) {
    isosurface_ = firstIsosurface(arguments_, *model_);
    light_ = firstLight(arguments_, *model_);
    const levelset::VolumeHistogram& histogram = model_->volume->histogram;
    const double span = histogram.high > histogram.low ? histogram.high - histogram.low : 1;
    transferEditor_ = TransferEditor(
        light_.transfer.empty() ? render::suggestedTransfer(histogram) : light_.transfer,
        histogram.low, histogram.low + span);
    display_.slices = firstSlices(arguments_, *model_);
  }
  watch_ = FileWatch(model_->watched);
  wasMissing_ = false;
  if (!keepView || wasEmpty) {
    camera_ = OrbitCamera(firstCamera(arguments_, *model_, pictureWidth_, pictureHeight_));
    if (!arguments_.from && !model_->camera && isPanelShown()) frameBesidePanel();
  }
  if (!keepView) {
    picks_.clear();
    if (!arguments_.clip && model_->canCut()) {
      isClipped_ = false;
      if (clip_.across != ClipPlane::Across::View)
        clip_.offset = model_->solidBounds.center()[static_cast<int>(clip_.across)];
    }
  }
  restartEditors(keepView);
  window_.setTitle(namesOf(model_->files) + " – Levelsmith");
  showMessage(fmt::format("{}: {}.", namesOf(model_->files), model_->description));
}

void Viewer::openChosen(const std::filesystem::path& file) {
  if (levelset::isLatticeFile(file)) return openDeformation(file);
  open(filesWith(model_ ? model_->files : std::vector<std::filesystem::path>{}, file));
}

bool Viewer::isPanelShown() const {
  return !arguments_.isScript() || arguments_.isInterface || arguments_.play;
}

void Viewer::frameBesidePanel() {
  if (!model_) return;
  const int panel = static_cast<int>(kPanelWidth), free = pictureWidth_ - panel;
  if (free < panel) return camera_.frame(model_->bounds, pictureWidth_, pictureHeight_);
  camera_.frame(model_->bounds, free, pictureHeight_);
  camera_.pan({0, 0}, {0.5 * panel, 0}, camera_.targetDepth(), pictureWidth_, pictureHeight_);
}

void Viewer::showFailure(const std::exception_ptr& failure, const std::string& instead) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::bad_alloc&) {
    showMessage("Memory ran out. " + instead);
  } catch (const std::exception& error) {
    showMessage(fmt::format("{} {}", error.what(), instead));
  }
}

// === Events from outside the interface

void Viewer::update() {
  takeModel();
  takePreviews();
  takeFrame();
  takeKeys();
  for (const std::filesystem::path& file : window_.takeDrops()) openChosen(file);
  watchFiles();
}

void Viewer::takeModel() {
  std::optional<Loader::Result> result = loader_.take();
  if (!result) return;
  if (result->failure) {
    showFailure(result->failure, model_ ? "(The previous model stays open.)" : "");
    return;
  }
  // Keep the view if only a patch was added.
  const bool isSameSolid =
      model_ && !model_->files.empty() && result->files.front() == model_->files.front();
  try {
    show(std::move(result->model), result->isReload || isSameSolid);
  } catch (const levelset::Error& error) {
    showMessage(error.what());
  }
  if (result->isReload) showMessage(message_ + " Read again.");
}

void Viewer::takeFrame() {
  if (const std::exception_ptr failure = picture_.failure()) showFailure(failure, "");
  const std::shared_ptr<const Frame> frame = picture_.frame();
  if (!frame || frame == frame_) return;
  const bool isNewNote = !frame_ || frame->note != frame_->note;
  frame_ = frame;
  window_.setPicture(frame->canvas);
  if (isNewNote && !frame->note.empty()) showMessage(frame->note);
  finishPick();
}

void Viewer::watchFiles() {
  const double now = glfwGetTime();
  if (!model_ || now < nextWatch_) return;
  nextWatch_ = now + kWatchSeconds;
  if (watch_.hasChanged()) reload();
  const bool isMissing = watch_.isAnyMissing();
  if (isMissing && !wasMissing_)
    showMessage(
        "A file was removed. Its contents stay open, and it is read again when it is back.");
  wasMissing_ = isMissing;
}

void Viewer::reload() {
  if (model_ && !loader_.isLoading()) open(model_->files, true);
}

bool Viewer::isBusy() const {
  // The newest frame and preview must also have been taken.
  return loader_.isLoading() || pendingPick_ || picture_.isBusy() || picture_.frame() != frame_ ||
         (patchWorker_ && (patchWorker_->isBusy() || patchWorker_->preview() != patchPreview_)) ||
         (deformWorker_ && (deformWorker_->isBusy() || deformWorker_->preview() != deformPreview_));
}

// === Keys

void Viewer::takeKeys() {
  const std::vector<KeyPress> keys = window_.takeKeys();
  for (const KeyPress& key : keys) {
    isEntered_ = isEntered_ || key.key == GLFW_KEY_ENTER || key.key == GLFW_KEY_KP_ENTER;
    isEscaped_ = isEscaped_ || key.key == GLFW_KEY_ESCAPE;
  }
  const bool isInDialog =
      ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel);
  if (ImGui::GetIO().WantTextInput || isInDialog) return;
  for (const KeyPress& key : keys) {
    if (key.character != 0)
      press(key.character);
    else
      pressSpecial(key);
  }
}

void Viewer::press(unsigned character) {
  if (pressForEditor(character)) return;
  const auto stepLayer = [&](std::size_t by) {
    const auto at = static_cast<std::size_t>(display_.layer);
    display_.layer = kLayers[(at + by) % kLayers.size()];
  };
  switch (character) {
    case 'f':
      frameBesidePanel();
      break;
    case 'x':
      camera_.lookAgainst({1, 0, 0});
      break;
    case 'X':
      camera_.lookAgainst({-1, 0, 0});
      break;
    case 'y':
      camera_.lookAgainst({0, 1, 0});
      break;
    case 'Y':
      camera_.lookAgainst({0, -1, 0});
      break;
    case 'z':
      camera_.lookAgainst({0, 0, 1});
      break;
    case 'Z':
      camera_.lookAgainst({0, 0, -1});
      break;
    case 'o':
      camera_.toggleOrtho();
      break;
    case 'l':
      stepLayer(1);
      break;
    case 'L':
      stepLayer(kLayers.size() - 1);
      break;
    case 'c':
      isClipped_ = !isClipped_;
      break;
    case 'e':
      togglePatchEditor();
      break;
    case 'd':
      toggleDeformEditor();
      break;
    case 's':
      toggleSculptEditor();
      break;
    case 'p':
      asksScreenshot_ = true;
      break;
    case 'r':
      reload();
      break;
    case 't':
      pickAt({static_cast<double>(ImGui::GetIO().MousePos.x),
              static_cast<double>(ImGui::GetIO().MousePos.y)},
             true);
      break;
    case '?':
    case 'h':
      asksKeys_ = true;
      break;
    default:
      break;
  }
}

void Viewer::pressSpecial(const KeyPress& key) {
  if (pressForEditor(key)) return;
  if (key.withControl && key.key == GLFW_KEY_O)
    fileList_.show(model_ && !model_->files.empty() ? model_->files.front() : ".");
  if (key.withControl && key.key == GLFW_KEY_C) isEditing() ? copyCommand(false) : copyPicks();
  if (key.withControl && key.key == GLFW_KEY_K) copyCommand(true);
  if (key.withControl && key.key == GLFW_KEY_S && isEditing()) asksResult_ = true;
  if (key.withControl && key.key == GLFW_KEY_Q) window_.close();
  if (key.key == GLFW_KEY_LEFT) camera_.orbit(-kTurnPerKey, 0);
  if (key.key == GLFW_KEY_RIGHT) camera_.orbit(kTurnPerKey, 0);
  if (key.key == GLFW_KEY_UP) camera_.orbit(0, kTurnPerKey);
  if (key.key == GLFW_KEY_DOWN) camera_.orbit(0, -kTurnPerKey);
}

// === The mouse

void Viewer::useMouse(int width, int height) {
  const ImGuiIO& io = ImGui::GetIO();
  // Convert ImGui's units to pixels of the picture.
  const auto perUnit = [](int pixels, float units) {
    return pixels / std::max(static_cast<double>(units), 1.0);
  };
  const V2d scale(perUnit(width, io.DisplaySize.x), perUnit(height, io.DisplaySize.y));
  const V2d place(static_cast<double>(io.MousePos.x) * scale.x,
                  static_cast<double>(io.MousePos.y) * scale.y);
  const double depth = frame_ && place.x >= 0 && place.y >= 0 && place.x < width && place.y < height
                           ? depthSeen(*frame_, place.x * frame_->view.camera.width / width,
                                       place.y * frame_->view.camera.height / height)
                                 .value_or(camera_.targetDepth())
                           : camera_.targetDepth();
  if (!io.WantCaptureMouse) {
    if (io.MouseWheel != 0)
      camera_.zoom(std::pow(kZoomPerStep, static_cast<double>(io.MouseWheel)), place, depth, width,
                   height);
    const bool isLeft = io.MouseClicked[0], isOther = io.MouseClicked[1] || io.MouseClicked[2];
    if (drag_ == Drag::None && (isLeft || isOther)) {
      if (isLeft && pressEditor(place, camera_.camera(width, height), io.KeyShift))
        drag_ = Drag::Points;
      else
        drag_ = isOther || io.KeyShift ? Drag::Pan : Drag::Orbit;
      dragStart_ = dragLast_ = place;
      dragDepth_ = depth;
      hasDragged_ = false;
    }
  }
  if (drag_ == Drag::None) {
    // The circle of the brush follows the pointer.
    if (sculptEditor_ && !io.WantCaptureMouse) moveEditor(place, camera_.camera(width, height));
    return;
  }
  if (drag_ == Drag::Points)
    moveEditor(place, camera_.camera(width, height));
  else
    dragTo(place, width, height);
  if (io.MouseDown[0] || io.MouseDown[1] || io.MouseDown[2]) return;
  if (!hasDragged_ && drag_ == Drag::Orbit && !isEditing()) pickAt(place, false);
  if (drag_ == Drag::Points) releaseEditor();
  drag_ = Drag::None;
}

void Viewer::dragTo(const V2d& place, int width, int height) {
  if ((place - dragStart_).length() > kClickPixels) hasDragged_ = true;
  if (!hasDragged_ || place == dragLast_) return;
  if (drag_ == Drag::Orbit) {
    const V2d step = (place - dragLast_) * kTurnPerPixel;
    camera_.orbit(-step.x, step.y);
  } else {
    camera_.pan(dragLast_, place, dragDepth_, width, height);
  }
  dragLast_ = place;
}

// === Points

void Viewer::pickAt(const V2d& place, bool isForTarget) {
  const auto pixel = [](double at) { return static_cast<int>(std::clamp(at, -1.0, 1e8)); };
  pendingPick_ = {{pixel(place.x), pixel(place.y)}};
  isPickForTarget_ = isForTarget;
  finishPick();
}

void Viewer::finishPick() {
  // Wait for a picture at full resolution: coarser pixels show other points of the surface.
  if (!pendingPick_ || !frame_ || frame_->pixelSize > 1) return;
  const std::optional<Picked> picked = pick(*frame_, (*pendingPick_)[0], (*pendingPick_)[1]);
  pendingPick_.reset();
  if (isPickForTarget_) {
    if (picked) camera_.centreOn(picked->position);
    return;
  }
  if (!picked) {
    showMessage("There is no surface at this pixel.");
    return;
  }
  addPick(*picked);
  window_.setClipboard(pointText(picked->position));
  showMessage(fmt::format("{} was copied to the clipboard.", pointText(picked->position)));
}

void Viewer::addPick(const Picked& picked) {
  picks_.push_back(picked);
}

void Viewer::copyPicks() {
  std::string text;
  for (const Picked& picked : picks_) {
    if (!text.empty()) text += " ";
    text += pointText(picked.position);
  }
  if (text.empty()) return;
  window_.setClipboard(text);
  showMessage(fmt::format("{} points were copied to the clipboard.", picks_.size()));
}

// === The picture

void Viewer::requestPicture(int width, int height) {
  pictureWidth_ = width;
  pictureHeight_ = height;
  if (!model_) return;
  View view{
      shownModel(), camera_.camera(width, height),      std::nullopt, style_, arguments_.matcap,
      opacity_,     display_.layer == Layer::Thickness, isosurface_,  light_};
  if (isClipped_ && view.model->canCut()) view.clip = clip_;
  picture_.request(view, display_);
}

void Viewer::saveScreenshot() {
  const std::filesystem::path name(screenshotName_.data());
  try {
    requireScreenshotName(name, isInterfaceShot_);
    if (isInterfaceShot_) {
      wantsInterfaceShot_ =
          true;  // written by writeInterfaceShot() after the next frame, when the dialog is closed
      return;
    }
    if (!frame_)
      throw levelset::InvalidInput("screenshot: no picture is available yet; open a file");
    writeScreenshot(name, *frame_);
    showMessage(fmt::format("{} was written{}.", name.string(),
                            frame_->isComplete ? "" : ", from an unfinished picture"));
  } catch (const std::exception& error) {
    showMessage(error.what());
  }
}

void Viewer::writeInterfaceShot() {
  if (!wantsInterfaceShot_) return;
  wantsInterfaceShot_ = false;
  const std::filesystem::path name(screenshotName_.data());
  const int width = pictureWidth_, height = pictureHeight_;
  try {
    const Canvas shot = window_.drawInMemory(width, height, [&] { drawInterface(width, height); });
    render::writePng(name, width, height, shot.colours);
    showMessage(fmt::format("{} was written.", name.string()));
  } catch (const std::exception& error) {
    showMessage(error.what());
  }
}

void Viewer::drawInterface(int width, int height) {
  useMouse(width, height);
  drawControls(width, height);
  drawMarks(width, height);
  drawPanel();
  drawStatus();
  drawScreenshotDialog();
  drawKeysDialog();
  drawResultDialog();
  if (const auto chosen = fileList_.draw(isEscaped_)) openChosen(*chosen);
  isEntered_ = isEscaped_ = false;
}

}  // namespace viewer
