#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/viewer/editing/deform_editor.h"
#include "apps/viewer/editing/deform_preview.h"
#include "apps/viewer/editing/patch_editor.h"
#include "apps/viewer/editing/patch_preview.h"
#include "apps/viewer/editing/sculpt_editor.h"
#include "apps/viewer/interaction/orbit_camera.h"
#include "apps/viewer/interaction/pick.h"
#include "apps/viewer/interaction/progressive_picture.h"
#include "apps/viewer/model/file_list.h"
#include "apps/viewer/model/file_watch.h"
#include "apps/viewer/model/loader.h"
#include "apps/viewer/viewer_arguments.h"
#include "apps/viewer/volume/transfer_editor.h"
#include "apps/viewer/window.h"

namespace viewer {

/// State of the viewer and reactions to the user's input.
class Viewer {
 public:
  Viewer(const Arguments& arguments, Window& window);

  /// Reads files in the background; the present model is shown until they are read. @param isReload
  /// true: the files are those of the present model, and the view is kept
  void open(const std::vector<std::filesystem::path>& files, bool isReload = false);
  /// Shows a model. @param keepView  true: keeps the present camera and picked points; false: the
  /// camera follows from the arguments and the model
  void show(std::shared_ptr<const Model> model, bool keepView);

  /// Handles external events: loaded models, finished pictures, dropped files, changed files.
  void update();
  /// Draws the panels and dialogs, and handles mouse and keyboard input.
  /// @param width, height  size of the picture, pixels
  void drawInterface(int width, int height);

  /// Writes a screenshot of the entire window if the user has requested one.
  void writeInterfaceShot();

  /// Requests the picture of the present view from the drawing thread. @param width, height  pixels
  void requestPicture(int width, int height);
  [[nodiscard]] const ProgressivePicture& picture() const { return picture_; }
  [[nodiscard]] bool isBusy() const;

  /// Writes the strokes of sculpting that no file has to a file beside the data. Returns a message;
  /// empty without such strokes.
  [[nodiscard]] std::string keepUnsavedStrokes() const;
  /// Opens a file as if the user had chosen it. A lattice file deforms the solid that is shown.
  void openChosen(const std::filesystem::path& file);
  /// Adds a picked point to the list of points in the panel, as a click on the surface does.
  void addPick(const Picked& picked);

 private:
  static constexpr float kPanelWidth = 250;  // width of the panel at the left, pixels

  [[nodiscard]] bool isPanelShown() const;
  void frameBesidePanel();
  void takeModel();
  void takeFrame();
  void takeKeys();
  void press(unsigned character);
  void pressSpecial(const KeyPress& press);
  [[nodiscard]] std::shared_ptr<const Model> shownModel() const;
  void watchFiles();
  void reload();

  void useMouse(int width, int height);
  void dragTo(const Imath::V2d& place, int width, int height);
  // === What the patch and the deformation share, viewer_editing.cpp
  [[nodiscard]] bool isEditing() const { return patchEditor_ || deformEditor_ || sculptEditor_; }
  /// Adapts the editors to a new model. @param keepsDesign  false: they are put away
  void restartEditors(bool keepsDesign);
  [[nodiscard]] bool pressEditor(const Imath::V2d& place, const render::Camera& camera,
                                 bool isAdding);
  void moveEditor(const Imath::V2d& place, const render::Camera& camera);
  void releaseEditor();
  /// @return true if the key belongs to an editor
  [[nodiscard]] bool pressForEditor(unsigned character);
  [[nodiscard]] bool pressForEditor(const KeyPress& key);
  void takePreviews();
  void copyCommand(bool isChain);
  void saveResult();
  void drawControls(int width, int height);
  void drawMarksOf(const std::vector<PictureStroke>& strokes, const std::vector<PictureMark>& marks,
                   bool isWrong, int width, int height);
  void drawResultDialog();
  // === Making a patch, viewer_patch.cpp
  void togglePatchEditor();
  void requestPatchPreview();
  void takePatchPreview();
  void copyPatch(bool isChain);
  void savePatch(const std::filesystem::path& name);
  void drawPatchEditorPart();
  // === Deforming the solid, viewer_deform.cpp
  void toggleDeformEditor();
  void startDeformation(const DeformDesign& design);
  void openDeformation(const std::filesystem::path& lattice);
  void startGivenDeformation();
  void requestDeformPreview();
  void takeDeformPreview();
  void copyDeformation(bool isChain);
  void saveDeformation(const std::filesystem::path& name);
  void drawDeformPart();
  void drawDeformControls();

  // === Sculpting a terrain, viewer_sculpt.cpp
  void toggleSculptEditor();
  void startSculpting();
  /// Shows the ground as it is now.
  void takeSculpted();
  [[nodiscard]] bool pressSculpting(const Imath::V2d& place, const render::Camera& camera);
  void moveSculpting(const Imath::V2d& place, const render::Camera& camera);
  [[nodiscard]] bool pressForSculpting(unsigned character);
  void stepSculpting(bool isUndo);
  void copySculpting(bool isChain);
  void saveSculpting(const std::filesystem::path& name);
  void drawSculptPart();

  void pickAt(const Imath::V2d& place, bool isForTarget);
  void finishPick();
  void copyPicks();
  void saveScreenshot();
  void showMessage(const std::string& sentence) { message_ = sentence; }
  void showFailure(const std::exception_ptr& failure, const std::string& instead);

  // === The interface, viewer_panels.cpp
  void drawPanel();
  void drawFilePart();
  void drawViewPart();
  void drawLayerPart();
  void drawClipPart();
  void drawVolumePart();
  void drawHistogram();
  void drawLightPart();
  void editTransfer(const Imath::V2d& place, const Imath::V2d& reach, bool isOver);
  void drawPatchPart();
  void drawEffectPart();  // viewer_effects.cpp
  void drawPointPart();
  void drawStatus();
  void drawMarks(int width, int height);
  void drawScreenshotDialog();
  void drawKeysDialog();

  Arguments arguments_;
  Window& window_;
  Loader loader_;
  ProgressivePicture picture_;
  FileList fileList_;
  FileWatch watch_;
  double nextWatch_ = 0;  // time of the next check of the files for changes, seconds
  bool wasMissing_ = false;

  std::shared_ptr<const Model> model_;
  OrbitCamera camera_;
  ClipPlane clip_;
  bool isClipped_ = false;
  Display display_;
  render::Style style_;
  // Isosurface and light of the model's volume. The editor keeps its points while the light is off.
  IsosurfaceView isosurface_;
  LightView light_;
  TransferEditor transferEditor_;
  double opacity_ = 1;                  // factor of the opacities of all solids and meshes
  std::shared_ptr<const Frame> frame_;  // frame that the window shows
  int pictureWidth_ = 1, pictureHeight_ = 1;

  enum class Drag { None, Orbit, Pan, Points };
  Drag drag_ = Drag::None;
  Imath::V2d dragStart_, dragLast_;
  double dragDepth_ = 1;
  bool hasDragged_ = false;
  std::optional<std::array<int, 2>> pendingPick_;
  bool isPickForTarget_ = false;
  std::vector<Picked> picks_;

  // The patch that the user makes; null outside the mode in which a patch is made.
  std::unique_ptr<PatchEditor> patchEditor_;
  std::unique_ptr<PatchWorker> patchWorker_;
  std::shared_ptr<const PatchPreview> patchPreview_;
  // The deformation that the user edits; null outside the mode in which the solid is deformed.
  std::unique_ptr<DeformEditor> deformEditor_;
  std::unique_ptr<DeformWorker> deformWorker_;
  std::shared_ptr<const DeformPreview> deformPreview_;
  BoxLattice boxLattice_;
  // File of the last saved deformation, and its control points; the name of the next one.
  std::filesystem::path deformFile_ = "lattice.json";
  std::vector<Imath::V3d> savedPoints_;
  bool isGivenDeformation_ = false;  // the deformation of the arguments was started
  // The ground that the user sculpts; null outside that mode.
  std::unique_ptr<SculptEditor> sculptEditor_;
  std::shared_ptr<const Model> sculptModel_;
  std::filesystem::path editsFile_;  // file of the edits; it exists if hasEditsFile_
  bool hasEditsFile_ = false;
  bool hadEdits_ = false;  // edits of a file were applied before the first stroke
  bool asksResult_ = false;
  std::array<char, 512> resultName_{};

  // Enter or Escape was pressed since the last frame. ImGui misses keys that are released within
  // one frame.
  bool isEntered_ = false, isEscaped_ = false;
  std::string message_;
  bool asksScreenshot_ = false, asksKeys_ = false;
  std::array<char, 512> screenshotName_{};
  bool isInterfaceShot_ = false;
  bool wantsInterfaceShot_ = false;
};

}  // namespace viewer
