#pragma once

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include "levelset/progress.h"
#include "levelset/terrain/tiles/patch_store.h"
#include "render/camera.h"
#include "render/gpu/terrain/terrain_painter.h"
#include "render/images/image.h"
#include "render/terrain/terrain_detail.h"

namespace viewer {

/// A terrain that the viewer shows.
struct ShownTerrain {
  std::shared_ptr<const levelset::PatchStore> store;
  std::shared_ptr<const levelset::HeightField> field;  ///< heights; null for a tiled file
  std::string description;                             ///< size and spacing, as a line for the user
  bool wasGeographic = false;                          ///< the file has degrees
  /// Patches are read before they are drawn, so that no coarser ones are seen.
  bool isReadAtOnce = false;
};

/// Reads a terrain for the viewer. Degrees become metres. Patches of a tiled file are read when
/// pictures need them, so it may be larger than the memory.
/// @throws InvalidInput for a terrain without a known height, and a tiled file in degrees
/// @throws as readHeightField(), metricHeights(), heightPyramid() and openTiledGround()
[[nodiscard]] ShownTerrain readShownTerrain(const std::filesystem::path& file,
                                            const levelset::Progress& progress = {});

/// Cells along a side of a patch of the viewer's pyramids.
inline constexpr int kShownCells = 32;

/// Box of the ground. @pre the terrain has a known sample
[[nodiscard]] Imath::Box3d boundsOf(const ShownTerrain& terrain);

/// Pictures of a terrain at the level of detail that they need, by OpenGL. Patches are read in
/// the background; coarser ones are drawn until they arrive.
class TerrainFrames {
 public:
  /// @throws render::NoOpenGl, and as render::TerrainDetail
  explicit TerrainFrames(const ShownTerrain& terrain);

  struct Drawn {
    std::shared_ptr<const render::Image> image;  ///< colours, Z, N, P and id
    bool isFinal = false;  ///< no patch will arrive that makes the picture better
    std::string note;      ///< sentence on a patch that cannot be read; empty: none
  };
  [[nodiscard]] Drawn draw(const render::Camera& camera);
  /// Waits until a patch arrives, at most a short time.
  void waitForPatch();

 private:
  void noteArrival();

  std::mutex mutex_;
  std::condition_variable hasNew_;
  std::atomic<int> arrivals_ = 0;
  int drawnArrivals_ = 0;  // arrivals before the last picture
  std::string note_;
  render::TerrainDetail::Reading reading_;
  render::TerrainDetail detail_;
  std::unique_ptr<render::TerrainPainter> painter_;
};

/// Layers of a picture, as a renderer of surfaces returns them, but without curvatures.
[[nodiscard]] render::Image imageOf(const render::TerrainPicture& picture,
                                    const render::Camera& camera);

}  // namespace viewer
