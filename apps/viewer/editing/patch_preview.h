#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "apps/viewer/editing/background_work.h"
#include "apps/viewer/editing/patch_design.h"
#include "apps/viewer/editing/solid_model.h"
#include "apps/viewer/model/model.h"
#include "levelset/progress.h"
#include "mapping/patches/patch.h"

namespace viewer {

/// Result of the work on a patch that the user designs.
struct PatchPreview {
  PatchDesign design;  ///< design from which the rest was computed
  PatchPaths sides;    ///< geodesics of the sides; empty for a side without both corners
  /// The textured model; null for fewer than four corners, for no texture, and while only the sides
  /// are known.
  std::shared_ptr<const Model> model = nullptr;
  std::optional<mapping::Patch> patch = {};  ///< the patch, if it has four corners
  /// True: computed on the grid of the base, as the actions in `command` do. False: on coarse
  /// voxels.
  bool isFine = false;
  double height = 0;      ///< height of the patch, world units
  std::string patchText;  ///< the `patch` action; empty for fewer than four corners
  std::string chainText;  ///< the actions from the base to the textured solid; empty without one,
                          ///< and for scenes
  std::string failure;    ///< reason why patch or texture could not be made; empty: none
};

/// Reason why no patch can be made on a model; empty if one can: the model needs one solid and
/// nothing else.
[[nodiscard]] std::string whyNoPatch(const Model& model);

/// Computes the sides of a design: the geodesics between its corners through its side points.
/// @return for each side the path, empty where the surface does not connect the points
[[nodiscard]] PatchPaths sidesOf(const levelset::NarrowBand& base, const PatchDesign& design);

/// Grids on which a preview is made.
enum class PreviewQuality {
  Coarse,  ///< 3 layers of about 17 x 17 particles, for a picture while the user drags
  Fine     ///< the layers and particles that the action `patch` makes by default
};

/// Makes the patch of a design and the textured model. An error of the operators is stored as
/// `failure`, and the sides are drawn nevertheless.
/// @param base  model on which the patch is made; @param surface  its solid, or that solid on a
/// coarser grid
/// @throws levelset::Cancelled when `progress` cancels
[[nodiscard]] PatchPreview previewPatch(const Model& base, const levelset::NarrowBand& surface,
                                        const PatchDesign& design, PreviewQuality quality,
                                        const levelset::Progress& progress = {});

/// Works on previews in a background thread: sides first, then the texture on coarse voxels, then,
/// when the user has let go, the texture on the grid of the base. A newer request replaces one
/// that waits, and cancels work on the fine grid. Work on coarse voxels is completed, so that a
/// long drag shows pictures.
class PatchWorker {
 public:
  /// @param wake  called from the working thread when a result is available
  PatchWorker(std::shared_ptr<const Model> base, std::function<void()> wake);

  /// @param isDragging  true: stops after the coarse result
  void request(const PatchDesign& design, bool isDragging) { work_.request({design, isDragging}); }
  /// Newest result; null before the first one.
  [[nodiscard]] std::shared_ptr<const PatchPreview> preview() const { return work_.result(); }
  [[nodiscard]] bool isBusy() const { return work_.isBusy(); }

 private:
  struct Request {
    PatchDesign design;
    bool isDragging = false;
  };
  using Work = BackgroundWork<Request, PatchPreview>;
  void work(const Request& request);

  std::shared_ptr<const Model> base_;
  levelset::NarrowBand coarse_;  // the base on the grid of the preview
  Work work_;                    // last: it ends before the members that it reads
};

}  // namespace viewer
