#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/viewer/interaction/clip_plane.h"
#include "apps/viewer/interaction/progressive_picture.h"
#include "apps/viewer/model/model.h"
#include "levelset/deform/cage/cage.h"

namespace viewer {

/// Command line arguments of the viewer.
struct Arguments {
  std::vector<std::filesystem::path> files;
  int width = 1280, height = 800;  ///< size of the picture, pixels
  bool hasSize = false;  ///< --size is given; false: the size in a scene file has priority
  /// Position of the eye, target and up direction, world units.
  std::optional<Imath::V3d> from = {}, to = {}, up = {};
  std::optional<double> verticalFov = {};  ///< vertical field of view, radians
  std::optional<double> orthoHeight = {};  ///< height of an orthographic view, world units
  std::optional<ClipPlane> clip = {};
  Display display = {};
  render::Style style = render::Style::Lit;
  std::shared_ptr<const render::ColourImage> matcap = {};  ///< null: the viewer's own
  // === For a volume; unset: the viewer's own choice
  std::optional<double> isovalue = {};
  bool hidesIsosurface = false;  ///< --isovalue none
  std::optional<render::VolumeInside> inside = {};
  std::optional<render::Filter> filter = {};
  std::string transfer = {};  ///< points of the transfer function, or "auto"; empty: none
  std::array<std::optional<double>, 3> slices = {};  ///< positions across i, j and k, grid indices
  std::optional<std::array<double, 2>> grey = {};    ///< values shown as black and as white

  // === A deformation of the solid
  std::filesystem::path lattice = {};    ///< lattice file; empty: none
  std::filesystem::path cage = {};       ///< mesh file of a cage at rest; empty: none
  std::filesystem::path movedCage = {};  ///< mesh file of the moved cage; empty: at rest
  levelset::CageCoordinates cageCoordinates = levelset::CageCoordinates::MeanValue;

  double opacity = 1;     ///< factor of the opacities of all solids and meshes
  long resolution = 256;  ///< voxels along the longest side of a mesh
  Renderer renderer = Renderer::Auto;
  std::optional<std::filesystem::path> screenshot = {};
  bool isInterface = false;                        ///< the screenshot shows the entire window
  std::optional<std::array<int, 2>> pick = {};     ///< x and y of the pixel to pick
  std::optional<std::filesystem::path> play = {};  ///< script of simulated input
  bool asksHelp = false, asksVersion = false;

  /// True when an option for volumes is given.
  [[nodiscard]] bool hasVolumeOption() const {
    return isovalue || hidesIsosurface || inside || filter || grey || !transfer.empty() ||
           slices[0] || slices[1] || slices[2];
  }
  /// True when a lattice or a cage is given.
  [[nodiscard]] bool givesDeformation() const { return !lattice.empty() || !cage.empty(); }
  /// True when the viewer runs without an open window: to write a screenshot, to print a picked
  /// point, or to play simulated input.
  [[nodiscard]] bool isScript() const { return screenshot || pick || play; }
};

/// Parses the command line.
/// @throws levelset::UsageError for an unknown option or an invalid value
[[nodiscard]] Arguments parseArguments(const std::vector<std::string>& words);
/// Text of levelsmith-view --help.
[[nodiscard]] std::string viewerHelp();

/// Isosurface, light and slices that are shown first of the model's volume. @pre the model has a
/// volume
[[nodiscard]] IsosurfaceView firstIsosurface(const Arguments& arguments, const Model& model);
[[nodiscard]] LightView firstLight(const Arguments& arguments, const Model& model);
[[nodiscard]] SliceView firstSlices(const Arguments& arguments, const Model& model);
/// Refuses options that do not apply to the model.
/// @throws levelset::UsageError for an option for volumes, without a volume
/// @throws levelset::InvalidInput for a clip plane, with a model that cannot be clipped
void requireFit(const Arguments& arguments, const Model& model);

/// Initial camera for a model: from the options, else from the scene file, else a camera that
/// frames the model.
/// @throws levelset::UsageError for an invalid camera
[[nodiscard]] render::Camera firstCamera(const Arguments& arguments, const Model& model, int width,
                                         int height);

}  // namespace viewer
