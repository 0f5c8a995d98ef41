#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "apps/viewer/editing/background_work.h"
#include "apps/viewer/editing/deform_design.h"
#include "apps/viewer/model/model.h"
#include "levelset/deform/deformation_certificate.h"
#include "levelset/mesh.h"
#include "levelset/progress.h"

namespace viewer {

/// Reason why a model cannot be deformed; empty if it can: it needs one solid and nothing else.
[[nodiscard]] std::string whyNoDeformation(const Model& model);

/// Result of the work on a deformation that the user edits.
struct DeformPreview {
  DeformDesign design;  ///< design from which the rest was computed
  /// The deformed model: a mesh with coarse triangles, or the solid if `isFine`.
  std::shared_ptr<const Model> model = nullptr;
  std::optional<levelset::FoldCertificate> certificate = {};  ///< empty: not computed yet
  /// True: the solid that the actions in `chainText` make.
  bool isFine = false;
  std::string failure = {};  ///< reason why the solid was not made; empty: none

  /// Returns the certificate in words, and where the map folds.
  [[nodiscard]] std::string certificateText() const;
  /// Returns true if the map is known to fold, or to overlap itself.
  [[nodiscard]] bool isRefused() const { return certificate && !certificate->isInjective(); }
};

/// Actions from the base to the deformed solid; empty if no file has the base alone.
/// @param file  file of DeformDesign::save()
[[nodiscard]] std::string deformChain(const Model& base, const DeformDesign& design,
                                      const std::filesystem::path& file);

/// Mesh of a solid, with normals, which deformedMesh() moves.
/// @param voxelSize  world units, see previewVoxel()
[[nodiscard]] levelset::TriMesh previewMesh(const levelset::NarrowBand& band, double voxelSize,
                                            const levelset::Progress& progress = {});

/// Moves the vertices and the normals of a mesh. Maps that fold are allowed.
[[nodiscard]] levelset::TriMesh deformedMesh(const levelset::TriMesh& mesh,
                                             const levelset::Deformation& map);

/// Works on previews in a background thread: the deformed mesh on coarse voxels first, then its
/// certificate, then, when the user has let go, the solid on the grid of the base. A map that is
/// refused stays a mesh. A newer request cancels the certificate after a third of a second.
class DeformWorker {
 public:
  /// @param wake  called from the working thread when a result is available
  DeformWorker(std::shared_ptr<const Model> base, std::function<void()> wake);

  /// @param isDragging  true: stops after the certificate
  void request(const DeformDesign& design, bool isDragging) {
    work_.request({std::make_shared<const DeformDesign>(design), isDragging});
  }
  /// Newest result; null before the first one.
  [[nodiscard]] std::shared_ptr<const DeformPreview> preview() const { return work_.result(); }
  [[nodiscard]] bool isBusy() const { return work_.isBusy(); }

 private:
  struct Request {
    std::shared_ptr<const DeformDesign> design;
    bool isDragging = false;
  };
  using Work = BackgroundWork<Request, DeformPreview>;
  void work(const Request& request);

  std::shared_ptr<const Model> base_;
  levelset::TriMesh coarse_;  // the base on the grid of the preview
  Work work_;                 // last: it ends before the members that it reads
};

}  // namespace viewer
