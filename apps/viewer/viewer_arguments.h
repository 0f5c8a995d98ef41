#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/viewer/interaction/clip_plane.h"
#include "apps/viewer/interaction/progressive_picture.h"
#include "apps/viewer/model/model.h"

namespace viewer {

/// Command line arguments of the viewer.
struct Arguments {
  std::vector<std::filesystem::path> files;
  int width = 1280, height = 800;  ///< size of the picture, pixels
  bool hasSize = false;            ///< the size is given; false: a scene's size has priority
  std::optional<Imath::V3d> from = {}, to = {}, up = {};
  std::optional<double> verticalFov = {};  ///< radians
  std::optional<double> orthoHeight = {};  ///< world units
  std::optional<ClipPlane> clip = {};
  Display display = {};
  render::Style style = render::Style::Lit;
  long resolution = 256;  ///< voxels along the longest side of a mesh
  Renderer renderer = Renderer::Auto;
  std::optional<std::filesystem::path> screenshot = {};
  bool isInterface = false;                     ///< the screenshot shows the entire window
  std::optional<std::array<int, 2>> pick = {};  ///< pixel to pick
  bool asksHelp = false, asksVersion = false;

  /// True when the viewer runs without user interaction.
  [[nodiscard]] bool isScript() const { return screenshot || pick; }
};

/// Parses the command line.
/// @throws levelset::UsageError
[[nodiscard]] Arguments parseArguments(const std::vector<std::string>& words);
/// Text of levelsmith-view --help.
[[nodiscard]] std::string viewerHelp();

/// First camera of a model: from the options, else from its scene, else one that frames it.
/// @throws levelset::UsageError for an invalid camera
[[nodiscard]] render::Camera firstCamera(const Arguments& arguments, const Model& model, int width,
                                         int height);

}  // namespace viewer
