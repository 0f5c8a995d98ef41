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

/// What the user asked for.
struct Arguments {
  std::vector<std::filesystem::path> files;
  int width = 1280, height = 800;  ///< of the picture, pixels
  bool hasSize = false;            ///< or is it a scene's?
  std::optional<Imath::V3d> from = {}, to = {}, up = {};
  std::optional<double> verticalFov = {};  ///< radians
  std::optional<double> orthoHeight = {};  ///< world units
  std::optional<ClipPlane> clip = {};
  Display display = {};
  render::Style style = render::Style::Lit;
  long resolution = 256;  ///< of meshes
  Renderer renderer = Renderer::Auto;
  std::optional<std::filesystem::path> screenshot = {};
  bool isInterface = false;                     ///< the screenshot is of the whole window
  std::optional<std::array<int, 2>> pick = {};  ///< a pixel
  bool asksHelp = false, asksVersion = false;

  /// Is there nobody to look at the window?
  [[nodiscard]] bool isScript() const { return screenshot || pick; }
};

/// @throws levelset::UsageError
[[nodiscard]] Arguments parseArguments(const std::vector<std::string>& words);
[[nodiscard]] std::string viewerHelp();

/// From where a model is seen: as the options say, else as its scene does, else framed.
/// @throws levelset::UsageError for a camera that cannot see
[[nodiscard]] render::Camera firstCamera(const Arguments& arguments, const Model& model, int width,
                                         int height);

}  // namespace viewer
